//! Reference of the direct illumination.

use crate::cpu::lights::{Intensities, PointSamples, is_lit, sample_light};
use crate::cpu::rays::Geometry;
use crate::cpu::receivers::receiver;
use crate::types::{LIGHT_AREA, LightSource, NO_SIDE, PixelSurface, SHAPE_SURFACE, SHAPE_TRIANGLE};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// Distance in units of the widest sample spacing of an area light. Receivers nearer than `NEAR`
/// take the closed form; from `NEAR` to twice `NEAR` it fades out.
const NEAR: f64 = 4.0;
/// Solid angle, sr, below which the closed form is not used: on the device its sum of arcs loses
/// all digits in f32.
const LARGE: f64 = 1e-4;

/// Unoccluded irradiance from a polygon of unit radiance, sr, for a receiver with that normal;
/// `corners` in order, relative to the receiver. [Lambert 1760]
pub fn polygon_irradiance(normal: DVec3, corners: &[DVec3]) -> f64 {
    let mut above = Vec::new();
    for (place, &from) in corners.iter().enumerate() {
        let to = corners[(place + 1) % corners.len()];
        let [before, after] = [from, to].map(|corner| normal.dot(corner));
        above.extend((before >= 0.0).then_some(from));
        above.extend((before * after < 0.0).then(|| from.lerp(to, before / (before - after))));
    }
    let arc = |(place, from): (usize, &DVec3)| {
        let to = above[(place + 1) % above.len()];
        let across = from.cross(to);
        match across.length() {
            0.0 => 0.0,
            sine => sine.atan2(from.dot(to)) / sine * normal.dot(across),
        }
    };
    0.5 * above.iter().enumerate().map(arc).sum::<f64>().abs()
}

/// Weight of the point samples of an area light for a receiver of that area. Near the light it
/// is the closed form over the unoccluded sum of the samples; further off it bounds 1/d². 1
/// for other lights.
pub fn sample_weight(light: &LightSource, position: DVec3, shading: DVec3, area_m2: f64) -> f64 {
    weight_of(light, &PointSamples::lattice(light), position, shading, area_m2)
}

fn weight_of(
    light: &LightSource,
    samples: &PointSamples,
    position: DVec3,
    shading: DVec3,
    area_m2: f64,
) -> f64 {
    let count = samples.points.len() as f64;
    if light.kind != LIGHT_AREA {
        return 1.0;
    }
    let [u, v] = [light.edge_u, light.edge_v].map(Vec3::as_dvec3);
    let (corner, area) = (light.position.as_dvec3() - position, f64::from(light.area));
    let distance = (corner + 0.5 * (u + v)).length().max(1e-12);
    let spacing = u.length().max(v.length()) / (count * f64::from(samples.sets)).sqrt();
    let spacings = (distance - 0.5 * (u.length() + v.length())) / spacing;
    let is_large = area > LARGE * distance.powi(2);
    let fraction = if is_large { (2.0 - spacings / NEAR).clamp(0.0, 1.0) } else { 0.0 };
    // [Wallace]
    let afar = 1.0 / (1.0 + area_m2 / PI / distance.powi(2));
    let white = LightSource { emission: Vec3::ONE, ..*light };
    let open = |place: &DVec2| {
        let found = sample_light(&white, Intensities::NONE, position, *place)?;
        Some(shading.dot(found.direction).max(0.0) * found.irradiance.x)
    };
    let sum = samples.points.iter().filter_map(open).sum::<f64>() / count;
    if fraction == 0.0 || sum == 0.0 {
        return afar;
    }
    let whole = match light.shape & SHAPE_TRIANGLE {
        0 => polygon_irradiance(shading, &[corner, corner + u, corner + u + v, corner + v]),
        _ => polygon_irradiance(shading, &[corner, corner + u, corner + v]),
    };
    afar + fraction * (whole / (sum * (1.0 + whole * area_m2 / (PI * area))) - afar)
}

/// Point samples of a light that illuminate a surface point of that area (m²). Each has its
/// number, the unit direction towards it and its irradiance per unit of the light's emission.
pub fn lit_samples(
    geometry: Geometry<'_>,
    light: &LightSource,
    position: Vec3,
    normal: Vec3,
    shading: Vec3,
    area_m2: f32,
) -> Vec<(u32, DVec3, f64)> {
    let lit = |(_, is_lit): &(_, bool)| *is_lit;
    let samples = PointSamples::lattice(light);
    let reached = reached(geometry, light, &samples, position, normal, shading, area_m2);
    reached.into_iter().filter(lit).map(|(sample, _)| sample).collect()
}

/// Point samples that illuminate a surface point unless something hides them, and whether they do.
fn reached(
    geometry: Geometry<'_>,
    light: &LightSource,
    samples: &PointSamples,
    position: Vec3,
    normal: Vec3,
    shading: Vec3,
    area_m2: f32,
) -> Vec<((u32, DVec3, f64), bool)> {
    // Rounding decides which side of the emitting surface a receiver on it is on.
    let height = light.axis.dot(light.position - position).abs();
    if light.shape & SHAPE_SURFACE != 0 && height <= 4.0 * geometry.clear_distance.at(position) {
        return Vec::new();
    }
    let white = LightSource { emission: Vec3::ONE, ..*light };
    let weight = weight_of(light, samples, position.as_dvec3(), shading.as_dvec3(), area_m2.into());
    let sample = |(number, place): (u32, &DVec2)| {
        let found = sample_light(&white, Intensities::NONE, position.as_dvec3(), *place)?;
        let cosine = shading.as_dvec3().dot(found.direction);
        let faces = cosine > 0.0 && normal.as_dvec3().dot(found.direction) > 0.0;
        // [Wallace]
        let excess = f64::from(area_m2) / PI / found.distance.powi(2);
        let bounded = if light.kind == LIGHT_AREA { weight } else { 1.0 / (1.0 + excess) };
        let factor = cosine * found.irradiance.x * bounded / samples.points.len() as f64;
        let is_lit = faces && is_lit(geometry, position, normal, &found);
        faces.then_some(((number, found.direction, factor), is_lit))
    };
    (0..).zip(&samples.points).filter_map(sample).collect()
}

