//! The device's ray rates in a scene, and those of a maintained library on the same processor. The
//! rays per second of passes are compared with them.
//!
//! The rays are four explicit lists in memory, so that only traversal is timed. Coherent: camera
//! rays, tile by tile, and rays from their hits to a light. Incoherent: diffuse reflections from
//! those hits, and rays between pairs of hits; in random order.

use std::sync::Arc;

use glam::Vec3;

use super::host_rays;
use super::measure::Summary;
use super::rates::{Rates, RaySets, mrays_per_s};
use crate::cpu::hemisphere::{Strata, frame};
use crate::cpu::sampling::hash;
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::precompute::rays::{RayAnswer, RayQuery, Rays};
use crate::reference::TracedScene;
use crate::scene::Scene;
use crate::types::{LIGHT_DIRECTIONAL, NO_SIDE};

/// Camera rays along an axis. Each other list has one ray per hit of a camera ray.
const ROW: u32 = 512;
/// Side of the camera rays' tiles.
const TILE: u32 = 8;
const REPEATS: usize = 5;
/// Offset of ray origins from their surface, as a fraction of the scene's size.
const CLEAR: f32 = 1e-5;
/// Length of segments, as a fraction of the distance to the surface at their end.
const SHORT: f32 = 0.999;

/// The ray rates of one scene.
#[derive(Clone, Debug, serde::Serialize)]
pub(super) struct RayRates {
    /// Rates of the device's kernels.
    pub(super) device: Rates,
    /// Closest hits with `obvhs` on all threads, if the device is this processor.
    pub(super) host: Option<Rates>,
}

/// Measures a scene seen by its first camera. The context's memory use must not be reported.
///
/// # Errors
/// The device lacks memory or failed.
pub(super) fn measure(context: &Arc<Context>, scene: Scene) -> Result<RayRates> {
    let traced = TracedScene::new(context, scene)?;
    let [closest, any] = [Rays::new(context)?, Rays::of_segments(context)?];
    let camera = camera_rays(&traced);
    let answers = closest.trace(&traced.buffers, &camera)?;
    let sets = ray_sets(&traced, camera, &answers);
    let rate = |rays: &Rays, queries: &[RayQuery]| -> Result<Option<f64>> {
        if queries.is_empty() {
            return Ok(None);
        }
        let times = rays.time(&traced.buffers, queries, REPEATS)?;
        Ok(mrays_per_s(queries.len(), Summary::from_times(times).median))
    };
    let device = Rates {
        closest_coherent: rate(&closest, &sets.camera)?,
        closest_incoherent: rate(&closest, &sets.reflected)?,
        any_coherent: rate(&any, &sets.shadow)?,
        any_incoherent: rate(&any, &sets.pairs)?,
    };
    let host = context.is_cpu().then(|| host_rays::rates(&traced.scene, &sets, REPEATS)).transpose()?;
    Ok(RayRates { device, host })
}

/// Rays through the image in tiles, each tile row by row.
fn camera_rays(traced: &TracedScene) -> Vec<RayQuery> {
    let view = &traced.view;
    let ray = |index: u32| {
        let (tile, within) = (index / (TILE * TILE), index % (TILE * TILE));
        let x = tile % (ROW / TILE) * TILE + within % TILE;
        let y = tile / (ROW / TILE) * TILE + within / TILE;
        let [across, down] = [x, y].map(|place| (place as f32 + 0.5) / ROW as f32 * 2.0 - 1.0);
        RayQuery { origin: view.position, direction: view.forward + across * view.right - down * view.up }
    };
    (0..ROW * ROW).map(ray).collect()
}

/// All four lists, from the hits of the camera rays.
fn ray_sets(traced: &TracedScene, camera: Vec<RayQuery>, answers: &[RayAnswer]) -> RaySets {
    let (low, high) = traced.scene.bounds();
    let size = (high - low).length();
    let [rings, sectors] = Hemisphere::new(256).constants().map(|constant| constant.1);
    let strata = Strata { rings, sectors };
    // Ray origins and their normals.
    let met: Vec<(Vec3, Vec3)> = camera
        .iter()
        .zip(answers)
        .filter(|(_, answer)| answer.side != NO_SIDE)
        .map(|(query, answer)| {
            let normal = traced.surfaces[answer.side as usize / 2].normal_of(answer.side % 2 == 1);
            (query.origin + answer.t * query.direction + CLEAR * size * normal, normal)
        })
        .collect();
    let mut shuffled: Vec<u32> = (0..met.len() as u32).collect();
    shuffled.sort_unstable_by_key(|&index| (hash(index), index));
    let reflected = |&index: &u32| {
        let (origin, normal) = met[index as usize];
        let direction = frame(normal) * strata.direction(hash(index) % strata.rays(), index, 0);
        RayQuery { origin, direction: direction.as_vec3() }
    };
    let between = |origin: Vec3, end: Vec3| RayQuery { origin, direction: SHORT * (end - origin) };
    let to_light = |&(origin, _): &(Vec3, Vec3)| match traced.light_sources.rows.first() {
        Some(light) if light.kind == LIGHT_DIRECTIONAL => RayQuery { origin, direction: -size * light.axis },
        Some(light) => between(origin, light.position + 0.5 * (light.edge_u + light.edge_v)),
        None => between(origin, 0.5 * (low + high)),
    };
    let pair = |pair: &[u32]| between(met[pair[0] as usize].0, met[pair[1] as usize].0);
    RaySets {
        reflected: shuffled.iter().map(reflected).collect(),
        shadow: met.iter().map(to_light).collect(),
        pairs: shuffled.windows(2).map(pair).collect(),
        camera,
    }
}
