//! Twin of the direct illumination.

use crate::cpu::lights::{is_lit, lattice_point, sample_light};
use crate::cpu::rays::Geometry;
use crate::types::{LightSource, NO_SIDE, PixelSurface};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Of each point sample of a light that lights a surface point of that extent (m²): its number, the unit direction towards it and
/// its share of the irradiance per unit of the light's emission.
pub fn lit_samples(
    geometry: Geometry<'_>,
    light: &LightSource,
    position: Vec3,
    normal: Vec3,
    shading: Vec3,
    area_m2: f32,
) -> Vec<(u32, DVec3, f64)> {
    let white = LightSource { emission: Vec3::ONE, ..*light };
    let sample = |number: u32| {
        let found = sample_light(&white, position.as_dvec3(), lattice_point(light, number))?;
        let cosine = shading.as_dvec3().dot(found.direction);
        let faces = cosine > 0.0 && normal.as_dvec3().dot(found.direction) > 0.0;
        // [Wallace]
        let bound = 1.0 + f64::from(area_m2) / PI / found.distance.powi(2);
        let factor = cosine * found.irradiance.x / bound / f64::from(light.samples);
        (faces && is_lit(geometry, position, normal, &found)).then_some((number, found.direction, factor))
    };
    (0..light.samples).filter_map(sample).collect()
}

/// Irradiance of a surface point of that extent (m²) per unit of a light's emission, from all its point samples.
pub fn light_factor(
    geometry: Geometry<'_>,
    light: &LightSource,
    position: Vec3,
    normal: Vec3,
    shading: Vec3,
    area_m2: f32,
) -> f64 {
    lit_samples(geometry, light, position, normal, shading, area_m2).iter().map(|sample| sample.2).sum()
}

/// Direct irradiance at a pixel per unit of a light's emission.
pub fn layer(geometry: Geometry<'_>, light: &LightSource, pixel: &PixelSurface) -> f64 {
    match pixel.side {
        NO_SIDE => 0.0,
        side => {
            let normal = geometry.normal(side);
            light_factor(geometry, light, pixel.position, normal, pixel.normal, pixel.footprint)
        }
    }
}

/// Direct irradiance at a pixel, W/m².
pub fn direct(geometry: Geometry<'_>, lights: &[LightSource], pixel: &PixelSurface) -> DVec3 {
    lights.iter().map(|light| layer(geometry, light, pixel) * light.emission.as_dvec3()).sum()
}
