//! Rates of rays, and the lists of rays that are timed.

use crate::passes::precompute::rays::RayQuery;

/// Rays per second of each kind, in 10⁶. `None` if the list is empty or the clock is too coarse.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub(super) struct Rates {
    /// Closest hits of camera rays.
    pub(super) closest_coherent: Option<f64>,
    /// Closest hits of reflected rays.
    pub(super) closest_incoherent: Option<f64>,
    /// Any hit towards a light.
    pub(super) any_coherent: Option<f64>,
    /// Any hit between two surfaces.
    pub(super) any_incoherent: Option<f64>,
}

/// The lists of rays.
pub(super) struct RaySets {
    pub(super) camera: Vec<RayQuery>,
    pub(super) reflected: Vec<RayQuery>,
    pub(super) shadow: Vec<RayQuery>,
    pub(super) pairs: Vec<RayQuery>,
}

/// Rays a second, in 10⁶.
pub(super) fn mrays_per_s(rays: usize, ms: f64) -> Option<f64> {
    (rays > 0 && ms > 0.0).then(|| rays as f64 / (1e3 * ms))
}
