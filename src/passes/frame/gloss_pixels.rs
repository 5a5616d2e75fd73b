//! Glossy pixels: the light of broad lobes, from records; rays into sharp lobes, traced once a
//! view, and the light that returns along them. In: pixels and fragments, lobes at records,
//! clusters. Out: glossy radiance (W/m²/sr), besides the diffuse one.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::antialias::SeenFragments;
use crate::passes::frame::bin_reads::BinReads;
use crate::passes::frame::gloss::{Gloss, GlossLight, GlossSpan, VertexKernels};
use crate::passes::frame::gloss_records::{BroadLobes, RecordLobes};
use crate::passes::frame::gloss_samples::{GlossSamples, GlossSampling};
use crate::passes::frame::light_sum::LightSum;
use crate::passes::precompute::gather_rays::MIN_ENTRY_POINTS;
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::types::{Grid, View};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A ray into the lobe of a pixel, as the frame reads it under a still camera.
    pub struct GlossRay {
        /// `cluster | material << cluster_bits`; `NO_TARGET` where the ray left the scene.
        pub target: u32,
        /// Scale of highlights, (n+2)/(n+1)·cosθ.
        pub weight: f32,
        /// Unit direction back towards the pixel: octahedral, two 16-bit integers.
        pub direction: u32,
        /// Slot with the lobe's outgoing flux of the surface there; [`NO_GLOSS_BIN`]: the flux
        /// comes from its vertices.
        pub gloss_bin: u32,
    }
}

gpu_struct! {
    /// Glossy radiance of a pixel, W/m²/sr.
    pub struct PixelGloss {
        /// Direct light of the lights.
        pub direct: Vec3,
        /// Light from surfaces.
        pub indirect: Vec3,
    }
}

