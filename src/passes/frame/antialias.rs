//! Antialiasing: pixels that show an edge are averaged over samples of their area. Where geometry or materials make the edge,
//! the samples' surfaces are found once a camera and kept; every light lights them as it lights pixels. Where a light makes it,
//! a shadow, that light alone is averaged, in its layer. In: pixels, scene, lights' layers. Out: which pixels, their samples.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT};
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::prefix_sum::PrefixSum;
use crate::passes::{OneLight, SceneBuffers};
use crate::types::{PixelSurface, View};
use std::sync::Arc;

gpu_struct! {
    /// What a sample of an edge pixel stands for.
    pub struct EdgeSource {
        /// The pixel whose indirect irradiance it takes.
        pub pixel: u32,
        /// Number of the pixel's point that it shows.
        pub number: u32,
        /// Of the points that were asked for it, those that met a surface.
        pub share: f32,
    }
}

gpu_struct! {
    /// Push constants of `edge_mark` and `shadow_mark`.
    pub struct EdgeMarkPush {
        /// Pixels.
        pub width: u32,
        /// Pixels.
        pub height: u32,
    }
}

gpu_struct! {
    /// Push constants of `edge_list`.
    pub struct EdgeListPush {
        /// Pixels.
        pub pixel_count: u32,
    }
}

gpu_struct! {
    /// Push constants of `edge_samples`.
    pub struct EdgeSamplesPush {
        /// The camera.
        pub view: View,
        /// Samples of a pixel at most.
        pub most_samples: u32,
        /// Samples that there is room for.
        pub capacity: u32,
    }
}

gpu_struct! {
    /// Push constants of `shadow_edges`.
    pub struct ShadowEdgesPush {
        /// The camera.
        pub view: View,
        /// Samples of a pixel at most.
        pub most_samples: u32,
        /// Samples that may be taken.
        pub capacity: u32,
        /// Which light.
        pub light: u32,
        /// First point sample of the light.
        pub first_sample: u32,
        /// Behind the last.
        pub end_sample: u32,
        /// 1: rays are traced although they cannot bring light.
        pub traces_all: u32,
    }
}

/// What this pass shares with its shaders.
pub const LAYOUTS: &[Layout] = &[
    EdgeSource::LAYOUT,
    EdgeMarkPush::LAYOUT,
    EdgeListPush::LAYOUT,
    EdgeSamplesPush::LAYOUT,
    ShadowEdgesPush::LAYOUT,
];

/// Cosine below which the normals of neighbouring pixels make an edge: 25°, more than curved models turn in a pixel.
pub const CREASE: f32 = 0.9;
/// Distance of a neighbour from the pixel's plane that makes an edge, in pixel widths.
pub const STEP: f32 = 2.0;
/// Relative difference of one light between neighbours that makes an edge.
pub const CONTRAST: f32 = 0.1;
/// Points that a sample of the scene's outline asks: what is beside a surface there is black, so that nothing shows more than how
/// much of the pixel it covers.
pub const OUTLINE_POINTS: u32 = 8;
/// An average pixel has room for the share 1/`SPREAD` of the samples that an edge pixel asks for.
const SPREAD: u64 = 16;
/// Samples of an edge pixel at the least; where there is room for fewer, no pixel has any.
pub const LEAST_SAMPLES: u32 = 4;
/// But there is room for so many at the least, 9 MiB: in a small picture light changes much from pixel to pixel, and most show an
/// edge.
const LEAST_ROOM: u64 = 1 << 18;

/// The pipelines and the samples.
pub struct Antialias {
    mark: Pipeline,
    shadow_mark: Pipeline,
    list: Pipeline,
    samples: Pipeline,
    shadow_edges: Pipeline,
    prefix_sum: PrefixSum,
    /// Index of each edge pixel.
    pub edge_pixels: Buffer,
    /// Workgroups along each axis that take four of them each; their number.
    edge_groups: Buffer,
    /// Index of each pixel at the shadow edges of the light that was taken last.
    shadow_pixels: Buffer,
    /// Shadow edges of the light that was taken last before each pixel, and their number.
    shadow_offsets: Buffer,
    size: [u32; 2],
    /// Samples of an edge pixel at most; zero turns antialiasing off.
    pub most_samples: u32,
    /// Samples that there is room for; with more edges than that, each gets fewer.
    pub capacity: u32,
    /// Edge pixels before each pixel, and their number.
    pub offsets: Buffer,
    /// `PixelSurface`s that samples see, edge pixel by edge pixel.
    pub edge_surfaces: Buffer,
    /// Their `EdgeSource`s.
    pub edge_sources: Buffer,
}

impl Antialias {
    /// The name of the pass that finds edges and what their samples see.
    pub const STEM: &str = "edge_samples";
    /// The name of the pass that averages a light where its shadows end.
    pub const SHADOW_STEM: &str = "shadow_edges";

