//! Each pass on the device against its slow reference on the CPU, at awkward sizes.
//!
//! Integers are exact. Floats agree to 1e-5, sums to 1e-4, each relative to the largest value of
//! the test. A test with another tolerance gives the reason. If a ray grazes an edge, f32 and f64
//! may take different sides: such tests state the allowed fraction.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;

mod accessibility;
mod addresses;
mod antialias;
mod blend;
mod bright;
mod clusters;
mod compose;
mod energy;
mod entry_points;
mod fragments;
mod frame;
mod gather;
mod gather_rays;
mod gloss;
mod gloss_pixels;
mod gloss_readers;
mod gloss_records;
mod inconsistent;
mod inspect;
mod irradiance_probe;
mod kernel_copy;
mod light_paths;
mod lights;
mod loop_limit;
mod merged_rays;
mod meters;
mod near_field;
mod near_hits;
mod near_lights;
mod needed_records;
mod path_scan;
mod path_trace;
mod photon_gather;
mod photons;
mod pixels;
mod plan;
mod prefix_sum;
mod preview;
mod rays;
mod reads;
mod resize;
mod shafts;
mod silhouettes;
mod sky;
mod splat;
mod textures;
mod tile_sort;
mod world;
