//! Panes: thin surfaces that let a fraction of the light pass straight on, and reflect nothing.
//!
//! They are no triangles of the scene, so no other part of the method sees them. Their tree follows
//! that of the scene, and scenes without panes do not pay for it.

use glam::Vec3;

use super::Triangle;
use super::bvh::Bvh;
use super::cutouts::Coverage;
use super::geometry::Assembled;
use crate::Result;
use crate::types::Node;

/// A triangle that lets light pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Pane {
    /// Corners, in recentred metres.
    pub positions: [Vec3; 3],
    /// Fraction of light of each colour that passes, 0..=1.
    pub colour: Vec3,
}

impl Pane {
    /// The colour in 11, 11 and 10 bits.
    pub fn packed_colour(&self) -> u32 {
        let bits = (self.colour.clamp(Vec3::ZERO, Vec3::ONE) * Vec3::new(2047.0, 2047.0, 1023.0)).round();
        let [red, green, blue] = bits.to_array().map(|bits| bits as u32);
        red | green << 11 | blue << 22
    }
}

/// Number of form factors of a light at a point: 1 if panes let all colours pass alike, else one
/// for each channel.
pub fn light_channels(panes: &[Pane]) -> u32 {
    let is_grey = |pane: &Pane| pane.colour.max_element() - pane.colour.min_element() < 1e-3;
    if panes.iter().all(is_grey) { 1 } else { 3 }
}

/// The tree of panes behind lists of `offsets` nodes and triangles, and the order of its triangles.
///
/// # Errors
/// The tree is too deep, as for [`Bvh::build`].
pub fn tree(panes: &[Pane], [first_node, first_triangle]: [usize; 2]) -> Result<(Vec<Node>, Vec<u32>)> {
    let triangle = |pane: &Pane| Triangle {
        positions: pane.positions,
        normals: [Vec3::ZERO; 3],
        material: 0,
        object: 0,
    };
    let Bvh { mut nodes, order, .. } = Bvh::build(&panes.iter().map(triangle).collect::<Vec<_>>())?;
    for node in &mut nodes {
        node.children.x += first_node as u32;
        node.children.y += first_triangle as u32;
    }
    Ok((nodes, order))
}

/// Takes the triangles out whose materials are panes. If no other triangle is left, all stay.
pub(super) fn taken_out(
    assembled: &mut Assembled,
    coverages: &[Coverage],
    warnings: &mut Vec<String>,
) -> Vec<Pane> {
    let colour = |triangle: &Triangle| match coverages[triangle.material as usize] {
        Coverage::Pane(colour) => Some(colour),
        _ => None,
    };
    let Assembled { triangles, coordinates, colours, .. } = assembled;
    let is_kept: Vec<bool> = triangles.iter().map(|triangle| colour(triangle).is_none()).collect();
    if !is_kept.contains(&true) {
        warnings.push("all surfaces are panes, which nothing would show: they are opaque".to_owned());
        return Vec::new();
    }
    let pane = |found: &Triangle| Some(Pane { positions: found.positions, colour: colour(found)? });
    let panes = triangles.iter().filter_map(pane).collect();
    retain(triangles, &is_kept);
    retain(coordinates, &is_kept);
    retain(colours, &is_kept);
    panes
}

/// Keeps the marked items of a list that may be empty.
fn retain<T>(list: &mut Vec<T>, is_kept: &[bool]) {
    let mut is_kept = is_kept.iter();
    list.retain(|_| is_kept.next().is_some_and(|is_kept| *is_kept));
}
