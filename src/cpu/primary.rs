//! Reference of the primary visibility.

use crate::cpu::rays::{Geometry, Hit};
use crate::types::View;
use glam::{DVec2, DVec3};

/// The surface at an image point.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// The hit itself.
    pub hit: Hit,
    /// 2·triangle + (1 if the back side).
    pub side: u32,
    /// Unit shading normal on the visible side.
    pub normal: DVec3,
    /// Area that the pixel covers at that depth, facing the camera, m².
    pub footprint: f64,
}

/// Traces the central ray of pixel (x, y). `None` if it leaves the scene.
pub fn primary(geometry: Geometry<'_>, view: &View, x: u32, y: u32) -> Option<Seen> {
    seen_through(geometry, view, DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5))
}

/// Direction through an image point, in pixels from the top left corner; of unit length along
/// the view axis.
pub fn direction_through(view: &View, point: DVec2) -> DVec3 {
    let across = point.x / f64::from(view.width) * 2.0 - 1.0;
    let down = point.y / f64::from(view.height) * 2.0 - 1.0;
    view.forward.as_dvec3() + across * view.right.as_dvec3() - down * view.up.as_dvec3()
}

/// Traces the ray of an image point, in pixels from the top left corner. `None` if it
/// leaves the scene.
pub fn seen_through(geometry: Geometry<'_>, view: &View, point: DVec2) -> Option<Seen> {
    let direction = direction_through(view, point);
    let hit = geometry.closest(view.position, direction)?;
    let surface = &geometry.surfaces[hit.triangle as usize];
    let side = geometry.side(hit.triangle, direction);
    let [n0, n1, n2] = [surface.n0, surface.n1, surface.n2].map(|normal| normal.as_dvec3());
    let shading = (hit.barycentric.x * n0 + hit.barycentric.y * n1 + hit.barycentric.z * n2).normalize();
    let footprint = f64::from(view.pixel_area) * hit.t * hit.t;
    Some(Seen { hit, side, normal: if side % 2 == 1 { -shading } else { shading }, footprint })
}
