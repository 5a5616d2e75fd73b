//! Highlights: direct light of one light that glossy pixels reflect to the camera, one value a
//! sample. In: samples of glossy pixels, a light. Out: the highlights of the light, per unit of its
//! emission and of the specular albedo.

use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, PassScope};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::gloss_pixels::GlossPixels;
use crate::passes::{OneLight, SceneBuffers};
use crate::types::IS_SKY;
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
        /// Row of the part of the light.
        pub light: u32,
        /// First point sample of the light.
        pub first_sample: u32,
        /// One past the last.
        pub end_sample: u32,
        /// Seed of the directions.
        pub seed: u32,
        /// Sum of `TRACES_ALL`, `ADDS` and `IS_SKY`.
        pub flags: u32,
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
        let [backgrounds, sky_texels] = scene.emission.sky();
        // The sky is sampled by directions of the lobe, all of it at once.
        let is_sky = light.sky.is_some();
        let light = OneLight { part_count: if is_sky { 1 } else { light.part_count }, ..light };
        for (light, (first_sample, end_sample)) in
            light.parts().flat_map(|part| part.spans().map(move |span| (part, span)))
        {
            if light.adds || first_sample > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.highlight,
                [self.used_capacity(), 1, 1],
                &HighlightsPush {
                    eye,
                    pixel_count: self.pixel_count,
                    max_samples: self.max_samples,
                    capacity: self.used_capacity(),
                    light: light.row,
                    first_sample,
                    end_sample,
                    seed,
                    flags: light.flags() | if is_sky { IS_SKY } else { 0 },
                },
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("Materials", &scene.materials),
                    ("Lights", light.table),
                    ("GlossOffsets", &self.samples.offsets),
                    ("GlossSamples", &self.samples.surfaces),
                    ("GlossPixels", &self.samples.pixels),
                    ("LightHighlights", highlights),
                    ("GlossParts", &self.samples.parts),
                    ("TruncatedLoops", &scene.truncated_loops),
                    backgrounds,
                    sky_texels,
                ],
            );
        }
    }
}
