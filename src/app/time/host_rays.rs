//! The same rays on this processor with the traversal of `obvhs`, as a baseline for our traversal
//! if the device is a CPU.

use std::time::Instant;

use super::measure::Summary;
use super::rates::{Rates, RaySets, mrays_per_s};
use crate::error::Result;
use crate::passes::precompute::rays::RayQuery;
use crate::scene::{Triangle, bvh::Bvh, host_bvh::HostBvh};

/// Rays of a thread's chunk.
const CHUNK: usize = 4096;

/// Rays per second of each kind, on all threads.
///
/// # Errors
/// The tree cannot be traversed, see [`Bvh::build`].
pub(super) fn rates(triangles: &[Triangle], sets: &RaySets, repeats: usize) -> Result<Rates> {
    let bvh = Bvh::build(triangles)?;
    let in_order: Vec<Triangle> = bvh.order.iter().map(|&index| triangles[index as usize]).collect();
    let tree = HostBvh::new(&bvh, &in_order);
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
    let closest = |query: &RayQuery| tree.closest(query.origin, query.direction).is_some();
    let any = |query: &RayQuery| tree.is_blocked(query.origin, query.direction);
    Ok(Rates {
        closest_coherent: rate(&sets.camera, &closest),
        closest_incoherent: rate(&sets.reflected, &closest),
        any_coherent: rate(&sets.shadow, &any),
        any_incoherent: rate(&sets.pairs, &any),
    })
}

/// Number of rays that hit something.
fn count(queries: &[RayQuery], meets: &(dyn Fn(&RayQuery) -> bool + Sync)) -> usize {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let next = std::sync::atomic::AtomicUsize::new(0);
    let work = || {
        let mut found = 0;
        loop {
            let first = next.fetch_add(CHUNK, std::sync::atomic::Ordering::Relaxed);
            if first >= queries.len() {
                return found;
            }
            let chunk = &queries[first..queries.len().min(first + CHUNK)];
            found += chunk.iter().filter(|query| meets(query)).count();
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
    use glam::Vec3;

    #[test]
    fn the_count_does_not_depend_on_threads() {
        let query = |index: usize| RayQuery { origin: index as f32 * Vec3::X, direction: Vec3::Y };
        let queries: Vec<RayQuery> = (0..3 * CHUNK + 7).map(query).collect();
        let is_third = |query: &RayQuery| (query.origin.x as usize).is_multiple_of(3);
        assert_eq!(count(&queries, &is_third), queries.len().div_ceil(3));
    }
}
