//! Reference of the form factors of the sky.

use crate::cpu::hemisphere::{Strata, frame};
use crate::cpu::rays::Geometry;
use crate::scene::octahedral;
use glam::Vec3;
use std::f64::consts::PI;

/// Form factor, sr, of an entry point with that random stream index, from the octahedral `table`
/// of `table_side`² radiances.
pub fn sky_factor(
    geometry: Geometry<'_>,
    strata: Strata,
    (position, side, stream): (Vec3, u32, u32),
    (table, table_side): (&[f32], u32),
    seed: u32,
) -> f64 {
    let normal = geometry.normal(side);
    let origin = geometry.offset_origin(position, normal);
    let directions =
        (0..strata.rays()).map(|ray| (frame(normal) * strata.direction(ray, stream, seed)).normalize());
    let open = directions.filter(|direction| geometry.closest(origin, *direction).is_none());
    let radiances = open.map(|direction| f64::from(table[octahedral::cell(direction, table_side) as usize]));
    PI / f64::from(strata.rays()) * radiances.sum::<f64>()
}
