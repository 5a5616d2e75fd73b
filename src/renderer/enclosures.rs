//! Enclosures hold no interior viewpoint when paths are traced, and take no part in transport. A
//! light alone in an enclosure changes nothing visible, and a camera alone sees nothing. An
//! enclosure takes part once it holds both, after another precomputation.

use crate::passes::precompute::rays::Rays;
use crate::passes::precompute::visibility::sides;
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
    pub(super) fn hold_both(&self, surfaces: &[Surface], camera: Vec3, lights: &[Vec3]) -> bool {
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
