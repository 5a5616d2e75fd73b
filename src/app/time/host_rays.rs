//! The same rays on this processor with the traversal of `obvhs`, as a baseline for our traversal
//! if the device is a CPU.

use std::time::{Duration, Instant};

use glam::Vec3A;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::{Ray, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::{Boundable, BvhBuildParams, aabb::Aabb};

use super::measure::Summary;
use super::ray_rates::{Rates, RaySets, mrays_per_s};
use crate::passes::precompute::rays::RayQuery;
use crate::scene::Triangle;

/// Rays of a thread's chunk.
const SHARE: usize = 4096;

struct Bounds(Aabb);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// A tree and its triangles in leaf order.
struct Tree {
    nodes: CwBvh,
    triangles: Vec<RtTriangle>,
}

impl Tree {
    /// Builds the tree as the renderer does.
    fn new(triangles: &[Triangle]) -> Self {
        let bounds: Vec<Bounds> =
            triangles.iter().map(|t| Bounds(Aabb::from_points(&t.positions.map(Into::into)))).collect();
        let params = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let nodes = build_cwbvh(&bounds, params, &mut Duration::default());
        let in_order = |&index: &u32| {
            let [a, b, c] = triangles[index as usize].positions.map(Vec3A::from);
            RtTriangle::new(a, b, c)
        };
        let triangles = nodes.primitive_indices.iter().map(in_order).collect();
        Self { nodes, triangles }
    }

    /// Whether a ray hits anything, by a closest-hit query.
    fn meets_closest(&self, query: &RayQuery) -> bool {
        let ray = Ray::new_inf(query.origin.into(), query.direction.into());
        self.nodes.ray_traverse(ray, &mut RayHit::none(), |ray, index| self.triangles[index].intersect(ray))
    }

    /// Whether anything lies on a segment.
    fn meets_any(&self, query: &RayQuery) -> bool {
        let ray = Ray::new(query.origin.into(), query.direction.into(), 0.0, 1.0);
        !self.nodes.ray_traverse_miss(ray, |ray, index| self.triangles[index].intersect(ray))
    }
}

/// Rays per second of each kind, on all threads.
pub(super) fn rates(triangles: &[Triangle], sets: &RaySets, repeats: usize) -> Rates {
    let tree = Tree::new(triangles);
    let rate = |queries: &[RayQuery], meets: &(dyn Fn(&RayQuery) -> bool + Sync)| {
        if queries.is_empty() {
            return None;
        }
        let times = (0..repeats).map(|_| {
            let start = Instant::now();
            std::hint::black_box(count(queries, meets));
            start.elapsed().as_secs_f64() * 1e3
        });
        mrays_per_s(queries.len(), Summary::from_times(times).median)
    };
    let (closest, any) =
        (|query: &RayQuery| tree.meets_closest(query), |query: &RayQuery| tree.meets_any(query));
    Rates {
        closest_coherent: rate(&sets.camera, &closest),
        closest_incoherent: rate(&sets.reflected, &closest),
        any_coherent: rate(&sets.shadow, &any),
        any_incoherent: rate(&sets.pairs, &any),
    }
}

/// Number of rays that hit something.
fn count(queries: &[RayQuery], meets: &(dyn Fn(&RayQuery) -> bool + Sync)) -> usize {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let next = std::sync::atomic::AtomicUsize::new(0);
    let work = || {
        let mut found = 0;
        loop {
            let first = next.fetch_add(SHARE, std::sync::atomic::Ordering::Relaxed);
            if first >= queries.len() {
                return found;
            }
            let share = &queries[first..queries.len().min(first + SHARE)];
            found += share.iter().filter(|query| meets(query)).count();
        }
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let own = work();
        own + workers.into_iter().map(|worker| worker.join().expect("counting cannot fail")).sum::<usize>()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes;
    use glam::Vec3;

    #[test]
    fn rays_meet_what_is_there() {
        let tree = Tree::new(&shapes::facing_squares(1.0, 1.0, 0.5).triangles);
        // Away from the diagonals, where two triangles meet; half a metre from either square.
        let ray = |origin: Vec3, direction| RayQuery { origin, direction };
        let middle = Vec3::new(0.1, 0.0, 0.2);
        for up in [Vec3::Y, Vec3::NEG_Y] {
            assert!(tree.meets_closest(&ray(middle, up)) && tree.meets_any(&ray(middle, 0.6 * up)));
            assert!(!tree.meets_any(&ray(middle, 0.4 * up)), "the segment ends before the square");
        }
        let (towards, aside) = (ray(middle, Vec3::Y), ray(middle + Vec3::X, Vec3::Y));
        assert!(!tree.meets_closest(&aside) && !tree.meets_closest(&ray(middle, Vec3::X)));
        // The result is independent of the number of threads.
        let queries: Vec<_> = (0..3 * SHARE + 7).map(|i| if i % 3 == 0 { aside } else { towards }).collect();
        let hits = (0..queries.len()).filter(|i| i % 3 != 0).count();
        assert_eq!(count(&queries, &|query| tree.meets_closest(query)), hits);
    }
}
