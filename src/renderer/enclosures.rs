//! Enclosures hold no interior viewpoint when paths are traced, and take no part in transport. A
//! light alone in an enclosure changes nothing visible, and a camera alone sees nothing. An
//! enclosure takes part once it holds both, after another precomputation.

use super::{Progress, Renderer};
use crate::error::Result;
use crate::passes::precompute::{rays::Rays, sides};
use crate::scene::{Light, host_bvh::HostBvh, solids::Solids};
use crate::types::Surface;
use glam::Vec3;

/// The enclosures of a scene, and whether they must be tested again.
pub(super) struct Enclosures {
    pub(super) solids: Solids,
    pub(super) groups: sides::Enclosures,
    pub(super) rays: Rays,
    /// Index of each triangle in the scene as it was given.
    pub(super) order: Vec<u32>,
    /// `None` if no enclosure holds anything.
    pub(super) tree: Option<HostBvh>,
    /// The camera or a light has changed since the last test.
    pub(super) is_due: bool,
    /// Result of the last test.
    pub(super) holds_both: bool,
}

impl Enclosures {
    /// Whether the camera and one of the lights are in the same enclosure. Uses the host alone.
    fn hold_both(&self, surfaces: &[Surface], camera: Vec3, lights: &[Vec3]) -> bool {
        let solids: Vec<u32> = self.solids.solids_around(camera).collect();
        if lights.iter().any(|&light| self.solids.solids_around(light).any(|solid| solids.contains(&solid))) {
            return true;
        }
        let Some(tree) = &self.tree else { return false };
        // Bounds first: rays take longer.
        let near = lights.iter().filter(|&&light| self.groups.may_hold([camera, light]));
        let around = |point: Vec3| {
            self.groups.around(point, |origin, direction| {
                let (_, triangle) = tree.closest(origin, direction)?;
                Some(2 * triangle + u32::from(surfaces[triangle as usize].normal.dot(direction) > 0.0))
            })
        };
        let mut near = near.peekable();
        let own = near.peek().and_then(|_| around(camera));
        own.is_some() && near.any(|&light| around(light) == own)
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
        opened.set_exposure(self.image.exposure_stops);
        opened.set_light_weights(self.image.light_weights);
        opened.set_skipping(self.dirty.skips);
        opened.set_serialised(self.is_serialised);
        *self = opened;
        Ok(true)
    }
}
