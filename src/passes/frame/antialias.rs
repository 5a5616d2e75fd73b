//! Antialiasing: pixels that show an edge, of geometry, a material or a shadow, are averaged over samples of their area.
//! In: pixels, direct irradiance (W/m²), scene, lights. Out: which pixels, and their samples.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use crate::passes::frame::prefix_sum::PrefixSum;
use crate::types::View;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// One sample of an edge pixel.
    pub struct EdgeSample {
        /// Direct irradiance, W/m².
        pub direct: Vec3,
        /// 2·triangle + (1 if the back side); `NO_SIDE` where the ray left the scene.
        pub side: u32,
        /// The pixel whose indirect irradiance it takes.
        pub source: u32,
    }
}

gpu_struct! {
    /// Push constants of `edge_mark`.
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
        /// Lights.
        pub light_count: u32,
        /// Samples of a pixel at most.
        pub most_samples: u32,
        /// Samples that there is room for.
        pub capacity: u32,
    }
}

/// What this pass shares with its shaders.
pub const LAYOUTS: &[Layout] =
    &[EdgeSample::LAYOUT, EdgeMarkPush::LAYOUT, EdgeListPush::LAYOUT, EdgeSamplesPush::LAYOUT];

/// Cosine below which the normals of neighbouring pixels make an edge: 25°, more than curved models turn in a pixel.
pub const CREASE: f32 = 0.9;
/// Distance of a neighbour from the pixel's plane that makes an edge, in pixel widths.
pub const STEP: f32 = 2.0;
/// Relative difference of direct light between neighbours that makes an edge.
pub const CONTRAST: f32 = 0.1;
/// An average pixel has room for the share 1/`SPREAD` of the samples that an edge pixel asks for.
const SPREAD: u64 = 16;
/// But there is room for so many at the least, 5 MiB: in a small picture light changes much from pixel to pixel, and most show an
/// edge.
const LEAST_ROOM: u64 = 1 << 18;

/// The pipelines and the samples.
pub struct Antialias {
    mark: Pipeline,
    list: Pipeline,
    samples: Pipeline,
    prefix_sum: PrefixSum,
    /// Index of each edge pixel.
    pub edge_pixels: Buffer,
    size: [u32; 2],
    /// Samples of an edge pixel at most; zero turns antialiasing off.
    pub most_samples: u32,
    /// Samples that there is room for; with more edges than that, each gets fewer.
    pub capacity: u32,
    /// Edge pixels before each pixel, and their number.
    pub offsets: Buffer,
    /// `EdgeSample`s, pixel by pixel.
    pub edge_samples: Buffer,
}

impl Antialias {
    /// The name of the pass in timings.
    pub const STEM: &str = "edge_samples";

    /// Makes room for an image of that size, with `most_samples` for each edge pixel.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, size: [u32; 2], most_samples: u32) -> Result<Self> {
        let pixel_count = size[0] * size[1];
        let all = u64::from(pixel_count) * u64::from(most_samples);
        let wanted = all.div_ceil(SPREAD).max(all.min(LEAST_ROOM));
        let bindable = context.limits().storage_range_bytes / size_of::<EdgeSample>() as u64;
        let capacity = wanted.min(bindable) as u32;
        let thresholds = [("CREASE", CREASE), ("STEP", STEP), ("CONTRAST", CONTRAST)];
        let offsets = Buffer::from_slice(context, "edge offsets", &vec![0_u32; pixel_count as usize + 1])?;
        Ok(Self {
            mark: Pipeline::new(
                context,
                "edge_mark",
                &thresholds.map(|(name, value)| (name, value.to_bits())),
            )?,
            list: Pipeline::new(context, "edge_list", &[])?,
            samples: Pipeline::new(context, Self::STEM, &[])?,
            prefix_sum: PrefixSum::new(context, pixel_count)?,
            edge_pixels: Buffer::storage(context, "edge pixels", 4 * u64::from(pixel_count))?,
            size,
            most_samples,
            capacity,
            offsets,
            edge_samples: Buffer::storage(
                context,
                "edge samples",
                u64::from(capacity.max(1)) * size_of::<EdgeSample>() as u64,
            )?,
        })
    }

    /// Finds the edges and samples them. Does nothing where antialiasing is off.
    #[expect(clippy::too_many_arguments, reason = "one call, at one place")]
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        view: &View,
        lights: &Buffer,
        light_count: u32,
        pixels: &Buffer,
        direct: &Buffer,
    ) {
        if self.most_samples == 0 {
            return;
        }
        let [width, height] = self.size;
        let pixel_count = width * height;
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(
            &self.mark,
            [width, height, 1],
            &EdgeMarkPush { width, height },
            &[
                ("Surfaces", &scene.surfaces),
                ("Pixels", pixels),
                ("DirectIrradiance", direct),
                ("EdgeOffsets", &self.offsets),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record(&mut pass, &self.offsets, pixel_count);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.list,
            [pixel_count, 1, 1],
            &EdgeListPush { pixel_count },
            &[("EdgeOffsets", &self.offsets), ("EdgePixels", &self.edge_pixels)],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.samples,
            [self.capacity, 1, 1],
            &EdgeSamplesPush {
                view: *view,
                light_count,
                most_samples: self.most_samples,
                capacity: self.capacity,
            },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Lights", lights),
                ("Pixels", pixels),
                ("EdgeOffsets", &self.offsets),
                ("EdgePixels", &self.edge_pixels),
                ("EdgeSamples", &self.edge_samples),
            ],
        );
    }

    /// Edge pixels of the last frame.
    ///
    /// # Errors
    /// The device failed.
    pub fn edge_count(&self) -> Result<u32> {
        let pixel_count = self.size[0] as usize * self.size[1] as usize;
        Ok(self.offsets.read_range::<u32>(pixel_count, 1)?[0])
    }
}
