//! Twin of the direct illumination.

use crate::cpu::rays::Geometry;
use crate::types::{LightSource, NO_SIDE, PixelSurface};
use glam::DVec3;
use std::f64::consts::PI;

/// Direct irradiance at a pixel, W/m².
pub fn direct(geometry: Geometry<'_>, lights: &[LightSource], pixel: &PixelSurface) -> DVec3 {
    let mut irradiance = DVec3::ZERO;
    if pixel.side == NO_SIDE {
        return irradiance;
    }
    let normal = geometry.normal(pixel.side);
    for light in lights {
        let to_light = light.position.as_dvec3() - pixel.position.as_dvec3();
        let facing = pixel.normal.as_dvec3().dot(to_light);
        let faces = facing > 0.0 && normal.as_dvec3().dot(to_light) > 0.0;
        if faces && geometry.is_visible(pixel.position, normal, light.position) {
            let disc = f64::from(pixel.footprint) / PI;
            let cosine = facing / to_light.length();
            irradiance += light.emission.as_dvec3() * cosine / (to_light.length_squared() + disc);
        }
    }
    irradiance
}
