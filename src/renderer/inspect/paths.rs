//! A light path, vertex by vertex. Positions are not stored, so the path is traced again with the
//! same random numbers. The flux that arrives at its vertices is stored.

use super::super::Renderer;
use crate::error::Result;
use crate::passes::ClusterBuffers;
use crate::passes::precompute::light_paths::{self, PathState};
use crate::types::Contribution;
use glam::Vec3;

/// A vertex of a light path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Point on a surface.
    pub position: Vec3,
    /// Unit geometric normal on the side that it lies on.
    pub normal: Vec3,
    /// Base cluster that the vertex contributes to. `None` inside a solid, where
    /// surface is interior.
    pub cluster: Option<u32>,
    /// Fraction of the path's flux that arrives here, per channel, with the materials of the last
    /// frame. If the entry point is glossy, the fraction of the flux after the first bounce. Zero
    /// if the vertex contributes to no cluster.
    pub throughput: Vec3,
}

#[doc(hidden)]
impl Renderer {
    /// The entry point nearest to `position`; its index is that of its path. `None` if there are no
    /// entry points. Reads all of them.
    ///
    /// # Errors
    /// The device failed.
    pub fn entry_point_near(&self, position: Vec3) -> Result<Option<u32>> {
        let points = self.transport.form_factors.entry_points()?;
        let distances = points.iter().map(|point| point.position.distance_squared(position));
        let nearest = (0..).zip(distances).min_by(|(_, a), (_, b)| a.total_cmp(b));
        Ok(nearest.map(|(index, _)| index))
    }

    /// The path that begins at this entry point, with the entry point first. Empty if there is no
    /// such entry point. Reads the steps of all paths before it.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn light_path_of(&self, entry_point: u32) -> Result<Vec<PathPoint>> {
        let steps = self.transport.path_scan.steps_of(entry_point)?;
        let Some(head) = steps.first() else { return Ok(Vec::new()) };
        let entry = self.transport.form_factors.entry_point(entry_point)?;
        let stream = self.world.path_streams[entry_point as usize];
        let cell_sizes = &self.world.scene.cell_sizes;
        let clusters = match cell_sizes.regions.is_empty() {
            true => ClusterBuffers::none(&self.context)?,
            false => self.world.cluster_tables.upload(&self.context)?,
        };
        let vertices = light_paths::retrace(
            &self.context,
            &self.world.buffers,
            (&clusters, cell_sizes),
            &self.world.traced_with,
            PathState::at([0, stream], entry.position, entry.side, head.weight),
            self.world.scene.quality.seed,
        )?;
        let geometry = self.geometry()?;
        let contributions = &self.transport.path_scan.contributions;
        steps
            .iter()
            .zip(vertices)
            .map(|(step, (position, side))| {
                let cluster = self.base_cluster_at(geometry, position, side);
                let throughput = match cluster {
                    Some(_) => contributions.read_one::<Contribution>(step.contribution)?.throughput,
                    None => Vec3::ZERO,
                };
                Ok(PathPoint { position, normal: geometry.normal(side), cluster, throughput })
            })
            .collect()
    }
}
