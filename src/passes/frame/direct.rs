//! Direct illumination of the pixels. [Yue §4, Tdi] In: pixels, lights (W/sr). Out: irradiance, W/m².

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use std::sync::Arc;

gpu_struct! {
    /// Push constants.
    pub struct DirectPush {
        /// Pixels.
        pub width: u32,
        /// Pixels.
        pub height: u32,
        /// Lights.
        pub light_count: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[DirectPush::LAYOUT];

/// The pipeline and its result.
pub struct Direct {
    pipeline: Pipeline,
    /// Direct irradiance of each pixel, W/m²; three floats.
    pub irradiance: Buffer,
}

impl Direct {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "direct";

    /// Makes room for an image of `pixel_count` pixels.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            irradiance: Buffer::storage(context, "direct irradiance", u64::from(pixel_count) * 12)?,
        })
    }

    /// One shadow ray for each pixel and light.
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        lights: &Buffer,
        light_count: u32,
        pixels: &Buffer,
        [width, height]: [u32; 2],
    ) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [width, height, 1],
            &DirectPush { width, height, light_count },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Lights", lights),
                ("Pixels", pixels),
                ("DirectIrradiance", &self.irradiance),
            ],
        );
    }
}
