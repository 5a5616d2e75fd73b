//! Antialiasing: edge pixels are averaged over samples of their area. Samples at edges of geometry
//! or materials are traced once a camera and kept. Every light illuminates them as it does pixels.
//! A slot sums the samples that take their indirect light from the same pixel and show the same
//! material. A pixel gets more samples of a light that varies much among them. At a shadow edge
//! only that light is averaged, in its own irradiance buffer. Camera rays of these samples start
//! from the roots of their pixel's frustum. In: pixels, scene, per-light irradiance buffers. Out:
//! edge pixels, their slots, light.

use crate::error::Result;
use crate::gpu::barrier::{
    COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE,
};
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::passes::GrowsWith;
pub use crate::passes::frame::edges::{
    EdgeCapacity, EdgeLightPush, EdgeListPush, EdgeMarkPush, EdgeSample, EdgeSamplesPush, EdgeSlot, LAYOUTS,
};
use crate::passes::frame::{
    light_sum::GROUP_VALUES,
    prefix_sum::PrefixSum,
    shafts::{BATCH, ShaftKernel, Shafts},
};
use crate::passes::{LightKernel, OneLight, SceneBuffers};
use crate::types::{PixelSurface, View};
use std::sync::Arc;

/// Cosine below which the normals of neighbouring pixels make an edge: 25°, more than curved
/// models turn within a pixel.
pub const CREASE: f32 = 0.9;
/// Distance of a neighbour from the pixel's plane that makes an edge, in pixel widths.
pub const STEP: f32 = 2.0;
/// Relative difference of one light between neighbours that makes an edge.
pub const CONTRAST: f32 = 0.1;
/// Image points of a sample at the scene's outline. The background is black, so only the covered
/// fraction of the pixel matters there. The sample counts it in eighths.
pub const OUTLINE_POINTS: u32 = 8;
/// Dissimilarity up to which a pixel serves a sample, or samples share a slot; it is above this for
/// another facet, and for a plane as far from the sample as a pixel is wide.
pub const ALIKE: f32 = 1.0;
/// Width of a pixel, in the smallest cells of the scene, up to which neighbouring pixels have
/// similar indirect light. Records lie one to two cells apart.
pub const SMOOTH: f32 = 0.25;
/// Variance of a light among samples over their squared mean from which a pixel takes more samples.
pub const SPREAD: f32 = 3.0;
/// Samples of such a pixel over that ratio: the variance of their mean is 1/`DENSITY`
/// of its square.
pub const DENSITY: u32 = 32;
/// Upper bound of these samples, over the samples that every edge pixel has.
pub const MAX_SAMPLE_FACTOR: u32 = 16;
/// Marks a pixel that is no edge pixel.
pub const NO_EDGE: u32 = u32::MAX;
/// Maximum number of slots of an edge pixel.
pub const MAX_SLOTS: u32 = 4;
/// The capacity suffices if one pixel in `SHARE` is an edge pixel.
const SHARE: u64 = 3;
/// Minimum number of samples of an edge pixel; no pixel has samples if the capacity allows fewer.
pub const MIN_SAMPLES: u32 = 4;
/// Minimum capacity of samples and slots, unless fewer suffice for all pixels: most pixels of a
/// small image are edge pixels.
const MIN_ROOM: u64 = 5 << 17;
/// The capacity for edge points suffices if one pixel in this many has one.
const PIXELS_PER_POINT: u64 = 4;
/// Minimum capacity for edge points, unless fewer slots exist.
const MIN_POINTS: u64 = 1 << 14;
/// Byte offsets of the dispatch sizes for workgroups of 64 samples, of 64 edge pixels, of values of
/// light (pixels, then slots), and of 64 batches of samples. In the list of a light, offset 0 is
/// the size for workgroups of four averaged pixels.
const SAMPLE_GROUPS: u64 = 16;
const PIXEL_GROUPS: u64 = 32;
const POINT_GROUPS: u64 = 48;
const BATCH_GROUPS: u64 = 64;

