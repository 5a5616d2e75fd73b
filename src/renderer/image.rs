//! The picture: passes whose buffers depend on its size. The renderer and the preview record them
//! with the same code.

use super::lights::Lights;
use super::plan::FramePlan;
use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER};
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::frame::{
    antialias::{Antialias, SeenFragments},
    compose::{Compose, Irradiances},
    direct::Direct,
    fragments::Fragments,
    pixel_colours::PixelColours,
    primary::Primary,
    silhouettes::Silhouettes,
    splat::SeenSurfaces,
    tonemap::Tonemap,
};
use crate::passes::{OneLight, SceneBuffers};
use crate::scene::DisplayTransform;
use crate::types::View;
use glam::Vec3;
use std::sync::Arc;

/// The passes of a picture from camera rays to display, without indirect light.
pub(super) struct Image {
    pub(super) view: View,
    pub(super) primary: Primary,
    pub(super) direct: Direct,
    pub(super) silhouettes: Silhouettes,
    pub(super) antialias: Antialias,
    pub(super) pixel_colours: PixelColours,
    pub(super) compose: Compose,
    pub(super) tonemap: Tonemap,
    pub(super) display_transform: DisplayTransform,
    /// Weights of direct and indirect light.
    pub(super) light_weights: [f32; 2],
}

impl Image {
    /// Allocates a picture of the view's size, with up to `edge_samples` samples of an edge pixel.
    pub(super) fn new(
        context: &Arc<Context>,
        buffers: &SceneBuffers,
        view: View,
        edge_samples: u32,
        is_glossy: bool,
    ) -> Result<Self> {
        let (size, pixels) = ([view.width, view.height], view.width * view.height);
        let antialias = Antialias::new(context, size, edge_samples)?;
        let fragments = antialias.capacity.fragments;
        Ok(Self {
            view,
            primary: Primary::new(context, pixels)?,
            direct: Direct::new(context, size, fragments)?,
            silhouettes: Silhouettes::new(context)?,
            pixel_colours: PixelColours::new(context, buffers, pixels, fragments)?,
            antialias,
            compose: Compose::new(context, buffers, size, is_glossy)?,
            tonemap: Tonemap::new(context, pixels)?,
            display_transform: DisplayTransform::default(),
            light_weights: [1.0, 1.0],
        })
    }

    /// The surfaces that indirect light is splatted to.
    pub(super) fn seen(&self) -> SeenSurfaces<'_> {
        let Fragments { edge_points, point_groups, .. } = &self.antialias.fragments;
        SeenSurfaces { pixels: &self.primary.pixels, edge_points, point_groups }
    }

    /// What the view shows.
    pub(super) fn seen_fragments(&self) -> SeenFragments<'_> {
        SeenFragments { pixels: &self.primary.pixels, antialias: &self.antialias }
    }

    /// Width and height in pixels.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.view.width, self.view.height]
    }

    /// Records surfaces at pixels, edges and the colours of images.
    pub(super) fn record_view(&self, rec: &mut Recorder, buffers: &SceneBuffers) {
        let (view, pixels) = (&self.view, &self.primary.pixels);
        self.primary.record(rec, buffers, view);
        rec.barrier(COMPUTE_TO_COMPUTE);
        self.antialias.record(rec, buffers, view, pixels);
        rec.barrier(COMPUTE_TO_INDIRECT);
        if buffers.textures.are_used {
            self.pixel_colours.record(rec, buffers, view, pixels, Some(&self.antialias));
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Records direct light: of each light that the plan names, then the sum over all.
    pub(super) fn record_direct(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        buffers: &SceneBuffers,
        lights: &Lights,
    ) {
        let (planned, pixels) = (lights.planned_irradiances(plan), &self.primary.pixels);
        if plan.pixel_batches {
            self.direct.record_batches(rec, buffers, pixels);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        // Maps depend on the light alone, as form factors do.
        let mut moved = lights.planned_factors(plan);
        moved.retain(|(light, _)| light.has_silhouettes());
        if !moved.is_empty() {
            let mut pass = rec.pass(Silhouettes::STEM);
            for (place, &(light, _)) in moved.iter().enumerate() {
                if place > 0 {
                    pass.barrier(COMPUTE_TO_TRANSFER);
                }
                self.silhouettes.record(&mut pass, buffers, light);
            }
            drop(pass);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if !planned.is_empty() {
            let mut pass = rec.pass(Direct::STEM);
            for (place, &(light, irradiance)) in planned.iter().enumerate() {
                if place > 0 {
                    pass.barrier(COMPUTE_TO_TRANSFER);
                }
                let light = OneLight { marks_penumbra: self.antialias.is_on(), ..light };
                self.direct.record(&mut pass, buffers, light, pixels, irradiance);
            }
            pass.barrier(COMPUTE_TO_COMPUTE);
            drop(pass);
            let mut pass = rec.pass(Antialias::SHADOW_STEM);
            for (place, (light, irradiance)) in planned.into_iter().enumerate() {
                if place > 0 {
                    pass.barrier(COMPUTE_TO_TRANSFER);
                }
                let irradiance = (irradiance, lights.shadow_groups(light));
                self.antialias.record_light(&mut pass, buffers, &self.view, light, pixels, irradiance);
            }
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
        if plan.direct_sum {
            self.direct.record_sum(rec, &self.antialias, &lights.irradiances());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Records the picture from direct and indirect irradiance, and its display.
    pub(super) fn record_picture(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        buffers: &SceneBuffers,
        light: IndirectLight<'_>,
    ) {
        if plan.compose {
            self.record_composition(rec, buffers, light, self.light_weights);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if plan.display {
            self.tonemap.record(rec, &self.compose.radiance, &self.display_transform);
        }
    }

    /// Records the picture with these weights of direct and indirect light.
    pub(super) fn record_composition(
        &self,
        rec: &mut Recorder,
        buffers: &SceneBuffers,
        light: IndirectLight<'_>,
        weights: [f32; 2],
    ) {
        let irradiances = Irradiances {
            pixels: &self.primary.pixels,
            direct: &self.direct.irradiance,
            indirect: light.irradiance,
            at_edges: light.at_edges,
            gloss: light.gloss,
            antialias: &self.antialias,
            colours: &self.pixel_colours,
            emission_scale: light.emission_scale,
        };
        self.compose.record(rec, buffers, &self.view, irradiances, weights);
    }
}

/// What a picture adds to direct light.
#[derive(Clone, Copy)]
pub(super) struct IndirectLight<'a> {
    /// Indirect irradiance at pixels.
    pub(super) irradiance: &'a Buffer,
    /// Indirect irradiance at edge points.
    pub(super) at_edges: &'a Buffer,
    /// Glossy radiance of pixels. `None` if no material may be glossy.
    pub(super) gloss: Option<&'a Buffer>,
    /// Factor of all light, direct light included.
    pub(super) emission_scale: Vec3,
}
