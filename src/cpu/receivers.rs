//! Reference of the points at which direct light meets surfaces that the camera sees.

use crate::cpu::rays::Geometry;
use glam::{DVec3, Vec3};

/// A point that takes light.
#[derive(Clone, Copy, Debug)]
pub struct Receiver {
    /// Where shadow rays start, metres.
    pub position: Vec3,
    /// Unit normal of the surface there that occludes.
    pub normal: Vec3,
}

/// The receiver at a point of a side with that shading normal. On a rounded surface it is lifted to
/// the smooth surface around the facet. [Hanika 2021]
pub fn receiver(geometry: Geometry<'_>, position: Vec3, side: u32, shading: Vec3) -> Receiver {
    let surface = &geometry.surfaces[side as usize / 2];
    let flat = Receiver { position, normal: geometry.normal(side) };
    if !surface.is_rounded() {
        return flat;
    }
    let corners = geometry.triangles[side as usize / 2].positions.map(Vec3::as_dvec3);
    let turn = if side % 2 == 1 { -1.0 } else { 1.0 };
    let normals = [surface.n0, surface.n1, surface.n2].map(|normal| turn * normal.as_dvec3());
    let (point, across) = (position.as_dvec3(), (corners[1] - corners[0]).cross(corners[2] - corners[0]));
    let lift: DVec3 = (0..3)
        .map(|corner| {
            let [next, last] = [corners[(corner + 1) % 3], corners[(corner + 2) % 3]];
            let share = (next - point).cross(last - point).dot(across) / across.length_squared();
            let below = -normals[corner].dot(point - corners[corner]);
            share.max(0.0) * below.max(0.0) * normals[corner]
        })
        .sum();
    if lift == DVec3::ZERO {
        return flat;
    }
    Receiver { position: (point + lift).as_vec3(), normal: shading }
}