/// The pipelines and the samples.
pub struct Antialias {
    mark: Pipeline,
    shadow_mark: Pipeline,
    list: Pipeline,
    samples: Pipeline,
    slots: Pipeline,
    points: Pipeline,
    batches: Pipeline,
    shafts: Shafts,
    direct: ShaftKernel,
    sums: Pipeline,
    frusta: Pipeline,
    shadow_edges: LightKernel,
    prefix_sum: PrefixSum,
    /// Index of each edge pixel, tile by tile of 8×8 pixels, in each along a Morton curve.
    pub edge_pixels: Buffer,
    /// Workgroups along each axis that take edge pixels or samples; the number of edge pixels.
    edge_groups: Buffer,
    /// Irradiance of each sample by the most recent light.
    edge_light: Buffer,
    /// Number of samples that each edge pixel needs for the most recent light; 0 if it has enough.
    pub edge_needs: Buffer,
    /// Pixels at which the most recent light is averaged, in any order: shadow edges, and edge
    /// pixels that need more samples. While edges are found, the buffer holds the prefix sum of the
    /// edge marks in tile order.
    shadow_pixels: Buffer,
    size: [u32; 2],
    /// Width of a pixel up to which indirect light is smooth over it and its neighbours, metres.
    pub smooth_m: f32,
    /// Capacity of the lists of samples and slots.
    pub capacity: EdgeCapacity,
    /// Index of each pixel in the list of edge pixels, or [`NO_EDGE`]; then the length
    /// of that list.
    pub numbers: Buffer,
    /// `EdgeSample`s, edge pixel by edge pixel.
    pub edge_samples: Buffer,
    /// Their `EdgeSlot`s, edge pixel by edge pixel.
    pub edge_slots: Buffer,
    /// `PixelSurface`s of edge pixels that no pixel's centre around shows.
    pub edge_points: Buffer,
    /// Dispatch size for workgroups of 64 edge points; their number.
    pub point_groups: Buffer,
}

impl Antialias {
    /// The name of the pass that finds edges and traces their samples.
    pub const STEM: &str = "edge_samples";
    /// The name of the pass that averages a light where its shadows end.
    pub const SHADOW_STEM: &str = "shadow_edges";

