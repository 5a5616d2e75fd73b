//! Path tracing. In: camera, scene, lights. In and out: sums of radiance over samples (W/m²/sr),
//! pixel by pixel.

use crate::error::Result;
use crate::gpu::barrier::TRANSFER_TO_COMPUTE;
use crate::gpu::{Buffer, Context, MAX_LOOP_ITERATIONS, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::{LitScene, SceneBuffers, loop_limit};
use crate::types::{LOOP_TRUNCATED, View};
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

gpu_struct! {
    /// A compensated sum.
    pub struct RadianceSum {
        /// The sum rounded to f32, W/m²/sr.
        pub high: Vec3,
        /// The rest, to be added to it.
        pub low: Vec3,
    }
}

gpu_struct! {
    /// Spread of a pixel's samples.
    pub struct SampleMoments {
        /// Sum over the samples of their squared distance from the mean of all.
        pub squares: Vec3,
        /// Camera, shadow and reflected rays so far.
        pub rays: u32,
    }
}

gpu_struct! {
    /// A path in progress.
    pub struct TracedPath {
        /// Origin of its next ray.
        pub origin: Vec3,
        /// Direction of its next ray.
        pub direction: Vec3,
        /// Product of brdf·cosθ/pdf so far, roulette included.
        pub throughput: Vec3,
        /// Radiance found so far, reflected once, W/m²/sr.
        pub direct: Vec3,
        /// Radiance reflected several times, W/m²/sr.
        pub indirect: Vec3,
        /// Vertices so far.
        pub depth: u32,
        /// Index of its random numbers: the number of finished samples.
        pub sample_index: u32,
    }
}

gpu_struct! {
    pub struct PathTracePush {
        pub view: View,
        pub light_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
        /// First tile of the dispatch; tiles are numbered row by row.
        pub first_tile: u32,
        /// Tiles in this dispatch.
        pub tile_count: u32,
        /// First sample; `RESUME`: paths continue from their state.
        pub first_sample: u32,
        /// One past the last sample.
        pub goal: u32,
        /// Maximum number of vertices of each pixel's paths in this dispatch.
        pub rounds: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] =
    &[RadianceSum::LAYOUT, SampleMoments::LAYOUT, TracedPath::LAYOUT, PathTracePush::LAYOUT];

/// Throughput below which Russian roulette may end a path.
pub const ROULETTE_THRESHOLD: f32 = 0.5;
/// Paths continue from their state.
const RESUME: u32 = u32::MAX;
/// Rays of a pixel in one dispatch. They bound its duration and its loops, of a thousand iterations
/// for each ray.
const RAYS_A_DISPATCH: u32 = 64;
const _: () = assert!(1000 * RAYS_A_DISPATCH < MAX_LOOP_ITERATIONS);
/// Maximum number of tiles of one dispatch: 2¹⁸ pixels fill the largest device, and their paths
/// take 17 MiB.
pub const TILE_LIMIT: u32 = 1 << 12;
/// Edge of a workgroup's tile in pixels.
const TILE: u32 = 8;

impl RadianceSum {
    /// The sum in full, W/m²/sr.
    pub fn value(&self) -> glam::DVec3 {
        self.high.as_dvec3() + self.low.as_dvec3()
    }
}

/// The sums of one sequence of samples, one element a pixel.
pub struct Accumulators {
    /// `RadianceSum` of light that was reflected once.
    pub direct: Buffer,
    /// `RadianceSum` of all other light.
    pub indirect: Buffer,
    /// The `SampleMoments` of each pixel.
    pub moments: Buffer,
}

impl Accumulators {
    /// Sums of no sample yet.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32) -> Result<Self> {
        let storage = |name, element: usize| {
            let buffer = Buffer::storage(
                context,
                GrowsWith::Pixels.named(name),
                u64::from(pixel_count) * element as u64,
            )?;
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

/// Result of [`PathTrace::run`].
#[derive(Clone, Copy, Debug)]
pub struct Ran {
    /// Device time of all dispatches, milliseconds.
    pub ms: f64,
    /// Device time of the longest dispatch, milliseconds.
    pub longest_ms: f64,
    /// False if the deadline passed before all samples were taken.
    pub is_complete: bool,
}

/// The pipeline and the paths in progress.
pub struct PathTrace {
    context: Arc<Context>,
    pipeline: Pipeline,
    paths: Buffer,
    unfinished: Buffer,
}

/// Inputs of [`PathTrace::run`].
#[derive(Clone, Copy)]
pub struct Job<'a> {
    /// The scene and its lights.
    pub scene: LitScene<'a>,
    /// Camera that the rays start from.
    pub view: &'a View,
    /// Seed of the samples.
    pub seed: u32,
    /// Sums of that sequence.
    pub sums: &'a Accumulators,
}

impl PathTrace {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "path_trace";

    /// Creates the pipeline, and allocates the paths of an image.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, scene: &SceneBuffers, view: &View) -> Result<Self> {
        let constants = [
            ("ROULETTE_THRESHOLD", ROULETTE_THRESHOLD.to_bits()),
            scene.textures.constant(),
            scene.emission.constant(),
        ];
        let lanes = u64::from(Self::tiles(view).min(TILE_LIMIT) * TILE * TILE);
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, Self::STEM, &constants)?,
            paths: Buffer::storage(context, "traced paths", lanes * size_of::<TracedPath>() as u64)?,
            unfinished: Buffer::storage(context, "unfinished", 4)?,
        })
    }

    /// Number of tiles in an image.
    pub fn tiles(view: &View) -> u32 {
        view.width.div_ceil(TILE) * view.height.div_ceil(TILE)
    }

    /// Takes some samples of a sequence in each pixel of at most [`TILE_LIMIT`] tiles. After the
    /// deadline it stops with the current dispatch.
    ///
    /// # Errors
    /// The device failed.
    pub fn run(
        &self,
        job: Job<'_>,
        tiles: Range<u32>,
        samples: Range<u32>,
        deadline: Option<Instant>,
    ) -> Result<Ran> {
        let mut first_sample = samples.start;
        let mut ran = Ran { ms: 0.0, longest_ms: 0.0, is_complete: true };
        while !samples.is_empty() {
            let push = PathTracePush {
                view: *job.view,
                light_count: job.scene.light_count,
                seed: job.seed,
                first_tile: tiles.start,
                tile_count: tiles.len() as u32,
                first_sample,
                goal: samples.end,
                rounds: (RAYS_A_DISPATCH / (1 + job.scene.light_count)).max(1),
            };
            let ((), timings) = self.context.run(|rec| self.record(rec, job, &push))?;
            ran.ms += timings[0].ms;
            ran.longest_ms = ran.longest_ms.max(timings[0].ms);
            let unfinished = self.unfinished.read::<u32>()?[0];
            loop_limit::refuse(unfinished & LOOP_TRUNCATED != 0, Self::STEM, push.light_count)?;
            if unfinished == 0 {
                break;
            }
            if deadline.is_some_and(|deadline| Instant::now() >= deadline) {
                ran.is_complete = false;
                break;
            }
            first_sample = RESUME;
        }
        Ok(ran)
    }

    /// Returns the state of the paths of these tiles, which must be those of the last run: each
    /// pixel and its path.
    ///
    /// # Errors
    /// The device failed.
    pub fn standing(&self, view: &View, tiles: Range<u32>) -> Result<Vec<(u32, TracedPath)>> {
        let paths: Vec<TracedPath> = self.paths.read_range(0, tiles.len() * (TILE * TILE) as usize)?;
        Ok(Self::pixels(view, tiles).zip(paths).filter_map(|(pixel, path)| Some((pixel?, path))).collect())
    }

    /// The pixels of some tiles. `None` for a position beyond the image.
    pub fn pixels(view: &View, tiles: Range<u32>) -> impl Iterator<Item = Option<u32>> + use<> {
        let (width, height) = (view.width, view.height);
        let across = width.div_ceil(TILE);
        tiles.flat_map(move |tile| (0..TILE * TILE).map(move |place| (tile, place))).map(
            move |(tile, place)| {
                let [x, y] = [tile % across * TILE + place % TILE, tile / across * TILE + place / TILE];
                (x < width && y < height).then_some(y * width + x)
            },
        )
    }

    fn record(&self, rec: &mut Recorder, job: Job<'_>, push: &PathTracePush) {
        rec.pass(Self::STEM).fill_zero(&self.unfinished).barrier(TRANSFER_TO_COMPUTE).dispatch(
            &self.pipeline,
            [push.tile_count * TILE * TILE, 1, 1],
            push,
            &job.scene.seen_bindings_and([
                ("DirectSums", &job.sums.direct),
                ("IndirectSums", &job.sums.indirect),
                ("Moments", &job.sums.moments),
                ("TracedPaths", &self.paths),
                ("Unfinished", &self.unfinished),
            ]),
        );
    }
}
