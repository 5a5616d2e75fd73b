//! Direct illumination of the pixels. [Yue §4, Tdi] In: surface points, lights. Out: an irradiance
//! buffer for each light, per unit emission; their sum, irradiance, W/m². Tiles of 8×8 pixels
//! share a shaft to the light.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_TRANSFER;
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::{
    antialias::Antialias,
    light_sum::LightSum,
    shafts::{ShaftKernel, Shafts},
};
use crate::passes::{OneLight, SceneBuffers};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    pub struct DirectPush {
        /// Points of a row.
        pub width: u32,
        pub point_count: u32,
        /// Row of the part of the light.
        pub light: u32,
        /// First point sample of the light.
        pub first_sample: u32,
        /// One past the last.
        pub end_sample: u32,
        /// Sum of `TRACES_ALL` and `ADDS`.
        pub flags: u32,
    }
}

gpu_struct! {
    /// Push constants of `pixel_batches`.
    pub struct PixelBatchesPush {
        /// Points of a row.
        pub width: u32,
        pub point_count: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[DirectPush::LAYOUT, PixelBatchesPush::LAYOUT];

/// The pipelines and the sum over all lights.
pub struct Direct {
    kernel: ShaftKernel,
    pixel_batches: Pipeline,
    shafts: Shafts,
    sum: LightSum,
    size: [u32; 2],
    fragment_count: u32,
    /// Direct irradiance of each pixel and then of each fragment, W/m²; three floats.
    pub irradiance: Buffer,
}

impl Direct {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "direct";
    /// The name of the pass that bounds tiles of pixels.
    pub const BATCHES_STEM: &str = "pixel_batches";
    /// Timing name of the sum over the lights.
    pub const SUM_STEM: &str = "direct_sum";

    /// Allocates buffers for an image of that size with `fragment_count` fragments.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, size: [u32; 2], fragment_count: u32) -> Result<Self> {
        let points = u64::from(size[0]) * u64::from(size[1]) + u64::from(fragment_count);
        Ok(Self {
            kernel: ShaftKernel::new(context, Self::STEM)?,
            pixel_batches: Pipeline::new(context, Self::BATCHES_STEM, &[])?,
            shafts: Shafts::new(context, size[0].div_ceil(8) * size[1].div_ceil(8))?,
            sum: LightSum::new(context)?,
            size,
            fragment_count,
            irradiance: Buffer::storage(context, GrowsWith::Pixels.named("direct irradiance"), points * 12)?,
        })
    }

    /// Number of values in a per-light irradiance buffer: one a pixel, then one a fragment.
    pub fn point_count(&self) -> u32 {
        self.pixel_count() + self.fragment_count
    }

    fn pixel_count(&self) -> u32 {
        self.size[0] * self.size[1]
    }

    /// Bounds the tiles of pixels; due after every change of the view.
    pub fn record_batches(&self, rec: &mut Recorder, scene: &SceneBuffers, pixels: &Buffer) {
        let [width, height] = self.size;
        rec.pass(Self::BATCHES_STEM).dispatch(
            &self.pixel_batches,
            [width.div_ceil(8) * height.div_ceil(8), 1, 1],
            &PixelBatchesPush { width, point_count: self.pixel_count() },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("SeenPoints", pixels),
                ("PointBatches", &self.shafts.batches),
            ],
        );
    }

    /// Fills the irradiance buffer of a light at the pixels, by a shadow ray from each pixel to
    /// each point sample of the light. Records into an open pass with barriers between its own
    /// dispatches. The caller records a barrier to transfers between two lights.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        pixels: &Buffer,
        irradiance: &Buffer,
    ) {
        for part in light.parts() {
            if part.adds {
                pass.barrier(COMPUTE_TO_TRANSFER);
            }
            self.record_part(pass, scene, part, pixels, irradiance);
        }
    }

    fn record_part(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        pixels: &Buffer,
        irradiance: &Buffer,
    ) {
        let width = self.size[0];
        if self.kernel.has_shafts(light) {
            self.shafts.record(pass, scene, light);
        }
        let bindings = [
            ("Nodes", &scene.nodes),
            ("Triangles", &scene.triangles),
            ("Surfaces", &scene.surfaces),
            ("Lights", light.table),
            ("SeenPoints", pixels),
            ("ShaftRoots", &self.shafts.roots),
            ("ShaftList", &self.shafts.list),
            ("LightIrradiance", irradiance),
            light.map(),
            ("RayCount", &scene.ray_counts[0]),
            ("TruncatedLoops", &scene.truncated_loops),
        ];
        for (first_sample, end_sample) in light.spans() {
            let push = DirectPush {
                width,
                point_count: self.pixel_count(),
                light: light.row,
                first_sample,
                end_sample,
                flags: light.flags(),
            };
            let points = (&self.shafts, self.shafts.point_count());
            self.kernel.record(pass, light, points, &push, &bindings);
        }
    }

    /// Sums the per-light irradiance buffers, weighted by the emissions, in order: at the pixels
    /// and the fragments.
    pub fn record_sum(&self, rec: &mut Recorder, antialias: &Antialias, irradiances: &[(Vec3, &Buffer)]) {
        let mut pass = rec.pass(Self::SUM_STEM);
        let points = (self.point_count(), antialias.point_groups());
        self.sum.record_counted(&mut pass, irradiances, points, 1.0, &self.irradiance);
    }
}
