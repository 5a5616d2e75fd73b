//! Clusters that a wall divides.

use crate::common::assert_silent;
use crate::world::World;
use lightpaths::passes::precompute::rays::Rays;
use lightpaths::passes::precompute::visibility::inconsistent::{inconsistent, levels};
use lightpaths::passes::precompute::visibility::near_clusters::{self, Patch};
use lightpaths::scene::shapes;

#[test]
fn what_lies_on_both_sides_of_a_wall_is_inconsistent_and_no_other_cluster() {
    let world = World::new(&shapes::thin_wall(), 16);
    let hvds = &world.hvds;
    let clearances = vec![0.1; hvds.fragments.len()];
    let normal = |side: u32| world.geometry().normal(side);
    let patches = near_clusters::patches(hvds, &clearances, normal, 1 + levels(hvds));
    let found = |entry_points: f32| {
        let in_clusters = vec![entry_points; hvds.parents.len()];
        let rays = Rays::new(&world.context).unwrap();
        inconsistent((&rays, &world.buffers), hvds, &patches, &in_clusters).unwrap()
    };
    let found_if_known = found(1.0);
    let mut seen = [0; 2];
    // Floor, ceiling and the long walls from inside; not the dividing wall, and not the walls
    // parallel to it.
    let is_crossed =
        |patch: &Patch| patch.clearance.is_finite() && patch.normal.x.abs() < 0.01 && !patch.is_back;
    for level in 1..=levels(hvds) {
        for cluster in hvds.levels[level].clone() {
            let Patch { low, high, .. } = patches[cluster as usize];
            if !is_crossed(&patches[cluster as usize]) {
                continue;
            }
            let is_parted = low.x < -0.005 && high.x > 0.005;
            let is_flat = (high - low).min_element() < 1e-3;
            if is_parted {
                assert!(found_if_known[cluster as usize], "level {level}: {low} to {high}");
            } else if is_flat && low.x * high.x > 0.0 {
                assert!(!found_if_known[cluster as usize], "level {level}: {low} to {high}");
            } else {
                continue;
            }
            seen[usize::from(is_parted)] += 1;
        }
    }
    println!("{seen:?} whole and parted");
    assert!(seen.iter().all(|&clusters| clusters > 20));
    let coarse = hvds.levels[levels(hvds)].end as usize..;
    assert!(found_if_known[coarse].iter().all(|inconsistent| !inconsistent), "too coarse to be read");
    assert!(found(0.9).is_empty(), "parts of single paths");
    assert_silent(&world.context);
}
