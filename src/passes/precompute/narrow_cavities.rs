//! Gaps that are narrow beside the cells that gather rays read: with a light in one, a coarse cell
//! takes what lies behind the blocker for what lies before it. [Yue §5, Figure 3] In: lights,
//! scene. Out: which clusters hold surface inside such a gap and surface outside, wherever the
//! lights are, so that a light may move into one; for each point and spot light the narrowest gap
//! that it stands in, to tell where too few entry points are next to it.

use super::entry_points::density;
use super::gather_rays::Hemisphere;
use super::near_clusters::Patch;
use super::rays::{RayQuery, Rays};
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::scene::directions::Directions;
use crate::scene::hvds::Hvds;
use crate::scene::{Light, LightKind};
use crate::types::{NO_CLUSTER, NO_SIDE, Surface};
use glam::Vec3;
use std::f32::consts::PI;

/// Pairs of opposite directions are looked along.
const DIRECTIONS: Directions = Directions { side: 8 };

/// Lights in gaps of so many of the widest cells that gather rays read need no care.
const RESOLVED: f32 = 2.5;
/// And cells part gaps of so many by themselves.
const PARTED: f32 = 0.75;
/// Entry points, in the mean, of each part of an inconsistent cluster; with fewer, what is read
/// instead would be of single paths.
const MIN_IN_PART: f32 = 1.0;
/// What gather rays read is so much narrower than their strata (`gather_rays`).
const SHARE: f32 = 0.25;

/// Widths of gaps, metres, in a scene of that size with cells of that size: those in which lights
/// need no care, and those that cells part.
pub fn resolved(scene_size: f32, cell_size: f32, hemisphere: Hemisphere) -> [f32; 2] {
    let read = SHARE * (PI / hemisphere.rays() as f32).sqrt() * scene_size;
    [RESOLVED, PARTED].map(|cells| cells * read.max(cell_size))
}

fn place(light: &Light) -> Option<Vec3> {
    match light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(position),
        LightKind::Area { .. } | LightKind::Directional { .. } => None,
    }
}

/// Entry points that fall into a square as wide as the gap, where so many stand for `area_m2`, at
/// the density that they have there: so many know how bright the light makes it.
pub fn entry_points_in(gap: f32, count: u32, area_m2: f64, cell_size: f32) -> f32 {
    gap * gap * density(gap, cell_size) * (f64::from(count) / area_m2) as f32
}

/// Which clusters hold surface inside a gap narrower than `parted` (metres), and surface
/// outside: once a light stands in there, they stand for neither. Empty where there is no
/// such gap. `patches` of the base clusters; `in_clusters`: entry points that each cluster
/// holds, in expectation.
///
/// # Errors
/// The device lacks memory or failed.
pub fn inconsistent(
    (rays, scene): (&Rays, &SceneBuffers),
    hvds: &Hvds,
    patches: &[Patch],
    surfaces: &[Surface],
    in_clusters: &[f32],
    parted: f32,
    clear_distance: f32,
) -> Result<Vec<bool>> {
    let patches = &patches[..hvds.levels[0].len()];
    let query = |patch: &Patch| RayQuery {
        origin: patch.middle + clear_distance * patch.normal,
        direction: patch.normal,
    };
    // Some only touch their cell and hold nothing.
    let holding: Vec<usize> =
        (0..patches.len()).filter(|&patch| patches[patch].clearance.is_finite()).collect();
    let queries: Vec<RayQuery> = holding.iter().map(|&patch| query(&patches[patch])).collect();
    let mut holds = vec![[false; 2]; hvds.parents.len()];
    for (&cluster, answer) in holding.iter().zip(rays.trace(scene, &queries)?) {
        // From the middle of what bulges, it is the inside that is met.
        let is_inside = answer.side != NO_SIDE
            && answer.t < parted
            && surfaces[answer.side as usize / 2].side_is_active(answer.side % 2 == 1);
        holds[cluster][usize::from(is_inside)] = true;
    }
    if holds.iter().all(|holds| !holds[1]) {
        return Ok(Vec::new());
    }
    for cluster in 0..holds.len() {
        let [outside, inside] = holds[cluster];
        if hvds.parents[cluster] != NO_CLUSTER {
            let around = &mut holds[hvds.parents[cluster] as usize];
            *around = [around[0] || outside, around[1] || inside];
        }
    }
    let is_known =
        |child: u32| holds[child as usize] == [false; 2] || in_clusters[child as usize] >= MIN_IN_PART;
    let is_inconsistent = |cluster: usize| {
        holds[cluster] == [true; 2]
            && (hvds.child_offsets[cluster]..hvds.child_offsets[cluster + 1]).all(is_known)
    };
    Ok((0..holds.len()).map(is_inconsistent).collect())
}

/// Widths of the narrowest gaps that the lights stand in, metres, light by light; infinite
/// for other kinds, which have no place or send nothing back, and for lights without a
/// surface on both sides.
///
/// # Errors
/// The device lacks memory or failed.
pub fn find(rays: &Rays, scene: &SceneBuffers, lights: &[Light]) -> Result<Vec<f32>> {
    let directions: Vec<Vec3> = (0..DIRECTIONS.count())
        .map(|bin| DIRECTIONS.middle(bin).as_vec3())
        .filter(|direction| direction.z >= 0.0)
        .flat_map(|direction| [direction, -direction])
        .collect();
    let ray = |origin| directions.iter().map(move |&direction| RayQuery { origin, direction });
    let queries: Vec<RayQuery> = lights.iter().filter_map(place).flat_map(ray).collect();
    let answers = rays.trace(scene, &queries)?;
    let mut pairs = answers.chunks_exact(2).map(|pair| match [pair[0].t, pair[1].t] {
        [forth, back] if forth > 0.0 && back > 0.0 => forth + back,
        _ => f32::INFINITY,
    });
    let narrowest = |light| match place(light) {
        Some(_) => pairs.by_ref().take(directions.len() / 2).fold(f32::INFINITY, f32::min),
        None => f32::INFINITY,
    };
    Ok(lights.iter().map(narrowest).collect())
}
