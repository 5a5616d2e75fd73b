//! Reference of the ray traversal: tests every triangle.

use crate::cpu::math::ClearDistance;
use crate::cpu::textures::Textures;
use crate::scene::{OpacityMaps, Triangle, hvds::Hvds};
use crate::types::{NO_CLUSTER, Surface};
use glam::{DVec3, Vec3};

/// The triangles that a ray can hit, and their attributes.
#[derive(Clone, Copy)]
pub struct Geometry<'a> {
    /// Corners of the triangles, metres.
    pub triangles: &'a [Triangle],
    /// Attributes, in the same order.
    pub surfaces: &'a [Surface],
    /// Images on them.
    pub textures: Textures<'a>,
    /// Holes in them.
    pub opacity: &'a OpacityMaps,
    /// Offset of ray origins from surfaces, metres.
    pub clear_distance: ClearDistance,
}

/// The hit of a ray on a triangle.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance in units of the direction's length.
    pub t: f64,
    /// Index of the triangle.
    pub triangle: u32,
    /// Weights of its corners, which sum to 1.
    pub barycentric: DVec3,
    /// The point itself, metres.
    pub position: DVec3,
}

/// Intersection of the ray from `origin` along `direction` with a triangle, edges included.
///
/// The signed volumes of edges and direction have one sign inside the triangle. Two triangles that
/// share an edge have exactly opposite volumes for it, so that no ray passes between them.
pub fn intersect(corners: [Vec3; 3], origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3() - origin);
    let volumes = DVec3::new(direction.dot(c.cross(b)), direction.dot(a.cross(c)), direction.dot(b.cross(a)));
    let sum = volumes.element_sum();
    if (volumes.min_element() < 0.0 && volumes.max_element() > 0.0) || sum == 0.0 {
        return None;
    }
    let barycentric = volumes / sum;
    let point = barycentric.x * a + barycentric.y * b + barycentric.z * c;
    let t = point.dot(direction) / direction.length_squared();
    (t > 0.0).then_some((t, barycentric))
}

impl Geometry<'_> {
    /// The nearest hit of a ray.
    pub fn closest(&self, origin: Vec3, direction: DVec3) -> Option<Hit> {
        let mut closest: Option<Hit> = None;
        for (index, triangle) in self.triangles.iter().enumerate() {
            let Some((t, barycentric)) = intersect(triangle.positions, origin.as_dvec3(), direction) else {
                continue;
            };
            let is_nearest = closest.is_none_or(|closest| t < closest.t);
            if is_nearest && !self.opacity.is_hole(index as u32, barycentric) {
                let [p0, p1, p2] = triangle.positions.map(Vec3::as_dvec3);
                let position = barycentric.x * p0 + barycentric.y * p1 + barycentric.z * p2;
                closest = Some(Hit { t, triangle: index as u32, barycentric, position });
            }
        }
        closest
    }

    /// A ray origin offset from the side that `normal` faces.
    pub fn offset_origin(&self, position: Vec3, normal: Vec3) -> Vec3 {
        position + self.clear_distance.at(position) * normal
    }

    /// 2·triangle + (1 if the ray comes from behind).
    pub fn side(&self, triangle: u32, direction: DVec3) -> u32 {
        let normal = self.surfaces[triangle as usize].normal.as_dvec3();
        2 * triangle + u32::from(normal.dot(direction) > 0.0)
    }

    /// Unit geometric normal of a side.
    pub fn normal(&self, side: u32) -> Vec3 {
        let normal = self.surfaces[side as usize / 2].normal;
        if side % 2 == 1 { -normal } else { normal }
    }

    /// Colour of the image at a point of a triangle; white if its material has none.
    pub fn colour(&self, triangle: u32, barycentric: DVec3) -> DVec3 {
        self.textures.colour(self.surfaces[triangle as usize].material, triangle, barycentric)
    }

    /// Weights of a triangle's corners at a point of its plane.
    pub fn barycentric_at(&self, triangle: u32, position: DVec3) -> DVec3 {
        self.triangles[triangle as usize].weights_at(position)
    }

    /// As [`Self::colour`], at a point of a side.
    pub fn colour_at(&self, side: u32, position: Vec3) -> DVec3 {
        self.colour(side / 2, self.barycentric_at(side / 2, position.as_dvec3()))
    }

    /// The base cluster that holds a point of a side; mirrors `glsl/include/grid.glsl`.
    pub fn cluster(&self, hvds: &Hvds, position: Vec3, side: u32) -> u32 {
        let cell = hvds.cell_at(position, self.normal(side));
        let code = self.surfaces[side as usize / 2].side_code(side % 2 == 1);
        hvds.base_cluster(cell, code, position).unwrap_or(NO_CLUSTER)
    }
}
