//! Colours of vertices as images: each triangle has a block of texels of its own.
//!
//! Interpolation between the corners is linear in a triangle and bilinear in an image. Both agree
//! if the block's texels lie on the linear function. Where that leaves 0..=1, texels beyond the
//! triangle's third edge are bounded, and colours beside that edge differ.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec2};

use super::Triangle;
use super::geometry::{Codes, WHITE};
use super::limits::IMAGE_SIDE;
use super::material::Material;
use super::texture::{self, Image, Texture};

/// Texels a side of a block. The largest that fits is used: it halves the error of bounded texels,
/// and costs nothing where colours repeat.
const BLOCK_SIDES: [u32; 3] = [8, 4, 2];
/// Texels of an atlas with blocks above the smallest.
const FINE_TEXELS: u64 = 1 << 22;

/// Triangles with the colours of their corners; the colours are empty if no model has any.
pub(super) struct Surface<'a> {
    pub(super) triangles: &'a [Triangle],
    pub(super) colours: &'a [[Codes; 3]],
}

/// The colours on the triangles of a material.
#[derive(Clone, Copy, Default)]
struct Tally {
    first: Option<Codes>,
    is_varied: bool,
    /// Linear, times area.
    sum: DVec3,
    area_m2: f64,
}

impl Surface<'_> {
    /// Multiplies the materials by the colours of their triangles. One colour of a whole material
    /// multiplies its albedo, varied ones become its image. A material that has an image is
    /// multiplied by their mean over its area. Returns a warning for each of these.
    pub(super) fn colour(&self, materials: &mut [Material], coordinates: &mut Vec<[Vec2; 3]>) -> Vec<String> {
        if self.colours.iter().flatten().all(|codes| *codes == WHITE) {
            return Vec::new();
        }
        let linear: [f64; 256] = std::array::from_fn(|code| texture::linear(code as u8).into());
        let tallies = self.tallies(materials.len(), &linear);
        let is_free = |(tally, material): (&Tally, &Material)| tally.is_varied && material.texture.is_none();
        let mut baked: Vec<bool> = tallies.iter().zip(materials.iter()).map(is_free).collect();
        let blocks = Blocks::new(self, &baked, &linear);
        match Atlas::new(&blocks.order, &linear) {
            Some(atlas) if baked.contains(&true) => {
                coordinates.resize(self.triangles.len(), [Vec2::ZERO; 3]);
                for (triangle, block, first) in blocks.places {
                    let mut corners = atlas.corners(block);
                    corners.rotate_right(first);
                    coordinates[triangle] = corners;
                }
                let image = Arc::new(atlas.image);
                for (material, _) in materials.iter_mut().zip(&baked).filter(|(_, is_baked)| **is_baked) {
                    let image = image.clone();
                    material.texture = Some(Texture { image, is_clamped: true, is_atlas: true });
                }
            }
            Some(_) => (),
            None => baked.fill(false),
        }
        let mut warnings = Vec::new();
        for ((tally, material), is_baked) in tallies.iter().zip(materials).zip(baked) {
            match tally.first {
                Some(codes) if !tally.is_varied => material.diffuse *= decoded(codes, &linear).as_vec3(),
                Some(_) if !is_baked => {
                    material.diffuse *= (tally.sum / tally.area_m2).as_vec3();
                    warnings.push(format!(
                        "material {:?} has vertex colours beside its image, or more than an image can hold: they count by their mean",
                        material.name
                    ));
                }
                _ => (),
            }
        }
        warnings
    }

    fn tallies(&self, count: usize, linear: &[f64; 256]) -> Vec<Tally> {
        let mut tallies = vec![Tally::default(); count];
        for (triangle, colours) in self.triangles.iter().zip(self.colours) {
            let tally = &mut tallies[triangle.material as usize];
            let first = *tally.first.get_or_insert(colours[0]);
            tally.is_varied |= colours.iter().any(|codes| *codes != first);
            let area_m2 = triangle.area_m2();
            tally.area_m2 += area_m2;
            tally.sum += area_m2 / 3.0 * colours.iter().map(|codes| decoded(*codes, linear)).sum::<DVec3>();
        }
        tallies
    }
}

