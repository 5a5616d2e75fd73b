//! Reference of the ambient accessibility of path vertices.

use crate::cpu::hemisphere::{Strata, frame};
use crate::cpu::rays::Geometry;
use crate::cpu::sampling::hash_pair;
use crate::scene::Naming;
use glam::Vec3;

/// Returns how many rays from a point on a side meet nothing within `reach` metres.
pub fn open_rays(
    geometry: Geometry<'_>,
    strata: Strata,
    (position, side): (Vec3, u32),
    reach: f32,
    (seed, naming): (u32, Naming),
) -> u32 {
    let [x, y, z] = position.to_array().map(f32::to_bits);
    let name = hash_pair(x, hash_pair(y, hash_pair(z, side & naming.side_bits())));
    let normal = geometry.normal(side);
    let origin = geometry.offset_origin(position, normal);
    let is_open = |ray: &u32| {
        let hit = geometry.closest(origin, frame(normal) * strata.direction(*ray, name, seed));
        hit.is_none_or(|hit| hit.t > f64::from(reach))
    };
    (0..strata.rays()).filter(is_open).count() as u32
}
