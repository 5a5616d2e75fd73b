//! Sides of triangles that take part in light transport.

use crate::scene::{Triangle, grid::cluster_code};
use crate::types::{self, ROUNDED};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

impl types::Surface {
    /// Cluster code of a side; mirrors `side_code` in `glsl/include/types.glsl`.
    pub fn side_code(&self, back: bool) -> u32 {
        self.sides >> (if back { 6 } else { 0 }) & 63
    }

    /// Unit geometric normal of a side.
    pub fn normal_of(&self, back: bool) -> Vec3 {
        if back { -self.normal } else { self.normal }
    }

    /// Whether a side takes part in transport; mirrors `side_is_active`.
    pub fn side_is_active(&self, back: bool) -> bool {
        self.sides & (if back { 0x2000 } else { 0x1000 }) != 0
    }

    /// Whether the shading normals describe a smooth surface around the facet.
    pub fn is_rounded(&self) -> bool {
        self.sides & ROUNDED != 0
    }

    /// Removes a side from transport.
    pub fn deactivate_side(&mut self, back: bool) {
        self.sides &= !(if back { 0x2000 } else { 0x1000 });
    }
}

/// Cosine between facet and shading normal above which a corner is flat.
const FLAT: f32 = 0.99999;

/// The same below which the normals describe no smooth surface. Some files give a box one normal
/// at each corner.
const STEEPEST: f32 = 0.7;

/// Whether the shading normals of a triangle describe a smooth surface around it.
fn is_rounded(triangle: &Triangle, normal: Vec3) -> bool {
    let least = triangle.normals.iter().map(|corner| corner.dot(normal)).fold(1.0, f32::min);
    (STEEPEST..FLAT).contains(&least)
}

/// The device's surface of a triangle. `active`: whether front and back take part in transport.
pub fn surface(triangle: &Triangle, active: [bool; 2]) -> types::Surface {
    let normal = triangle.geometric_normal();
    types::Surface {
        normal,
        material: triangle.material,
        sides: cluster_code(normal, false)
            | cluster_code(-normal, true) << 6
            | u32::from(active[0]) << 12
            | u32::from(active[1]) << 13
            | if is_rounded(triangle, normal) { ROUNDED } else { 0 },
        n0: triangle.normals[0],
        n1: triangle.normals[1],
        n2: triangle.normals[2],
        unused: glam::UVec2::ZERO,
    }
}

/// The surfaces with only their first active side.
pub fn one_side(surfaces: &[types::Surface]) -> Vec<types::Surface> {
    let mut surfaces = surfaces.to_vec();
    let mut is_first = true;
    for surface in &mut surfaces {
        for back in [false, true] {
            if surface.side_is_active(back) && !std::mem::take(&mut is_first) {
                surface.deactivate_side(back);
            }
        }
    }
    surfaces
}

/// Whether the scene has geometry in front of each side, as [front, back] of each triangle. Other
/// sides, such as the outside of a room's walls, receive and reflect no indirect light, wherever
/// the lights are.
pub fn sides_that_see_something(triangles: &[Triangle]) -> Vec<[bool; 2]> {
    let size = triangles.iter().flat_map(|t| t.positions).fold(0.0f32, |s, p| s.max(p.abs().max_element()));
    let slack = 1e-6 * f64::from(size);
    let extremes = extreme_points(triangles);
    let in_front = |point: DVec3, normal: DVec3| {
        let sees = |p: &Vec3| normal.dot(p.as_dvec3() - point) > slack;
        // A few extreme points decide nearly every side. Only sides that face away from everything
        // need the full search.
        extremes.iter().any(sees) || triangles.iter().any(|t| t.positions.iter().any(sees))
    };
    triangles
        .par_iter()
        .map(|t| {
            let (point, normal) = (t.positions[0].as_dvec3(), t.geometric_normal().as_dvec3());
            [in_front(point, normal), in_front(point, -normal)]
        })
        .collect()
}

/// The scene's furthest vertices along the 26 code directions.
fn extreme_points(triangles: &[Triangle]) -> Vec<Vec3> {
    (0..crate::scene::grid::CODE_COUNT)
        .into_par_iter()
        .filter_map(|code| {
            let direction = crate::scene::grid::code_direction(code).as_vec3();
            let vertices = triangles.iter().flat_map(|t| t.positions);
            vertices.max_by(|a, b| a.dot(direction).total_cmp(&b.dot(direction)))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_inside_of_a_corner_sees_something() {
        let triangle = |a: Vec3, b: Vec3, c: Vec3| Triangle {
            positions: [a, b, c],
            normals: [Vec3::Y; 3],
            material: 0,
            object: 0,
        };
        let floor = triangle(Vec3::ZERO, Vec3::Z, Vec3::X);
        let wall = triangle(Vec3::ZERO, Vec3::Y, Vec3::Z);
        assert_eq!(floor.geometric_normal(), Vec3::Y);
        assert_eq!(wall.geometric_normal(), Vec3::X);
        assert_eq!(sides_that_see_something(&[floor, wall]), [[true, false], [true, false]]);
    }
}
