//! Code that test binaries share.

#![allow(dead_code, unreachable_pub, clippy::unwrap_used, reason = "each test binary uses a part")]

pub mod edits;
pub mod needles;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use lightpaths::gpu::{Context, ContextOptions};

/// The device of this test binary, with validation and the hazard check on. A missing device is a
/// failure, not a skip.
pub fn context() -> Arc<Context> {
    static CONTEXT: OnceLock<Arc<Context>> = OnceLock::new();
    CONTEXT
        .get_or_init(|| {
            let options =
                ContextOptions { validation: true, hazard_check: true, ..ContextOptions::default() };
            let context =
                Context::new(&options).expect("the tests need a Vulkan device and the validation layers");
            eprintln!("{} ({}), {:?}", context.name(), context.driver(), context.limits());
            context
        })
        .clone()
}

/// Fails if the validation layer has reported anything since the last call.
pub fn assert_silent(context: &Context) {
    assert_eq!(context.take_validation_messages(), [""; 0], "the validation layer is silent");
}

/// Reproducible words: a linear congruential generator (Knuth's MMIX constants), its upper bits.
pub fn random_words(seed: u64, count: usize) -> Vec<u32> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 32) as u32
        })
        .collect()
}

/// All channels of an EXR file, by name.
pub fn channels(path: &Path) -> BTreeMap<String, Vec<f32>> {
    use exr::prelude::{ReadChannels, ReadLayers};
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let image = reader.first_valid_layer().all_attributes().from_file(path).unwrap();
    let channels = image.layer_data.channel_data.list;
    channels.iter().map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect()
}
