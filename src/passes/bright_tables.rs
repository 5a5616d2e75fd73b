//! Tables of the pass that samples bright clusters: which clusters it watches, and where it aims.
//! They depend neither on lights nor on the camera.

use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::precompute::gather_rays::{Hemisphere, far_cells};
use crate::scene::hvds::Hvds;
use crate::types::{NO_CLUSTER, PathVertex, Surface};
use bytemuck::Zeroable;
use glam::Vec3;
use rayon::prelude::*;
use std::ops::Range;

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

/// A cluster that belongs to no watched one; mirrors `glsl/include/bright.glsl`.
pub const NOT_WATCHED: u32 = u32::MAX;

/// Level of the watched clusters, whose cells are two to that power of smallest cells wide. There
/// are far fewer than base clusters, and they still resolve the surface beside a lamp.
const WATCHED_LEVEL: u8 = 2;

/// The tables of a hierarchy.
pub struct BrightTables {
    /// The entry point of each base cluster that is nearest to their middle, or zeros.
    pub sites: Vec<BrightSite>,
    /// The watched clusters, in ascending order. They hold all entry points of clusters whose flux
    /// frames compute. None holds another.
    pub watched: Vec<Watched>,
    /// Index of the watched cluster to which each cluster belongs, or [`NOT_WATCHED`].
    pub watched_of: Vec<u32>,
    /// Clusters above watched ones, level by level.
    pub above: Vec<u32>,
    /// Range of each level in `above`, from the finest one on; none is empty.
    pub levels: Vec<Range<u32>>,
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
        let mut met: Vec<(u32, u32)> =
            summed().map(|point| (watched_over(hvds, point.cluster, is_summed), material(point))).collect();
        met.par_sort_unstable();
        let most = |points: &[(u32, u32)]| {
            let alike = points.chunk_by(|a, b| a == b);
            let (cluster, material) = alike.max_by_key(|alike| alike.len()).map_or((0, 0), |alike| alike[0]);
            Watched { cluster, material }
        };
        let watched: Vec<Watched> = met.chunk_by(|a, b| a.0 == b.0).map(most).collect();

        // Parents come after their children.
        let cluster_count = hvds.cluster_count() as usize;
        let mut watched_of = vec![NOT_WATCHED; cluster_count];
        (0..).zip(&watched).for_each(|(index, watched)| watched_of[watched.cluster as usize] = index);
        for cluster in (0..cluster_count).rev() {
            let parent = hvds.parents[cluster];
            if parent != NO_CLUSTER && watched_of[parent as usize] != NOT_WATCHED {
                watched_of[cluster] = watched_of[parent as usize];
            }
        }
        let mut is_above = vec![false; cluster_count];
        for cluster in 0..cluster_count {
            let parent = hvds.parents[cluster] as usize;
            let holds = is_above[cluster] || watched_of[cluster] != NOT_WATCHED;
            if holds && watched_of.get(parent) == Some(&NOT_WATCHED) {
                is_above[parent] = true;
            }
        }
        let (mut above, mut levels) = (Vec::new(), Vec::new());
        for level in &hvds.levels[1..] {
            let first = above.len() as u32;
            above.extend(level.clone().filter(|&cluster| is_above[cluster as usize]));
            levels.push(first..above.len() as u32);
        }
        levels.retain(|level| !level.is_empty());
        Self { sites, watched, watched_of, above, levels }
    }
}

/// The watched cluster that holds a base cluster: the largest one whose flux frames compute, up to
/// the size of [`WATCHED_LEVEL`].
fn watched_over(hvds: &Hvds, base: u32, is_summed: &[bool]) -> u32 {
    let mut cluster = base;
    for _ in hvds.cell_levels[base as usize]..WATCHED_LEVEL {
        let parent = hvds.parents[cluster as usize];
        if parent == NO_CLUSTER || !is_summed[parent as usize] {
            break;
        }
        cluster = parent;
    }
    cluster
}
