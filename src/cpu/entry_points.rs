//! Reference of the entry points: the same points, patch by patch in the order of the strata.

use crate::cpu::rays::Geometry;
use crate::cpu::sampling::sample_3d;
use crate::scene::hvds::Hvds;
use crate::types::PathVertex;
use glam::{DVec3, Vec3};

/// A triangle of a fragment: its corners, its side, the weight of its points, and the random stream
/// index of the first.
pub type Patch = ([Vec3; 3], u32, f32, u32);

/// Places the points of every patch; `point_offsets` are the CSR offsets of the patches' points.
pub fn entry_points(
    geometry: Geometry<'_>,
    hvds: &Hvds,
    patches: &[Patch],
    point_offsets: &[u32],
    seed: u32,
) -> Vec<PathVertex> {
    let mut points = Vec::new();
    for (&(corners, side, weight, stream), range) in patches.iter().zip(point_offsets.windows(2)) {
        let [p0, p1, p2] = corners.map(Vec3::as_dvec3);
        for index in range[0]..range[1] {
            let u = sample_3d(stream.wrapping_add(index - range[0]), seed).as_dvec3();
            let along = u.x.sqrt();
            let inside = (1.0 - along) * p0 + along * ((1.0 - u.y) * p1 + u.y * p2);
            let middle =
                geometry.triangles[side as usize / 2].positions.map(Vec3::as_dvec3).iter().sum::<DVec3>()
                    / 3.0;
            // Slightly off the triangle's edges, as in the shader.
            let position = inside.lerp(middle, 1.0 / 32_768.0).as_vec3();
            let cluster = geometry.cluster(hvds, position, side);
            points.push(PathVertex { position, side, incoming: Vec3::ZERO, weight, cluster, lobe: 0.0 });
        }
    }
    points
}