    /// Makes room for an image of that size, with `most_samples` for each edge pixel.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, size: [u32; 2], most_samples: u32) -> Result<Self> {
        let pixel_count = size[0] * size[1];
        let all = u64::from(pixel_count) * u64::from(most_samples);
        let wanted = all.div_ceil(SPREAD).max(all.min(LEAST_ROOM));
        let bindable = context.limits().storage_range_bytes / size_of::<PixelSurface>() as u64;
        let capacity = wanted.min(bindable) as u32;
        let no_edges = vec![0_u32; pixel_count as usize + 1];
        let bits = |thresholds: &[(&'static str, f32)]| -> Vec<_> {
            thresholds.iter().map(|&(name, value)| (name, value.to_bits())).collect()
        };
        let room = u64::from(capacity.max(1));
        Ok(Self {
            mark: Pipeline::new(context, "edge_mark", &bits(&[("CREASE", CREASE), ("STEP", STEP)]))?,
            shadow_mark: Pipeline::new(context, "shadow_mark", &bits(&[("CONTRAST", CONTRAST)]))?,
            list: Pipeline::new(context, "edge_list", &[])?,
            samples: Pipeline::new(context, Self::STEM, &[("OUTLINE_POINTS", OUTLINE_POINTS)])?,
            shadow_edges: Pipeline::new(context, Self::SHADOW_STEM, &[])?,
            prefix_sum: PrefixSum::new(context, pixel_count)?,
            edge_pixels: Buffer::storage(context, "edge pixels", 4 * u64::from(pixel_count))?,
            edge_groups: Self::groups(context)?,
            shadow_pixels: Buffer::storage(context, "shadow pixels", 4 * u64::from(pixel_count))?,
            shadow_offsets: Buffer::from_slice(context, "shadow offsets", &no_edges)?,
            size,
            most_samples,
            capacity,
            offsets: Buffer::from_slice(context, "edge offsets", &no_edges)?,
            edge_surfaces: Buffer::storage(
                context,
                "edge surfaces",
                room * size_of::<PixelSurface>() as u64,
            )?,
            edge_sources: Buffer::storage(context, "edge sources", room * size_of::<EdgeSource>() as u64)?,
        })
    }

    /// Finds the edges that a camera sees, and what samples of them see. Does nothing where antialiasing is off.
    pub fn record(&self, rec: &mut Recorder, scene: &SceneBuffers, view: &View, pixels: &Buffer) {
        if self.most_samples == 0 {
            return;
        }
        let [width, height] = self.size;
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(
            &self.mark,
            [width, height, 1],
            &EdgeMarkPush { width, height },
            &[("Surfaces", &scene.surfaces), ("Pixels", pixels), ("EdgeOffsets", &self.offsets)],
        );
        self.record_list(&mut pass, &self.offsets, &self.edge_pixels, &self.edge_groups);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.samples,
            [self.capacity, 1, 1],
            &EdgeSamplesPush { view: *view, most_samples: self.most_samples, capacity: self.capacity },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Pixels", pixels),
                ("EdgeOffsets", &self.offsets),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeSurfaces", &self.edge_surfaces),
                ("EdgeSources", &self.edge_sources),
            ],
        );
    }

    /// Averages a light over the pixels that its shadows' edges cross, in its layer of the pixels; `groups`, of [`Self::groups`], keeps
    /// their number. Records into an open pass, with barriers between its own dispatches only. Does nothing where antialiasing is off.
    pub fn record_shadows(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        view: &View,
        light: OneLight<'_>,
        pixels: &Buffer,
        (layer, groups): (&Buffer, &Buffer),
    ) {
        if self.most_samples == 0 {
            return;
        }
        let [width, height] = self.size;
        pass.dispatch(
            &self.shadow_mark,
            [width, height, 1],
            &EdgeMarkPush { width, height },
            &[("LightLayer", layer), ("EdgeOffsets", &self.offsets), ("ShadowOffsets", &self.shadow_offsets)],
        );
        self.record_list(pass, &self.shadow_offsets, &self.shadow_pixels, groups);
        pass.barrier(COMPUTE_TO_INDIRECT);
        for (first_sample, end_sample) in light.spans() {
            let push = ShadowEdgesPush {
                view: *view,
                most_samples: self.most_samples,
                capacity: self.capacity,
                light: light.index,
                first_sample,
                end_sample,
                traces_all: u32::from(light.traces_all),
            };
            if first_sample > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch_indirect(
                &self.shadow_edges,
                (groups, 0),
                &push,
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("Lights", light.table),
                    ("Pixels", pixels),
                    ("ShadowOffsets", &self.shadow_offsets),
                    ("ShadowPixels", &self.shadow_pixels),
                    ("LightLayer", layer),
                ],
            );
        }
    }

    /// Turns marks into a list of the marked pixels.
    fn record_list(&self, pass: &mut PassScope<'_>, offsets: &Buffer, pixels: &Buffer, groups: &Buffer) {
        let pixel_count = self.size[0] * self.size[1];
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record(pass, offsets, pixel_count);
        pass.barrier(COMPUTE_TO_COMPUTE);
        let edges = [("EdgeOffsets", offsets), ("EdgePixels", pixels), ("EdgeGroups", groups)];
        pass.dispatch(&self.list, [pixel_count, 1, 1], &EdgeListPush { pixel_count }, &edges);
    }

    /// Room for the number of edge pixels in a list, and of workgroups that take them.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn groups(context: &Arc<Context>) -> Result<Buffer> {
        Buffer::from_slice(context, "edge groups", &[0_u32; 4])
    }

    /// Edge pixels that were counted there.
    ///
    /// # Errors
    /// The device failed.
    pub fn counted(groups: &Buffer) -> Result<u32> {
        Ok(groups.read_range::<u32>(3, 1)?[0])
    }

    /// Pixels of this camera that show an edge of geometry or of a material.
    ///
    /// # Errors
    /// The device failed.
    pub fn edge_count(&self) -> Result<u32> {
        Self::counted(&self.edge_groups)
    }
}
