//! Highlights: direct light of one light that glossy pixels reflect to the camera, one value a
//! sample. In: samples of glossy pixels, a light. Out: the highlights of the light, per unit of its
//! emission and of the specular albedo.

use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, PassScope};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::gloss_pixels::GlossPixels;
use crate::passes::{OneLight, SceneBuffers};
use glam::Vec3;

gpu_struct! {
    /// Push constants of `highlights`.
    pub struct HighlightsPush {
        /// The camera, metres.
        pub eye: Vec3,
        /// Pixels of the image.
        pub pixel_count: u32,
        /// Samples of a pixel at most.
        pub max_samples: u32,
        /// Capacity of the list of samples.
        pub capacity: u32,
        /// Index of the light.
        pub light: u32,
        /// First point sample of the light.
        pub first_sample: u32,
        /// One past the last.
        pub end_sample: u32,
        /// Seed of the directions.
        pub seed: u32,
        /// 1: rays are traced although they cannot bring light.
        pub traces_all: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[HighlightsPush::LAYOUT];

impl GlossPixels {
    /// Timing name of the highlights of the lights.
    pub const HIGHLIGHTS_STEM: &str = "highlights";

    /// Fills the highlights of a light, one value a sample. Records into an open pass with barriers
    /// between its own dispatches. The caller records a barrier to dispatches between two lights.
    pub fn record_highlights(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        (eye, seed): (Vec3, u32),
        highlights: &Buffer,
    ) {
        for (first_sample, end_sample) in light.spans() {
            if first_sample > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.highlight,
                [self.capacity, 1, 1],
                &HighlightsPush {
                    eye,
                    pixel_count: self.pixel_count,
                    max_samples: self.max_samples,
                    capacity: self.capacity,
                    light: light.index,
                    first_sample,
                    end_sample,
                    seed,
                    traces_all: u32::from(light.traces_all),
                },
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("Materials", &scene.materials),
                    ("Lights", light.table),
                    ("GlossOffsets", &self.offsets),
                    ("GlossSamples", &self.samples),
                    ("GlossPixels", &self.pixels),
                    ("LightHighlights", highlights),
                    ("TruncatedLoops", &scene.truncated_loops),
                ],
            );
        }
    }
}
