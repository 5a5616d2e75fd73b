//! The clusters on the device, for lookup by position and by parent.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::scene::grid::CellGrid;
use crate::scene::hvds::Hvds;
use crate::scene::octree::Octree;
use crate::types::Grid;
use bytemuck::Zeroable;
use glam::UVec3;
use std::sync::Arc;

gpu_struct! {
    /// Links of a cluster in the hierarchy.
    pub(super) struct ClusterLink {
        /// Cluster one level up; `NO_CLUSTER` at the root.
        pub parent: u32,
        /// Expected number of entry points on its surface.
        pub entry_points: f32,
    }
}

/// Layouts of the structs shared with the shaders.
pub(super) const LAYOUTS: &[Layout] = &[ClusterLink::LAYOUT];

/// Cluster tables in host memory.
pub struct ClusterTables {
    /// The hierarchy, without its fragments.
    pub hvds: Hvds,
    /// Expected number of entry points in each cluster.
    pub entry_points: Vec<f32>,
}

impl ClusterTables {
    /// Tables of a hierarchy. `entry_points`: expected number in each cluster.
    pub fn new(hvds: &Hvds, entry_points: &[f32]) -> Self {
        Self { hvds: hvds.without_fragments(), entry_points: entry_points.to_vec() }
    }

    /// Uploads the lists of clusters.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn upload(&self, context: &Arc<Context>) -> Result<ClusterBuffers> {
        let hvds = &self.hvds;
        let link = |(cluster, &entry_points)| ClusterLink { parent: hvds.coarser(cluster), entry_points };
        let links: Vec<ClusterLink> = (0..).zip(&self.entry_points).map(link).collect();
        Ok(ClusterBuffers {
            grid: hvds.grid,
            octree: Buffer::from_slice(context, GrowsWith::Cells.named("octree"), &hvds.octree.words)?,
            cell_clusters: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("cell clusters"),
                &hvds.cell_clusters,
            )?,
            links: Buffer::from_slice(context, GrowsWith::Cells.named("cluster links"), &links)?,
            unweighted: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("unweighted clusters"),
                &hvds.unweighted,
            )?,
            base_count: hvds.levels[0].len() as u32,
        })
    }
}

impl ClusterBuffers {
    /// Empty tables, for rays that look up no cluster.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn none(context: &Arc<Context>) -> Result<Self> {
        let grid = CellGrid::new(Grid { cells: UVec3::ONE, ..Zeroable::zeroed() });
        let list = |name, words: &[u32]| Buffer::from_slice(context, GrowsWith::Cells.named(name), words);
        Ok(Self {
            octree: list("octree", &Octree::new(&grid, &[]).0.words)?,
            grid,
            cell_clusters: list("cell clusters", &[])?,
            links: list("cluster links", &[])?,
            unweighted: list("unweighted clusters", &[])?,
            base_count: 0,
        })
    }
}

/// Cluster tables on the device. The gather rays need them; so do the rays of glossy pixels.
pub struct ClusterBuffers {
    /// The smallest cells.
    pub grid: CellGrid,
    /// The octree of base cells, whose words refer to `cell_clusters`.
    pub octree: Buffer,
    /// `code << 26 | cluster` of the base cells.
    pub cell_clusters: Buffer,
    /// `ClusterLink` of each cluster: its parent, or `NO_CLUSTER` if the parent may not replace it.
    pub links: Buffer,
    /// Unweighted cluster of each base cluster, or `NO_CLUSTER`.
    pub unweighted: Buffer,
    /// Clusters of the base level.
    pub base_count: u32,
}
