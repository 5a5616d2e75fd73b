//! Path tracing. In: camera, scene, lights. In and out: sums of radiance over samples (W/m²/sr), pixel by pixel.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use crate::types::View;
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// A sum and what rounding took from it.
    pub struct RadianceSum {
        /// The sum as f32 has it, W/m²/sr.
        pub high: Vec3,
        /// What is to be added to it.
        pub low: Vec3,
    }
}

gpu_struct! {
    /// What is known of the spread of a pixel's samples.
    pub struct SampleMoments {
        /// Sum over the samples of their squared distance from the mean of all.
        pub squares: Vec3,
        /// Camera, shadow and reflected rays so far.
        pub rays: u32,
    }
}

gpu_struct! {
    /// Push constants.
    pub struct PathTracePush {
        /// The camera.
        pub view: View,
        /// Lights.
        pub light_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
        /// Squares of pixels are numbered row by row.
        pub first_tile: u32,
        /// Squares in this dispatch.
        pub tile_count: u32,
        /// How many samples each pixel has had.
        pub first_sample: u32,
        /// How many it gets.
        pub sample_count: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[RadianceSum::LAYOUT, SampleMoments::LAYOUT, PathTracePush::LAYOUT];

/// Throughput below which Russian roulette may end a path.
pub const ROULETTE_THRESHOLD: f32 = 0.5;
/// A workgroup works on a square of so many pixels a side.
const TILE: u32 = 8;

impl RadianceSum {
    /// The sum in full, W/m²/sr.
    pub fn value(&self) -> glam::DVec3 {
        self.high.as_dvec3() + self.low.as_dvec3()
    }
}

/// The sums of one sequence of samples, a place a pixel.
pub struct Accumulators {
    /// `RadianceSum` of light that was reflected once.
    pub direct: Buffer,
    /// `RadianceSum` of all other light.
    pub indirect: Buffer,
    /// `SampleMoments`.
    pub moments: Buffer,
}

impl Accumulators {
    /// Sums of no sample yet.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32) -> Result<Self> {
        let storage = |name, element: usize| {
            let buffer = Buffer::storage(context, name, u64::from(pixel_count) * element as u64)?;
            context.run(|rec| rec.fill_zero(&buffer))?;
            Ok(buffer)
        };
        Ok(Self {
            direct: storage("direct sums", size_of::<RadianceSum>())?,
            indirect: storage("indirect sums", size_of::<RadianceSum>())?,
            moments: storage("sample moments", size_of::<SampleMoments>())?,
        })
    }
}

/// The pipeline.
pub struct PathTrace {
    pipeline: Pipeline,
}

impl PathTrace {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "path_trace";

    /// Makes the pipeline.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        let constants = [("ROULETTE_THRESHOLD", ROULETTE_THRESHOLD.to_bits())];
        Ok(Self { pipeline: Pipeline::new(context, Self::STEM, &constants)? })
    }

    /// Squares of pixels in an image.
    pub fn tiles(view: &View) -> u32 {
        view.width.div_ceil(TILE) * view.height.div_ceil(TILE)
    }

    /// Takes samples of some tiles; `samples` are numbered through a sequence that `seed` names.
    #[expect(clippy::too_many_arguments, reason = "one call, at one place")]
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        (lights, light_count): (&Buffer, u32),
        view: &View,
        seed: u32,
        tiles: Range<u32>,
        samples: Range<u32>,
        sums: &Accumulators,
    ) {
        let push = PathTracePush {
            view: *view,
            light_count,
            seed,
            first_tile: tiles.start,
            tile_count: tiles.len() as u32,
            first_sample: samples.start,
            sample_count: samples.len() as u32,
        };
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [push.tile_count * TILE * TILE, 1, 1],
            &push,
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Lights", lights),
                ("DirectSums", &sums.direct),
                ("IndirectSums", &sums.indirect),
                ("Moments", &sums.moments),
            ],
        );
    }
}