gpu_struct! {
    /// Push constants of `gloss_rays`.
    pub struct GlossRaysPush {
        pub grid: Grid,
        /// The camera, metres.
        pub eye: Vec3,
        /// Pixels of the image.
        pub pixel_count: u32,
        /// Samples of a pixel at most.
        pub max_samples: u32,
        /// Capacity of the list of samples.
        pub capacity: u32,
        pub stride: u32,
        /// Seed of all decisions.
        pub seed: u32,
        /// Width of the cluster field in `GlossRay::target`.
        pub cluster_bits: u32,
        /// Minimum sample count of a cluster.
        pub min_entry_points: f32,
        /// Exponents of broad lobes ([`BroadLobes::packed`]).
        pub broad_exponents: u32,
        /// Direction bins along an edge of the square map.
        pub side: u32,
        /// Exponent of the sharpest lobe that the bins resolve.
        pub max_exponent: f32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_hits`.
    pub struct GlossHitsPush {
        /// Vertices of this dispatch.
        pub span: GlossSpan,
        /// Pixels of the image.
        pub pixel_count: u32,
        /// Samples of a pixel at most.
        pub max_samples: u32,
        /// Capacity of the list of samples.
        pub capacity: u32,
        /// Width of the cluster field in `GlossRay::target`.
        pub cluster_bits: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_pixels`.
    pub struct GlossPixelsPush {
        /// Pixels of the image.
        pub pixel_count: u32,
        /// Samples of a pixel at most.
        pub max_samples: u32,
        /// Capacity of the list of samples.
        pub capacity: u32,
        /// Width of the cluster field in `GlossRay::target`.
        pub cluster_bits: u32,
        /// Exponents of broad lobes ([`BroadLobes::packed`]).
        pub broad_exponents: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    GlossRay::LAYOUT,
    PixelGloss::LAYOUT,
    GlossRaysPush::LAYOUT,
    GlossHitsPush::LAYOUT,
    GlossPixelsPush::LAYOUT,
];

/// A ray that reads no gloss bin.
pub const NO_GLOSS_BIN: u32 = u32::MAX;
/// Rays from each sample (`glsl/include/gloss_rays.glsl`).
pub const LOBE_RAYS: u32 = 4;
/// The capacity suffices for all samples if one pixel in `SHARE` is glossy. If more are, pixels
/// without rays get fewer samples first.
const SHARE: u64 = 8;
/// Minimum capacity, 5 MB.
const MIN_ROOM: u64 = 1 << 16;
/// The same if samples only place the points of highlights.
const MIN_HIGHLIGHTS: u64 = 1 << 14;
/// Invocations of the tracing kernel: enough to fill a device, few enough to be cheap if
/// little is glossy.
const STRIDE: u32 = 1 << 16;
/// Maximum number of samples of an invocation: bounds its loop iterations.
const SAMPLES_OF_INVOCATION: u32 = 8;

/// Number of samples that suffices if few pixels are glossy: `least`, or all in a small picture.
fn wanted_samples(pixel_count: u32, max_samples: u32, least: u64) -> u64 {
    let all = u64::from(pixel_count) * u64::from(max_samples);
    all.div_ceil(SHARE).max(all.min(least))
}

/// Inputs of glossy pixels besides their own samples.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// Geometry and materials.
    pub scene: &'a SceneBuffers,
    /// What the view shows.
    pub seen: SeenFragments<'a>,
    /// Irradiance of each cluster, W/m².
    pub irradiance: &'a Buffer,
    /// 1/area of each cluster, 1/m².
    pub inverse_areas: &'a Buffer,
    /// The glossy clusters.
    pub gloss: &'a Gloss,
    /// `Contribution`s in cluster order.
    pub contributions: &'a Buffer,
    /// Lobes at records. `None`: rays bring all light.
    pub lobes: Option<RecordLobes<'a>>,
}

/// The pipelines, the samples and rays of the view, and their light.
pub struct GlossPixels {
    trace: Pipeline,
    pub(super) highlight: Pipeline,
    sum: LightSum,
    meet: VertexKernels,
    gloss: Pipeline,
    pub(super) pixel_count: u32,
    pub(super) max_samples: u32,
    /// Capacity of the list of samples.
    pub capacity: u32,
    cluster_bits: u32,
    /// False without light paths: clusters then hold no light.
    has_paths: bool,
    /// The lobes that records bring; initially none.
    pub broad: BroadLobes,
    /// Directions of lobes start from samples: rays, or those to a sky. If not, samples only
    /// place the points of highlights.
    pub takes_samples: bool,
    /// The glossy pixels of the view, and their samples.
    pub samples: GlossSamples,
    /// `GlossRay`s, sample by sample.
    pub rays: Buffer,
    /// Packed colour of the image at each ray's hit; one unused word in scenes without images.
    pub colours: Buffer,
    /// Light of glossy surfaces on the rays of each sample, W/m²; three floats.
    hits: Buffer,
    /// Highlights of each sample per unit of specular albedo, W/m²/sr; three floats.
    highlights: Buffer,
    /// `PixelGloss` of each pixel.
    pub radiance: Buffer,
}

impl GlossPixels {
    /// Timing name of tracing the rays.
    pub const RAYS_STEM: &str = "gloss_rays";
    /// Timing name of the light.
    pub const STEM: &str = "gloss_pixels";

    /// Allocates buffers for an image of `pixel_count` pixels with `max_rays` for each glossy
    /// pixel, rounded up to a multiple of four. `cluster_bits` is the width of the cluster field in
    /// targets of rays. Without light paths (`has_paths`) the pixels show highlights only, and no
    /// ray is traced. `may_trace`: some lobe may take rays, now or after an edit.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        pixel_count: u32,
        max_rays: u32,
        cluster_bits: u32,
        [has_paths, may_trace]: [bool; 2],
    ) -> Result<Self> {
        let textures = &scene.textures;
        let max_samples = max_rays.div_ceil(LOBE_RAYS);
        let wanted = wanted_samples(pixel_count, max_samples, MIN_ROOM);
        let sample_bytes = u64::from(LOBE_RAYS) * size_of::<GlossRay>() as u64;
        let capacity = wanted.min(context.limits().storage_range_bytes / sample_bytes) as u32;
        let allocate = |name, bytes: u64| {
            Buffer::storage(context, GrowsWith::Pixels.named(name), u64::from(capacity.max(1)) * bytes)
        };
        let traces = ("TRACES", u32::from(has_paths && may_trace));
        Ok(Self {
            trace: Pipeline::new(context, Self::RAYS_STEM, &[textures.constant(), traces])?,
            highlight: Pipeline::new(context, Self::HIGHLIGHTS_STEM, &[scene.emission.constant()])?,
            sum: LightSum::new(context)?,
            meet: VertexKernels::new(context, "gloss_hits")?,
            gloss: Pipeline::new(context, Self::STEM, &[textures.constant()])?,
            pixel_count,
            max_samples,
            capacity,
            cluster_bits,
            has_paths,
            broad: BroadLobes::default(),
            takes_samples: true,
            samples: GlossSamples::new(context, pixel_count, capacity)?,
            rays: allocate("gloss rays", sample_bytes)?,
            colours: textures.colours(
                context,
                GrowsWith::Pixels.named("gloss colours"),
                u64::from(capacity * LOBE_RAYS),
            )?,
            hits: allocate("gloss hits", 12)?,
            highlights: allocate("highlights", 12)?,
            radiance: Buffer::storage(
                context,
                GrowsWith::Pixels.named("gloss radiance"),
                u64::from(pixel_count) * size_of::<PixelGloss>() as u64,
            )?,
        })
    }

    /// Capacity of the list of samples that frames use.
    pub(super) fn used_capacity(&self) -> u32 {
        let least = if self.takes_samples { MIN_ROOM } else { MIN_HIGHLIGHTS };
        u64::from(self.capacity).min(wanted_samples(self.pixel_count, self.max_samples, least)) as u32
    }

    /// Finds the glossy pixels, samples them, and traces their lobes.
    pub fn record_rays(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        (clusters, bins): (&ClusterBuffers, &BinReads),
        seen: SeenFragments<'_>,
        view: &View,
        seed: u32,
    ) {
        let pixel_count = self.pixel_count;
        let (max_samples, capacity) = (self.max_samples, self.used_capacity());
        let stride = STRIDE.max(capacity.div_ceil(SAMPLES_OF_INVOCATION)).min(capacity);
        let sampling = GlossSampling { max_samples, capacity, stride, seed };
        let mut pass = rec.pass(Self::RAYS_STEM);
        self.samples.record(&mut pass, scene, (seen, view), (sampling, self.broad), &self.radiance);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.trace,
            [stride, 1, 1],
            &GlossRaysPush {
                grid: *clusters.grid,
                eye: view.position,
                pixel_count,
                max_samples,
                capacity,
                stride,
                seed,
                cluster_bits: self.cluster_bits,
                min_entry_points: MIN_ENTRY_POINTS,
                broad_exponents: self.broad.packed(),
                side: bins.directions.side,
                max_exponent: bins.max_exponent,
            },
            &scene.textures.after([
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Octree", &clusters.octree),
                ("CellClusters", &clusters.cell_clusters),
                ("ClusterLinks", &clusters.links),
                ("UnweightedClusters", &clusters.unweighted),
                ("GlossOffsets", &self.samples.offsets),
                ("GlossPixels", &self.samples.pixels),
                ("GlossSamples", &self.samples.surfaces),
                ("GlossRays", &self.rays),
                ("GlossColours", &self.colours),
                ("TruncatedLoops", &scene.truncated_loops),
                ("ReadOffsets", &bins.first),
                ("BinReads", &bins.reads),
            ]),
        );
    }

    /// Computes the light that glossy pixels reflect: the light along the rays, the sums of the
    /// lights' hits and highlights, weighted by the emissions, and the light of broad lobes. `due`
    /// are the lights with stale hits.
    pub fn record(
        &self,
        rec: &mut Recorder,
        around: Surroundings<'_>,
        due: &[GlossLight<'_>],
        [hits, highlights]: [&[(Vec3, &Buffer)]; 2],
    ) {
        let Surroundings { scene, seen, irradiance, inverse_areas, gloss, contributions, lobes } = around;
        let (pixel_count, max_samples, capacity) = (self.pixel_count, self.max_samples, self.used_capacity());
        let cluster_bits = self.cluster_bits;
        let (due, hits) = if self.has_paths { (due, hits) } else { Default::default() };
        let mut pass = rec.pass(Self::STEM);
        self.sum.record(&mut pass, highlights, capacity, 1.0, &self.highlights);
        for light in due {
            gloss.record_lobes(&mut pass, &scene.materials, contributions, light);
            pass.barrier(COMPUTE_TO_COMPUTE);
            for span in gloss.spans(light) {
                let mut buffers = gloss.lobe_buffers(light).to_vec();
                buffers.extend([
                    ("Materials", &scene.materials),
                    ("GlossOffsets", &self.samples.offsets),
                    ("GlossRays", &self.rays),
                    ("InverseAreas", inverse_areas),
                    ("LightHits", light.hits),
                ]);
                pass.dispatch(
                    self.meet.of(light),
                    [capacity, 1, 1],
                    &GlossHitsPush { span, pixel_count, max_samples, capacity, cluster_bits },
                    &buffers,
                );
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
        }
        gloss.sum.record(&mut pass, hits, capacity, 1.0, &self.hits);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.gloss,
            [pixel_count, 1, 1],
            &GlossPixelsPush {
                pixel_count,
                max_samples,
                capacity,
                cluster_bits,
                broad_exponents: self.broad.packed(),
            },
            &[
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("GlossOffsets", &self.samples.offsets),
                ("GlossPixels", &self.samples.pixels),
                ("GlossSamples", &self.samples.surfaces),
                ("GlossRays", &self.rays),
                ("Irradiance", irradiance),
                ("GlossHits", &self.hits),
                ("Highlights", &self.highlights),
                ("GlossRadiance", &self.radiance),
                ("GlossColours", &self.colours),
                ("InverseAreas", inverse_areas),
                ("GlossBins", &gloss.bins),
                ("GlossFluxes", &gloss.fluxes),
                ("GlossParts", &self.samples.parts),
            ],
        );
        if let Some(lobes) = lobes.filter(RecordLobes::are_read) {
            pass.barrier(COMPUTE_TO_COMPUTE);
            lobes.record(
                &mut pass,
                scene,
                seen,
                [&self.samples.offsets, &self.samples.pixels, &self.radiance],
            );
        }
    }
}
