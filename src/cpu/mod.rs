//! Slow and simple reference implementations of the passes, with the same inputs and outputs. Tests
//! compare the device with them.
//!
//! A reference takes the f32 inputs of the device and computes in f64. Integer decisions of the
//! device are integer decisions here, too.

pub mod accessibility;
pub mod antialias;
pub mod blend;
pub mod brdf;
pub mod bright;
pub mod compose;
pub mod direct;
pub mod emission;
pub mod entry_points;
pub mod form_factors;
pub mod gather;
pub mod gather_rays;
pub mod gloss;
pub mod gloss_pixels;
pub mod hemisphere;
pub mod hvds;
pub mod irradiance_probe;
pub mod light_paths;
pub mod light_sum;
pub mod lights;
pub mod lit_scene;
pub mod math;
pub mod near_field;
pub mod near_lights;
pub mod needed_records;
pub mod path_scan;
pub mod path_trace;
pub mod photon_gather;
pub mod photon_irradiance;
pub mod photon_map;
pub mod photon_reach;
pub mod photon_trace;
pub mod photons;
pub mod pixel_colours;
pub mod prefix_sum;
pub mod primary;
pub mod rays;
pub mod receivers;
pub mod records;
pub mod sampling;
pub mod shafts;
pub mod sky_factors;
pub mod splat;
pub mod splat_apply;
pub mod textures;
pub mod tile_sort;
mod tone_curves;
pub mod tonemap;
