//! Indirect irradiance at cache points by path tracing, to measure the error of the gather pass.
//! [Kajiya 1986] In: cache points, scene, lights. Out: irradiance, W/m², one a cache point.

use super::path_trace::ROULETTE_THRESHOLD;
use crate::error::Result;
use crate::gpu::barrier::TRANSFER_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::precompute::{Chunks, gather_rays::Hemisphere};
use crate::passes::{LitScene, loop_limit};
use crate::types::LOOP_TRUNCATED;
use glam::{DVec3, Vec3};
use std::sync::Arc;

gpu_struct! {
    /// A path in progress, and the radiance of the finished ones.
    pub struct ProbePath {
        /// Origin of its next ray.
        pub origin: Vec3,
        /// Direction of its next ray.
        pub direction: Vec3,
        /// Product of brdf·cosθ/pdf since the first hit, roulette included.
        pub throughput: Vec3,
        /// Sum over the paths, W/m²/sr.
        pub radiance: Vec3,
        /// Vertices so far; 0: starts at the cache point.
        pub depth: u32,
        /// Index of its random numbers: the number of finished paths.
        pub sample_index: u32,
    }
}

gpu_struct! {
    pub struct IrradianceProbePush {
        /// First cache point of the dispatch.
        pub first_point: u32,
        /// Cache points in the dispatch.
        pub point_count: u32,
        pub light_count: u32,
        /// Seed of the paths.
        pub seed: u32,
        /// Seed of the gather rays.
        pub gather_seed: u32,
        /// 1: paths start along the gather rays; 0: each in a new direction of the stratum.
        pub has_gather_rays: u32,
        /// Paths of each stratum.
        pub goal: u32,
        /// Maximum number of vertices of each invocation's paths in this dispatch.
        pub rounds: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[ProbePath::LAYOUT, IrradianceProbePush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "irradiance_probe";

/// Rays of an invocation in one dispatch: bounds its loops ([`crate::gpu::MAX_LOOP_ITERATIONS`]).
const RAYS_A_DISPATCH: u32 = 128;
/// Maximum number of strata of one dispatch: their paths take 15 MiB.
const STRATA_LIMIT: u32 = 1 << 18;
/// Strata of an invocation.
const STRATA: u32 = 8;

/// Inputs of [`trace`].
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The scene and its lights.
    pub scene: LitScene<'a>,
    /// Radiance of the sky without its bright spots, and the side of its octahedral table.
    pub sky: Option<(&'a Buffer, u32)>,
    /// A `CachePoint` for each probe.
    pub cache_points: &'a Buffer,
    /// Number of cache points.
    pub point_count: u32,
    /// Strata of each point's hemisphere.
    pub hemisphere: Hemisphere,
    /// The seed of the gather rays whose directions the paths take. `None`: new directions
    /// in each stratum.
    pub gather_seed: Option<u32>,
    /// Seed of the paths.
    pub seed: u32,
    /// Paths of each stratum.
    pub samples: u32,
}

/// Indirect irradiance at each cache point, W/m².
///
/// # Errors
/// The device lacks memory or failed.
pub fn trace(context: &Arc<Context>, job: Job<'_>) -> Result<Vec<Vec3>> {
    let [rings, sectors] = job.hemisphere.constants();
    let roulette = ("ROULETTE_THRESHOLD", ROULETTE_THRESHOLD.to_bits());
    let textures = job.scene.buffers.textures.constant();
    // An unused binding without a sky.
    let (sky_radiance, sky_side) = job.sky.unwrap_or((job.cache_points, 0));
    let constants = [rings, sectors, roulette, ("STRATA", STRATA), ("SKY_SIDE", sky_side), textures];
    let pipeline = Pipeline::new(context, STEM, &constants)?;
    let strata = job.hemisphere.rays();
    let points_at_a_time = (STRATA_LIMIT / strata).clamp(1, job.point_count.max(1));
    let path_bytes = size_of::<ProbePath>() as u64;
    let paths = Buffer::storage(context, "probe paths", u64::from(points_at_a_time * strata) * path_bytes)?;
    let unfinished = Buffer::storage(context, "unfinished", 4)?;
    let scale = std::f64::consts::PI / f64::from(strata) / f64::from(job.samples.max(1));
    let mut irradiance = Vec::with_capacity(job.point_count as usize);
    Chunks::new(64, points_at_a_time).run(job.point_count, |first_point, point_count| {
        let push = IrradianceProbePush {
            first_point,
            point_count,
            light_count: job.scene.light_count,
            seed: job.seed,
            gather_seed: job.gather_seed.unwrap_or(0),
            has_gather_rays: u32::from(job.gather_seed.is_some()),
            goal: job.samples,
            rounds: (RAYS_A_DISPATCH / (1 + job.scene.light_count)).max(1),
        };
        context.run(|rec| rec.fill_zero(&paths))?;
        let mut longest = 0.0_f64;
        loop {
            let ((), timings) = context.run(|rec| {
                rec.pass(STEM).fill_zero(&unfinished).barrier(TRANSFER_TO_COMPUTE).dispatch(
                    &pipeline,
                    [(point_count * strata).div_ceil(STRATA), 1, 1],
                    &push,
                    &job.scene.bindings_and([
                        ("CachePoints", job.cache_points),
                        ("ProbePaths", &paths),
                        ("Unfinished", &unfinished),
                        ("SkyRadiance", sky_radiance),
                    ]),
                );
            })?;
            longest = longest.max(timings[0].ms);
            let left = unfinished.read::<u32>()?[0];
            loop_limit::refuse(left & LOOP_TRUNCATED != 0, STEM, push.light_count)?;
            if left == 0 {
                break;
            }
        }
        let found: Vec<ProbePath> = paths.read_range(0, (point_count * strata) as usize)?;
        irradiance.extend(found.chunks_exact(strata as usize).map(|row| {
            let sum: DVec3 = row.iter().map(|path| path.radiance.as_dvec3()).sum();
            (scale * sum).as_vec3()
        }));
        Ok(longest)
    })?;
    Ok(irradiance)
}
