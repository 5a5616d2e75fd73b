//! Enclosures hold no interior viewpoint when paths are traced, and take no part in transport. A
//! light alone in an enclosure changes nothing visible, and a camera alone sees nothing. An
//! enclosure takes part once it holds both.

use super::Renderer;
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::precompute::{Silent, rays::Rays, sides};
use crate::scene::{Light, solids::Solids};
use glam::Vec3;

/// The enclosures of a scene, and whether they must be tested again.
pub(super) struct Enclosures {
    pub(super) solids: Solids,
    pub(super) groups: sides::Enclosures,
    pub(super) rays: Rays,
    /// Index of each triangle in the scene as it was given.
    pub(super) order: Vec<u32>,
    /// The camera or a light has changed since the last test.
    pub(super) is_due: bool,
}

impl Enclosures {
    /// Whether the camera and one of the lights are in the same enclosure.
    fn hold_both(&self, buffers: &SceneBuffers, camera: Vec3, lights: &[Vec3]) -> Result<bool> {
        let solids: Vec<u32> = self.solids.solids_around(camera).collect();
        if lights.iter().any(|&light| self.solids.solids_around(light).any(|solid| solids.contains(&solid))) {
            return Ok(true);
        }
        // Bounds first: rays wait for the device.
        let near: Vec<Vec3> =
            lights.iter().copied().filter(|&light| self.groups.may_hold([camera, light])).collect();
        if near.is_empty() {
            return Ok(false);
        }
        let around = self.groups.around(&self.rays, buffers, &[&[camera], &near[..]].concat())?;
        Ok(around[0].is_some() && around[1..].contains(&around[0]))
    }
}

/// A warning for each light in a solid.
pub(super) fn lost_lights<'a>(solids: &'a Solids, lights: &'a [Light]) -> impl Iterator<Item = String> + 'a {
    let is_lost = |light: &&Light| light.kind.position().is_some_and(|place| solids.hold(place));
    lights.iter().filter(is_lost).map(|light| {
        format!(
            "light `{}` is inside a closed surface, and none of its light leaves it; move it, or the camera in there, too",
            light.name
        )
    })
}

impl Renderer {
    /// Precomputes the scene anew if an enclosure holds both the camera and a light. This equals
    /// a cold start and takes as long. The enclosure then takes part for good. [`Self::frame`]
    /// calls this. A caller that leaves out frames calls it in their place, to get the same bits
    /// in later frames.
    ///
    /// # Errors
    /// The device lacks memory for the old and the new results, or failed; the renderer then stays
    /// as it was.
    pub fn open_enclosures(&mut self) -> Result<()> {
        if !std::mem::take(&mut self.closed.is_due) {
            return Ok(());
        }
        let camera = self.scene.cameras[0].position;
        let active = self.scene.lights.iter().filter(|light| light.is_on);
        let lights: Vec<Vec3> = active.filter_map(|light| light.kind.position()).collect();
        if !self.closed.hold_both(&self.buffers, camera, &lights)? {
            return Ok(());
        }
        let mut scene = self.scene.clone();
        scene.places.push(camera);
        scene.warnings.clear();
        let mut order = vec![0; self.closed.order.len()];
        (0..).zip(&self.closed.order).for_each(|(new, &old)| order[old as usize] = new);
        scene.reorder(&order);
        let mut opened = Self::new(&self.context, scene, &mut Silent)?;
        opened.closed.is_due = false;
        opened.set_exposure(self.exposure_stops);
        opened.set_skipping(self.skips);
        *self = opened;
        Ok(())
    }
}
