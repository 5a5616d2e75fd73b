//! Passes of the reference renderers.

pub mod irradiance_probe;
pub mod path_trace;
pub mod photon_gather;
pub mod photon_irradiance;
pub mod photon_map;
pub mod photon_reach;
pub mod photon_trace;
pub mod tile_sort;
