//! Mirrors `glsl/include/lights.glsl`: light sources seen from a surface point.

use crate::cpu::hemisphere::frame;
use crate::cpu::rays::Geometry;
use crate::scene::luminaire::Grid;
use crate::types::{
    LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_GROUP, LIGHT_SKY, LIGHT_SPOT, LightSource, SHAPE_TRIANGLE,
    SHAPE_TWO_SIDED,
};
use glam::{DVec2, DVec3, Vec3};

/// A direction in which a light may be seen.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit, towards the light.
    pub direction: DVec3,
    /// Distance in metres; infinite for a directional light.
    pub distance: f64,
    /// Irradiance of a facing surface, before visibility, over the sample's pdf, W/m².
    pub irradiance: DVec3,
}

/// Values that follow the rows of a table of lights: measured intensities.
#[derive(Clone, Copy, Debug, Default)]
pub struct Intensities<'a> {
    /// Word of the table at which the values start.
    pub first_word: usize,
    /// The values, from there on.
    pub values: &'a [f32],
}

impl<'a> Intensities<'a> {
    /// Of a table that has none.
    pub const NONE: Self = Self { first_word: 0, values: &[] };

    /// Azimuth of the plane C0 of a measured spot, radians, and the nodes of its intensities.
    fn of(self, light: &LightSource) -> (f64, Grid<'a>) {
        let own = &self.values[light.area as usize - self.first_word..];
        let [rows, columns] = [own[0], own[1]].map(|count| count as u32);
        let fractions = &self.values[own[3] as usize - self.first_word..][..(rows * columns) as usize];
        (own[2].into(), Grid { rows, columns, widest: light.outer_angle.into(), fractions })
    }

    /// Fraction of a spot's intensity in a unit direction of travel.
    pub fn fraction(self, light: &LightSource, direction: DVec3) -> f64 {
        if light.area == 0.0 {
            return spot_falloff(light, direction);
        }
        let (c0, grid) = self.of(light);
        let local = frame(light.axis).transpose() * direction;
        let axial = local.truncate().length().atan2(local.z);
        grid.fraction(axial, c0 - local.y.atan2(local.x))
    }

    /// Integral of the measured fraction over all directions, sr. `None` if nothing was measured.
    pub fn steradians(self, light: &LightSource) -> Option<f64> {
        (light.kind == LIGHT_SPOT && light.area > 0.0).then(|| self.of(light).1.steradians())
    }
}

/// Fraction of a spot's intensity in a unit direction of travel; linear in the angle between
/// the two half-angles.
pub fn spot_falloff(light: &LightSource, direction: DVec3) -> f64 {
    let axis = light.axis.as_dvec3();
    let angle = axis.cross(direction).length().atan2(axis.dot(direction));
    let [inner, outer] = [light.inner_angle, light.outer_angle].map(f64::from);
    if angle <= inner {
        1.0
    } else if angle < outer {
        (outer - angle) / (outer - inner)
    } else {
        0.0
    }
}

/// Image of `u` in the unit square, on the triangle (0,0), (1,0), (0,1) if the light is one.
pub fn on_shape(light: &LightSource, u: DVec2) -> DVec2 {
    if light.shape & SHAPE_TRIANGLE == 0 {
        return u;
    }
    let root = u.x.sqrt();
    DVec2::new(1.0 - root, u.y * root)
}

/// Cosine at an area light that emits in a direction; zero or less if that side does not emit.
pub fn emitted_cosine(light: &LightSource, direction: DVec3) -> f64 {
    let cosine = light.axis.as_dvec3().dot(direction);
    if light.shape & SHAPE_TWO_SIDED == 0 { cosine } else { cosine.abs() }
}

/// Unit direction towards a point of a part of the sky.
pub fn sky_direction(light: &LightSource, u: DVec2) -> DVec3 {
    let [azimuth, width, height] = light.edge_u.to_array().map(f64::from);
    let (sin, cos) = (azimuth + u.x * width).sin_cos();
    let height = height + u.y * f64::from(light.outer_angle);
    let radius = (1.0 - height * height).max(0.0).sqrt();
    DVec3::new(radius * sin, height, -radius * cos)
}

/// A part of a light of several, chosen by power with the random number `u`; its emission is
/// divided by the probability. A light of one part is returned as it is.
pub fn chosen_part(light: &LightSource, table: &[LightSource], u: f64) -> LightSource {
    if light.kind != LIGHT_GROUP {
        return *light;
    }
    let parts = &table[light.stride as usize..][..light.modulus as usize];
    let place = parts.partition_point(|part| f64::from(part.inner_angle) <= u).min(parts.len() - 1);
    let before = if place == 0 { 0.0 } else { parts[place - 1].inner_angle };
    let part = parts[place];
    LightSource { emission: light.emission * (part.relative / (part.inner_angle - before)), ..part }
}

