//! The clusters on the device, as the precomputation asks for them: by position, and by their place in the hierarchy.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::precompute::gather_rays::ClusterLink;
use crate::scene::hvds::Hvds;
use crate::types::Grid;
use std::sync::Arc;

/// Needed until the gather rays are traced.
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

impl ClusterBuffers {
    /// Uploads the tables. `entry_points`: how many each cluster holds, in expectation.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn new(context: &Arc<Context>, hvds: &Hvds, entry_points: &[f32]) -> Result<Self> {
        let links: Vec<ClusterLink> = (0..)
            .zip(entry_points)
            .map(|(cluster, &entry_points)| ClusterLink { parent: hvds.coarser(cluster), entry_points })
            .collect();
        Ok(Self {
            grid: hvds.grid,
            cell_first: Buffer::from_slice(context, "cell first", &hvds.cell_first)?,
            cell_clusters: Buffer::from_slice(context, "cell clusters", &hvds.cell_clusters)?,
            links: Buffer::from_slice(context, "cluster links", &links)?,
            wholes: Buffer::from_slice(context, "wholes", &hvds.wholes)?,
            base_count: hvds.levels[0].len() as u32,
        })
    }
}
