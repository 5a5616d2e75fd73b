//! Antialiasing: edge pixels are averaged over samples of their area. Samples at edges of geometry
//! or materials are traced once a camera. Samples that see one surface are a fragment, and every
//! light illuminates fragments as it does pixels. At a shadow edge only that light is averaged, in
//! its own irradiance buffer. In: pixels, scene, per-light irradiance buffers. Out: edge pixels,
//! their fragments, light.

use crate::error::Result;
use crate::gpu::barrier::{
    COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE,
};
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::passes::GrowsWith;
pub use crate::passes::frame::edges::{
    ALIKE, CONTRAST, COVERAGE, EDGE_WORDS, EdgeCapacity, EdgeLightPush, EdgeListPush, EdgeMarkPush,
    EdgeSamplesPush, Fragment, FragmentMarkPush, LAYOUTS, MASKED, MAX_FRAGMENTS, MAX_SAMPLES, SAMPLE_STEP,
    SHADING, SPREAD, ShadowMarkPush, TILE_WORDS, TileTrianglesPush,
};
use crate::passes::frame::edges::{EDGE_GROUPS, EdgeView, FRAGMENT_GROUPS, POINT_GROUPS, contrast, places};
use crate::passes::frame::{fragments::Fragments, light_sum::GROUP_VALUES, prefix_sum::PrefixSum};
use crate::passes::{LightKernel, OneLight, SceneBuffers};
use crate::types::{PixelSurface, View};
use std::sync::Arc;

/// Cosine below which the normals of neighbouring pixels make an edge: 25°, more than curved
/// models turn within a pixel.
pub const CREASE: f32 = 0.9;
/// Distance of a neighbour from the pixel's plane that makes an edge, in pixel widths.
pub const STEP: f32 = 2.0;
/// Width of a pixel, in the smallest cells of the scene, up to which neighbouring pixels have
/// similar indirect light. Records lie one to two cells apart.
pub const SMOOTH: f32 = 0.25;
/// Marks a pixel that is no edge pixel.
pub const NO_EDGE: u32 = u32::MAX;
/// Fraction of the pixels of a busy picture of [`BUSY_PIXELS`] that are edge pixels.
const SHARE: [u64; 2] = [2, 5];
const BUSY_PIXELS: u64 = 640 * 480;
/// Minimum capacity of samples and fragments, unless fewer suffice for all pixels: most pixels of a
/// small image are edge pixels.
const MIN_ROOM: u64 = 5 << 17;
/// The capacity for edge points suffices if one pixel in this many has one.
const PIXELS_PER_POINT: u64 = 4;
/// Minimum capacity for edge points, unless fewer fragments exist.
const MIN_POINTS: u64 = 1 << 14;

/// What a view shows: surfaces at the pixels, and the fragments of edge pixels.
#[derive(Clone, Copy)]
pub struct SeenFragments<'a> {
    /// A `PixelSurface` for each pixel.
    pub pixels: &'a Buffer,
    /// Samples and fragments of edge pixels.
    pub antialias: &'a Antialias,
}

impl SeenFragments<'_> {
    /// Width and height in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        self.antialias.size
    }
}

/// The pipelines and the samples.
pub struct Antialias {
    mark: Pipeline,
    list: Pipeline,
    tile_triangles: Pipeline,
    edge_triangles: Pipeline,
    samples: Pipeline,
    rays: Pipeline,
    groups: Pipeline,
    shadow_mark: Pipeline,
    shadow_edges: LightKernel,
    prefix_sum: PrefixSum,
    /// Index of each edge pixel, tile by tile of 8×8 pixels, in each along a Morton curve.
    pub edge_pixels: Buffer,
    /// Dispatch sizes over edge pixels, their samples and their fragments, and the numbers of edge
    /// pixels and of fragments.
    edge_groups: Buffer,
    /// Triangles that camera rays through a tile may meet, [`TILE_WORDS`] each.
    in_tiles: Buffer,
    /// The same for edge pixels, [`EDGE_WORDS`] each.
    in_edges: Buffer,
    /// Edge pixels with more triangles than that: size of a dispatch over their samples, their
    /// number, size of a dispatch over themselves; the pixels, in any order.
    dense_edges: Buffer,
    /// Pixels at which the most recent light is averaged, in any order: those at shadow edges.
    shadow_pixels: Buffer,
    size: [u32; 2],
    /// Width of a pixel up to which indirect light is smooth over it and its neighbours, metres.
    pub smooth_m: f32,
    /// Capacity of the lists of samples and fragments.
    pub capacity: EdgeCapacity,
    /// Index of each pixel in the list of edge pixels, or [`NO_EDGE`]; then the length
    /// of that list.
    pub numbers: Buffer,
    /// Sides that the samples see, edge pixel by edge pixel.
    pub edge_samples: Buffer,
    /// The fragments of edge pixels.
    pub fragments: Fragments,
}

