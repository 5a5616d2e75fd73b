//! Whether a model is a room, by rays from points inside of its bounds.

use glam::Vec3;
use rayon::prelude::*;

use super::probe::{Probe, Surroundings, sphere};
use crate::scene::Triangle;

/// Points along the longer sides of the bounds.
const SIDE: usize = 6;
/// Rays from each point.
const RAYS: usize = 48;
/// Surface points at which faces are judged.
const FACES: usize = 256;

/// What rays from inside of the bounds met.
pub(super) struct Room {
    /// Points that have fronts all around, and what is around them.
    pub(super) points: Vec<(Vec3, Surroundings)>,
    /// Fraction of the bounds with fronts all around.
    pub(super) fill: f32,
    /// Much of the bounds has fronts all around.
    pub(super) is_closed: bool,
}

impl Room {
    pub(super) fn new(probe: &Probe) -> Self {
        let cells: Vec<Vec3> = (0..SIDE.pow(3))
            .map(|cell| {
                let index = [cell % SIDE, cell / SIDE % SIDE, cell / SIDE / SIDE];
                // Off the planes of symmetry, where models have edges.
                let place = |axis: usize| (index[axis] as f32 + 0.47 + 0.02 * axis as f32) / SIDE as f32;
                probe.low + probe.size() * Vec3::new(place(0), place(1), place(2))
            })
            .collect();
        let found: Vec<_> = cells.par_iter().map(|&point| (point, probe.surroundings(point, RAYS))).collect();
        let is_enclosed = |around: &Surroundings| around.fronts >= 0.7 && around.backs <= 0.2;
        let points: Vec<_> = found.into_iter().filter(|(_, around)| is_enclosed(around)).collect();
        let fill = points.len() as f32 / cells.len() as f32;
        Self { points, fill, is_closed: fill >= 0.15 }
    }

    /// Whether most points have a front in a direction.
    pub(super) fn is_closed_along(&self, probe: &Probe, way: Vec3) -> bool {
        let way = (way + 0.01 * Vec3::new(0.7, 0.4, 0.5)).normalize();
        let is_closed = |point: Vec3| probe.cast(point, way).is_some_and(|hit| hit.is_front);
        let closed = self.points.iter().filter(|(point, _)| is_closed(*point)).count();
        closed as f32 >= 0.4 * self.points.len() as f32
    }

    /// Whether the model is a room: closed all around, and above by a ceiling. A cup has none.
    pub(super) fn is_room(&self, probe: &Probe, up: Vec3) -> bool {
        self.is_closed && self.is_closed_along(probe, up) && !probe.is_inverted
    }

    /// Fraction of the rays that leave through what is missing or open.
    pub(super) fn open_fraction(&self) -> f32 {
        let open = self.points.iter().map(|(_, around)| 1.0 - around.fronts - around.backs);
        open.sum::<f32>() / self.points.len().max(1) as f32
    }

    /// Whether the faces are the wrong way round: no front is seen from outside, and what is hidden
    /// is no furniture. An empty room is the same but for its shape, a box.
    pub(super) fn is_inverted(&self, probe: &Probe, up: Vec3) -> bool {
        let Faces { exposed_fronts, solids } = Faces::new(probe);
        let is_box = self.fill >= 0.6 && boxy(probe, up) > 0.95;
        exposed_fronts < 0.05 && solids < 0.05 && !is_box
    }
}

/// Fractions of the surface.
struct Faces {
    /// Its front is seen from far away.
    exposed_fronts: f32,
    /// Neither side is seen from far away, and behind the front there is a back: furniture.
    solids: f32,
}

impl Faces {
    fn new(probe: &Probe) -> Self {
        let samples = samples(probe);
        let is_exposed = |point: Vec3, normal: Vec3| {
            sphere(RAYS).any(|way| way.dot(normal) > 0.1 && probe.leaves(point, normal, way))
        };
        let is_solid = |point: Vec3, normal: Vec3| {
            let behind = probe.cast(point - 1e-3 * normal, (-normal + 0.01 * Vec3::ONE).normalize());
            behind.is_some_and(|hit| !hit.is_front)
        };
        let judged = samples.par_iter().map(|&(point, normal)| {
            let front = is_exposed(point, normal);
            [front, !front && !is_exposed(point, -normal) && is_solid(point, normal)]
        });
        let judged: Vec<_> = judged.collect();
        let fraction = |fact: usize| {
            judged.iter().filter(|facts| facts[fact]).count() as f32 / judged.len().max(1) as f32
        };
        Self { exposed_fronts: fraction(0), solids: fraction(1) }
    }
}

/// Points spread over the surface, with the normals of their fronts.
fn samples(probe: &Probe) -> Vec<(Vec3, Vec3)> {
    let total: f64 = probe.triangles.iter().map(Triangle::area_m2).sum();
    let mut sum = 0.0;
    let mut samples = Vec::with_capacity(FACES);
    for triangle in &probe.triangles {
        sum += triangle.area_m2();
        // A large triangle holds several samples.
        while samples.len() < FACES && sum >= (samples.len() as f64 + 0.5) / FACES as f64 * total {
            let [u, v] = [0.618_034, 0.754_878].map(|step: f32| (samples.len() as f32 * step).fract());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let [a, b, c] = triangle.positions;
            samples.push((a + u * (b - a) + v * (c - a), triangle.geometric_normal()));
        }
    }
    samples
}

/// Fraction of the surface that is horizontal or parallel to one of two perpendicular walls.
fn boxy(probe: &Probe, up: Vec3) -> f32 {
    let (mut straight, mut area) = (0.0, 0.0);
    let largest = probe
        .triangles
        .iter()
        .filter(|triangle| triangle.geometric_normal().dot(up).abs() < 0.02)
        .max_by(|a, b| a.area_m2().total_cmp(&b.area_m2()));
    let wall = largest.map_or(Vec3::X, Triangle::geometric_normal);
    let axes = [up, wall, up.cross(wall)];
    for triangle in &probe.triangles {
        let (own, normal) = (triangle.area_m2() as f32, triangle.geometric_normal());
        area += own;
        if axes.iter().any(|axis| axis.dot(normal).abs() > 0.98) {
            straight += own;
        }
    }
    straight / area
}
