//! Visibility-inconsistent clusters: a wall divides the cluster, light differs on its two sides,
//! and one value for both leaks through the wall, however thick it is. The children of such a
//! cluster cannot see each other from half a cell width above the surface.

use super::near_clusters::Patch;
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::precompute::rays::{RayQuery, Rays};
use crate::scene::hvds::Hvds;
use glam::Vec3;

/// Tested levels above the base; gather rays hardly read coarser clusters.
const LEVELS: usize = 4;

/// Number of tested levels: some above the base cells of each size.
pub fn levels(hvds: &Hvds) -> usize {
    let largest = hvds.cell_levels.iter().max().map_or(0, |&level| usize::from(level));
    (LEVELS + largest).min(hvds.levels.len() - 1)
}
/// Minimum expected number of entry points of each child; with fewer, readers would get light
/// of single paths.
const MIN_IN_PART: f32 = 1.0;
/// Segments of one trace.
const CHUNK: usize = 1 << 20;

/// Marks the inconsistent clusters: something blocks the view between their children, or a child is
/// inconsistent. Empty if there is none. `patches` of all [`levels`] and the base;
/// `in_clusters`: expected number of entry points in each cluster.
///
/// # Errors
/// The device lacks memory or failed.
pub fn inconsistent(
    (rays, scene): (&Rays, &SceneBuffers),
    hvds: &Hvds,
    patches: &[Patch],
    in_clusters: &[f32],
) -> Result<Vec<bool>> {
    let mut inconsistent = vec![false; hvds.parents.len()];
    let holds = |cluster: &u32| patches[*cluster as usize].clearance.is_finite();
    let children = |cluster: u32| hvds.children_of(cluster).iter().copied().filter(holds);
    for level in 1..=levels(hvds) {
        let height = 0.5 * hvds.grid.cell_size() as f32 * (1 << (level - 1)) as f32;
        let over = |child: u32| patches[child as usize].middle + height * patches[child as usize].normal;
        let clusters: Vec<u32> = hvds.levels[level].clone().collect();
        for clusters in clusters.chunks(CHUNK / 8) {
            let mut queries = Vec::new();
            for &cluster in clusters {
                let points: Vec<Vec3> = children(cluster).map(over).collect();
                let segment = |[from, to]: [usize; 2]| RayQuery {
                    origin: points[from],
                    direction: points[to] - points[from],
                };
                queries.extend(pairs(points.len()).map(segment));
            }
            let answers = rays.trace_within(scene, &queries, 1.0)?;
            let mut is_blocked = answers.iter().map(|answer| answer.t >= 0.0);
            for &cluster in clusters {
                let children: Vec<u32> = children(cluster).collect();
                let is_parted = groups(children.len(), &mut is_blocked) > 1;
                let inherits = children.iter().any(|&child| inconsistent[child as usize]);
                let is_known = children.iter().all(|&child| in_clusters[child as usize] >= MIN_IN_PART);
                inconsistent[cluster as usize] = (is_parted || inherits) && is_known;
            }
        }
    }
    Ok(if inconsistent.contains(&true) { inconsistent } else { Vec::new() })
}

/// All pairs of `count` items.
fn pairs(count: usize) -> impl Iterator<Item = [usize; 2]> {
    (0..count).flat_map(|to| (0..to).map(move |from| [from, to]))
}

/// Number of groups of mutually visible items, where visibility is transitive; `is_blocked` is in
/// the order of [`pairs`].
fn groups(count: usize, is_blocked: &mut impl Iterator<Item = bool>) -> usize {
    let mut groups: Vec<usize> = (0..count).collect();
    for ([from, to], is_blocked) in pairs(count).zip(is_blocked) {
        let (joined, kept) = (groups[from], groups[to]);
        if !is_blocked {
            groups.iter_mut().filter(|group| **group == joined).for_each(|group| *group = kept);
        }
    }
    groups.sort_unstable();
    groups.dedup();
    groups.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_sees_one_of_a_group_is_in_it() {
        // 0-1, 0-2, 1-2, 0-3, 1-3, 2-3: 3 sees 1 only, and 2 sees 0 only.
        let mut seen = [true, false, true, true, false, true, true].into_iter();
        assert_eq!(groups(4, &mut seen), 2);
        assert_eq!(seen.next(), Some(true), "no answer of others is taken");
        assert_eq!(groups(4, &mut [true, false, false, true, false, true].into_iter()), 1);
        assert_eq!([0, 1].map(|count| groups(count, &mut std::iter::empty::<bool>())), [0, 1]);
    }
}
