//! Reference of the shafts: the occluders between a light and some points, by a test
//! of every triangle.

use crate::cpu::lights::{Intensities, lattice_point, sample_light};
use crate::cpu::rays::{Geometry, intersect};
use crate::types::LightSource;
use glam::Vec3;
use std::collections::BTreeSet;

/// Triangles that hide a point sample of a light from one of the points, if that faces it; points
/// are given by position and side.
pub fn hiders(geometry: Geometry<'_>, light: &LightSource, points: &[(Vec3, u32)]) -> BTreeSet<u32> {
    let mut found = BTreeSet::new();
    for &(position, side) in points {
        let normal = geometry.normal(side);
        let origin = geometry.offset_origin(position, normal).as_dvec3();
        for number in 0..light.samples {
            let Some(sample) =
                sample_light(light, Intensities::NONE, position.as_dvec3(), lattice_point(light, number))
            else {
                continue;
            };
            if normal.as_dvec3().dot(sample.direction) <= 0.0 {
                continue;
            }
            let (ray, end) = match sample.distance.is_infinite() {
                true => (sample.direction, f64::INFINITY),
                false => (position.as_dvec3() + sample.distance * sample.direction - origin, 0.99999),
            };
            let hits = (0..).zip(geometry.triangles).filter(|(_, triangle)| {
                intersect(triangle.positions, origin, ray).is_some_and(|(t, _)| t < end)
            });
            found.extend(hits.map(|(index, _)| index));
        }
    }
    found
}
