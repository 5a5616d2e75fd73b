//! What the settings resolve of a scene, and what to say where that is too little.

use super::precompute::FINEST;
use crate::passes::precompute::narrow_gaps;
use crate::scene::directions::{Directions, directions_for, resolved_exponent};
use crate::scene::{Material, Scene};
use glam::Vec3;

/// Directions in which clusters that shine are read at most, unless more are asked for: enough for exponents up to 1 420. Each that a gather
/// ray reads takes 28 bytes and 12 more a light, so that there are not many more of them than rays that read them.
const MOST_DIRECTIONS: u32 = 1 << 12;

/// Directions in which clusters that shine are read: more than asked for where that resolves a lobe that stays as it is. An editable one
/// does not count, because its picture must not depend on what it was at load.
pub(super) fn outgoing_directions(materials: &[Material], directions: Directions) -> Directions {
    let stays = |material: &&Material| material.specular != Vec3::ZERO && !material.editable;
    let sharpest = materials.iter().filter(stays).map(|material| material.exponent).fold(0.0, f32::max);
    Directions::new(directions.count().max(directions_for(sharpest).min(MOST_DIRECTIONS)))
}

/// What to say of lobes that are sharper than the directions that clusters are read in.
pub(super) fn blurred(materials: &[Material], directions: Directions) -> impl Iterator<Item = String> {
    let resolved = resolved_exponent(directions.count());
    let is_sharp =
        move |material: &&Material| material.specular != Vec3::ZERO && material.exponent > resolved;
    materials.iter().filter(is_sharp).map(move |material| {
        format!(
            "material `{}`: what it sends on to other surfaces is blurred: {} directions resolve exponents up to {resolved:.0}, and it has {}; raise quality.directions to {}",
            material.name,
            directions.count(),
            material.exponent,
            directions_for(material.exponent)
        )
    })
}

/// What to say of lights in gaps that cells of that size, so many along the longest axis, do not resolve.
pub(super) fn unresolved(
    scene: &Scene,
    gaps: &[f32],
    cell_size: f32,
    finest: u32,
) -> impl Iterator<Item = String> {
    let needed = move |gap: f32| narrow_gaps::RESOLVED * cell_size / gap;
    let narrow = scene.lights.iter().zip(gaps).filter(move |(_, gap)| needed(**gap) > 1.0);
    narrow.map(move |(light, gap)| {
        let factor = (needed(*gap).ceil() as u32).next_power_of_two();
        let cells = scene.quality.cells.saturating_mul(factor);
        let advice = match finest.saturating_mul(factor) <= FINEST {
            true => format!("raise quality.cells to {cells}, and quality.gather_rays where the light still leaks"),
            false => "no number of cells does; move it or what hides it".to_owned(),
        };
        format!(
            "light `{}` stands in a gap of {gap:.3} m, and cells of {cell_size:.3} m tell its two sides apart from {:.3} m on: light may leak past what hides it; {advice}",
            light.name,
            narrow_gaps::RESOLVED * cell_size
        )
    })
}
