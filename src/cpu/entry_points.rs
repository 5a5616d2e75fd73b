//! Twin of the entry points: the same points, side by side in the order of the strata.

use crate::cpu::rays::Geometry;
use crate::scene::hvds::Hvds;
use crate::types::PathVertex;
use glam::Vec3;

/// Places the points of every active side; `first_points` has the first point of each side, and the total.
pub fn entry_points(
    geometry: Geometry<'_>,
    hvds: &Hvds,
    sides: &[u32],
    first_points: &[u32],
) -> Vec<PathVertex> {
    let mut points = Vec::new();
    for (&side, run) in sides.iter().zip(first_points.windows(2)) {
        let count = run[1] - run[0];
        let [p0, p1, p2] = geometry.triangles[side as usize / 2].positions.map(Vec3::as_dvec3);
        for rank in 0..count {
            let shift = if side % 2 == 1 { 0.25 } else { 0.75 };
            let along = ((f64::from(rank) + shift) / f64::from(count)).sqrt();
            let v = f64::from(rank.reverse_bits() >> 8) / 16_777_216.0 + 0.5 / f64::from(count);
            let position = ((1.0 - along) * p0 + along * ((1.0 - v) * p1 + v * p2)).as_vec3();
            let cluster = geometry.cluster(hvds, position, side);
            points.push(PathVertex { position, side, incoming: Vec3::ZERO, weight: 1.0, cluster });
        }
    }
    points
}
