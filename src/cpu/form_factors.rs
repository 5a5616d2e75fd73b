//! Reference of the form factors.

use crate::cpu::direct::light_factor;
use crate::cpu::rays::Geometry;
use crate::types::LightSource;
use glam::Vec3;

/// Irradiance at a point of a side, with an area of `area_m2`, per unit of a light's emission.
pub fn form_factor(
    geometry: Geometry<'_>,
    position: Vec3,
    side: u32,
    light: &LightSource,
    area_m2: f32,
) -> f64 {
    let normal = geometry.normal(side);
    light_factor(geometry, light, position, normal, normal, area_m2)
}
