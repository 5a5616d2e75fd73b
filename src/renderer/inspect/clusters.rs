//! The clusters of one level of the hierarchy, at the pixels that show them.

use super::super::Renderer;
use crate::cpu::rays::Geometry;
use crate::error::Result;
use crate::types::{NO_CLUSTER, NO_SIDE, PixelSurface};
use glam::Vec3;

/// The cluster at the surface point of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterAt {
    /// Index of the cluster among the clusters of all levels.
    pub cluster: u32,
    /// Irradiance that distant readers get now, W/m².
    pub irradiance: Vec3,
}

#[doc(hidden)]
impl Renderer {
    /// Number of levels of the hierarchy: the first is the base, with the finest cells; the last
    /// is the root.
    pub fn hvds_level_count(&self) -> u32 {
        self.world.cluster_tables.hvds.levels.len() as u32
    }

    /// Edge of the cells of a level, metres.
    pub fn hvds_cell_size_m(&self, level: u32) -> f64 {
        self.world.cluster_tables.hvds.grid.cell_size() * f64::from(level).exp2()
    }

    /// For each pixel of the last frame, row by row from the top, the cluster of `level` at its
    /// surface point. Beyond the root level, the root cluster. `None` if the ray left the scene, if
    /// the surface takes no part in transport, or before the first frame of this size. Call it
    /// between frames, before the next edit. It computes the whole hierarchy, clusters outside the
    /// live set included. That costs about as much as the frame after a light has moved.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn cluster_colours(&self, level: u32) -> Result<Vec<Option<ClusterAt>>> {
        if !self.has_picture() {
            return Ok(vec![None; self.size().iter().product::<u32>() as usize]);
        }
        self.complete_clusters()?;
        let geometry = self.geometry()?;
        let clusters = self.world.cluster_tables.hvds.cluster_count();
        let irradiance: Vec<Vec3> = self.transport.pyramid.irradiance.read_range(0, clusters as usize)?;
        let pixels: Vec<PixelSurface> = self.image.primary.pixels.read()?;
        let found = |pixel: &PixelSurface| {
            if pixel.side == NO_SIDE {
                return None;
            }
            let base = self.base_cluster_at(geometry, pixel.position, pixel.side)?;
            let cluster = self.cluster_above(base, level);
            Some(ClusterAt { cluster, irradiance: self.lights.emission_scale * irradiance[cluster as usize] })
        };
        Ok(pixels.iter().map(found).collect())
    }

    /// The base cluster at a point on a side. `None` if there is none.
    pub(super) fn base_cluster_at(&self, geometry: Geometry<'_>, position: Vec3, side: u32) -> Option<u32> {
        let cluster = geometry.cluster(&self.world.cluster_tables.hvds, position, side);
        (cluster != NO_CLUSTER).then_some(cluster)
    }

    /// The ancestor of a base cluster, `levels` levels up, or the root.
    fn cluster_above(&self, mut cluster: u32, levels: u32) -> u32 {
        for _ in 0..levels {
            match self.world.cluster_tables.hvds.parents[cluster as usize] {
                NO_CLUSTER => break,
                parent => cluster = parent,
            }
        }
        cluster
    }
}
