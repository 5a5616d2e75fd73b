//! Which sides of which triangles take part in light transport.

use std::collections::HashMap;

use crate::scene::{Triangle, grid::cluster_code};
use crate::types;
use glam::{DVec3, Vec3};

impl types::Surface {
    /// Cluster code of a side; twin of `side_code` in `glsl/include/types.glsl`.
    pub fn side_code(&self, back: bool) -> u32 {
        self.sides >> (if back { 6 } else { 0 }) & 63
    }

    /// Unit geometric normal of a side.
    pub fn normal_of(&self, back: bool) -> Vec3 {
        if back { -self.normal } else { self.normal }
    }

    /// Whether a side takes part in transport; twin of `side_is_active`.
    pub fn side_is_active(&self, back: bool) -> bool {
        self.sides & (if back { 0x2000 } else { 0x1000 }) != 0
    }

    /// A side takes part no longer.
    pub fn deactivate_side(&mut self, back: bool) {
        self.sides &= !(if back { 0x2000 } else { 0x1000 });
    }
}

/// The device's view of a triangle's surface; `active` says which of front and back take part in transport.
pub fn surface(triangle: &Triangle, active: [bool; 2]) -> types::Surface {
    let normal = triangle.geometric_normal();
    types::Surface {
        normal,
        material: triangle.material,
        sides: cluster_code(normal, false)
            | cluster_code(-normal, true) << 6
            | u32::from(active[0]) << 12
            | u32::from(active[1]) << 13,
        n0: triangle.normals[0],
        n1: triangle.normals[1],
        n2: triangle.normals[2],
    }
}

/// Sides that have some part of the scene in front of them, as [front, back] of each triangle. The others, such as the
/// outside of a room's walls, receive no indirect light and pass none on, wherever the lights stand.
pub fn sides_that_see_something(triangles: &[Triangle]) -> Vec<[bool; 2]> {
    let size = triangles.iter().flat_map(|t| t.positions).fold(0.0f32, |s, p| s.max(p.abs().max_element()));
    let slack = 1e-6 * f64::from(size);
    let extremes = extreme_points(triangles);
    let in_front = |point: DVec3, normal: DVec3| {
        let sees = |p: &Vec3| normal.dot(p.as_dvec3() - point) > slack;
        // A few extreme points settle nearly every side; the full search is for those that look away from everything.
        extremes.iter().any(sees) || triangles.iter().any(|t| t.positions.iter().any(sees))
    };
    triangles
        .iter()
        .map(|t| {
            let (point, normal) = (t.positions[0].as_dvec3(), t.geometric_normal().as_dvec3());
            [in_front(point, normal), in_front(point, -normal)]
        })
        .collect()
}

/// Triangles whose backs look into a solid: they belong to a surface without a border that is wound outwards and holds none of `eyes`
/// (lights and cameras). Parts that reach into each other show their fronts to each other's insides, where no light comes.
pub fn backs_inside_solids(triangles: &[Triangle], eyes: &[Vec3]) -> Vec<bool> {
    let mut corners: HashMap<[u32; 3], usize> = HashMap::new();
    let mut parent = Vec::new();
    let indexed: Vec<[usize; 3]> = triangles
        .iter()
        .map(|triangle| {
            triangle.positions.map(|p| {
                // Adding zero makes -0 equal to 0.
                *corners.entry((p + 0.0).to_array().map(f32::to_bits)).or_insert_with(|| {
                    parent.push(parent.len());
                    parent.len() - 1
                })
            })
        })
        .collect();
    let mut edges: HashMap<[usize; 2], i32> = HashMap::new();
    for &[a, b, c] in &indexed {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let roots = [from, to].map(|corner| root(&mut parent, corner));
            parent[roots[0]] = roots[1];
            *edges.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let mut is_solid = vec![true; parent.len()];
    for (edge, balance) in edges {
        is_solid[root(&mut parent, edge[0])] &= balance == 0;
    }
    let parts: Vec<usize> = indexed.iter().map(|corners| root(&mut parent, corners[0])).collect();
    // Over a whole surface: its volume; and, of each eye, how often it goes around that.
    let mut sum = |of: &dyn Fn([DVec3; 3]) -> f64, is_meant: &dyn Fn(f64) -> bool| {
        let mut sums = vec![0.0; is_solid.len()];
        for (triangle, &part) in triangles.iter().zip(&parts) {
            sums[part] += of(triangle.positions.map(Vec3::as_dvec3));
        }
        is_solid.iter_mut().zip(sums).for_each(|(solid, sum)| *solid &= is_meant(sum));
    };
    sum(&|[a, b, c]| a.dot(b.cross(c)), &|volume| volume > 0.0);
    for eye in eyes {
        let solid_angle = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|p| (p - eye.as_dvec3()).normalize_or_zero());
            2.0 * a.dot(b.cross(c)).atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
        };
        sum(&solid_angle, &|angle| angle < 2.0 * std::f64::consts::PI);
    }
    parts.iter().map(|&part| is_solid[part]).collect()
}

/// The representative of a corner's surface.
fn root(parent: &mut [usize], mut corner: usize) -> usize {
    while parent[corner] != corner {
        parent[corner] = parent[parent[corner]];
        corner = parent[corner];
    }
    corner
}

/// The scene's furthest vertices along the 26 code directions.
fn extreme_points(triangles: &[Triangle]) -> Vec<Vec3> {
    (0..crate::scene::grid::CODE_COUNT)
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
    use crate::scene::shapes;

    #[test]
    fn backs_of_solids_are_inside_unless_somebody_is() {
        let [room, block] = [[2.0, 2.0, 2.0], [0.5, 0.5, 0.5]]
            .map(|size| shapes::closed_box(Vec3::from(size), 0.5).triangles);
        let turned = |triangle: &Triangle| {
            let [a, b, c] = triangle.positions;
            Triangle { positions: [a, c, b], ..*triangle }
        };
        // A room has its fronts inside, a block outside; the last one lacks a facet.
        let mut all = room.clone();
        all.extend(block.iter().map(turned));
        let found = backs_inside_solids(&all, &[Vec3::new(0.6, 0.0, 0.0)]);
        assert!(
            found[..room.len()].iter().all(|solid| !solid) && found[room.len()..].iter().all(|solid| *solid)
        );
        assert!(backs_inside_solids(&all, &[Vec3::ZERO]).iter().all(|solid| !solid), "an eye inside");
        all.pop();
        assert!(backs_inside_solids(&all, &[]).iter().all(|solid| !solid), "a border");
    }

    #[test]
    fn only_the_inside_of_a_corner_sees_something() {
        let triangle =
            |a: Vec3, b: Vec3, c: Vec3| Triangle { positions: [a, b, c], normals: [Vec3::Y; 3], material: 0 };
        let floor = triangle(Vec3::ZERO, Vec3::Z, Vec3::X);
        let wall = triangle(Vec3::ZERO, Vec3::Y, Vec3::Z);
        assert_eq!(floor.geometric_normal(), Vec3::Y);
        assert_eq!(wall.geometric_normal(), Vec3::X);
        assert_eq!(sides_that_see_something(&[floor, wall]), [[true, false], [true, false]]);
    }
}
