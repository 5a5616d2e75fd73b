//! Mirrors `glsl/include/emission.glsl`: rays that leave light sources, and their power.

use crate::cpu::hemisphere::frame;
use crate::cpu::lights::{Intensities, on_shape, sky_direction};
use crate::cpu::sampling::sample_cosine;
use crate::types::{
    LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_GROUP, LIGHT_SKY, LIGHT_SPOT, LightSource, SHAPE_TWO_SIDED,
};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};

/// A ray that leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct EmittedRay {
    /// Position on the light, metres.
    pub origin: DVec3,
    /// Unit vector along the ray.
    pub direction: DVec3,
    /// Flux over the ray's pdf, W: the mean over all rays is the light's power.
    pub flux: DVec3,
}

/// ∫ falloff dω of a spot, sr.
fn spot_solid_angle(light: &LightSource) -> f64 {
    let [inner, outer] = [light.inner_angle, light.outer_angle].map(f64::from);
    // 1 - cos of the mean angle and of half the difference, so that narrow cones do not cancel.
    let [mean, half] = [0.5 * (outer + inner), 0.5 * (outer - inner)];
    let lost = if half < 1e-3 { half * half / 6.0 } else { 1.0 - half.sin() / half };
    TAU * (2.0 * (0.5 * mean).sin().powi(2) + mean.cos() * lost)
}

/// Power that a light sends into the scene, W. For a light at infinity: through the disc of the
/// scene's bounding sphere. `table` has the parts of the light.
pub fn light_power(
    light: &LightSource,
    (table, intensities): (&[LightSource], Intensities<'_>),
    scene_radius: f64,
) -> DVec3 {
    let factor = match light.kind {
        LIGHT_SPOT => intensities.steradians(light).unwrap_or_else(|| spot_solid_angle(light)),
        LIGHT_AREA if light.shape & SHAPE_TWO_SIDED != 0 => 2.0 * PI * f64::from(light.area),
        LIGHT_AREA => PI * f64::from(light.area),
        LIGHT_DIRECTIONAL => PI * scene_radius.powi(2),
        LIGHT_SKY => PI * scene_radius.powi(2) * f64::from(light.area),
        LIGHT_GROUP => {
            let parts = &table[light.stride as usize..][..light.modulus as usize];
            let power = |part: &LightSource| {
                let unit = LightSource { emission: Vec3::splat(part.relative), ..*part };
                light_power(&unit, (table, intensities), scene_radius).x
            };
            parts.iter().map(power).sum()
        }
        _ => 4.0 * PI,
    };
    factor * light.emission.as_dvec3()
}

/// Samples a ray. `u` selects its direction, or the position on the disc of a light at infinity;
/// `v` selects the position on an area light and the side, or the direction of a part of the sky.
pub fn emit(
    light: &LightSource,
    intensities: Intensities<'_>,
    (scene_centre, scene_radius): (DVec3, f64),
    u: DVec2,
    v: DVec3,
) -> EmittedRay {
    let (sin, cos) = (TAU * u.y).sin_cos();
    let (position, axis) = (light.position.as_dvec3(), light.axis.as_dvec3());
    let flux = light_power(light, (&[], intensities), scene_radius);
    match light.kind {
        LIGHT_DIRECTIONAL | LIGHT_SKY => {
            let is_sky = light.kind == LIGHT_SKY;
            let axis = if is_sky { -sky_direction(light, v.truncate()) } else { axis };
            let on_disc = frame(axis.as_vec3()) * DVec3::new(u.x.sqrt() * cos, u.x.sqrt() * sin, -1.0);
            EmittedRay { origin: scene_centre + scene_radius * on_disc, direction: axis, flux }
        }
        LIGHT_AREA => {
            let place = on_shape(light, v.truncate());
            let origin = position + place.x * light.edge_u.as_dvec3() + place.y * light.edge_v.as_dvec3();
            let is_back = light.shape & SHAPE_TWO_SIDED != 0 && v.z < 0.5;
            let axis = if is_back { -light.axis } else { light.axis };
            EmittedRay { origin, direction: frame(axis) * sample_cosine(u), flux }
        }
        kind => {
            let is_spot = kind == LIGHT_SPOT;
            let cap = if is_spot { 2.0 * (0.5 * f64::from(light.outer_angle)).sin().powi(2) } else { 2.0 };
            let height = cap * u.x;
            let radius = (height * (2.0 - height)).sqrt();
            let local = DVec3::new(radius * cos, radius * sin, 1.0 - height);
            let direction = if is_spot { frame(light.axis) * local } else { local };
            let falloff = if is_spot { intensities.fraction(light, direction) } else { 1.0 };
            EmittedRay { origin: position, direction, flux: TAU * cap * falloff * light.emission.as_dvec3() }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::sample_3d;
    use glam::Vec3;

    /// The mean flux of the rays is the power, and the power is the closed form.
    #[test]
    fn rays_carry_the_power_of_their_light() {
        let spot = |inner_angle, outer_angle| LightSource {
            kind: LIGHT_SPOT,
            axis: Vec3::new(0.48, 0.6, -0.64),
            inner_angle,
            outer_angle,
            ..LightSource::point(Vec3::ZERO, Vec3::splat(3.0))
        };
        let [i, o] = [0.3, 1.1];
        let smooth = 3.0 * TAU * (1.0 - (f64::sin(o) - f64::sin(i)) / (o - i));
        let narrow = 3.0 * PI * 1e-4 * 1e-4;
        for (light, power) in [
            (LightSource::point(Vec3::ZERO, Vec3::splat(3.0)), 12.0 * PI),
            (spot(0.3, 1.1), smooth),
            (spot(0.7, 0.7), 3.0 * TAU * (1.0 - f64::cos(0.7))),
            (spot(1e-4, 1e-4), narrow),
        ] {
            assert!(
                (light_power(&light, (&[], Intensities::NONE), 1.0).x / power - 1.0).abs() < 1e-6,
                "{power}"
            );
            let rays = 1 << 12;
            let flux = |index| {
                let u = sample_3d(index, 5).truncate().as_dvec2();
                let ray = emit(&light, Intensities::NONE, (DVec3::ZERO, 1.0), u, DVec3::ZERO);
                assert!((ray.direction.length() - 1.0).abs() < 1e-6);
                ray.flux.x
            };
            let mean = (0..rays).map(flux).sum::<f64>() / f64::from(rays);
            assert!((mean / power - 1.0).abs() < 2e-3, "{mean}, {power}");
        }
    }

    #[test]
    fn a_light_at_infinity_covers_the_scene() {
        let light = LightSource {
            kind: LIGHT_DIRECTIONAL,
            axis: Vec3::new(0.0, -0.6, 0.8),
            ..LightSource::point(Vec3::ZERO, Vec3::ONE)
        };
        let centre = DVec3::new(1.0, 2.0, 3.0);
        assert!((light_power(&light, (&[], Intensities::NONE), 2.0).x - 4.0 * PI).abs() < 1e-9);
        for index in 0..64 {
            let ray = emit(
                &light,
                Intensities::NONE,
                (centre, 2.0),
                sample_3d(index, 1).truncate().as_dvec2(),
                DVec3::ZERO,
            );
            let along = (ray.origin - centre).dot(ray.direction);
            let across = (ray.origin - centre - along * ray.direction).length();
            assert!((along + 2.0).abs() < 1e-5 && across <= 2.0 + 1e-5, "{along}, {across}");
        }
    }
}
