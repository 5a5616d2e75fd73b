//! Sides of triangles that light can reach: the inside of enclosures gets no entry points, no
//! clusters and no cache points.
//!
//! Rays join sides that see each other into groups. A group takes part in transport if it also sees
//! the void or surrounds a camera. Sides that provably see no surface are inactive already; so are
//! backs inside solids, because interpenetrating solids would join them with the rest. Positions of
//! lights do not matter: an enclosure without a camera is not visible.

use crate::cpu::math::ClearDistance;
use crate::cpu::sampling::hash;
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::precompute::fragment_points::name_of;
use crate::passes::precompute::rays::{RayQuery, Rays};
use crate::scene::{Measure, Scene, Triangle, solids::Solids};
use crate::types::{NO_SIDE, Surface};
use glam::Vec3;
use std::collections::HashMap;

/// Minimum number of rays from each side. A side whose rays miss all its neighbours is
/// joined by theirs.
const RAYS_PER_SIDE: usize = 16;
/// Minimum number of rays from all sides together: the opening between two spaces may be small.
const RAYS: usize = 1 << 16;
/// Rays from each camera.
const RAYS_PER_POINT: u32 = 256;

/// Groups of sides that no other side and no camera sees.
pub struct Enclosures {
    /// The group of each inactive side. `None` for active sides, and for sides that see
    /// nothing at all.
    groups: Vec<Option<usize>>,
    /// Low and high corner of each group, metres.
    bounds: HashMap<usize, [Vec3; 2]>,
}

impl Enclosures {
    fn new(triangles: &[Triangle], groups: Vec<Option<usize>>) -> Self {
        let mut bounds = HashMap::new();
        for (side, group) in groups.iter().enumerate() {
            let Some(group) = group else { continue };
            let [low, high] = bounds.entry(*group).or_insert([Vec3::INFINITY, Vec3::NEG_INFINITY]);
            for corner in triangles[side / 2].positions {
                (*low, *high) = (low.min(corner), high.max(corner));
            }
        }
        Self { groups, bounds }
    }

    /// The group of each side, [`u32::MAX`] if it has none: the input of [`Self::of_numbers`].
    pub fn numbers(&self) -> Vec<u32> {
        self.groups.iter().map(|group| group.map_or(u32::MAX, |group| group as u32)).collect()
    }

    /// The enclosures of [`Self::numbers`]; triangles in BVH order.
    pub fn of_numbers(triangles: &[Triangle], numbers: &[u32]) -> Self {
        let group = |&group: &u32| (group != u32::MAX).then_some(group as usize);
        Self::new(triangles, numbers.iter().map(group).collect())
    }

    /// Whether one enclosure may contain both points.
    pub fn may_hold(&self, points: [Vec3; 2]) -> bool {
        let is_in = |point: Vec3, [low, high]: [Vec3; 2]| point.cmpgt(low).all() && point.cmplt(high).all();
        self.bounds.values().any(|bounds| points.iter().all(|&point| is_in(point, *bounds)))
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.bounds.is_empty()
    }

    /// Returns the enclosure around a point. `side_along` returns the side that a ray meets.
    pub fn around(&self, point: Vec3, side_along: impl Fn(Vec3, Vec3) -> Option<u32>) -> Option<usize> {
        let group =
            |ray: RayQuery| side_along(ray.origin, ray.direction).and_then(|side| self.groups[side as usize]);
        most(rays_around(point).map(group)).flatten()
    }
}

