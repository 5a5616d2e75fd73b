//! Measures against light leaks and hidden surface. A cluster has one flux for all its surface, so
//! light crosses a wall inside it, and surface that no light reaches darkens its mean. Each file
//! measures one such fault with rays, on the surface and before any light is known. Planes that
//! split clusters are in `src/scene`.

pub mod accessibility;
pub mod clearance;
pub mod exposed_fractions;
pub mod inconsistent;
pub mod narrow_cavities;
pub mod near_clusters;
pub mod near_hits;
pub mod sides;

/// Results of the measures from which the hierarchy is finished.
pub struct Visibility {
    /// Positions and orientations of clusters of the finest levels.
    pub patches: Vec<near_clusters::Patch>,
    /// Whether each cluster is visibility-inconsistent. Empty if none is.
    pub inconsistent: Vec<bool>,
}
