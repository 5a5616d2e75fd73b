//! The scene as the precomputation has prepared it.

use super::enclosures::Enclosures;
use crate::passes::{ClusterBuffers, ClusterTables, SceneBuffers};
use crate::scene::Scene;
use crate::types::{Reflectance, Surface};
use glam::Vec3;

/// The scene, with its triangles in BVH order, and the tables that only queries read.
pub(super) struct World {
    pub(super) scene: Scene,
    pub(super) surfaces: Vec<Surface>,
    pub(super) buffers: SceneBuffers,
    pub(super) enclosures: Enclosures,
    pub(super) cluster_tables: ClusterTables,
    /// `None` if no material may be glossy: no ray queries clusters after the precomputation.
    pub(super) clusters: Option<ClusterBuffers>,
    /// Index of each light path's random stream.
    pub(super) path_streams: Vec<u32>,
    /// Materials at the time when the light paths were traced.
    pub(super) traced_with: Vec<Reflectance>,
}

impl World {
    /// Unit normal on a side.
    pub(super) fn normal(&self, side: u32) -> Vec3 {
        self.surfaces[side as usize / 2].normal_of(side % 2 == 1)
    }
}
