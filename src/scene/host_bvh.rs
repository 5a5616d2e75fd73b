//! Rays on the host, for queries of a few rays between frames. Frames trace on the device.

use crate::scene::{OpacityMaps, Scene, Triangle, bvh::Bvh};
use glam::{Vec3, Vec3A};
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;

/// The acceleration structure with its triangles, for the traversal of `obvhs`.
pub struct HostBvh {
    tree: CwBvh,
    triangles: Vec<RtTriangle>,
    /// `None` if no triangle has holes.
    holes: Option<Holes>,
}

struct Holes {
    triangles: Vec<Triangle>,
    maps: OpacityMaps,
}

impl HostBvh {
    /// Copies the tree; the scene's triangles are in its order.
    pub fn new(bvh: &Bvh, scene: &Scene) -> Self {
        let Scene { triangles, opacity, .. } = scene;
        let copy = || Holes { triangles: triangles.clone(), maps: opacity.clone() };
        Self { holes: (!opacity.is_empty()).then(copy), ..Self::without_holes(bvh, triangles) }
    }

    /// The tree of triangles in its order, all of them without holes.
    pub(super) fn without_holes(bvh: &Bvh, triangles: &[Triangle]) -> Self {
        let triangle = |triangle: &Triangle| {
            let [a, b, c] = triangle.positions.map(Vec3A::from);
            RtTriangle::new(a, b, c)
        };
        let nodes = bytemuck::cast_slice(&bvh.nodes).to_vec();
        let primitive_indices = (0..triangles.len() as u32).collect();
        Self {
            tree: CwBvh { nodes, primitive_indices, ..CwBvh::default() },
            triangles: triangles.iter().map(triangle).collect(),
            holes: None,
        }
    }

    /// The closest hit of a ray: distance in units of the direction's length, and triangle.
    pub fn closest(&self, origin: Vec3, direction: Vec3) -> Option<(f32, u32)> {
        let mut hit = RayHit::none();
        let ray = Ray::new_inf(origin.into(), direction.into());
        let is_hit = self.tree.ray_traverse(ray, &mut hit, |ray, index| self.intersect(ray, index));
        is_hit.then_some((hit.t, hit.primitive_id))
    }

    /// Distance to a triangle; infinite if the ray misses it.
    fn intersect(&self, ray: &Ray, index: usize) -> f32 {
        let t = self.triangles[index].intersect(ray);
        let is_hole = |Holes { triangles, maps }: &Holes| {
            maps.is_hole_at(triangles, index as u32, Vec3::from(ray.origin + t * ray.direction).as_dvec3())
        };
        if t.is_finite() && self.holes.as_ref().is_some_and(is_hole) { f32::INFINITY } else { t }
    }

    /// The triangles whose boxes a line meets, from a point to the end of its direction.
    pub(super) fn near(&self, origin: Vec3, direction: Vec3) -> Vec<u32> {
        let mut found = Vec::new();
        let ray = Ray::new(origin.into(), direction.into(), 0.0, 1.0);
        self.tree.ray_traverse_anyhit(ray, |_, index| found.push(index as u32));
        found
    }

    /// Whether anything lies between a ray's origin and the end of its direction.
    pub fn is_blocked(&self, origin: Vec3, direction: Vec3) -> bool {
        let ray = Ray::new(origin.into(), direction.into(), 0.0, 1.0);
        !self.tree.ray_traverse_miss(ray, |ray, index| self.intersect(ray, index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes;

    #[test]
    fn rays_meet_what_is_there() {
        let mut scene = shapes::facing_squares(1.0, 1.0, 0.5);
        let bvh = Bvh::build(&scene.triangles).unwrap();
        scene.reorder(&bvh.order);
        let tree = HostBvh::new(&bvh, &scene);
        // Away from the diagonals, where two triangles meet; half a metre from either square.
        let middle = Vec3::new(0.1, 0.0, 0.2);
        for up in [Vec3::Y, Vec3::NEG_Y] {
            let (t, triangle) = tree.closest(middle, 2.0 * up).unwrap();
            assert!((t - 0.25).abs() < 1e-6, "{t}");
            let height = scene.triangles[triangle as usize].positions[0].y;
            assert!((height - 0.5 * up.y).abs() < 1e-6, "{height}");
            assert!(tree.is_blocked(middle, 0.6 * up));
            assert!(!tree.is_blocked(middle, 0.4 * up), "the segment ends before the square");
        }
        // Holes in the lower square alone.
        let levels: Vec<u32> = scene.triangles.iter().map(|t| u32::from(t.positions[0].y < 0.0)).collect();
        scene.opacity = OpacityMaps::new(&levels, |_, _| true);
        let cut = HostBvh::new(&bvh, &scene);
        assert!(cut.is_blocked(middle, Vec3::Y) && !cut.is_blocked(middle, Vec3::NEG_Y));
        assert!(cut.closest(middle, Vec3::Y).is_some() && cut.closest(middle, Vec3::NEG_Y).is_none());
        assert!(tree.closest(middle, Vec3::X).is_none() && tree.closest(middle + Vec3::X, Vec3::Y).is_none());
    }
}
