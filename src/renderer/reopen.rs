//! Another precomputation, once the camera and a light are in one enclosure.

use super::{Progress, Renderer};
use crate::error::Result;
use glam::Vec3;

impl Renderer {
    /// Whether an enclosure holds both the camera and a light since the last precomputation. It has
    /// no indirect light until [`Self::open_enclosures`]. Uses the host alone.
    pub fn needs_precompute(&mut self) -> bool {
        let world = &mut self.world;
        if std::mem::take(&mut world.enclosures.is_due) {
            let camera = world.scene.cameras[0].position;
            let active = world.scene.lights.iter().filter(|light| light.is_on);
            let lights: Vec<Vec3> = active.filter_map(|light| light.kind.position()).collect();
            world.enclosures.holds_both = world.enclosures.hold_both(&world.surfaces, camera, &lights);
        }
        world.enclosures.holds_both
    }

    /// Precomputes the scene again if an enclosure holds both the camera and a light; returns
    /// whether it did. This equals a cold start and takes as long. The enclosure then takes
    /// part for good. A caller that leaves out frames calls this instead: later frames then
    /// have the same bits.
    ///
    /// # Errors
    /// The device lacks memory for the old and the new results, or failed; the renderer then stays
    /// as it was.
    pub fn open_enclosures(&mut self, progress: &mut dyn Progress) -> Result<bool> {
        if !self.needs_precompute() {
            return Ok(false);
        }
        let world = &self.world;
        let mut scene = world.scene.clone();
        scene.interior_viewpoints.push(scene.cameras[0].position);
        scene.warnings.clear();
        let mut order = vec![0; world.enclosures.order.len()];
        (0..).zip(&world.enclosures.order).for_each(|(new, &old)| order[old as usize] = new);
        scene.reorder(&order);
        let mut opened = Self::new(&self.context, scene, progress)?;
        opened.world.enclosures.is_due = false;
        opened.set_display_transform(self.image.display_transform);
        opened.set_light_weights(self.image.light_weights);
        opened.set_skipping(self.dirty.skips);
        opened.set_serialised(self.is_serialised);
        *self = opened;
        Ok(true)
    }
}
