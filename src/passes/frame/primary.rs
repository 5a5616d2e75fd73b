//! Primary visibility: the surface at each pixel's centre. In: camera. Out: position, side, shading
//! normal, footprint (m²).

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::scene::Camera;
use crate::types::{PixelSurface, View};
use std::sync::Arc;

gpu_struct! {
    pub struct PrimaryPush {
        pub view: View,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[PrimaryPush::LAYOUT];

/// The pipeline and its result.
pub struct Primary {
    pipeline: Pipeline,
    /// `PixelSurface`s, row by row from the top.
    pub pixels: Buffer,
}

impl Primary {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "primary";

    /// Allocates the surfaces of `pixel_count` pixels.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, pixel_count: u32) -> Result<Self> {
        let bytes = u64::from(pixel_count) * size_of::<PixelSurface>() as u64;
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            pixels: Buffer::storage(context, GrowsWith::Pixels.named("pixels"), bytes)?,
        })
    }

    /// Traces one ray a pixel.
    pub fn record(&self, rec: &mut Recorder, scene: &SceneBuffers, view: &View) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [64 * view.width.div_ceil(8) * view.height.div_ceil(8), 1, 1],
            &PrimaryPush { view: *view },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Pixels", &self.pixels),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
    }
}

impl From<&Camera> for View {
    fn from(camera: &Camera) -> Self {
        let [right, up, forward] = camera.frame();
        let [width, height] = camera.size;
        let half_height = (0.5 * camera.fov_y_degrees.to_radians()).tan();
        let half_width = half_height * width as f32 / height as f32;
        Self {
            position: camera.position,
            pixel_area: 4.0 * half_width * half_height / (width as f32 * height as f32),
            right: right * half_width,
            width,
            up: up * half_height,
            height,
            forward,
        }
    }
}
