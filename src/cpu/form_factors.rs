//! Twin of the form factors.

use crate::cpu::rays::Geometry;
use glam::Vec3;
use std::f64::consts::PI;

/// Irradiance at a point of a side from a point light of 1 W/sr, 1/m²: point to disc of `area_m2`.
pub fn form_factor(geometry: Geometry<'_>, position: Vec3, side: u32, light: Vec3, area_m2: f32) -> f64 {
    let normal = geometry.normal(side);
    let to_light = light.as_dvec3() - position.as_dvec3();
    let facing = normal.as_dvec3().dot(to_light);
    if facing <= 0.0 || !geometry.is_visible(position, normal, light) {
        return 0.0;
    }
    // [Wallace]
    facing / to_light.length() / (to_light.length_squared() + f64::from(area_m2) / PI)
}
