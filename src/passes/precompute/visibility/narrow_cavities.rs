//! Narrow cavities: gaps that are narrow beside the cells that gather rays read. With a light in
//! one, a coarse cell mixes the surface before the blocker with the surface behind it. [Yue §5,
//! Figure 3] In: lights, scene. Out: clusters that hold surface inside and outside such a cavity,
//! for any position of the lights, because a light may move into one; the width of the narrowest
//! cavity around each point and spot light, to detect too few entry points beside it.

use super::near_clusters::Patch;
use crate::cpu::math::ClearDistance;
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::precompute::entry_points::density;
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::precompute::rays::{RayQuery, Rays};
use crate::scene::directions::Directions;
use crate::scene::hvds::Hvds;
use crate::scene::{Light, LightKind};
use crate::types::{NO_CLUSTER, NO_SIDE, Surface};
use glam::Vec3;
use std::f32::consts::PI;

/// Direction bins of the rays, which are traced in opposite pairs.
const DIRECTIONS: Directions = Directions { side: 8 };

/// Width, in the widest cells that gather rays read, from which a light in a gap
/// needs no treatment.
const RESOLVED: f32 = 2.5;
/// Width, in these cells, from which cells separate the two sides of a gap.
const PARTED: f32 = 0.75;
/// Minimum expected number of entry points of each child of an inconsistent cluster; with fewer,
/// readers would get light of single paths.
const MIN_IN_PART: f32 = 1.0;
/// Width of the cells that gather rays read, in widths of a stratum (`gather_rays`).
const SHARE: f32 = 0.25;

/// Widths of gaps, metres, from which lights need no treatment, and from which cells separate
/// their two sides.
pub fn resolved(scene_size: f32, cell_size: f32, hemisphere: Hemisphere) -> [f32; 2] {
    let read = SHARE * (PI / hemisphere.rays() as f32).sqrt() * scene_size;
    [RESOLVED, PARTED].map(|cells| cells * read.max(cell_size))
}

fn place(light: &Light) -> Option<Vec3> {
    match light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(position),
        LightKind::Area { .. }
        | LightKind::Directional { .. }
        | LightKind::Surface { .. }
        | LightKind::Sky { .. } => None,
    }
}

/// Expected number of entry points in a square as wide as the gap, at their density there, for
/// `count` points on `area_m2`. It determines how accurate the brightness of the cavity is.
pub fn entry_points_in(gap: f32, count: u32, area_m2: f64, cell_size: f32) -> f32 {
    gap * gap * density(gap, cell_size) * (f64::from(count) / area_m2) as f32
}

/// Marks clusters that hold surface inside a gap narrower than `parted` (metres) and surface
/// outside: a light in the gap makes them inconsistent. Empty if there is no such gap. `patches` of
/// the base clusters; `in_clusters`: expected number of entry points in each cluster.
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
    clear_distance: ClearDistance,
) -> Result<Vec<bool>> {
    let patches = &patches[..hvds.levels[0].len()];
    let query = |patch: &Patch| RayQuery {
        origin: patch.middle + clear_distance.at(patch.middle) * patch.normal,
        direction: patch.normal,
    };
    // Some clusters only touch their cell and hold no area.
    let holding: Vec<usize> =
        (0..patches.len()).filter(|&patch| patches[patch].clearance.is_finite()).collect();
    let queries: Vec<RayQuery> = holding.iter().map(|&patch| query(&patches[patch])).collect();
    let mut holds = vec![[false; 2]; hvds.parents.len()];
    for (&cluster, answer) in holding.iter().zip(rays.trace_within(scene, &queries, parted)?) {
        // From the middle of a convex cluster the ray starts inside and meets a back side.
        let is_inside =
            answer.side != NO_SIDE && surfaces[answer.side as usize / 2].side_is_active(answer.side % 2 == 1);
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
        holds[cluster] == [true; 2] && hvds.children_of(cluster as u32).iter().copied().all(is_known)
    };
    Ok((0..holds.len()).map(is_inconsistent).collect())
}

/// Widths of the narrowest gaps around the lights, metres, light by light. Infinite for area and
/// directional lights, and for lights without a surface on two opposite sides.
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