fn decoded(codes: Codes, linear: &[f64; 256]) -> DVec3 {
    DVec3::from(codes.map(|code| linear[usize::from(code)]))
}

/// Blocks of an atlas, each once.
struct Blocks {
    /// Colours of a block's corners, in the order of the atlas.
    order: Vec<[Codes; 3]>,
    /// Triangle, its block, and which of its corners is the first of the block.
    places: Vec<(usize, u32, usize)>,
}

impl Blocks {
    fn new(surface: &Surface, baked: &[bool], linear: &[f64; 256]) -> Self {
        let mut blocks = Self { order: Vec::new(), places: Vec::new() };
        let mut known = HashMap::new();
        for (index, (triangle, colours)) in surface.triangles.iter().zip(surface.colours).enumerate() {
            if !baked[triangle.material as usize] {
                continue;
            }
            let first = best_corner(*colours, linear);
            let mut corners = *colours;
            corners.rotate_left(first);
            let block = *known.entry(corners).or_insert_with(|| {
                blocks.order.push(corners);
                blocks.order.len() as u32 - 1
            });
            blocks.places.push((index, block, first));
        }
        blocks
    }
}

/// The corner for which the colour opposite to it, across the other two, is least out of range.
fn best_corner(colours: [Codes; 3], linear: &[f64; 256]) -> usize {
    let [a, b, c] = colours.map(|codes| decoded(codes, linear));
    let excess = |opposite: DVec3| (opposite - opposite.clamp(DVec3::ZERO, DVec3::ONE)).abs().max_element();
    let excesses = [b + c - a, c + a - b, a + b - c].map(excess);
    (0..3).min_by(|&i, &j| excesses[i].total_cmp(&excesses[j])).unwrap_or(0)
}

/// Blocks of texels in rows.
struct Atlas {
    image: Image,
    side: u32,
    across: u32,
}

impl Atlas {
    /// `None` if the blocks do not fit into an image.
    fn new(order: &[[Codes; 3]], linear: &[f64; 256]) -> Option<Self> {
        let count = order.len() as u64;
        let fits = |side: &&u32| count * u64::from(**side).pow(2) <= FINE_TEXELS;
        let side = *BLOCK_SIDES.iter().find(fits).unwrap_or(&BLOCK_SIDES[2]);
        let across = (count as f64).sqrt().ceil().max(1.0) as u32;
        if across * side > IMAGE_SIDE {
            return None;
        }
        let down = (count as u32).div_ceil(across).max(1);
        let [width, height] = [across * side, down * side];
        let mut codes = vec![WHITE; width as usize * height as usize];
        for (block, corners) in (0..).zip(order) {
            let [a, b, c] = corners.map(|codes| decoded(codes, linear));
            let [left, top] = [block % across * side, block / across * side];
            let step = 1.0 / f64::from(side - 1);
            for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
                let [u, v] = [x, y].map(|along| f64::from(along) * step);
                let colour = (a + u * (b - a) + v * (c - a)).as_vec3();
                codes[(top + y) as usize * width as usize + (left + x) as usize] =
                    colour.to_array().map(texture::code);
            }
        }
        Some(Self { image: Image { size: [width, height], codes }, side, across })
    }

    /// Image coordinates of a block's corners: centres of texels.
    fn corners(&self, block: u32) -> [Vec2; 3] {
        let size = DVec2::from(self.image.size.map(f64::from));
        let [left, top] = [block % self.across, block / self.across].map(|place| place * self.side);
        let far = self.side - 1;
        [[0, 0], [far, 0], [0, far]].map(|[x, y]| {
            let place = (DVec2::new(f64::from(left + x), f64::from(top + y)) + 0.5) / size;
            DVec2::new(place.x, 1.0 - place.y).as_vec2()
        })
    }
}
