//! The same rays on this processor with the traversal of `obvhs`, as a baseline for our traversal
//! if the device is a CPU.

use std::time::Instant;

use rayon::prelude::*;

use super::measure::Summary;
use super::rates::{Rates, RaySets, mrays_per_s};
use crate::error::Result;
use crate::passes::precompute::rays::RayQuery;
use crate::scene::{Scene, bvh::Bvh, host_bvh::HostBvh};

/// Rays per second of each kind, on all threads.
///
/// # Errors
/// The tree cannot be traversed, see [`Bvh::build`].
pub(super) fn rates(scene: &Scene, sets: &RaySets, repeats: usize) -> Result<Rates> {
    let bvh = Bvh::build(&scene.triangles)?;
    let mut in_order = scene.clone();
    in_order.reorder(&bvh.order);
    let tree = HostBvh::new(&bvh, &in_order);
    let rate = |queries: &[RayQuery], meets: &(dyn Fn(&RayQuery) -> bool + Sync)| {
        if queries.is_empty() {
            return None;
        }
        let times = (0..repeats).map(|_| {
            let start = Instant::now();
            std::hint::black_box(queries.par_iter().filter(|query| meets(query)).count());
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
