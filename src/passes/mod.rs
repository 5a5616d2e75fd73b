//! The passes: each a host file, a shader and a CPU reference of one stem.

pub mod bright_tables;
mod cluster_buffers;
mod emission_buffers;
pub mod frame;
pub mod gather_targets;
pub mod gloss_tables;
mod grows_with;
pub mod kernel_copy;
mod lattice;
mod light_table;
mod loop_limit;
pub mod meters;
mod one_light;
pub mod precompute;
pub mod reference;
mod scene_buffers;
mod texture_buffers;

pub use cluster_buffers::{ClusterBuffers, ClusterTables};
pub use emission_buffers::EmissionBuffers;
pub use grows_with::GrowsWith;
pub use light_table::{LightRows, LightTable, light_sources};
pub use one_light::{LightKernel, OneLight, SkyTable};
pub use scene_buffers::{LitScene, SceneBuffers, reflectances};
pub use texture_buffers::{TextureBuffers, has_textures};

use crate::layout::Layout;

/// The layout of every structure that a pass shares with its shaders: one line a pass.
pub fn layouts() -> Vec<Layout> {
    [
        crate::types::LAYOUTS,
        precompute::rays::LAYOUTS,
        precompute::entry_points::LAYOUTS,
        precompute::light_paths::LAYOUTS,
        precompute::visibility::accessibility::LAYOUTS,
        precompute::visibility::clearance::LAYOUTS,
        precompute::gather_rays::LAYOUTS,
        precompute::neighbours::LAYOUTS,
        frame::primary::LAYOUTS,
        frame::shafts::LAYOUTS,
        frame::silhouettes::LAYOUTS,
        frame::direct::LAYOUTS,
        frame::antialias::LAYOUTS,
        frame::form_factors::LAYOUTS,
        frame::sky_factors::LAYOUTS,
        cluster_buffers::LAYOUTS,
        gloss_tables::LAYOUTS,
        frame::near_lights::LAYOUTS,
        frame::light_sum::LAYOUTS,
        frame::path_scan::LAYOUTS,
        frame::hvds::LAYOUTS,
        frame::near_field::LAYOUTS,
        frame::gloss::LAYOUTS,
        frame::gloss_beams::LAYOUTS,
        frame::gloss_pixels::LAYOUTS,
        frame::gloss_samples::LAYOUTS,
        frame::gloss_records::LAYOUTS,
        frame::highlights::LAYOUTS,
        frame::needed_records::LAYOUTS,
        frame::gather::LAYOUTS,
        frame::blend::LAYOUTS,
        bright_tables::LAYOUTS,
        frame::bright::LAYOUTS,
        frame::prefix_sum::LAYOUTS,
        frame::record_tree::LAYOUTS,
        frame::splat::LAYOUTS,
        frame::own_records::LAYOUTS,
        frame::pixel_colours::LAYOUTS,
        frame::compose::LAYOUTS,
        frame::tonemap::LAYOUTS,
        kernel_copy::LAYOUTS,
        meters::LAYOUTS,
        reference::path_trace::LAYOUTS,
        reference::irradiance_probe::LAYOUTS,
        reference::photon_trace::LAYOUTS,
        reference::photon_map::LAYOUTS,
        reference::tile_sort::LAYOUTS,
        reference::photon_reach::LAYOUTS,
        reference::photon_irradiance::LAYOUTS,
        reference::photon_gather::LAYOUTS,
    ]
    .concat()
}
