//! Radiance towards the camera. In: pixels, direct and indirect irradiance (W/m²), reflectances. Out: W/m²/sr.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use std::sync::Arc;

gpu_struct! {
    /// Push constants.
    pub struct ComposePush {
        /// Pixels.
        pub pixel_count: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[ComposePush::LAYOUT];

/// The pipeline and the picture.
pub struct Compose {
    pipeline: Pipeline,
    pixel_count: u32,
    /// Radiance of each pixel, W/m²/sr; three floats.
    pub radiance: Buffer,
}

impl Compose {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "compose";

    /// Makes room for an image of `pixel_count` pixels.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            pixel_count,
            radiance: Buffer::storage(context, "radiance", u64::from(pixel_count) * 12)?,
        })
    }

    /// Adds and reflects.
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        pixels: &Buffer,
        direct: &Buffer,
        indirect: &Buffer,
    ) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [self.pixel_count, 1, 1],
            &ComposePush { pixel_count: self.pixel_count },
            &[
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Pixels", pixels),
                ("DirectIrradiance", direct),
                ("IndirectIrradiance", indirect),
                ("Radiance", &self.radiance),
            ],
        );
    }
}
