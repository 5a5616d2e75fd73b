//! Photon tracing from the lights. [Jensen 1996] In: number of rays of each light. Out: one photon
//! for each surface met, W.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::precompute::Chunks;
use crate::passes::reference::photon_map::PhotonMap;
use crate::passes::{LitScene, SceneBuffers, loop_limit};
use crate::types::LOOP_TRUNCATED;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// State of a photon path between two dispatches.
    pub struct PhotonPath {
        /// Origin of its next ray.
        pub origin: Vec3,
        /// The light that it comes from.
        pub light: u32,
        /// Unit direction of its next ray; of no meaning before the first surface.
        pub direction: Vec3,
        /// Index among the light's rays: its random stream index.
        pub ray: u32,
        /// W; before the first surface: this ray's fraction of the light's rays.
        pub flux: Vec3,
        /// Surfaces so far.
        pub depth: u32,
        /// One while the path continues.
        pub is_alive: u32,
    }
}

gpu_struct! {
    pub struct PhotonTracePush {
        /// Middle of the scene.
        pub scene_centre: Vec3,
        /// Radius of a sphere around the scene, metres.
        pub scene_radius: f32,
        /// First path of this dispatch.
        pub first_path: u32,
        /// One past the last.
        pub end_path: u32,
        /// First slot of path 0.
        pub first_slot: u32,
        /// Seed of all decisions.
        pub seed: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[PhotonPath::LAYOUT, PhotonTracePush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "photon_trace";

/// Maximum number of surfaces that a path meets in a dispatch; unused slots stay empty.
pub const STEPS: u32 = 4;
/// Upper bound of the survival probability: a path ends even if nothing is absorbed.
pub const MAX_SURVIVAL: f32 = 0.98;

/// The sphere around a scene.
#[derive(Clone, Copy, Debug)]
pub struct BoundingSphere {
    /// Centre of the scene's sphere, metres.
    pub centre: Vec3,
    /// Radius of the scene's sphere, metres.
    pub radius: f32,
}

/// The pipeline and the paths.
pub struct PhotonTrace {
    context: Arc<Context>,
    pipeline: Pipeline,
    paths: Buffer,
    chunks: Chunks,
    sphere: BoundingSphere,
}

impl PhotonTrace {
    /// Allocates the states of `capacity` paths.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        capacity: u32,
        sphere: BoundingSphere,
    ) -> Result<Self> {
        let constants =
            [("STEPS", STEPS), ("MAX_SURVIVAL", MAX_SURVIVAL.to_bits()), scene.textures.constant()];
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &constants)?,
            paths: Buffer::storage(
                context,
                "photon paths",
                u64::from(capacity) * size_of::<PhotonPath>() as u64,
            )?,
            chunks: Chunks::new(1 << 12, u32::MAX),
            sphere,
        })
    }

    /// Traces paths to their ends into the slots of a map, with random decisions by `seed`. Returns
    /// the number of used slots. `None` if there are too few slots. Adds the device time in
    /// milliseconds to `ms`.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn trace(
        &mut self,
        scene: LitScene<'_>,
        mut paths: Vec<PhotonPath>,
        seed: u32,
        map: &PhotonMap,
        ms: &mut f64,
    ) -> Result<Option<u32>> {
        let mut used = 0;
        while !paths.is_empty() {
            let count = paths.len() as u32;
            if count * STEPS > map.capacity() - used {
                return Ok(None);
            }
            self.paths.write(&paths)?;
            self.chunks.run(count, |first, chunk| {
                let push = PhotonTracePush {
                    scene_centre: self.sphere.centre,
                    scene_radius: self.sphere.radius,
                    first_path: first,
                    end_path: first + chunk,
                    first_slot: used,
                    seed,
                };
                let ((), timings) = self.context.run(|rec| {
                    rec.pass(STEM).dispatch(
                        &self.pipeline,
                        [chunk, 1, 1],
                        &push,
                        &scene.bindings_and([("PhotonPaths", &self.paths), ("Photons", &map.slots)]),
                    );
                })?;
                *ms += timings[0].ms;
                Ok(timings[0].ms)
            })?;
            used += count * STEPS;
            paths = self.paths.read_range(0, paths.len())?;
            loop_limit::refuse(paths.iter().any(|path| path.is_alive == LOOP_TRUNCATED), STEM, 0)?;
            paths.retain(|path| path.is_alive == 1);
        }
        Ok(Some(used))
    }
}

/// Distributes `count` rays over lights in proportion to their powers (W), by largest remainders; a
/// light with power gets at least one.
pub fn deal(powers: &[f64], count: u32) -> Vec<u32> {
    let total: f64 = powers.iter().sum();
    let fractions: Vec<f64> =
        powers.iter().map(|power| if total > 0.0 { power / total * f64::from(count) } else { 0.0 }).collect();
    let mut rays: Vec<u32> = fractions.iter().map(|fraction| *fraction as u32).collect();
    let mut order: Vec<usize> = (0..powers.len()).filter(|&light| powers[light] > 0.0).collect();
    order.sort_by(|&a, &b| fractions[b].fract().total_cmp(&fractions[a].fract()));
    let distributed: u32 = rays.iter().sum();
    for &light in order.iter().take(count.saturating_sub(distributed) as usize) {
        rays[light] += 1;
    }
    for light in order {
        rays[light] = rays[light].max(1);
    }
    rays
}

/// New paths: `rays[l]` of light l, whose sequence continues at `first_rays[l]`.
pub fn start(rays: &[u32], first_rays: &[u32]) -> Vec<PhotonPath> {
    let of_light = |(light, (&count, &first)): (usize, (&u32, &u32))| {
        (0..count).map(move |ray| PhotonPath {
            origin: Vec3::ZERO,
            light: light as u32,
            direction: Vec3::ZERO,
            ray: first.wrapping_add(ray),
            flux: Vec3::splat(1.0 / count as f32),
            depth: 0,
            is_alive: 1,
        })
    };
    rays.iter().zip(first_rays).enumerate().flat_map(of_light).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_are_dealt_in_proportion_to_power() {
        assert_eq!(deal(&[1.0, 3.0, 0.0], 8), [2, 6, 0]);
        assert_eq!(deal(&[1.0, 1.0, 1.0], 8).iter().sum::<u32>(), 8);
        assert_eq!(deal(&[1e-9, 1.0], 8), [1, 8]);
        assert_eq!(deal(&[0.0], 8), [0]);
        assert_eq!(deal(&[], 8), [0_u32; 0]);
    }

    #[test]
    fn fractions_of_a_light_sum_to_one() {
        let paths = start(&[4, 0, 2], &[10, 0, 7]);
        let of = |light| paths.iter().filter(move |path| path.light == light);
        assert_eq!(of(0).map(|path| path.ray).collect::<Vec<_>>(), [10, 11, 12, 13]);
        assert_eq!([of(0), of(2)].map(|paths| paths.map(|path| path.flux.x).sum::<f32>()), [1.0; 2]);
    }
}
