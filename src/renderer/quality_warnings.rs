//! Quality warnings: they name the features of a scene that the settings do not resolve.

use crate::passes::frame::gloss::is_little;
use crate::passes::precompute::visibility::narrow_cavities;
use crate::scene::directions::{Directions, directions_for, resolved_exponent};

use crate::scene::fragment::Fragment;
use crate::scene::grid::{CellGrid, FINEST, finest_cells};
use crate::scene::{Material, Scene};
use glam::Vec3;

/// Maximum number of direction bins of glossy clusters, unless the settings request more. It
/// resolves exponents up to 1 420. A bin that a gather ray reads takes 28 bytes and 12 more for
/// each light, so there are not many more bins than rays that read them.
const MAX_DIRECTIONS: u32 = 1 << 12;

/// Minimum number of direction bins of glossy clusters, unless the settings request fewer.
const MIN_DIRECTIONS: u32 = 64;

/// Direction bins of glossy clusters. There are more than requested if that resolves the sharpest
/// lobe. There are fewer if all lobes are weak and broad: their radiance is smooth, and each bin
/// costs the same. If a material is editable, there are at least as many as requested, because the
/// picture must not depend on the material at load.
pub(super) fn outgoing_directions(materials: &[Material], directions: Directions) -> Directions {
    let stays = |material: &&Material| material.specular != Vec3::ZERO && !material.editable;
    let sharpest = materials.iter().filter(stays).map(|material| material.exponent).fold(0.0, f32::max);
    let count = directions.count();
    let may_be_few =
        |material: &Material| !material.editable && (material.specular == Vec3::ZERO || is_little(material));
    let least = if materials.iter().all(may_be_few) { MIN_DIRECTIONS.min(count) } else { count };
    Directions::new(directions_for(sharpest).clamp(least, MAX_DIRECTIONS.max(count)))
}

/// Warnings about lobes that the direction bins do not resolve.
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

/// Entry points on a square as wide as a gap that sample a light in it well enough. Measured
/// (`hidden_light`): irradiance of the walls around is within 3 % with 26 entry points, within 35
/// % with 6.
const ENOUGH: f32 = 16.0;

/// Warnings about lights in gaps with few entry points beside them. `gaps` are the widths at the
/// lights, metres; widths below `resolved` count. `quality.entry_points` stand for `area_m2`, in
/// cells of `cell_size`.
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

/// Minimum number of entry points that carry a light to the visible clusters. The relative error of
/// its indirect light is about 1 over the root of this number. Measured (`docs/decisions/`): with
/// 16 entry points it was 15 to 48 % off, with 150 3 to 4 %, with 600 as much as other lights.
pub(super) const FEWEST: f64 = 256.0;

/// The warning about a light that `count` entry points carry to the visible clusters.
pub(super) fn few_paths(scene: &Scene, light: usize, count: f64) -> String {
    let quality = &scene.quality;
    let needed = f64::from(quality.entry_points) * FEWEST / count;
    // Rounded up to two digits.
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

/// Minimum median clearance of the surface, in cells of the finest level; below it, cells are too
/// wide. Measured: a box of two metres, and a speck further and further away (`docs/decisions/`).
const CLEARANCE: f64 = 0.75;
/// Minimum median clearance of the surface in view, measured with few rays. The built-in scenes
/// have 0.47 (atrium, `draft`) and more.
const CLEARANCE_IN_VIEW: f64 = 0.45;

/// Median clearance of the surface, metres, weighted by the exposed area of fragments.
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

/// The warning about cells that are wide beside the clearance of most surface, as in a scene that
/// fills a small fraction of its box. `grid` is that of the finest level.
pub(super) fn wide_cells(clearance: f64, grid: &CellGrid, cells: u32) -> Option<String> {
    wide_cells_beside("half of the surface", (clearance, CLEARANCE), grid, cells)
}

/// The warning about cells that are wide beside the surface in view, such as a small building on a
/// large ground. `clearance` is the median clearance in view.
pub(super) fn wide_cells_in_view(clearance: f64, grid: &CellGrid, cells: u32) -> Option<String> {
    wide_cells_beside("half of what the camera sees", (clearance, CLEARANCE_IN_VIEW), grid, cells)
}

fn wide_cells_beside(
    what: &str,
    (clearance, least): (f64, f64),
    grid: &CellGrid,
    cells: u32,
) -> Option<String> {
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

/// The warning about cache points that are too few.
pub(super) fn uncovered(cache_points: u32) -> String {
    format!(
        "{cache_points} cache points do not cover the scene's curved surfaces; pixels without one take the nearest; raise quality.cache_points"
    )
}
