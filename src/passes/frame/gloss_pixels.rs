//! Pixels whose surface shines: rays into their Phong lobes, traced once a view, and the light that comes back along them.
//! In: pixels, clusters. Out: radiance (W/m²/sr) beside what the albedo reflects.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::antialias::EdgeListPush;
use crate::passes::frame::gather::GatherSources;
use crate::passes::frame::gloss::Gloss;
use crate::passes::frame::prefix_sum::PrefixSum;
use crate::passes::precompute::gather_rays::LEAST_ENTRY_POINTS;
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::types::Grid;
use glam::{UVec2, Vec3};
use std::sync::Arc;

gpu_struct! {
    /// A ray into the lobe of a pixel: all that a frame under a still camera needs of it.
    pub struct GlossRay {
        /// `cluster | material << cluster_bits`; `NO_TARGET` where the ray left the scene.
        pub target: u32,
        /// (n+2)/(n+1)·cosθ.
        pub weight: f32,
        /// Unit direction back towards the pixel: octahedral, two 16-bit integers.
        pub direction: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_mark`.
    pub struct GlossMarkPush {
        /// Of the image.
        pub pixel_count: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_rays`.
    pub struct GlossRaysPush {
        /// Base grid.
        pub grid: Grid,
        /// The camera, metres.
        pub eye: Vec3,
        /// Of the image.
        pub pixel_count: u32,
        /// Rays of a pixel.
        pub most_rays: u32,
        /// Rays that there is room for.
        pub capacity: u32,
        /// Invocations.
        pub stride: u32,
        /// Seed of all decisions.
        pub seed: u32,
        /// Width of the cluster field in `GlossRay::target`.
        pub cluster_bits: u32,
        /// Clusters with fewer of them are not trusted.
        pub least_entry_points: f32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_hits`.
    pub struct GlossHitsPush {
        /// Of the image.
        pub pixel_count: u32,
        /// Rays of a pixel.
        pub most_rays: u32,
        /// Rays that there is room for.
        pub capacity: u32,
        /// Width of the cluster field in `GlossRay::target`.
        pub cluster_bits: u32,
        /// Beams of an entry point.
        pub beam_count: u32,
        /// Vertices of this dispatch, of each base cluster: first, and how many.
        pub window: UVec2,
    }
}

gpu_struct! {
    /// Push constants of `gloss_pixels`.
    pub struct GlossPixelsPush {
        /// Of the image.
        pub pixel_count: u32,
        /// Rays of a pixel.
        pub most_rays: u32,
        /// Rays that there is room for.
        pub capacity: u32,
        /// Width of the cluster field in `GlossRay::target`.
        pub cluster_bits: u32,
    }
}

/// What these passes share with their shaders.
pub const LAYOUTS: &[Layout] = &[
    GlossRay::LAYOUT,
    GlossMarkPush::LAYOUT,
    GlossRaysPush::LAYOUT,
    GlossHitsPush::LAYOUT,
    GlossPixelsPush::LAYOUT,
];

/// There is room for all the rays of so large a share of the pixels: where more shine, each gets fewer.
const SHARE: u64 = 8;
/// But there is room for so many at the least, 3 MB.
const LEAST_ROOM: u64 = 1 << 18;
/// Invocations that trace: enough to fill a device, few enough not to be idle in number where little shines.
const STRIDE: u32 = 1 << 16;

/// The pipelines, the rays of the view, and what they see.
pub struct GlossPixels {
    mark: Pipeline,
    list: Pipeline,
    trace: Pipeline,
    meet: Pipeline,
    shine: Pipeline,
    prefix_sum: PrefixSum,
    pixel_count: u32,
    most_rays: u32,
    capacity: u32,
    offsets: Buffer,
    pixels: Buffer,
    /// `GlossRay`s, pixel by pixel.
    pub rays: Buffer,
    /// What each ray that meets what shines finds there, W/m²; three floats.
    hits: Buffer,
    /// What each pixel shines, W/m²/sr; three floats.
    pub radiance: Buffer,
}

impl GlossPixels {
    /// The name of the first pass in timings: the rays.
    pub const RAYS_STEM: &str = "gloss_rays";
    /// The name of the second pass in timings: the light.
    pub const STEM: &str = "gloss_pixels";

    /// Makes room for an image of that size, with `most_rays` for each shining pixel.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32, most_rays: u32) -> Result<Self> {
        let all = u64::from(pixel_count) * u64::from(most_rays);
        let wanted = all.div_ceil(SHARE).max(all.min(LEAST_ROOM));
        let bindable = context.limits().storage_range_bytes / size_of::<GlossRay>() as u64;
        let capacity = wanted.min(bindable) as u32;
        let ray_bytes = u64::from(capacity.max(1)) * size_of::<GlossRay>() as u64;
        Ok(Self {
            mark: Pipeline::new(context, "gloss_mark", &[])?,
            list: Pipeline::new(context, "edge_list", &[])?,
            trace: Pipeline::new(context, Self::RAYS_STEM, &[])?,
            meet: Pipeline::new(context, "gloss_hits", &[])?,
            shine: Pipeline::new(context, Self::STEM, &[])?,
            prefix_sum: PrefixSum::new(context, pixel_count)?,
            pixel_count,
            most_rays,
            capacity,
            offsets: Buffer::storage(context, "gloss offsets", 4 * (u64::from(pixel_count) + 1))?,
            pixels: Buffer::storage(context, "gloss pixels", 4 * u64::from(pixel_count))?,
            rays: Buffer::storage(context, "gloss rays", ray_bytes)?,
            hits: Buffer::storage(context, "gloss hits", 12 * u64::from(capacity.max(1)))?,
            radiance: Buffer::storage(context, "gloss radiance", 12 * u64::from(pixel_count))?,
        })
    }

    /// Finds the pixels that shine, and traces their lobes.
    #[expect(clippy::too_many_arguments, reason = "one call, at one place")]
    pub fn record_rays(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        clusters: &ClusterBuffers,
        pixels: &Buffer,
        eye: Vec3,
        cluster_bits: u32,
        seed: u32,
    ) {
        let pixel_count = self.pixel_count;
        let mut pass = rec.pass(Self::RAYS_STEM);
        pass.dispatch(
            &self.mark,
            [pixel_count, 1, 1],
            &GlossMarkPush { pixel_count },
            &[
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Pixels", pixels),
                ("GlossOffsets", &self.offsets),
                ("GlossRadiance", &self.radiance),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record(&mut pass, &self.offsets, pixel_count);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.list,
            [pixel_count, 1, 1],
            &EdgeListPush { pixel_count },
            &[("EdgeOffsets", &self.offsets), ("EdgePixels", &self.pixels)],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        let stride = STRIDE.min(self.capacity);
        pass.dispatch(
            &self.trace,
            [stride, 1, 1],
            &GlossRaysPush {
                grid: clusters.grid,
                eye,
                pixel_count,
                most_rays: self.most_rays,
                capacity: self.capacity,
                stride,
                seed,
                cluster_bits,
                least_entry_points: LEAST_ENTRY_POINTS,
            },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("CellFirst", &clusters.cell_first),
                ("CellClusters", &clusters.cell_clusters),
                ("ClusterLinks", &clusters.links),
                ("Pixels", pixels),
                ("GlossOffsets", &self.offsets),
                ("GlossPixels", &self.pixels),
                ("GlossRays", &self.rays),
            ],
        );
    }

    /// The light that comes back along the rays. `first_deposits` and `deposits` of the base clusters.
    #[expect(clippy::too_many_arguments, reason = "one call, at one place")]
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        sources: GatherSources<'_>,
        gloss: &Gloss,
        first_deposits: &Buffer,
        deposits: &Buffer,
        pixels: &Buffer,
        cluster_bits: u32,
    ) {
        let mut pass = rec.pass(Self::STEM);
        for window in gloss.windows() {
            pass.dispatch(
                &self.meet,
                [self.capacity, 1, 1],
                &GlossHitsPush {
                    pixel_count: self.pixel_count,
                    most_rays: self.most_rays,
                    capacity: self.capacity,
                    cluster_bits,
                    beam_count: gloss.beam_count,
                    window,
                },
                &[
                    ("Materials", &scene.materials),
                    ("GlossOffsets", &self.offsets),
                    ("GlossRays", &self.rays),
                    ("InverseAreas", sources.inverse_areas),
                    ("BaseRanges", &gloss.base_ranges),
                    ("GlossShifts", &gloss.shifts),
                    ("ReflectedFlux", &gloss.reflected_flux),
                    ("FirstDeposits", first_deposits),
                    ("Deposits", deposits),
                    ("GlossVertices", &gloss.vertices),
                    ("GlossBeams", &gloss.beams),
                    ("GlossHits", &self.hits),
                ],
            );
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
        pass.dispatch(
            &self.shine,
            [self.pixel_count, 1, 1],
            &GlossPixelsPush {
                pixel_count: self.pixel_count,
                most_rays: self.most_rays,
                capacity: self.capacity,
                cluster_bits,
            },
            &[
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Pixels", pixels),
                ("GlossOffsets", &self.offsets),
                ("GlossPixels", &self.pixels),
                ("GlossRays", &self.rays),
                ("Irradiance", sources.irradiance),
                ("GlossHits", &self.hits),
                ("GlossRadiance", &self.radiance),
            ],
        );
    }

    /// Shining pixels of the last view.
    ///
    /// # Errors
    /// The device failed.
    pub fn count(&self) -> Result<u32> {
        Ok(self.offsets.read_range::<u32>(self.pixel_count as usize, 1)?[0])
    }
}
