//! Radiance towards the camera. In: pixels, direct and indirect irradiance (W/m²), fragments of
//! edge pixels, reflectances. Out: W/m²/sr.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_INDIRECT;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::passes::frame::antialias::{Antialias, EdgeCapacity};
use crate::passes::frame::pixel_colours::PixelColours;
use crate::types::View;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    pub struct ComposePush {
        /// Camera of the image.
        pub view: View,
        /// Capacity for samples of edge pixels.
        pub capacity: EdgeCapacity,
        /// Factor of all light: the colour of the only active light.
        pub emission_scale: Vec3,
        /// 1, or 0 for an image without direct light.
        pub direct_weight: f32,
        /// 1, or 0 for an image without indirect light.
        pub indirect_weight: f32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[ComposePush::LAYOUT];

/// Inputs of the composition.
#[derive(Clone, Copy)]
pub struct Irradiances<'a> {
    /// A `PixelSurface` for each pixel.
    pub pixels: &'a Buffer,
    /// Direct irradiance of each pixel and then of each fragment, W/m².
    pub direct: &'a Buffer,
    /// Indirect irradiance of each pixel, W/m².
    pub indirect: &'a Buffer,
    /// Indirect irradiance of each edge point, W/m².
    pub at_edges: &'a Buffer,
    /// Glossy radiance of each pixel, W/m²/sr. `None` if no material may be glossy.
    pub gloss: Option<&'a Buffer>,
    /// Samples of the pixels that show an edge.
    pub antialias: &'a Antialias,
    /// Colours of images at pixels and samples.
    pub colours: &'a PixelColours,
    /// Factor of all light: the colour of the only active light.
    pub emission_scale: Vec3,
}

/// The pipelines and the image.
pub struct Compose {
    centres: Pipeline,
    edges: Pipeline,
    size: [u32; 2],
    /// Radiance of each pixel, W/m²/sr; three floats.
    pub radiance: Buffer,
}

impl Compose {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "compose";

    /// Allocates buffers for an image of that size; `is_glossy` if some material may be glossy.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        size: [u32; 2],
        is_glossy: bool,
    ) -> Result<Self> {
        let pipeline = |at_edges: u32| {
            let constants = [
                ("IS_GLOSSY", u32::from(is_glossy)),
                ("AT_EDGES", at_edges),
                scene.textures.constant(),
                scene.emission.constant(),
            ];
            Pipeline::new(context, Self::STEM, &constants)
        };
        Ok(Self {
            centres: pipeline(0)?,
            edges: pipeline(1)?,
            size,
            radiance: Buffer::storage(
                context,
                GrowsWith::Pixels.named("radiance"),
                u64::from(size[0]) * u64::from(size[1]) * 12,
            )?,
        })
    }

    /// Adds and reflects direct and indirect light with these weights; [1, 1] for the full image.
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        view: &View,
        irradiances: Irradiances<'_>,
        [direct_weight, indirect_weight]: [f32; 2],
    ) {
        let Irradiances { pixels, direct, indirect, at_edges, gloss, antialias, colours, emission_scale } =
            irradiances;
        let pixel_count = self.size[0] * self.size[1];
        let push = ComposePush {
            view: *view,
            capacity: antialias.capacity,
            emission_scale,
            direct_weight,
            indirect_weight,
        };
        let own = [
            ("Surfaces", &scene.surfaces),
            ("Materials", &scene.materials),
            ("Pixels", pixels),
            ("DirectIrradiance", direct),
            ("IndirectIrradiance", indirect),
            ("EdgeNumbers", &antialias.numbers),
            ("FragmentFirsts", &antialias.fragments.firsts),
            // If nothing is glossy, no pass reads it.
            ("GlossRadiance", gloss.unwrap_or(indirect)),
            ("Radiance", &self.radiance),
            ("PixelColours", &colours.of_pixels),
            ("EdgeColours", &colours.of_edges),
            ("EdgePixels", &antialias.edge_pixels),
        ];
        let traced = [
            ("Nodes", &scene.nodes),
            ("Triangles", &scene.triangles),
            ("TruncatedLoops", &scene.truncated_loops),
            ("EdgeIrradiance", at_edges),
            ("Fragments", &antialias.fragments.list),
            ("FragmentSurfaces", &antialias.fragments.surfaces),
        ];
        let bindings: Vec<_> = own.into_iter().chain(scene.emission.bindings()).chain(traced).collect();
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(&self.centres, [pixel_count, 1, 1], &push, &bindings);
        if antialias.is_on() {
            pass.barrier(COMPUTE_TO_INDIRECT);
            pass.dispatch_indirect(&self.edges, antialias.pixel_groups(), &push, &bindings);
        }
    }
}
