//! The clusters of a level of the hierarchy, where pixels show them.

use super::super::Renderer;
use crate::cpu::rays::Geometry;
use crate::error::Result;
use crate::types::{NO_CLUSTER, NO_SIDE, PixelSurface};
use glam::Vec3;

/// The cluster that holds what a pixel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClusterAt {
    /// Its index among those of all levels.
    pub cluster: u32,
    /// Its irradiance now, W/m²: as readers from afar see it.
    pub irradiance: Vec3,
}

impl Renderer {
    /// Levels of the hierarchy: the first is the base, of the finest cells, the last the root.
    pub fn hvds_level_count(&self) -> u32 {
        self.cluster_tables.hvds.levels.len() as u32
    }

    /// Edge of the cells of a level, metres.
    pub fn hvds_cell_size_m(&self, level: u32) -> f64 {
        self.cluster_tables.hvds.grid.cell_size() * f64::from(level).exp2()
    }

    /// For each pixel of the last frame, row by row from the top, the cluster of that level that
    /// holds what it shows; of a level beyond the root, the root's. None where the ray left the
    /// scene, where the pixel's surface takes no part in transport, and before the first frame of
    /// this size. Works out the whole hierarchy, of which frames leave out what nothing reads:
    /// about as much work as the frame after a light has moved. To be asked between frames, before
    /// the next edit.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn cluster_colours(&self, level: u32) -> Result<Vec<Option<ClusterAt>>> {
        if !self.has_picture() {
            return Ok(vec![None; self.size().iter().product::<u32>() as usize]);
        }
        self.complete_clusters()?;
        let geometry = self.geometry()?;
        let clusters = self.cluster_tables.hvds.cluster_count();
        let irradiance: Vec<Vec3> = self.pyramid.irradiance.read_range(0, clusters as usize)?;
        let pixels: Vec<PixelSurface> = self.primary.pixels.read()?;
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

    /// The base cluster that holds a point of a side.
    pub(super) fn base_cluster_at(&self, geometry: Geometry<'_>, position: Vec3, side: u32) -> Option<u32> {
        let cluster = geometry.cluster(&self.cluster_tables.hvds, position, side);
        (cluster != NO_CLUSTER).then_some(cluster)
    }

    /// The cluster that holds a base cluster so many levels up, or the root's.
    fn cluster_above(&self, mut cluster: u32, levels: u32) -> u32 {
        for _ in 0..levels {
            match self.cluster_tables.hvds.parents[cluster as usize] {
                NO_CLUSTER => break,
                parent => cluster = parent,
            }
        }
        cluster
    }
}