/// Deactivates sides that light cannot reach. Surfaces and triangles in BVH order; rays start
/// `clear_distance` off their surface.
///
/// # Errors
/// The device lacks memory or failed.
pub fn deactivate_unreachable(
    rays: &Rays,
    buffers: &SceneBuffers,
    scene: &Scene,
    solids: &Solids,
    clear_distance: ClearDistance,
    surfaces: &mut [Surface],
) -> Result<Enclosures> {
    for (surface, is_inside) in surfaces.iter_mut().zip(solids.backs()) {
        if is_inside {
            surface.deactivate_side(true);
        }
    }
    let side_count = 2 * surfaces.len();
    if !scene.quality.takes(Measure::Enclosures) {
        return Ok(Enclosures::new(&scene.triangles, vec![None; side_count]));
    }
    let mut queries = Vec::new();
    let mut sources = Vec::new();
    let outside = side_count;
    let is_active = |surfaces: &[Surface], side: usize| surfaces[side / 2].side_is_active(side % 2 == 1);
    let naming = scene.naming();
    let rays_per_side = RAYS_PER_SIDE.max(RAYS / side_count.max(1)) as u32;
    for side in 0..side_count {
        if !is_active(surfaces, side) {
            continue;
        }
        let [p0, p1, p2] = scene.triangles[side / 2].positions;
        let normal = surfaces[side / 2].normal_of(side % 2 == 1);
        let name = || name_of(&[p0, p1, p2], side % 2 == 1);
        let first = naming.pick(side as u32 * rays_per_side, || name() >> 8);
        let other = naming.pick(side as u32, || hash(name()) >> 8);
        for ray in 0..rays_per_side {
            let u = plastic_sequence(first + ray);
            let along = u[0].sqrt();
            let position = (1.0 - along) * p0 + along * ((1.0 - u[1]) * p1 + u[1] * p2);
            // Lambert's law needs no frame: the normal plus a point on the unit sphere.
            let direction = normal + sphere([u[2], plastic_sequence(other ^ ray)[0]]);
            queries.push(RayQuery { origin: position + clear_distance.at(position) * normal, direction });
            sources.push(side);
        }
    }
    let viewpoints = scene.viewpoints();
    queries.extend(viewpoints.iter().flat_map(|&point| rays_around(point)));
    let answers = rays.trace(buffers, &queries)?;
    // Interior surface sees the inside of its solid, which must not join everything else
    // that sees it.
    let target = |side: u32| match side {
        NO_SIDE => Some(outside),
        side => Some(side as usize).filter(|&side| is_active(surfaces, side)),
    };
    let mut groups = Groups::new(side_count + 1);
    for (&source, answer) in sources.iter().zip(&answers) {
        if let Some(target) = target(answer.side) {
            groups.join(source, target);
        }
    }
    // Both sides of a hole see the same, however few rays pass it.
    for (triangle, _) in scene.opacity.micromaps() {
        let [front, back] = [2 * triangle, 2 * triangle + 1].map(|side| match is_active(surfaces, side) {
            true => side,
            false => outside,
        });
        groups.join(front, back);
    }
    for seen in answers[sources.len()..].chunks_exact(RAYS_PER_POINT as usize) {
        let seen = seen.iter().map(|answer| target(answer.side).map(|target| groups.find(target)));
        if let Some(group) = most(seen).flatten() {
            groups.join(group, outside);
        }
    }
    let reachable = groups.find(outside);
    let mut left_out =
        |side| Some(groups.find(side)).filter(|&group| is_active(surfaces, side) && group != reachable);
    let closed = Enclosures::new(&scene.triangles, (0..side_count).map(&mut left_out).collect());
    for side in (0..side_count).filter(|&side| closed.groups[side].is_some()) {
        surfaces[side / 2].deactivate_side(side % 2 == 1);
    }
    Ok(closed)
}

/// Rays all around a point.
fn rays_around(point: Vec3) -> impl Iterator<Item = RayQuery> {
    (0..RAYS_PER_POINT).map(move |ray| {
        let u = plastic_sequence(ray);
        RayQuery { origin: point, direction: sphere([u[0], u[1]]) }
    })
}

/// The value of more than half of the items. `None` if there is none.
fn most<T: Ord + Copy>(items: impl Iterator<Item = T>) -> Option<T> {
    let mut items: Vec<T> = items.collect();
    items.sort_unstable();
    let middle = *items.get(items.len() / 2)?;
    (2 * items.iter().filter(|&&item| item == middle).count() > items.len()).then_some(middle)
}

/// Point of a three-dimensional additive recurrence on the plastic number's generalisation.
pub(super) fn plastic_sequence(index: u32) -> [f32; 3] {
    // 1/g, 1/g² and 1/g³, g⁴ = g + 1.
    const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_2];
    STEPS.map(|step| (0.5 + f64::from(index) * step).fract() as f32)
}

/// Uniform point on the unit sphere.
pub(super) fn sphere(u: [f32; 2]) -> Vec3 {
    let z = 1.0 - 2.0 * u[0];
    let radius = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = (std::f32::consts::TAU * u[1]).sin_cos();
    Vec3::new(radius * cos, radius * sin, z)
}

struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn find(&mut self, mut item: usize) -> usize {
        while self.0[item] != item {
            self.0[item] = self.0[self.0[item]];
            item = self.0[item];
        }
        item
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_is_more_than_half() {
        assert_eq!(most([1, 3, 3].into_iter()), Some(3));
        assert_eq!(most([1, 3, 3, 2].into_iter()), None);
        assert_eq!(most(std::iter::empty::<u32>()), None);
    }
}
