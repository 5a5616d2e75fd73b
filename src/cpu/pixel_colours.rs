//! Reference of the pixels' colours.

use crate::cpu::rays::Geometry;
use crate::types::{NO_SIDE, View};
use glam::{DVec2, DVec3, Vec3};

/// Colour of a triangle's image where the ray of an image point meets its plane; `point` is in
/// pixels from the top left corner. `None` if the ray meets the plane's other side or a hole.
pub fn colour_through(geometry: Geometry<'_>, view: &View, point: DVec2, side: u32) -> Option<DVec3> {
    let [right, up, forward] = [view.right, view.up, view.forward].map(Vec3::as_dvec3);
    let ndc = point / DVec2::new(f64::from(view.width), f64::from(view.height)) * 2.0 - 1.0;
    let direction = forward + ndc.x * right - ndc.y * up;
    let triangle = side / 2;
    let facing = geometry.normal(side).as_dvec3().dot(direction);
    let apart = geometry.triangles[triangle as usize].positions[0] - view.position;
    let t = geometry.normal(side).as_dvec3().dot(apart.as_dvec3()) / facing;
    let barycentric = geometry.barycentric_at(triangle, view.position.as_dvec3() + t * direction);
    let is_seen = facing < 0.0 && !geometry.opacity.is_hole(triangle, barycentric);
    is_seen.then(|| geometry.colour(triangle, barycentric))
}

/// Mean colour of a pixel that shows that side, over `points`² image points; black if
/// it shows nothing.
pub fn pixel_colour(geometry: Geometry<'_>, view: &View, pixel: u32, side: u32, points: u32) -> DVec3 {
    if side == NO_SIDE {
        return DVec3::ZERO;
    }
    let corner = DVec2::new(f64::from(pixel % view.width), f64::from(pixel / view.width));
    let place = |index: u32| DVec2::new(f64::from(index % points) + 0.5, f64::from(index / points) + 0.5);
    let through = |index| colour_through(geometry, view, corner + place(index) / f64::from(points), side);
    let found: Vec<DVec3> = (0..points * points).filter_map(through).collect();
    found.iter().sum::<DVec3>() / found.len().max(1) as f64
}
