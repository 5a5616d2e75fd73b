//! Fragments: pieces of triangles in cells, from which clusters are made.

use glam::Vec3;

/// The polygon of one triangle side in one base cell, in which candidate cache points are drawn.
#[derive(Clone, Debug)]
pub struct Fragment {
    /// 2·triangle + (1 if the back side).
    pub side: u32,
    /// Its base cluster.
    pub cluster: u32,
    /// Exact area, m².
    pub area_m2: f64,
    /// Exposed area fraction: the fraction outside of solids, 0..=1.
    pub open: f32,
    /// Corners of the convex polygon, on the surface.
    pub corners: Vec<Vec3>,
}

impl Fragment {
    /// Mean of the corners.
    pub fn middle(&self) -> Vec3 {
        self.corners.iter().sum::<Vec3>() / self.corners.len() as f32
    }

    /// Exposed area, m².
    pub fn open_area_m2(&self) -> f64 {
        f64::from(self.open) * self.area_m2
    }
}

/// The plane that splits a cluster: `normal·x = w`. The second half lies in front of it.
pub type Plane = [f32; 4];
