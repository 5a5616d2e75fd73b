//! What the settings resolve of a scene, and what to say where that is too little.

use super::precompute::{FINEST, finest_cells};
use crate::passes::frame::gloss::is_little;
use crate::passes::precompute::narrow_cavities;
use crate::scene::directions::{Directions, directions_for, resolved_exponent};
use crate::scene::hvds::Fragment;
use crate::scene::{Material, Scene};
use crate::types::Grid;
use glam::Vec3;

/// Directions in which glossy clusters are read at most, unless more are asked for: enough for
/// exponents up to 1 420. Each that a gather ray reads takes 28 bytes and 12 more a light, so that
/// there are not many more of them than rays that read them.
const MAX_DIRECTIONS: u32 = 1 << 12;

/// Directions in which glossy clusters are read at least, unless fewer are asked for.
const MIN_DIRECTIONS: u32 = 64;

/// Directions in which glossy clusters are read: more than asked for where that resolves the
/// sharpest lobe, and fewer where all lobes are a little broad gloss: that is smooth, and each
/// direction costs as much as another. Where a material is editable, as many as asked for at least,
/// because its picture must not depend on what it was at load.
pub(super) fn outgoing_directions(materials: &[Material], directions: Directions) -> Directions {
    let stays = |material: &&Material| material.specular != Vec3::ZERO && !material.editable;
    let sharpest = materials.iter().filter(stays).map(|material| material.exponent).fold(0.0, f32::max);
    let count = directions.count();
    let may_be_few =
        |material: &Material| !material.editable && (material.specular == Vec3::ZERO || is_little(material));
    let least = if materials.iter().all(may_be_few) { MIN_DIRECTIONS.min(count) } else { count };
    Directions::new(directions_for(sharpest).clamp(least, MAX_DIRECTIONS.max(count)))
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

/// Entry points on a square as wide as a gap that tell well enough how bright a light in it makes
/// it. Measured (`hidden_light`): with 26 the walls around get what they should within 3 %, with 6
/// within 35 %.
const ENOUGH: f32 = 16.0;

/// What to say of lights in gaps so narrow that few entry points are next to them. `gaps` of the
/// lights, metres, those below `resolved` count; so many entry points stand for `area_m2`, in cells
/// of that size.
pub(super) fn undersampled(
    scene: &Scene,
    gaps: &[f32],
    resolved: f32,
    area_m2: f64,
    cell_size: f32,
) -> impl Iterator<Item = String> {
    let count = scene.quality.entry_points;
    let narrow = scene.lights.iter().zip(gaps).filter(move |(_, gap)| **gap < resolved);
    narrow.filter_map(move |(light, &gap)| {
        let found = narrow_cavities::entry_points_in(gap, count, area_m2, cell_size);
        let needed = (f64::from(count) * f64::from(ENOUGH / found)).ceil();
        let hint = match needed <= f64::from(1 << 24) {
            true => format!("raise quality.entry_points to {needed}"),
            false => "no number of them does; move it or what hides it".to_owned(),
        };
        (found < ENOUGH).then(|| {
            format!(
                "light `{}` stands in a gap of {gap:.3} m with few entry points next to it: the light in there and what leaves it is noisy; {hint}",
                light.name
            )
        })
    })
}

/// Entry points that a light is carried by at the least: their number tells its indirect light to
/// one part in the root of it. Measured (`docs/decisions.md`): with 16 it was 15 to 48 % off, with
/// 150 3 to 4 %, with 600 as much as others.
pub(super) const FEWEST: f64 = 256.0;

/// What to say of a light that so many entry points carry to what the camera sees.
pub(super) fn few_paths(scene: &Scene, light: usize, count: f64) -> String {
    let quality = &scene.quality;
    let needed = f64::from(quality.entry_points) * FEWEST / count;
    // Two digits will do.
    let step = 10_f64.powf(needed.log10().floor() - 1.0);
    let needed = (needed / step).ceil() * step;
    let hint = match needed <= f64::from(1 << 24) {
        true => format!("raise quality.entry_points (--set quality.entry_points={needed})"),
        false => "no number of them does; widen what it comes through".to_owned(),
    };
    format!(
        "light `{}` comes to what the camera sees by {count:.0} of {} entry points (preset {}): its indirect light may be {:.0} % off; {hint}",
        scene.lights[light].name,
        quality.entry_points,
        quality.preset,
        100.0 / count.sqrt()
    )
}

/// What half of the surface has before it at least, in cells of the finest level, where
/// these are not too wide. Measured: a box of two metres, and a speck further and
/// further away (`docs/decisions.md`).
const CLEARANCE: f64 = 0.75;
/// The same of what the camera sees, by few rays. The built-in scenes have 0.47 (atrium,
/// `draft`) and more.
const CLEARANCE_IN_VIEW: f64 = 0.45;

/// How far half of the surface has no other before it, metres; by what the fragments are from
/// what they see.
pub(super) fn typical_clearance(fragments: &[Fragment], clearances: &[f32]) -> f64 {
    let area = |fragment: &Fragment| fragment.open_area_m2();
    let mut by_clearance: Vec<(f32, f64)> =
        clearances.iter().copied().zip(fragments.iter().map(area)).collect();
    by_clearance.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * by_clearance.iter().map(|(_, area)| area).sum::<f64>();
    let mut below = 0.0;
    let middle = by_clearance.iter().find(|(_, area)| {
        below += area;
        below >= half
    });
    middle.map_or(f64::INFINITY, |(clearance, _)| f64::from(*clearance))
}

/// What to say of cells that are wide beside most of the surface, as in a scene that fills a small
/// part of its box. `grid` of the finest level.
pub(super) fn wide_cells(clearance: f64, grid: &Grid, cells: u32) -> Option<String> {
    wide_cells_beside("half of the surface", (clearance, CLEARANCE), grid, cells)
}

/// The same of what the camera sees, as of a small building on a large ground. `clearance` is what
/// half of that has before it.
pub(super) fn wide_cells_in_view(clearance: f64, grid: &Grid, cells: u32) -> Option<String> {
    wide_cells_beside("half of what the camera sees", (clearance, CLEARANCE_IN_VIEW), grid, cells)
}

fn wide_cells_beside(what: &str, (clearance, least): (f64, f64), grid: &Grid, cells: u32) -> Option<String> {
    let size = grid.cell_size();
    let hint = match finest_cells(cells) < FINEST {
        true => "raise quality.cells",
        false => "leave out what is far from the rest, more cells are no finer",
    };
    (clearance < least * size).then(|| {
        format!(
            "{what} has other surface within {clearance:.3} m, and cells are {size:.3} m wide: indirect light is blurred there; {hint}"
        )
    })
}

/// What to say of cache points that are too few.
pub(super) fn uncovered(cache_points: u32) -> String {
    format!(
        "{cache_points} cache points do not cover the scene's curved surfaces; pixels without one take the nearest; raise quality.cache_points"
    )
}