    /// Allocates buffers for an image of that size, with `max_samples` for each edge pixel.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, size: [u32; 2], max_samples: u32) -> Result<Self> {
        let pixel_count = size[0] * size[1];
        let capacity = Self::capacity(context, pixel_count, max_samples);
        let mut no_edges = vec![NO_EDGE; pixel_count as usize];
        no_edges.push(0);
        let creases = [("CREASE", CREASE.to_bits()), ("STEP", STEP.to_bits())];
        let more =
            [("SPREAD", SPREAD.to_bits()), ("DENSITY", DENSITY), ("MAX_SAMPLE_FACTOR", MAX_SAMPLE_FACTOR)];
        let stored = |name, count: u32, bytes: usize| {
            Buffer::storage(context, GrowsWith::Pixels.named(name), u64::from(count) * bytes as u64)
        };
        let pixels = |name| stored(name, pixel_count, size_of::<u32>());
        Ok(Self {
            mark: Pipeline::new(context, "edge_mark", &creases)?,
            shadow_mark: Pipeline::new(context, "shadow_mark", &[("CONTRAST", CONTRAST.to_bits())])?,
            list: Pipeline::new(context, "edge_list", &[("GROUP_POINTS", GROUP_VALUES), ("BATCH", BATCH)])?,
            samples: Pipeline::new(
                context,
                Self::STEM,
                &[("OUTLINE_POINTS", OUTLINE_POINTS), ("ALIKE", ALIKE.to_bits())],
            )?,
            slots: Pipeline::new(context, "edge_slots", &[("ALIKE", ALIKE.to_bits())])?,
            points: Pipeline::new(context, "edge_points", &[])?,
            batches: Pipeline::new(context, "edge_batches", &[])?,
            shafts: Shafts::new(context, capacity.samples.div_ceil(BATCH))?,
            direct: ShaftKernel::new(context, "edge_direct")?,
            sums: Pipeline::new(context, "edge_sums", &more)?,
            frusta: Pipeline::new(context, "pixel_frusta", &[])?,
            shadow_edges: LightKernel::new(context, Self::SHADOW_STEM, &[])?,
            prefix_sum: PrefixSum::new(context, places(size))?,
            edge_pixels: pixels("edge pixels")?,
            // Kernels write it only if antialiasing is on.
            edge_groups: Buffer::from_slice(
                context,
                GrowsWith::Pixels.named("edge groups"),
                &[0_u32; GROUP_WORDS as usize],
            )?,
            edge_light: stored("edge light", capacity.samples, size_of::<f32>())?,
            edge_needs: pixels("edge needs")?,
            shadow_pixels: stored("shadow pixels", places(size) + 1, size_of::<u32>())?,
            size,
            smooth_m: f32::INFINITY,
            capacity,
            numbers: Buffer::from_slice(context, GrowsWith::Pixels.named("edge numbers"), &no_edges)?,
            edge_samples: stored("edge samples", capacity.samples, size_of::<EdgeSample>())?,
            edge_slots: stored("edge slots", capacity.slots, size_of::<EdgeSlot>())?,
            edge_points: stored("edge points", capacity.points.max(1), size_of::<PixelSurface>())?,
            point_groups: Buffer::from_slice(
                context,
                GrowsWith::Pixels.named("edge point groups"),
                &[0_u32; 4],
            )?,
        })
    }

    /// Capacity for an image of `pixel_count` pixels: samples for a fraction of them, and the slots
    /// of as many edge pixels.
    fn capacity(context: &Context, pixel_count: u32, max_samples: u32) -> EdgeCapacity {
        let all = u64::from(pixel_count) * u64::from(max_samples);
        let wanted = all.div_ceil(SHARE).max(all.min(MIN_ROOM));
        let bindable = context.limits().storage_range_bytes / size_of::<EdgeSample>() as u64;
        let all_slots = u64::from(pixel_count) * u64::from(MAX_SLOTS);
        let slots = (u64::from(pixel_count) * 3 / 2).max(all_slots.min(MIN_ROOM));
        let slots = if max_samples == 0 { 0 } else { slots.min(bindable) };
        let points = (u64::from(pixel_count) / PIXELS_PER_POINT).max(all_slots.min(MIN_POINTS)).min(slots);
        EdgeCapacity {
            max_samples,
            samples: wanted.min(bindable) as u32,
            slots: slots as u32,
            points: points as u32,
        }
    }

    /// Finds the edges in the view of a camera and traces their samples. Does nothing if
    /// antialiasing is off.
    pub fn record(&self, rec: &mut Recorder, scene: &SceneBuffers, view: &View, pixels: &Buffer) {
        if self.capacity.max_samples == 0 {
            return;
        }
        let [width, height] = self.size;
        let marks = &self.shadow_pixels;
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(
            &self.mark,
            [width, height, 1],
            &EdgeMarkPush { width, height },
            &[("Surfaces", &scene.surfaces), ("Pixels", pixels), ("EdgeMarks", marks)],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record(&mut pass, marks, places(self.size));
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.list,
            [places(self.size), 1, 1],
            &self.list_push(),
            &[
                ("EdgeMarks", marks),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeNumbers", &self.numbers),
                ("EdgeGroups", &self.edge_groups),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch_indirect(
            &self.samples,
            (&self.edge_groups, SAMPLE_GROUPS),
            &self.samples_push(view),
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Pixels", pixels),
                ("EdgeNumbers", &self.numbers),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeSamples", &self.edge_samples),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch_indirect(
            &self.batches,
            (&self.edge_groups, BATCH_GROUPS),
            &self.samples_push(view),
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("EdgeNumbers", &self.numbers),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeSamples", &self.edge_samples),
                ("PointBatches", &self.shafts.batches),
            ],
        );
        pass.barrier(COMPUTE_TO_TRANSFER);
        pass.fill_zero(marks);
        // A view without edges has no workgroup that counts them.
        pass.fill_zero(&self.point_groups);
        pass.barrier(TRANSFER_TO_COMPUTE);
        pass.dispatch_indirect(
            &self.slots,
            self.pixel_groups(),
            &self.samples_push(view),
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("EdgeNumbers", &self.numbers),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeSamples", &self.edge_samples),
                ("EdgeSlots", &self.edge_slots),
                ("PointNumbers", marks),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record(&mut pass, marks, places(self.size));
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch_indirect(
            &self.points,
            self.pixel_groups(),
            &self.samples_push(view),
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("EdgeNumbers", &self.numbers),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeSamples", &self.edge_samples),
                ("PointNumbers", marks),
                ("EdgeSlots", &self.edge_slots),
                ("EdgePoints", &self.edge_points),
                ("PointGroups", &self.point_groups),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
    }

    /// Evaluates a light at the edge pixels, and averages it at shadow edges, in its irradiance
    /// buffer. `groups`, of [`Self::groups`], holds the number of averaged pixels. Records into an
    /// open pass with barriers between its own dispatches. The caller records a barrier to
    /// transfers and indirect dispatches before. Does nothing if antialiasing is off.
    pub fn record_light(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        view: &View,
        light: OneLight<'_>,
        pixels: &Buffer,
        (irradiance, groups): (&Buffer, &Buffer),
    ) {
        if !self.is_on() {
            return;
        }
        // Before the barrier of the shafts' list, which serves both.
        pass.fill_zero(groups);
        for part in light.parts() {
            if part.adds {
                pass.barrier(COMPUTE_TO_TRANSFER);
            }
            self.record_samples(pass, scene, view, part);
        }
        self.record_sums(pass, irradiance, groups);
        self.record_shadow_edges(pass, scene, view, light, pixels, (irradiance, groups));
    }

    fn light_push(
        &self,
        view: &View,
        light: OneLight<'_>,
        (first_sample, end_sample): (u32, u32),
    ) -> EdgeLightPush {
        EdgeLightPush {
            view: *view,
            capacity: self.capacity,
            light: light.row,
            first_sample,
            end_sample,
            sample_step: light.point_step(),
            flags: light.flags(),
        }
    }

    /// What kernels that trace edge samples read of the scene.
    fn traced<'a>(&'a self, scene: &'a SceneBuffers, light: OneLight<'a>) -> [(&'static str, &'a Buffer); 5] {
        [
            ("Nodes", &scene.nodes),
            ("Triangles", &scene.triangles),
            ("Surfaces", &scene.surfaces),
            ("Lights", light.table),
            ("EdgeNumbers", &self.numbers),
        ]
    }

    /// Evaluates the light at the samples of edge pixels.
    fn record_samples(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        view: &View,
        light: OneLight<'_>,
    ) {
        let samples = [
            ("EdgePixels", &self.edge_pixels),
            ("EdgeSamples", &self.edge_samples),
            ("ShaftRoots", &self.shafts.roots),
            ("ShaftList", &self.shafts.list),
            ("EdgeLight", &self.edge_light),
            ("TruncatedLoops", &scene.truncated_loops),
        ];
        let bindings: Vec<_> = self.traced(scene, light).into_iter().chain(samples).collect();
        self.shafts.record_counted(pass, scene, light, (&self.edge_groups, BATCH_GROUPS));
        pass.barrier(COMPUTE_TO_INDIRECT);
        let (all, deep) = ((&self.edge_groups, SAMPLE_GROUPS), (&self.shafts.list, 0));
        for span in light.point_spans() {
            let push = self.light_push(view, light, span);
            pass.dispatch_indirect(self.direct.shallow(light), all, &push, &bindings);
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch_indirect(self.direct.deep(light), deep, &push, &bindings);
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Sums the samples of edge pixels, and lists the pixels at shadow edges.
    fn record_sums(&self, pass: &mut PassScope<'_>, irradiance: &Buffer, groups: &Buffer) {
        let [width, height] = self.size;
        pass.dispatch_indirect(
            &self.sums,
            self.pixel_groups(),
            &self.list_push(),
            &[
                ("EdgeNumbers", &self.numbers),
                ("EdgeSamples", &self.edge_samples),
                ("EdgeLight", &self.edge_light),
                ("LightIrradiance", irradiance),
                ("EdgeNeeds", &self.edge_needs),
                ("EdgePixels", &self.edge_pixels),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.shadow_mark,
            [(width * height).div_ceil(4), 1, 1],
            &EdgeMarkPush { width, height },
            &[
                ("LightIrradiance", irradiance),
                ("EdgeNumbers", &self.numbers),
                ("EdgeNeeds", &self.edge_needs),
                ("ShadowPixels", &self.shadow_pixels),
                ("ShadowGroups", groups),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
    }

    /// Averages the light at shadow edges over more samples.
    fn record_shadow_edges(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        view: &View,
        light: OneLight<'_>,
        pixels: &Buffer,
        (irradiance, groups): (&Buffer, &Buffer),
    ) {
        let traced = self.traced(scene, light);
        let listed = [
            ("Pixels", pixels),
            ("ShadowGroups", groups),
            ("ShadowPixels", &self.shadow_pixels),
            // The roots of shafts are no longer needed here.
            ("ShaftRoots", &self.shafts.roots),
        ];
        let scene_and_edges = traced.into_iter().filter(|(name, _)| *name != "Lights");
        let bindings: Vec<_> = scene_and_edges.chain(listed).collect();
        pass.dispatch_indirect(&self.frusta, (groups, PIXEL_GROUPS), &self.samples_push(view), &bindings);
        pass.barrier(COMPUTE_TO_COMPUTE);
        let averaged = [
            ("EdgeSlots", &self.edge_slots),
            ("EdgeNeeds", &self.edge_needs),
            ("LightIrradiance", irradiance),
            ("TruncatedLoops", &scene.truncated_loops),
            ("EdgePoints", &self.edge_points),
        ];
        let bindings: Vec<_> = traced.into_iter().chain(listed).chain(averaged).collect();
        for (part, span) in light.parts().flat_map(|part| part.point_spans().map(move |span| (part, span))) {
            if part.adds || span.0 > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch_indirect(
                self.shadow_edges.of(part),
                (groups, 0),
                &self.light_push(view, part, span),
                &bindings,
            );
        }
    }

    /// Dispatch size for workgroups of 64 edge pixels each, with its offset.
    pub fn pixel_groups(&self) -> (&Buffer, u64) {
        (&self.edge_groups, PIXEL_GROUPS)
    }

    /// Dispatch size for sums of light over pixels and used slots, [`GROUP_VALUES`] values a
    /// workgroup. `None` if antialiasing is off.
    pub fn point_groups(&self) -> Option<(&Buffer, u64)> {
        (self.capacity.max_samples > 0).then_some((&self.edge_groups, POINT_GROUPS))
    }

    fn samples_push(&self, view: &View) -> EdgeSamplesPush {
        EdgeSamplesPush { view: *view, capacity: self.capacity, smooth_m2: self.smooth_m * self.smooth_m }
    }

    fn list_push(&self) -> EdgeListPush {
        EdgeListPush {
            width: self.size[0],
            pixel_count: self.size[0] * self.size[1],
            capacity: self.capacity,
        }
    }

    /// Allocates the dispatch sizes and the number of pixels of a list of shadow edges.
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
        self.capacity.max_samples > 0
    }

    /// Buffer and byte offset of the number of edge pixels of the view.
    pub fn edge_count_at(&self) -> (&Buffer, u64) {
        (&self.edge_groups, 12)
    }

    /// Returns the number of edge pixels of this camera.
    ///
    /// # Errors
    /// The device failed.
    pub fn edge_count(&self) -> Result<u32> {
        Self::counted(&self.edge_groups)
    }
}

/// Words of a list's dispatch sizes and counts.
const GROUP_WORDS: u64 = 20;

/// Positions in tile order of an image of that size, including those of pixels beyond its edges.
fn places([width, height]: [u32; 2]) -> u32 {
    64 * width.div_ceil(8) * height.div_ceil(8)
}
