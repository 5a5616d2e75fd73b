//! Lights in gaps that are narrow beside the cells that gather rays read: in a coarse cell what lies behind the blocker is taken for what
//! lies before it. [Yue §5, Figure 3]
//! In: lights, scene. Out: for each point and spot light the narrowest gap that it stands in; then, which clusters hold surface inside such a
//! gap and surface outside.

use super::entry_points::density;
use super::gather_rays::Hemisphere;
use super::near_clusters::Patch;
use super::rays::{RayQuery, Rays};
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::scene::directions::Directions;
use crate::scene::hvds::Hvds;
use crate::scene::{Light, LightKind};
use crate::types::NO_CLUSTER;
use glam::Vec3;
use std::f32::consts::PI;

/// Pairs of opposite directions are looked along.
const DIRECTIONS: Directions = Directions { side: 8 };

/// Gaps of so many of the widest cells that gather rays read need no care.
const RESOLVED: f32 = 2.5;
/// What gather rays read is so much narrower than their strata (`gather_rays`).
const SHARE: f32 = 0.25;
/// Surface is inside a gap if it sees another within so many widths of it, and the light is within so many: there it is brightest.
const CLEARANCE: f32 = 1.75;
const REACH: f32 = 32.0;

/// Width of gaps that need no care, metres, in a scene of that size with cells of that size.
pub fn resolved(scene_size: f32, cell_size: f32, hemisphere: Hemisphere) -> f32 {
    let read = SHARE * (PI / hemisphere.rays() as f32).sqrt() * scene_size;
    RESOLVED * read.max(cell_size)
}

fn place(light: &Light) -> Option<Vec3> {
    match light.kind {
        LightKind::Point { position, .. } | LightKind::Spot { position, .. } => Some(position),
        LightKind::Area { .. } | LightKind::Directional { .. } => None,
    }
}

/// Entry points that fall into a square as wide as the gap, where so many stand for `area_m2`, at the density that they have there: so many
/// know how bright the light makes it.
pub fn entry_points_in(gap: f32, count: u32, area_m2: f64, cell_size: f32) -> f32 {
    gap * gap * density(gap, cell_size) * (f64::from(count) / area_m2) as f32
}

/// Which clusters hold surface inside a gap with a light, and surface outside: they stand for neither. Empty where there is no such gap.
/// `gaps` of the lights, metres; those below `resolved` count. `patches` of the base clusters.
pub fn mixed(hvds: &Hvds, patches: &[Patch], lights: &[Light], gaps: &[f32], resolved: f32) -> Vec<bool> {
    let narrow: Vec<(Vec3, f32)> = lights
        .iter()
        .zip(gaps)
        .filter(|(_, gap)| **gap < resolved)
        .filter_map(|(light, &gap)| Some((place(light)?, gap)))
        .collect();
    if narrow.is_empty() {
        return Vec::new();
    }
    let is_inside = |patch: &Patch| {
        let is_in = |&(light, gap): &(Vec3, f32)| {
            patch.clearance < CLEARANCE * gap && patch.middle.distance(light) < REACH * gap
        };
        narrow.iter().any(is_in)
    };
    let mut holds = vec![[false; 2]; hvds.parents.len()];
    for (cluster, patch) in patches[..hvds.levels[0].len()].iter().enumerate() {
        // Some only touch their cell and hold nothing.
        holds[cluster][usize::from(is_inside(patch))] = patch.clearance.is_finite();
    }
    for cluster in 0..holds.len() {
        let [outside, inside] = holds[cluster];
        if hvds.parents[cluster] != NO_CLUSTER {
            let around = &mut holds[hvds.parents[cluster] as usize];
            *around = [around[0] || outside, around[1] || inside];
        }
    }
    holds.into_iter().map(|holds| holds == [true; 2]).collect()
}

/// Widths of the narrowest gaps that the lights stand in, metres, light by light; infinite for other kinds, which have no place or send
/// nothing back, and for lights without a surface on both sides.
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
