//! A model scaled to the unit sphere, with rays on the host: the rules that choose a camera and a
//! light ask it which sides of which surfaces they meet.

use glam::{DVec3, Vec3, Vec3Swizzles};

use crate::Result;
use crate::scene::bvh::Bvh;
use crate::scene::host_bvh::HostBvh;
use crate::scene::{Camera, Triangle};

/// Most triangles that a ray may be expected to test. The corners of a fan's thousands of slivers
/// bound nearly all of it, and a tree over them takes minutes to build.
const MOST_TESTS: f32 = 1000.0;
/// Rays leave a surface by this much, in radii of the model.
pub(super) const OFFSET: f32 = 1e-4;

/// The model, recentred on the middle of its bounds and scaled to a radius of one.
pub(super) struct Probe {
    tree: HostBvh,
    /// Triangles in the tree's order, scaled.
    pub(super) triangles: Vec<Triangle>,
    /// Corners of the scaled bounds.
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    /// The middle of the bounds in the scene, metres.
    middle: DVec3,
    /// Radius of the model in the scene, metres.
    pub(super) radius_m: f64,
    /// Backs count as fronts: all faces of an object face inwards.
    pub(super) is_inverted: bool,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy)]
pub(super) struct Hit {
    pub(super) point: Vec3,
    pub(super) distance: f32,
    /// Unit normal of the side that was hit.
    pub(super) normal: Vec3,
    pub(super) is_front: bool,
    /// Cosine between the ray and the normal.
    pub(super) cosine: f32,
    /// The surface's material.
    pub(super) material: u32,
}

/// What the rays from a point meet, as fractions of all rays.
#[derive(Clone, Copy, Default)]
pub(super) struct Surroundings {
    pub(super) fronts: f32,
    pub(super) backs: f32,
    /// Distance to the nearest surface that a ray met.
    pub(super) nearest: f32,
}

impl Probe {
    pub(super) fn new(triangles: &[Triangle]) -> Result<Self> {
        let points = || triangles.iter().flat_map(|triangle| triangle.positions);
        let (low, high) =
            points().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let middle = 0.5 * (low.as_dvec3() + high.as_dvec3());
        let radius_m = 0.5 * (high.as_dvec3() - low.as_dvec3()).length();
        let scaled = |p: Vec3| ((p.as_dvec3() - middle) / radius_m).as_vec3();
        let [mut low, mut high] = [low, high].map(scaled);
        let mut triangles: Vec<_> = triangles
            .iter()
            .map(|triangle| Triangle { positions: triangle.positions.map(scaled), ..*triangle })
            .collect();
        if expected_tests(&triangles, high - low) > MOST_TESTS {
            // The two sides of a flat box would coincide.
            (low, high) = (low - 1e-3, high + 1e-3);
            triangles = bounding_box(low, high);
        }
        let bvh = Bvh::build(&triangles)?;
        let triangles: Vec<_> = bvh.order.iter().map(|&index| triangles[index as usize]).collect();
        Ok(Self {
            tree: HostBvh::without_holes(&bvh, &triangles),
            triangles,
            low,
            high,
            middle,
            radius_m,
            is_inverted: false,
        })
    }

    /// The closest surface along a unit direction.
    pub(super) fn cast(&self, from: Vec3, direction: Vec3) -> Option<Hit> {
        let (distance, triangle) = self.tree.closest(from, direction)?;
        let cross = self.triangles[triangle as usize].cross();
        let normal = cross.normalize_or_zero().as_vec3();
        let cosine = -normal.dot(direction);
        Some(Hit {
            point: from + distance * direction,
            distance,
            normal: if cosine < 0.0 { -normal } else { normal },
            is_front: (cosine > 0.0) != self.is_inverted,
            cosine: cosine.abs(),
            material: self.triangles[triangle as usize].material,
        })
    }

    /// Whether nothing lies between a hit and a point.
    pub(super) fn sees(&self, hit: &Hit, point: Vec3) -> bool {
        let from = hit.point + OFFSET * hit.normal;
        !self.tree.is_blocked(from, 0.999 * (point - from))
    }

