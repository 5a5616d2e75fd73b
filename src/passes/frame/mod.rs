//! Passes of a frame.

pub mod antialias;
pub mod bin_reads;
pub mod blend;
pub mod compose;
pub mod direct;
pub mod edges;
pub mod form_factors;
pub mod gather;
pub mod gloss;
pub mod gloss_beams;
pub mod gloss_pixels;
pub mod highlights;
pub mod hvds;
pub mod light_sum;
pub mod near_field;
pub mod near_lights;
pub mod needed_records;
pub mod path_scan;
pub mod pixel_colours;
pub mod prefix_sum;
pub mod primary;
pub mod shafts;
pub mod splat;
pub mod splat_capacity;
pub mod tile_sort;
pub mod tonemap;
