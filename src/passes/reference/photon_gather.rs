//! Final gathering at the pixels. [Jensen 1996] In: camera, lights, irradiance points. In and out:
//! sums over samples, W/m²/sr.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::precompute::Chunks;
use crate::passes::reference::photon_map::PhotonGrid;
use crate::passes::{LitScene, SceneBuffers};
use crate::types::View;
use glam::{DVec3, Vec3};
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// Compensated sums over the samples of a pixel.
    pub struct GatherSums {
        /// Light reflected once, W/m²/sr.
        pub direct: Vec3,
        /// Rounding error, to be subtracted from it.
        pub direct_lost: Vec3,
        /// All other light, W/m²/sr.
        pub indirect: Vec3,
        /// Rounding error, to be subtracted from it.
        pub indirect_lost: Vec3,
    }
}

gpu_struct! {
    pub struct PhotonGatherPush {
        pub view: View,
        /// The cells of the irradiance points.
        pub grid: PhotonGrid,
        pub light_count: u32,
        /// First pixel of this dispatch.
        pub first_pixel: u32,
        /// One past the last.
        pub end_pixel: u32,
        /// Number of earlier samples of each pixel.
        pub first_sample: u32,
        /// Number of samples that each pixel gets.
        pub sample_count: u32,
        /// Radius of the density estimate, metres.
        pub radius: f32,
        /// Seed of all decisions.
        pub seed: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[GatherSums::LAYOUT, PhotonGatherPush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "photon_gather";

impl GatherSums {
    /// Both sums in full: direct and indirect.
    pub fn values(&self) -> [DVec3; 2] {
        [
            self.direct.as_dvec3() - self.direct_lost.as_dvec3(),
            self.indirect.as_dvec3() - self.indirect_lost.as_dvec3(),
        ]
    }
}

/// Irradiance points of a photon map, which gather rays read.
#[derive(Clone, Copy)]
pub struct Irradiance<'a> {
    /// A `MapEntry` for each irradiance point.
    pub points: &'a Buffer,
    /// First point of each bucket.
    pub entry_offsets: &'a Buffer,
    /// Sixteen bytes a point.
    pub reaches: &'a Buffer,
    /// Irradiance at each point, W/m².
    pub irradiances: &'a Buffer,
    /// The cells of the points.
    pub grid: PhotonGrid,
    /// Radius of the density estimate, metres.
    pub radius: f32,
}

/// One sequence of samples.
pub struct Sequence {
    /// `GatherSums`, a pixel each.
    pub sums: Buffer,
    /// Seed of its random numbers.
    pub seed: u32,
}

impl Sequence {
    /// Sums of no sample yet.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32, seed: u32) -> Result<Self> {
        let bytes = u64::from(pixel_count) * size_of::<GatherSums>() as u64;
        let sums = Buffer::storage(context, GrowsWith::Pixels.named("gather sums"), bytes)?;
        context.run(|rec| rec.fill_zero(&sums))?;
        Ok(Self { sums, seed })
    }
}

/// The pipeline of the final gather.
pub struct PhotonGather {
    context: Arc<Context>,
    pipeline: Pipeline,
    chunks: Chunks,
}

impl PhotonGather {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>, scene: &SceneBuffers) -> Result<Self> {
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &[scene.textures.constant(), scene.emission.constant()])?,
            chunks: Chunks::new(1 << 10, u32::MAX),
        })
    }

    /// Adds samples of a sequence to every pixel, and the device time in milliseconds to `ms`.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn gather(
        &mut self,
        scene: LitScene<'_>,
        view: &View,
        irradiance: Irradiance<'_>,
        sequence: &Sequence,
        samples: Range<u32>,
        ms: &mut f64,
    ) -> Result<()> {
        self.chunks.run(view.width * view.height, |first, chunk| {
            let push = PhotonGatherPush {
                view: *view,
                grid: irradiance.grid,
                light_count: scene.light_count,
                first_pixel: first,
                end_pixel: first + chunk,
                first_sample: samples.start,
                sample_count: samples.len() as u32,
                radius: irradiance.radius,
                seed: sequence.seed,
            };
            let ((), timings) = self.context.run(|rec| {
                rec.pass(STEM).dispatch(
                    &self.pipeline,
                    [chunk, 1, 1],
                    &push,
                    &scene.seen_bindings_and([
                        ("Points", irradiance.points),
                        ("EntryOffsets", irradiance.entry_offsets),
                        ("Reaches", irradiance.reaches),
                        ("Irradiances", irradiance.irradiances),
                        ("PixelSums", &sequence.sums),
                        ("TruncatedLoops", &scene.buffers.truncated_loops),
                    ]),
                );
            })?;
            *ms += timings[0].ms;
            Ok(timings[0].ms)
        })?;
        scene.buffers.refuse_truncated_loops(STEM, scene.light_count)
    }
}