    /// Whether a direction from a point with that normal leads out of the model.
    pub(super) fn leaves(&self, point: Vec3, normal: Vec3, direction: Vec3) -> bool {
        !self.tree.is_blocked(point + OFFSET * normal, 4.0 * direction)
    }

    /// What is around a point.
    pub(super) fn surroundings(&self, from: Vec3, rays: usize) -> Surroundings {
        let mut found = Surroundings { nearest: f32::INFINITY, ..Surroundings::default() };
        for hit in sphere(rays).filter_map(|direction| self.cast(from, direction)) {
            *if hit.is_front { &mut found.fronts } else { &mut found.backs } += 1.0 / rays as f32;
            found.nearest = found.nearest.min(hit.distance);
        }
        found
    }

    /// Size of the scaled bounds.
    pub(super) fn size(&self) -> Vec3 {
        self.high - self.low
    }

    /// A point of the scene, recentred metres.
    pub(super) fn scene_from_unit(&self, point: Vec3) -> DVec3 {
        self.middle + self.radius_m * point.as_dvec3()
    }

    /// The scaled point of a point of the scene.
    pub(super) fn unit_from_scene(&self, point: Vec3) -> Vec3 {
        ((point.as_dvec3() - self.middle) / self.radius_m).as_vec3()
    }

    /// Hits of `side` times `side` camera rays across a square picture; `None` where they miss.
    pub(super) fn picture(&self, camera: &Camera, side: usize) -> Vec<Option<Hit>> {
        let [right, up, forward] = camera.frame();
        let tan = (0.5 * camera.fov_y_degrees).to_radians().tan();
        let place = |index: usize| tan * (2.0 * (index as f32 + 0.5) / side as f32 - 1.0);
        let rays = (0..side * side).map(|pixel| (place(pixel % side), place(pixel / side)));
        rays.map(|(x, y)| self.cast(camera.position, (forward + x * right - y * up).normalize())).collect()
    }
}

/// Least number of triangles that a ray through the model tests. The probability that it meets the
/// bounds of one is the ratio of their surfaces.
fn expected_tests(triangles: &[Triangle], size: Vec3) -> f32 {
    let surface = |size: Vec3| size.dot(size.zxy());
    let bounds = triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.positions;
        surface(a.max(b).max(c) - a.min(b).min(c))
    });
    bounds.sum::<f32>() / surface(size).max(f32::MIN_POSITIVE)
}

/// Two triangles for each side of the bounds.
fn bounding_box(low: Vec3, high: Vec3) -> Vec<Triangle> {
    let corner = |bits: usize| Vec3::from_array([0, 1, 2].map(|axis| [low, high][bits >> axis & 1][axis]));
    let sides: [[usize; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    let triangle = |corners: [usize; 3]| Triangle {
        positions: corners.map(corner),
        normals: [Vec3::Y; 3],
        material: 0,
        object: 0,
    };
    triangles.map(triangle).collect()
}

/// Unit directions, spread evenly over the sphere (a Fibonacci spiral). None is along an axis,
/// where rays pass between the triangles of a model's middle edges.
pub(in crate::scene) fn sphere(count: usize) -> impl Iterator<Item = Vec3> {
    const GOLDEN_ANGLE: f32 = 2.399_963_2;
    (0..count).map(move |index| {
        let height = 1.0 - (2 * index + 1) as f32 / count as f32;
        let (sin, cos) = (GOLDEN_ANGLE * index as f32 + 0.1).sin_cos();
        let radius = (1.0 - height * height).sqrt();
        Vec3::new(radius * cos, height, radius * sin)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_of_slow_models_has_its_fronts_outside() {
        let sides = bounding_box(Vec3::new(-1.0, -2.0, -3.0), Vec3::ONE);
        assert_eq!(sides.len(), 12);
        let volume: f64 = sides.iter().map(|side| side.cross().dot(side.positions[0].as_dvec3())).sum();
        assert!((volume / 6.0 - 24.0).abs() < 1e-9, "{volume}");
        // A ray meets two sides, and the bounds of both triangles of each.
        let cost = expected_tests(&sides, Vec3::new(2.0, 3.0, 4.0));
        assert!((cost - 4.0).abs() < 1e-6, "{cost}");
    }
}
