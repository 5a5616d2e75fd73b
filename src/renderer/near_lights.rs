//! Near-light correction: computed when form factors are stale, before the frame is recorded.

use super::Renderer;
use super::precompute::Precomputed;
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::frame::near_lights::NearLights;
use crate::scene::Scene;
use std::sync::Arc;

/// A buffer of `NearFactor`s and their number.
pub(super) type NearFactors = (Buffer, u32);

/// Prepares the search for entry points near a light.
pub(super) fn near_lights(context: &Arc<Context>, scene: &Scene, made: &Precomputed) -> Result<NearLights> {
    let may_be_glossy = |material: u32| scene.materials[material as usize].may_be_glossy();
    NearLights::new(context, &made.entry_points, &made.surfaces, may_be_glossy, made.area_m2)
}

impl Renderer {
    /// Computes the near-light correction of lights with stale form factors. Returns
    /// device time, milliseconds.
    pub(super) fn find_near_lights(&mut self) -> Result<f64> {
        let mut device_ms = 0.0;
        let (surfaces, gloss) = (&self.surfaces, &self.gloss);
        let is_diffuse = |side: u32| {
            let surface = &surfaces[side as usize / 2];
            let may_be_glossy =
                gloss.as_ref().is_some_and(|gloss| gloss.may_be_glossy(surface.material as usize));
            surface.side_is_active(side % 2 == 1) && !may_be_glossy
        };
        let near = &self.near_lights;
        let tracer = (&self.closed.rays, &self.buffers);
        for (light, factors) in self.lights.near_due() {
            let (found, ms) = near.find(tracer, surfaces, is_diffuse, light)?;
            device_ms += ms;
            *factors = if found.is_empty() { None } else { Some((near.upload(&found)?, found.len() as u32)) };
        }
        Ok(device_ms)
    }
}