/// Samples a light as seen from `position`; `u` selects the point of an area light, uniformly, and
/// is unused for other kinds. `None` if the light does not reach that point.
pub fn sample_light(
    light: &LightSource,
    intensities: Intensities<'_>,
    position: DVec3,
    u: DVec2,
) -> Option<LightSample> {
    let emission = light.emission.as_dvec3();
    if light.kind == LIGHT_DIRECTIONAL {
        let direction = -light.axis.as_dvec3();
        return Some(LightSample { direction, distance: f64::INFINITY, irradiance: emission });
    }
    if light.kind == LIGHT_SKY {
        let (direction, irradiance) = (sky_direction(light, u), f64::from(light.area) * emission);
        return Some(LightSample { direction, distance: f64::INFINITY, irradiance });
    }
    let u = on_shape(light, u);
    let source = light.position.as_dvec3() + u.x * light.edge_u.as_dvec3() + u.y * light.edge_v.as_dvec3();
    let to_light = source - position;
    let distance = to_light.length();
    if distance <= 1e-12 {
        return None;
    }
    let direction = to_light / distance;
    let factor = match light.kind {
        LIGHT_SPOT => intensities.fraction(light, -direction),
        LIGHT_AREA => f64::from(light.area) * emitted_cosine(light, -direction),
        _ => 1.0,
    };
    let irradiance = emission * factor / distance.powi(2);
    (factor > 0.0).then_some(LightSample { direction, distance, irradiance })
}

/// Point sample number `number` of a light, for [`sample_light`], from a lattice with one sample in
/// every row and every column.
pub fn lattice_point(light: &LightSource, number: u32) -> DVec2 {
    let skipped = light.modulus - light.samples;
    let row = (number + skipped) * light.stride % light.modulus - skipped;
    let place = DVec2::new(f64::from(number), f64::from(row));
    (place + 0.5) / f64::from(light.samples)
}

/// Point samples of a light, for [`sample_light`].
pub struct PointSamples {
    /// Places on the light.
    pub points: Vec<DVec2>,
    /// Number of such sets that receivers close together have.
    pub sets: u32,
}

impl PointSamples {
    /// The lattice, which is the same for all receivers.
    pub fn lattice(light: &LightSource) -> Self {
        Self { points: (0..light.samples).map(|number| lattice_point(light, number)).collect(), sets: 1 }
    }

    /// The samples of image point `number` of a pixel. From four on, they are every sixteenth point
    /// of a lattice with that step.
    pub fn of_image_point(count: u32, number: u32, step: u32) -> Self {
        let sets = if count < 4 { 1 } else { 16 };
        let place = |column: u32| {
            let row = column * step % (sets * count);
            (DVec2::new(f64::from(column), f64::from(row)) + 0.5) / f64::from(sets * count)
        };
        let columns = (0..count).map(|sample| number % sets + sets * sample);
        Self { points: columns.map(place).collect(), sets }
    }

    /// A grid from edge to edge, slightly inside. It tells whether something hides a part.
    pub fn probes() -> Self {
        let inset = |step: u32| 0.02 + 0.96 * f64::from(step) / 3.0;
        let places = (0..16).map(|number| DVec2::new(inset(number % 4), inset(number / 4)));
        Self { points: places.collect(), sets: 1 }
    }
}

/// Whether nothing is between a surface point (on the side that `normal` faces) and the light.
pub fn is_lit(geometry: Geometry<'_>, position: Vec3, normal: Vec3, light: &LightSample) -> bool {
    let origin = geometry.offset_origin(position, normal);
    if light.distance.is_infinite() {
        return geometry.closest(origin, light.direction).is_none();
    }
    let ray = position.as_dvec3() + light.distance * light.direction - origin.as_dvec3();
    geometry.closest(origin, ray).is_none_or(|hit| hit.t >= 0.99999)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spot_falls_linearly_in_the_angle() {
        let light = LightSource {
            kind: LIGHT_SPOT,
            axis: Vec3::NEG_Z,
            inner_angle: 0.25,
            outer_angle: 0.75,
            ..LightSource::point(Vec3::Z, Vec3::splat(4.0))
        };
        for (angle, fraction) in
            [(0.0, 1.0), (0.2499, 1.0), (0.35, 0.8), (0.5, 0.5), (0.7, 0.1), (0.76, 0.0), (3.0, 0.0)]
        {
            let (sin, cos) = f64::sin_cos(angle);
            let found = sample_light(
                &light,
                Intensities::NONE,
                DVec3::new(2.0 * sin, 0.0, 1.0 - 2.0 * cos),
                DVec2::ZERO,
            );
            let irradiance = found.map_or(0.0, |found| found.irradiance.x);
            assert!((irradiance - fraction).abs() < 1e-9, "{angle}: {irradiance}, {fraction}");
        }
        let hard = LightSource { inner_angle: 0.75, ..light };
        assert_eq!(
            [0.74, 0.76].map(|a: f64| spot_falloff(&hard, DVec3::new(a.sin(), 0.0, -a.cos()))),
            [1.0, 0.0]
        );
    }

    #[test]
    fn a_light_on_the_receiver_is_no_sample_and_an_area_light_emits_forward_only() {
        let light = LightSource::point(Vec3::X, Vec3::ONE);
        assert!(sample_light(&light, Intensities::NONE, DVec3::X, DVec2::ZERO).is_none());
        let area = LightSource {
            kind: LIGHT_AREA,
            axis: Vec3::Z,
            area: 2.0,
            edge_u: Vec3::X,
            edge_v: 2.0 * Vec3::Y,
            ..LightSource::point(Vec3::ZERO, Vec3::ONE)
        };
        let at = |position| sample_light(&area, Intensities::NONE, position, DVec2::splat(0.5));
        assert!(at(DVec3::new(0.5, 1.0, -3.0)).is_none());
        let found = at(DVec3::new(0.5, 1.0, 3.0)).unwrap();
        assert_eq!((found.direction, found.distance), (DVec3::NEG_Z, 3.0));
        assert!((found.irradiance.x - 2.0 / 9.0).abs() < 1e-12);
    }
}