/// Irradiance of a surface point of that area (m²) per unit of a light's emission, from all
/// its point samples.
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
pub fn irradiance(geometry: Geometry<'_>, light: &LightSource, pixel: &PixelSurface) -> f64 {
    irradiance_by(geometry, light, &PointSamples::lattice(light), pixel)
}

/// As [`irradiance`], by other samples of the light.
pub fn irradiance_by(
    geometry: Geometry<'_>,
    light: &LightSource,
    samples: &PointSamples,
    pixel: &PixelSurface,
) -> f64 {
    seen_samples(geometry, light, samples, pixel)
        .iter()
        .filter(|sample| sample.1)
        .map(|sample| sample.0)
        .sum()
}

/// Whether a pixel sees a part of a light and not all of it, by its samples and by probes.
pub fn is_in_penumbra(geometry: Geometry<'_>, light: &LightSource, pixel: &PixelSurface) -> bool {
    sees_a_part(geometry, light, &[PointSamples::lattice(light), PointSamples::probes()], pixel)
}

/// Whether a pixel sees a part of those samples of a light.
pub fn sees_a_part(
    geometry: Geometry<'_>,
    light: &LightSource,
    samples: &[PointSamples],
    pixel: &PixelSurface,
) -> bool {
    let sees = |samples: &PointSamples| seen_samples(geometry, light, samples, pixel);
    let seen: Vec<_> = samples.iter().flat_map(sees).collect();
    seen.iter().any(|sample| sample.1) && seen.iter().any(|sample| !sample.1)
}

/// The irradiance that samples bring to a pixel if nothing hides them, and whether they do.
fn seen_samples(
    geometry: Geometry<'_>,
    light: &LightSource,
    samples: &PointSamples,
    pixel: &PixelSurface,
) -> Vec<(f64, bool)> {
    if pixel.side == NO_SIDE {
        return Vec::new();
    }
    let at = receiver(geometry, pixel.position, pixel.side, pixel.normal);
    let reached = reached(geometry, light, samples, at.position, at.normal, pixel.normal, pixel.footprint);
    reached.into_iter().map(|((_, _, factor), is_lit)| (factor, is_lit)).collect()
}

/// Direct irradiance at a pixel, W/m².
pub fn direct(geometry: Geometry<'_>, lights: &[LightSource], pixel: &PixelSurface) -> DVec3 {
    lights.iter().map(|light| irradiance(geometry, light, pixel) * light.emission.as_dvec3()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance by a midpoint rule with `parts` points along each edge.
    fn by_parts(normal: DVec3, [corner, u, v]: [DVec3; 3], parts: u32) -> f64 {
        let area = u.cross(v);
        let part = |index: u32| {
            let [x, y] =
                [index % parts, index / parts].map(|place| (f64::from(place) + 0.5) / f64::from(parts));
            let at = corner + x * u + y * v;
            let distance2 = at.length_squared();
            normal.dot(at).max(0.0) * area.dot(at).abs() / distance2.powi(2)
        };
        (0..parts * parts).map(part).sum::<f64>() / f64::from(parts * parts)
    }

    fn outline([corner, u, v]: [DVec3; 3]) -> [DVec3; 4] {
        [corner, corner + u, corner + u + v, corner + v]
    }

    #[test]
    fn parallelograms_light_as_the_sum_of_their_parts_does() {
        let normal = DVec3::new(0.36, 0.48, 0.8);
        for place in [
            [[-0.5, -0.5, 1.0], [1.0, 0.0, 0.0], [0.3, 1.0, 0.2]],
            [[-0.5, -0.5, -0.2], [1.0, 0.0, 0.0], [0.0, 0.3, 1.4]],
            [[0.4, -2.0, -2.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]],
            [[-1.0, -1.0, -1.1], [2.0, 0.0, 0.0], [0.0, 2.0, 0.1]],
            [[-3.0, -3.0, 0.4], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0]],
        ] {
            let place = place.map(DVec3::from);
            let (whole, parts) = (polygon_irradiance(normal, &outline(place)), by_parts(normal, place, 2000));
            assert!((whole - parts).abs() < 1e-3 * parts + 1e-6, "{whole}, {parts} in parts");
        }
        // The whole sky; nothing of it.
        let sky = [DVec3::new(-1.0, -1.0, 1e-6), 2.0 * DVec3::X, 2.0 * DVec3::Y];
        assert!((polygon_irradiance(DVec3::Z, &outline(sky)) - PI).abs() < 1e-5);
        assert_eq!(polygon_irradiance(DVec3::NEG_Z, &outline(sky)), 0.0);
    }
}
