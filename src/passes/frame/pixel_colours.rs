//! Colours of images at pixels and at fragments; composition multiplies
//! albedos by them. In: surfaces at the pixels, images. Out: packed colours. Nothing runs in
//! scenes without images.

use crate::cpu::textures::unpack_colour;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::passes::frame::antialias::{Antialias, EdgeCapacity};
use crate::scene::Material;
use crate::types::{NO_SIDE, PixelSurface, Surface, View};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// Push constants of `pixel_colours`.
    pub struct PixelColoursPush {
        pub view: View,
    }
}

gpu_struct! {
    /// Push constants of `edge_colours`.
    pub struct EdgeColoursPush {
        pub view: View,
        /// Capacity for samples of edge pixels.
        pub capacity: EdgeCapacity,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[PixelColoursPush::LAYOUT, EdgeColoursPush::LAYOUT];

/// Points along each side of a pixel for its mean colour.
pub const POINTS: u32 = 4;

/// The pipelines and their results.
pub struct PixelColours {
    pipelines: Option<[Pipeline; 2]>,
    /// Packed mean colour of each pixel; one unused word in scenes without images.
    pub of_pixels: Buffer,
    /// Packed colour of each fragment; likewise.
    pub of_edges: Buffer,
}

impl PixelColours {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "pixel_colours";

    /// Allocates buffers for `pixel_count` pixels and `fragment_count` fragments, if the
    /// scene has images.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        pixel_count: u32,
        fragment_count: u32,
    ) -> Result<Self> {
        let constant = scene.textures.constant();
        let pipelines = || -> Result<_> {
            Ok([
                Pipeline::new(context, Self::STEM, &[("POINTS", POINTS), constant])?,
                Pipeline::new(context, "edge_colours", &[constant])?,
            ])
        };
        Ok(Self {
            pipelines: scene.textures.are_used.then(pipelines).transpose()?,
            of_pixels: scene.textures.colours(
                context,
                GrowsWith::Pixels.named("pixel colours"),
                pixel_count.into(),
            )?,
            of_edges: scene.textures.colours(
                context,
                GrowsWith::Pixels.named("edge colours"),
                fragment_count.into(),
            )?,
        })
    }

    /// Computes the colours of all pixels, and of the edge pixels of the same camera. Does nothing
    /// in scenes without images.
    pub fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        view: &View,
        pixels: &Buffer,
        antialias: Option<&Antialias>,
    ) {
        let Some([of_pixels, of_edges]) = &self.pipelines else { return };
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(
            of_pixels,
            [view.width * view.height, 1, 1],
            &PixelColoursPush { view: *view },
            &scene.textures.after([
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Pixels", pixels),
                ("PixelColours", &self.of_pixels),
            ]),
        );
        let Some(antialias) = antialias.filter(|antialias| antialias.is_on()) else {
            return;
        };
        let capacity = antialias.capacity;
        pass.dispatch_indirect(
            of_edges,
            antialias.fragment_groups(),
            &EdgeColoursPush { view: *view, capacity },
            &scene.textures.after([
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("EdgeNumbers", &antialias.numbers),
                ("EdgePixels", &antialias.edge_pixels),
                ("EdgeSamples", &antialias.edge_samples),
                ("SampleMasks", &antialias.fragments.of_samples),
                ("FragmentFirsts", &antialias.fragments.firsts),
                ("Fragments", &antialias.fragments.list),
                ("EdgeGroups", antialias.fragment_groups().0),
                ("EdgeColours", &self.of_edges),
            ]),
        );
    }

    /// Diffuse albedo of each pixel, its colour included; black if the ray left the scene.
    ///
    /// # Errors
    /// The device failed.
    pub fn albedos(
        &self,
        pixels: &[PixelSurface],
        surfaces: &[Surface],
        materials: &[Material],
    ) -> Result<Vec<[f32; 3]>> {
        let colours: Option<Vec<u32>> =
            self.pipelines.as_ref().map(|_| self.of_pixels.read_range(0, pixels.len())).transpose()?;
        let albedo = |(index, pixel): (usize, &PixelSurface)| {
            if pixel.side == NO_SIDE {
                return [0.0; 3];
            }
            let diffuse = materials[surfaces[pixel.side as usize / 2].material as usize].diffuse;
            let colour =
                colours.as_ref().map_or(Vec3::ONE, |colours| unpack_colour(colours[index]).as_vec3());
            (diffuse * colour).to_array()
        };
        Ok(pixels.iter().enumerate().map(albedo).collect())
    }
}
