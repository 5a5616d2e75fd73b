//! Which sides of which triangles light can reach: the inside of closed solids gets no entry points, no clusters and
//! no cache points.
//!
//! Rays between sides join what sees each other; a group of sides takes part if it also sees the void, a light or a
//! camera. Sides that provably see no surface at all were left out before, and so are backs inside solids, which parts that reach into
//! each other would join with the rest.

use super::rays::{RayQuery, Rays};
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::scene::{Scene, solids::Solids};
use crate::types::{NO_SIDE, Surface};
use glam::Vec3;

/// Rays from each side. A side whose rays happen to miss all its neighbours is reached from theirs.
const RAYS_PER_SIDE: u32 = 16;
/// Rays from each light and camera.
const RAYS_PER_POINT: u32 = 256;

/// Clears the activity of sides that light cannot reach. Surfaces and triangles in BVH order; rays start `clear_distance`
/// (metres) off their surface.
///
/// # Errors
/// The device lacks memory or failed.
pub fn deactivate_unreachable(
    rays: &Rays,
    buffers: &SceneBuffers,
    scene: &Scene,
    solids: &Solids,
    clear_distance: f32,
    surfaces: &mut [Surface],
) -> Result<()> {
    for (surface, is_inside) in surfaces.iter_mut().zip(solids.backs()) {
        if is_inside {
            surface.deactivate_side(true);
        }
    }
    let mut queries = Vec::new();
    let mut sources = Vec::new();
    let side_count = 2 * surfaces.len();
    let outside = side_count;
    for side in 0..side_count {
        let (surface, back) = (&surfaces[side / 2], side % 2 == 1);
        if !surface.side_is_active(back) {
            continue;
        }
        let [p0, p1, p2] = scene.triangles[side / 2].positions;
        let normal = if back { -surface.normal } else { surface.normal };
        for ray in 0..RAYS_PER_SIDE {
            let u = plastic_sequence(side as u32 * RAYS_PER_SIDE + ray);
            let along = u[0].sqrt();
            let position = (1.0 - along) * p0 + along * ((1.0 - u[1]) * p1 + u[1] * p2);
            // Lambert's law needs no frame: the normal plus a point on the unit sphere.
            let direction = normal + sphere([u[2], plastic_sequence(ray ^ side as u32)[0]]);
            queries.push(RayQuery { origin: position + clear_distance * normal, direction });
            sources.push(side);
        }
    }
    for point in scene.eyes() {
        for ray in 0..RAYS_PER_POINT {
            let u = plastic_sequence(ray);
            queries.push(RayQuery { origin: point, direction: sphere([u[0], u[1]]) });
            sources.push(outside);
        }
    }
    let answers = rays.trace(buffers, &queries)?;
    let mut groups = Groups::new(side_count + 1);
    for (&source, answer) in sources.iter().zip(&answers) {
        let target = if answer.side == NO_SIDE { outside } else { answer.side as usize };
        // What is buried in a solid sees its inside, which must not join it with all else that does.
        if target == outside || surfaces[target / 2].side_is_active(target % 2 == 1) {
            groups.join(source, target);
        }
    }
    let reachable = groups.find(outside);
    for side in 0..side_count {
        if groups.find(side) != reachable {
            surfaces[side / 2].deactivate_side(side % 2 == 1);
        }
    }
    Ok(())
}

/// Point of a three-dimensional additive recurrence on the plastic number's generalisation.
pub(super) fn plastic_sequence(index: u32) -> [f32; 3] {
    // 1/g, 1/g² and 1/g³, g⁴ = g + 1.
    const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];
    STEPS.map(|step| (0.5 + f64::from(index) * step).fract() as f32)
}

/// Uniform point on the unit sphere.
pub(super) fn sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * u[1]).sin_cos();
    Vec3::new(radius * cos, radius * sin, z)
}

/// Disjoint sets.
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn find(&mut self, mut item: usize) -> usize {
        while self.0[item] != item {
            self.0[item] = self.0[self.0[item]];
            item = self.0[item];
        }
        item
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
    }
}