impl Antialias {
    /// The name of the pass that finds edges and traces their samples.
    pub const STEM: &str = "edge_samples";
    /// The name of the pass that averages a light where its shadows end.
    pub const SHADOW_STEM: &str = "shadow_edges";

    /// Allocates buffers for an image of that size, with up to `light_samples` samples of a light
    /// in each fragment of an edge pixel.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, size: [u32; 2], light_samples: u32) -> Result<Self> {
        let pixel_count = size[0] * size[1];
        let capacity = Self::capacity(context, size, light_samples);
        let mut no_edges = vec![NO_EDGE; pixel_count as usize];
        no_edges.push(0);
        let alike = ("ALIKE", ALIKE.to_bits());
        let creases = [("CREASE", CREASE.to_bits()), ("STEP", STEP.to_bits())];
        let words = |name, count: u32| {
            Buffer::storage(context, GrowsWith::Pixels.named(name), 4 * u64::from(count.max(1)))
        };
        let edges = capacity.samples.checked_div(max_samples(light_samples)).unwrap_or(0);
        Ok(Self {
            mark: Pipeline::new(context, "edge_mark", &creases)?,
            list: Pipeline::new(context, "edge_list", &[("GROUP_POINTS", GROUP_VALUES)])?,
            tile_triangles: Pipeline::new(context, "tile_triangles", &[])?,
            edge_triangles: Pipeline::new(context, "edge_triangles", &[])?,
            samples: Pipeline::new(context, Self::STEM, &[alike])?,
            rays: Pipeline::new(context, "edge_rays", &[])?,
            groups: Pipeline::new(context, "edge_groups", &[alike])?,
            shadow_mark: Pipeline::new(context, "shadow_mark", &[])?,
            shadow_edges: LightKernel::new(context, Self::SHADOW_STEM, &[])?,
            prefix_sum: PrefixSum::new(context, places(size))?,
            edge_pixels: words("edge pixels", pixel_count)?,
            // Kernels write it only if antialiasing is on.
            edge_groups: Buffer::from_slice(
                context,
                GrowsWith::Pixels.named("edge groups"),
                &[0_u32; GROUP_WORDS as usize],
            )?,
            in_tiles: words("triangles in tiles", TILE_WORDS * capacity.tiles)?,
            in_edges: words("triangles in edge pixels", EDGE_WORDS * edges)?,
            dense_edges: words("dense edge pixels", DENSE_HEADER + pixel_count)?,
            shadow_pixels: words("shadow pixels", pixel_count)?,
            size,
            smooth_m: f32::INFINITY,
            capacity,
            numbers: Buffer::from_slice(context, GrowsWith::Pixels.named("edge numbers"), &no_edges)?,
            edge_samples: words("edge samples", capacity.samples)?,
            fragments: Fragments::new(context, places(size), capacity)?,
        })
    }

    /// Capacity for an image of that size: all samples for the edge pixels of a busy picture, whose
    /// number grows as the image's width, and two fragments for twice as many at least.
    fn capacity(context: &Context, size: [u32; 2], light_samples: u32) -> EdgeCapacity {
        let pixels = u64::from(size[0]) * u64::from(size[1]);
        let busy = pixels.min((pixels * BUSY_PIXELS).isqrt()) * SHARE[0] / SHARE[1];
        let bindable = context.limits().storage_range_bytes;
        // Most pixels of a small image are edge pixels.
        let within = |wanted: u64, all: u64, bytes: usize| {
            wanted.max(all.min(MIN_ROOM)).min(bindable / bytes as u64) as u32
        };
        let of_pixel = u64::from(max_samples(light_samples));
        let fragments = if light_samples == 0 { 0 } else { u64::from(MAX_FRAGMENTS) };
        let tiles = if light_samples == 0 { 0 } else { places(size) / 64 };
        // Each edge pixel has a list of triangles, too.
        let most = bindable / (4 * u64::from(EDGE_WORDS)) * of_pixel;
        let samples = within(busy * of_pixel, pixels * of_pixel, size_of::<u32>()).min(most as u32);
        let fragments =
            within(busy.max(pixels / 5) * fragments, pixels * fragments, size_of::<PixelSurface>());
        let points = (pixels / PIXELS_PER_POINT).max(MIN_POINTS).min(fragments.into()) as u32;
        let tiles = tiles.min((bindable / (4 * u64::from(TILE_WORDS))) as u32);
        EdgeCapacity { light_samples, samples, fragments, points, tiles }
    }

    fn edges<'a>(&'a self, scene: &'a SceneBuffers, view: &'a View, pixels: &'a Buffer) -> EdgeView<'a> {
        EdgeView {
            scene,
            view,
            pixels,
            numbers: &self.numbers,
            edge_pixels: &self.edge_pixels,
            samples: &self.edge_samples,
            groups: &self.edge_groups,
            capacity: self.capacity,
            smooth_m: self.smooth_m,
        }
    }

    /// Finds the edges in the view of a camera, traces their samples and groups them into
    /// fragments. Does nothing if antialiasing is off.
    pub fn record(&self, rec: &mut Recorder, scene: &SceneBuffers, view: &View, pixels: &Buffer) {
        if !self.is_on() {
            return;
        }
        let edges = self.edges(scene, view, pixels);
        let [width, height] = self.size;
        let marks = &self.fragments.firsts;
        let mut pass = rec.pass(Self::STEM);
        let bindings = [
            ("Nodes", &scene.nodes),
            ("Triangles", &scene.triangles),
            ("Surfaces", &scene.surfaces),
            ("MeshEdges", &scene.mesh_edges),
            ("Pixels", pixels),
            ("EdgeMarks", marks),
            ("TruncatedLoops", &scene.truncated_loops),
        ];
        for (count, edge_count) in [(places(self.size), 0), (scene.mesh_edge_count, scene.mesh_edge_count)] {
            if count > 0 {
                let push = EdgeMarkPush { view: *view, edge_count };
                pass.dispatch(&self.mark, [count, 1, 1], &push, &bindings);
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
        }
        self.prefix_sum.record(&mut pass, marks, places(self.size));
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.list,
            [places(self.size), 1, 1],
            &EdgeListPush { width, pixel_count: width * height, capacity: self.capacity },
            &[
                ("EdgeMarks", marks),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeNumbers", &self.numbers),
                ("EdgeGroups", &self.edge_groups),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch(
            &self.tile_triangles,
            [places(self.size) / 64, 1, 1],
            &TileTrianglesPush { view: *view, capacity: self.capacity },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("EdgeMarks", marks),
                ("TileTriangles", &self.in_tiles),
            ],
        );
        // The marks are read; the numbers of fragments take their place.
        pass.barrier(COMPUTE_TO_TRANSFER);
        pass.fill_zero(&self.dense_edges);
        self.fragments.clear(&mut pass);
        pass.barrier(TRANSFER_TO_COMPUTE);
        pass.dispatch_indirect(
            &self.edge_triangles,
            (&self.edge_groups, EDGE_GROUPS),
            &edges.samples_push(),
            &[
                ("Triangles", &scene.triangles),
                ("EdgeNumbers", &self.numbers),
                ("EdgePixels", &self.edge_pixels),
                ("TileTriangles", &self.in_tiles),
                ("EdgeTriangles", &self.in_edges),
                ("DenseEdges", &self.dense_edges),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        let (masks, firsts) = (&self.fragments.of_samples, &self.fragments.firsts);
        let of_scene =
            [("Nodes", &scene.nodes), ("Triangles", &scene.triangles), ("Surfaces", &scene.surfaces)];
        let of_edges = [("EdgeNumbers", &self.numbers), ("EdgePixels", &self.edge_pixels)];
        let found =
            [("SampleMasks", masks), ("FragmentFirsts", firsts), ("TruncatedLoops", &scene.truncated_loops)];
        pass.dispatch_indirect(
            &self.samples,
            (&self.edge_groups, EDGE_GROUPS),
            &edges.samples_push(),
            &[
                &of_scene[..],
                &of_edges,
                &[("EdgeTriangles", &self.in_edges), ("EdgeSamples", &self.edge_samples)],
                &found,
            ]
            .concat(),
        );
        // Both dispatches write samples, each of other pixels.
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch_indirect(
            &self.rays,
            (&self.dense_edges, 0),
            &edges.samples_push(),
            &[
                &of_scene[..],
                &of_edges,
                &[
                    ("DenseEdges", &self.dense_edges),
                    ("EdgeSamples", &self.edge_samples),
                    ("TruncatedLoops", &scene.truncated_loops),
                ],
            ]
            .concat(),
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch_indirect(
            &self.groups,
            (&self.dense_edges, DENSE_GROUPS),
            &edges.samples_push(),
            &[
                &of_scene[..],
                &of_edges,
                &[("DenseEdges", &self.dense_edges), ("EdgeSamples", &self.edge_samples)],
                &found,
            ]
            .concat(),
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.fragments.record(&mut pass, &edges);
    }

    /// Evaluates a light at the fragments, and averages it at shadow edges, in its irradiance
    /// buffer. `groups`, of [`Self::groups`], holds the numbers of averaged pixels and fragments.
    /// Records into an open pass with barriers between its own dispatches. The caller records a
    /// barrier to transfers and indirect dispatches before. Does nothing if antialiasing is off.
    pub fn record_light(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        view: &View,
        light: OneLight<'_>,
        pixels: &Buffer,
        light_buffers: (&Buffer, &Buffer),
    ) {
        if !self.is_on() {
            return;
        }
        let edges = self.edges(scene, view, pixels);
        let (irradiance, groups) = light_buffers;
        let [width, height] = self.size;
        pass.fill_zero(groups);
        pass.barrier(TRANSFER_TO_COMPUTE);
        self.fragments.record_light(pass, &edges, light, light_buffers);
        // Both lists are counted in one buffer.
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.shadow_mark,
            [(width * height).div_ceil(4), 1, 1],
            &ShadowMarkPush { width, height, contrast: contrast(light) },
            &[
                ("LightIrradiance", irradiance),
                ("EdgeNumbers", &self.numbers),
                ("ShadowPixels", &self.shadow_pixels),
                ("ShadowGroups", groups),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        self.fragments.record_mixed(pass, &edges, light, light_buffers);
        self.record_shadow_edges(pass, &edges, light, light_buffers);
    }

    /// Averages the light at shadow edges over samples of their pixels.
    fn record_shadow_edges(
        &self,
        pass: &mut PassScope<'_>,
        edges: &EdgeView<'_>,
        light: OneLight<'_>,
        (irradiance, groups): (&Buffer, &Buffer),
    ) {
        let scene = edges.scene;
        let bindings = edges.traced(
            light,
            &[
                ("EdgeNumbers", &self.numbers),
                ("Pixels", edges.pixels),
                ("ShadowGroups", groups),
                ("ShadowPixels", &self.shadow_pixels),
                ("LightIrradiance", irradiance),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
        for (part, span) in light.parts().flat_map(|part| part.point_spans().map(move |span| (part, span))) {
            pass.barrier(COMPUTE_TO_COMPUTE);
            let push = edges.light_push(part, span);
            pass.dispatch_indirect(self.shadow_edges.of(part), (groups, 0), &push, &bindings);
        }
    }

    /// Dispatch size for workgroups of 64 edge pixels each, with its offset.
    pub fn pixel_groups(&self) -> (&Buffer, u64) {
        (&self.edge_groups, EDGE_GROUPS)
    }

    /// Dispatch size for workgroups of 64 fragments each, with its offset.
    pub fn fragment_groups(&self) -> (&Buffer, u64) {
        (&self.edge_groups, FRAGMENT_GROUPS)
    }

    /// Dispatch size for sums of light over pixels and fragments, [`GROUP_VALUES`] values a
    /// workgroup. `None` if antialiasing is off.
    pub fn point_groups(&self) -> Option<(&Buffer, u64)> {
        self.is_on().then_some((&self.edge_groups, POINT_GROUPS))
    }

    /// Allocates the dispatch sizes and the counts of a light's shadow edges and mixed fragments.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn groups(context: &Arc<Context>) -> Result<Buffer> {
        Buffer::storage(context, GrowsWith::Pixels.named("shadow groups"), 4 * GROUP_WORDS)
    }

    /// Returns the number of pixels that is counted in `groups`.
    ///
    /// # Errors
    /// The device failed.
    pub fn counted(groups: &Buffer) -> Result<u32> {
        Ok(groups.read_range::<u32>(3, 1)?[0])
    }

    /// Whether pixels have more than one sample: if not, no pass counts shadow edges.
    pub fn is_on(&self) -> bool {
        self.capacity.light_samples > 0
    }

    /// Buffer and byte offset of the number of edge pixels of the view.
    pub fn edge_count_at(&self) -> (&Buffer, u64) {
        (&self.edge_groups, 12)
    }

    /// Buffer and byte offset of the number of fragments of the view.
    pub fn fragment_count_at(&self) -> (&Buffer, u64) {
        (&self.edge_groups, 76)
    }

    /// Returns the number of edge pixels of this camera.
    ///
    /// # Errors
    /// The device failed.
    pub fn edge_count(&self) -> Result<u32> {
        Self::counted(&self.edge_groups)
    }
}

/// Samples of an edge pixel if the capacity suffices.
fn max_samples(light_samples: u32) -> u32 {
    (COVERAGE * light_samples).next_multiple_of(SAMPLE_STEP).min(MAX_SAMPLES)
}

/// Words before the list of pixels with too many triangles; `glsl/include/antialias.glsl` has them.
const DENSE_HEADER: u32 = 8;
/// Byte offset there of the size of a dispatch over these pixels.
const DENSE_GROUPS: u64 = 16;
/// Words of a list's dispatch sizes and counts.
const GROUP_WORDS: u64 = 20;
