//! Direct illumination of what the camera sees. [Yue §4, Tdi] In: surface points, lights. Out: a layer for each light, free of its
//! colour; their sum, irradiance, W/m².

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::{antialias::Antialias, light_sum::LightSum};
use crate::passes::{OneLight, SceneBuffers};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// Push constants.
    pub struct DirectPush {
        /// Points of a row.
        pub width: u32,
        /// Points.
        pub point_count: u32,
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

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[DirectPush::LAYOUT];

/// The pipelines and the sum over all lights.
pub struct Direct {
    pipeline: Pipeline,
    sum: LightSum,
    size: [u32; 2],
    slot_count: u32,
    /// Direct irradiance of each pixel and then of each slot of edge pixels, W/m²; three floats.
    pub irradiance: Buffer,
}

impl Direct {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "direct";
    /// What the sum over the lights is called in timings.
    pub const SUM_STEM: &str = "direct_sum";

    /// Makes room for an image of that size and so many slots of edge pixels.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, size: [u32; 2], slot_count: u32) -> Result<Self> {
        let points = u64::from(size[0]) * u64::from(size[1]) + u64::from(slot_count);
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            sum: LightSum::new(context)?,
            size,
            slot_count,
            irradiance: Buffer::storage(context, "direct irradiance", points * 12)?,
        })
    }

    /// Values of a light's layer: one a pixel, then one a slot of edge pixels.
    pub fn point_count(&self) -> u32 {
        self.pixel_count() + self.slot_count
    }

    fn pixel_count(&self) -> u32 {
        self.size[0] * self.size[1]
    }

    /// Fills a light's layer at the pixels: shadow rays from each to each of its point samples. Records into an open pass,
    /// with barriers between its own dispatches only.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        pixels: &Buffer,
        layer: &Buffer,
    ) {
        let [width, _] = self.size;
        for (first_sample, end_sample) in light.spans() {
            if first_sample > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.pipeline,
                [self.size[0], self.size[1], 1],
                &DirectPush {
                    width,
                    point_count: self.pixel_count(),
                    light: light.index,
                    first_sample,
                    end_sample,
                    traces_all: u32::from(light.traces_all),
                },
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("Lights", light.table),
                    ("SeenPoints", pixels),
                    ("LightLayer", layer),
                ],
            );
        }
    }

    /// Sums the lights' layers, each with its emission, in order: at the pixels, and in as many slots as edge pixels have.
    pub fn record_sum(&self, rec: &mut Recorder, antialias: &Antialias, layers: &[(Vec3, &Buffer)]) {
        let mut pass = rec.pass(Self::SUM_STEM);
        let points = (self.point_count(), antialias.point_groups());
        self.sum.record_counted(&mut pass, layers, points, 1.0, &self.irradiance);
    }
}
