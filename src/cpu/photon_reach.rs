//! Reference of the reach of irradiance points.

use crate::cpu::hemisphere::frame;
use crate::cpu::photons::{SAME_PLANE, SurfacePoint, sector_direction};
use crate::cpu::rays::Geometry;

/// Exact reach of a point in each sector, in 1/255 of the radius. `None` if no wall is that near.
pub fn photon_reach(geometry: Geometry<'_>, point: SurfacePoint, radius: f32) -> [Option<f64>; 16] {
    let above =
        geometry.offset_origin(point.position, point.normal) + SAME_PLANE as f32 * radius * point.normal;
    std::array::from_fn(|sector| {
        let direction = frame(point.normal) * sector_direction(sector).extend(0.0);
        let hit = geometry.closest(above, direction)?;
        (hit.t < f64::from(radius)).then_some(255.0 * hit.t / f64::from(radius))
    })
}
