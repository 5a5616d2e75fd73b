//! Tables of the pass that samples bright clusters: which clusters it watches, and where it aims.
//! They depend neither on lights nor on the camera.

use crate::gpu::MAX_LOOP_ITERATIONS;
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::precompute::gather_rays::{Hemisphere, far_cells};
use crate::scene::hvds::Hvds;
use crate::types::{NO_CLUSTER, PathVertex, Surface};
use bytemuck::Zeroable;
use glam::Vec3;
use rayon::prelude::*;

gpu_struct! {
    /// A point of a base cluster, in its middle.
    pub struct BrightSite {
        pub position: Vec3,
        /// 2·triangle + (1 if the back side).
        pub side: u32,
        /// Longer gather rays leave the cluster's light out if it is bright, metres.
        pub reach: f32,
    }
}

gpu_struct! {
    /// A watched cluster. The sums over these tell whether anything may be bright.
    pub struct Watched {
        pub cluster: u32,
        /// Material of most of its entry points.
        pub material: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[BrightSite::LAYOUT, Watched::LAYOUT];

/// Level of the watched clusters, whose cells are two to that power of smallest cells wide. There
/// are far fewer than base clusters, and they still resolve the surface beside a lamp.
const WATCHED_LEVEL: u8 = 2;

/// The tables of a hierarchy.
pub struct BrightTables {
    /// The entry point of each base cluster that is nearest to their middle, or zeros.
    pub sites: Vec<BrightSite>,
    /// The watched clusters. They hold all entry points of clusters whose flux frames compute. None
    /// holds another. Those in one cluster are adjacent.
    pub watched: Vec<Watched>,
    /// For each cluster, first and end of the watched clusters in it, or of the one around it.
    pub ranges: Vec<[u32; 2]>,
}

impl BrightTables {
    /// Tables of a hierarchy. `is_summed`: clusters whose flux frames compute.
    pub fn new(
        hvds: &Hvds,
        (entry_points, surfaces): (&[PathVertex], &[Surface]),
        is_summed: &[bool],
        hemisphere: Hemisphere,
    ) -> Self {
        let base_count = hvds.levels[0].len();
        let material = |point: &PathVertex| surfaces[point.side as usize / 2].material;
        let mut middles = vec![(Vec3::ZERO, 0_u32); base_count];
        for point in entry_points {
            let (sum, count) = &mut middles[point.cluster as usize];
            *sum += point.position;
            *count += 1;
        }
        let mut sites = vec![BrightSite::zeroed(); base_count];
        let mut nearest = vec![f32::INFINITY; base_count];
        let summed = || entry_points.iter().filter(|point| is_summed[point.cluster as usize]);
        for point in summed() {
            let cluster = point.cluster as usize;
            let (sum, count) = middles[cluster];
            let apart = point.position.distance_squared(sum / count as f32);
            if apart < nearest[cluster] {
                let reach = far_cells(hemisphere) * hvds.cell_size_of(point.cluster);
                nearest[cluster] = apart;
                sites[cluster] = BrightSite { position: point.position, side: point.side, reach };
            }
        }
        let met = || summed().map(|point| (point.cluster, material(point)));
        let of_level = |level| watched_clusters(hvds, met(), is_summed, level);
        // The shaders loop over bright clusters.
        let mut levels = (WATCHED_LEVEL..u8::MAX).map(of_level);
        let is_short = |watched: &Vec<Watched>| watched.len() < MAX_LOOP_ITERATIONS as usize;
        let watched = levels.find(is_short).unwrap_or_default();
        let ranges = ranges(hvds, &watched);
        let mut in_order = watched.clone();
        for watched in watched {
            in_order[ranges[watched.cluster as usize][0] as usize] = watched;
        }
        Self { sites, watched: in_order, ranges }
    }
}

/// For each cluster, first and end of the watched clusters in it, or of the one around it, if these
/// are listed depth first.
fn ranges(hvds: &Hvds, watched: &[Watched]) -> Vec<[u32; 2]> {
    let cluster_count = hvds.cluster_count() as usize;
    let mut is_held = vec![false; cluster_count];
    let mut counts = vec![0; cluster_count];
    for watched in watched {
        is_held[watched.cluster as usize] = true;
        counts[watched.cluster as usize] = 1;
    }
    // Parents come after their children.
    for cluster in 0..cluster_count {
        let count = counts[cluster];
        if let Some(of_parent) = counts.get_mut(hvds.parents[cluster] as usize) {
            *of_parent += count;
        }
    }
    let mut ranges = vec![[0; 2]; cluster_count];
    let mut free = vec![0; cluster_count];
    let mut free_of_roots = 0;
    for cluster in (0..cluster_count).rev() {
        let parent = hvds.parents[cluster] as usize;
        if is_held.get(parent) == Some(&true) {
            is_held[cluster] = true;
            ranges[cluster] = ranges[parent];
            continue;
        }
        let free_of_parent = free.get_mut(parent).unwrap_or(&mut free_of_roots);
        let first = *free_of_parent;
        *free_of_parent += counts[cluster];
        free[cluster] = first;
        ranges[cluster] = [first, first + counts[cluster]];
    }
    ranges
}

/// The watched clusters of a level, in ascending order. `points`: cluster and material of each.
fn watched_clusters(
    hvds: &Hvds,
    points: impl Iterator<Item = (u32, u32)>,
    is_summed: &[bool],
    level: u8,
) -> Vec<Watched> {
    let over = |(cluster, material)| (watched_over(hvds, cluster, is_summed, level), material);
    let mut met: Vec<(u32, u32)> = points.map(over).collect();
    met.par_sort_unstable();
    let most = |points: &[(u32, u32)]| {
        let alike = points.chunk_by(|a, b| a == b);
        let (cluster, material) = alike.max_by_key(|alike| alike.len()).map_or((0, 0), |alike| alike[0]);
        Watched { cluster, material }
    };
    met.chunk_by(|a, b| a.0 == b.0).map(most).collect()
}

/// The watched cluster that holds a base cluster: the largest one whose flux frames compute, up to
/// the size of a level.
fn watched_over(hvds: &Hvds, base: u32, is_summed: &[bool], level: u8) -> u32 {
    let mut cluster = base;
    for _ in hvds.cell_levels[base as usize]..level {
        let parent = hvds.parents[cluster as usize];
        if parent == NO_CLUSTER || !is_summed[parent as usize] {
            break;
        }
        cluster = parent;
    }
    cluster
}
