//! The clusters on the device, as the precomputation asks for them: by position, and by their place in the hierarchy.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::precompute::gather_rays::ClusterLink;
use crate::scene::hvds::Hvds;
use crate::types::Grid;
use std::sync::Arc;

/// The tables on the host.
pub struct ClusterTables {
    grid: Grid,
    cell_first: Vec<u32>,
    cell_clusters: Vec<u32>,
    links: Vec<ClusterLink>,
    wholes: Vec<u32>,
    base_count: u32,
}

impl ClusterTables {
    /// Of a hierarchy. `entry_points`: how many each cluster holds, in expectation.
    pub fn new(hvds: &Hvds, entry_points: &[f32]) -> Self {
        let link = |(cluster, &entry_points)| ClusterLink { parent: hvds.coarser(cluster), entry_points };
        Self {
            grid: hvds.grid,
            cell_first: hvds.cell_first.clone(),
            cell_clusters: hvds.cell_clusters.clone(),
            links: (0..).zip(entry_points).map(link).collect(),
            wholes: hvds.wholes.clone(),
            base_count: hvds.levels[0].len() as u32,
        }
    }

    /// Uploads them.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn upload(&self, context: &Arc<Context>) -> Result<ClusterBuffers> {
        Ok(ClusterBuffers {
            grid: self.grid,
            cell_first: Buffer::from_slice(context, "cell first", &self.cell_first)?,
            cell_clusters: Buffer::from_slice(context, "cell clusters", &self.cell_clusters)?,
            links: Buffer::from_slice(context, "cluster links", &self.links)?,
            wholes: Buffer::from_slice(context, "wholes", &self.wholes)?,
            base_count: self.base_count,
        })
    }
}

/// Needed until the gather rays are traced; where pixels may shine, by their rays, too.
pub struct ClusterBuffers {
    /// The base grid.
    pub grid: Grid,
    /// First place in `cell_clusters` of each base cell, and the end.
    pub cell_first: Buffer,
    /// `code << 26 | cluster` of the base cells.
    pub cell_clusters: Buffer,
    /// `ClusterLink` of each cluster: its parent, if that may stand for it.
    pub links: Buffer,
    /// Whole of each base cluster, or `NO_CLUSTER`.
    pub wholes: Buffer,
    /// Clusters of the base level.
    pub base_count: u32,
}
