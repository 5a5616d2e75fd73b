//! Clusters that a wall parts: light differs on its two sides, and one value for both leaks through it, however thick the wall is. Their parts
//! cannot see each other, from as far over the surface as half of their cells are wide.

use super::near_clusters::Patch;
use super::rays::{RayQuery, Rays};
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::scene::hvds::Hvds;

/// Levels over the base that are looked at; coarser clusters are hardly read.
pub const LEVELS: usize = 4;
/// Entry points, in the mean, of each part; with fewer, what is read instead would be of single paths.
const LEAST_IN_PART: f32 = 1.0;
/// Segments that are traced at a time.
const CHUNK: usize = 1 << 20;

/// Which clusters stand for none below them, because something stands between these, or between those of one of them; empty
/// where there is none. `patches` of
/// [`LEVELS`] levels and the base; `in_clusters`: entry points that each cluster holds, in expectation.
///
/// # Errors
/// The device lacks memory or failed.
pub fn separated(
    (rays, scene): (&Rays, &SceneBuffers),
    hvds: &Hvds,
    patches: &[Patch],
    in_clusters: &[f32],
) -> Result<Vec<bool>> {
    let mut separated = vec![false; hvds.parents.len()];
    let holds = |cluster: &u32| patches[*cluster as usize].clearance.is_finite();
    let children = |cluster: u32| {
        (hvds.first_children[cluster as usize]..hvds.first_children[cluster as usize + 1]).filter(holds)
    };
    for level in 1..hvds.levels.len().min(LEVELS + 1) {
        let height = 0.5 * hvds.grid.cell_size() as f32 * (1 << (level - 1)) as f32;
        let over = |child: u32| patches[child as usize].middle + height * patches[child as usize].normal;
        let clusters: Vec<u32> = hvds.levels[level].clone().collect();
        for clusters in clusters.chunks(CHUNK / 8) {
            let mut queries = Vec::new();
            for &cluster in clusters {
                for [from, to] in pairs(&children(cluster).collect::<Vec<_>>()) {
                    queries.push(RayQuery { origin: over(from), direction: over(to) - over(from) });
                }
            }
            let answers = rays.trace(scene, &queries)?;
            let mut is_blocked = answers.iter().map(|answer| (0.0..1.0).contains(&answer.t));
            for &cluster in clusters {
                let children: Vec<u32> = children(cluster).collect();
                let is_parted = parts(&children, &mut is_blocked) > 1;
                let inherits = children.iter().any(|&child| separated[child as usize]);
                let is_known = children.iter().all(|&child| in_clusters[child as usize] >= LEAST_IN_PART);
                separated[cluster as usize] = (is_parted || inherits) && is_known;
            }
        }
    }
    Ok(if separated.contains(&true) { separated } else { Vec::new() })
}

/// All pairs.
fn pairs(children: &[u32]) -> impl Iterator<Item = [u32; 2]> + '_ {
    children.iter().enumerate().flat_map(move |(k, &to)| children[..k].iter().map(move |&from| [from, to]))
}

/// How many groups the children fall into of which no one sees one of another, given which of the [`pairs`] do not.
fn parts(children: &[u32], is_blocked: &mut impl Iterator<Item = bool>) -> usize {
    let mut groups: Vec<u32> = children.to_vec();
    for ([from, to], is_blocked) in pairs(children).zip(is_blocked) {
        let group = |child| groups[children.iter().position(|&other| other == child).unwrap()];
        let (a, b) = (group(from), group(to));
        if !is_blocked {
            groups.iter_mut().filter(|group| **group == a).for_each(|group| *group = b);
        }
    }
    groups.sort_unstable();
    groups.dedup();
    groups.len()
}
