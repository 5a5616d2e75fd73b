//! The clusters on the device, as the precomputation asks for them: by position, and by their place
//! in the hierarchy.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::precompute::gather_rays::ClusterLink;
use crate::scene::hvds::Hvds;
use crate::types::Grid;
use bytemuck::Zeroable;
use glam::UVec3;
use std::sync::Arc;

/// The tables on the host.
pub struct ClusterTables {
    /// The hierarchy, without its fragments.
    pub hvds: Hvds,
    /// Entry points that each cluster holds, in expectation.
    pub entry_points: Vec<f32>,
}

impl ClusterTables {
    /// Of a hierarchy. `entry_points`: how many each cluster holds, in expectation.
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
            cell_offsets: Buffer::from_slice(context, "cell offsets", &hvds.cell_offsets)?,
            cell_clusters: Buffer::from_slice(context, "cell clusters", &hvds.cell_clusters)?,
            links: Buffer::from_slice(context, "cluster links", &links)?,
            unweighted: Buffer::from_slice(context, "unweighted clusters", &hvds.unweighted)?,
            base_count: hvds.levels[0].len() as u32,
        })
    }
}

impl ClusterBuffers {
    /// Tables that hold no cluster, for rays that ask for none.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn none(context: &Arc<Context>) -> Result<Self> {
        let list = |name, words: &[u32]| Buffer::from_slice(context, name, words);
        Ok(Self {
            grid: Grid { cells: UVec3::ONE, ..Zeroable::zeroed() },
            cell_offsets: list("cell offsets", &[0; 2])?,
            cell_clusters: list("cell clusters", &[])?,
            links: list("cluster links", &[])?,
            unweighted: list("unweighted clusters", &[])?,
            base_count: 0,
        })
    }
}

/// Needed until the gather rays are traced; if pixels may be glossy, by their rays, too.
pub struct ClusterBuffers {
    /// The base grid.
    pub grid: Grid,
    /// First place in `cell_clusters` of each base cell, and the end.
    pub cell_offsets: Buffer,
    /// `code << 26 | cluster` of the base cells.
    pub cell_clusters: Buffer,
    /// `ClusterLink` of each cluster: its parent, if that may stand for it.
    pub links: Buffer,
    /// Whole of each base cluster, or `NO_CLUSTER`.
    pub unweighted: Buffer,
    /// Clusters of the base level.
    pub base_count: u32,
}
