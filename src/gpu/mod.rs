//! The device layer: the only code that calls Vulkan, and the only `unsafe` code.
//!
//! All compute runs on one queue; only `window` draws, on the same queue. A [`Context`] owns device
//! and memory, a [`Buffer`] is storage on it, a [`Pipeline`] is a compiled shader whose interface
//! is read from its SPIR-V. [`Context::run`] records, submits and waits. Within it,
//! [`Recorder::pass`] opens a pass: a label, two timestamps and a row in the returned timings.
//! Barriers are explicit, from the vocabulary in [`barrier`], and checked while recording.

pub mod barrier;
mod buffer;
mod buffer_name;
mod capture;
mod command_counts;
mod context;
mod device;
mod device_files;
mod glsl;
pub mod hash;
mod hazard;
mod host_block;
mod in_flight;
mod instance;
mod names;
mod optional;
mod pipeline;
mod pipeline_store;
mod pipelines;
mod program;
mod quirks;
mod recorder;
mod reload;
mod run;
mod schedule;
pub mod shaders;
pub mod spirv;
mod split_buffer;
mod submission;
mod timeline;
mod timing;
mod tuning;
mod tuning_store;
#[cfg(feature = "window")]
pub mod window;

pub use barrier::Barrier;
pub use buffer::Buffer;
pub use buffer_name::BufferName;
pub use capture::Capture;
pub use command_counts::CommandCounts;
pub use context::{Context, ContextOptions, MemoryUse};
pub use device::{DeviceSummary, Limits};
pub use device_files::cache_folder;
pub use host_block::{HostBlock, HostUpload};
pub use in_flight::InFlight;
pub use optional::{PipelineStatistics, Statistic};
pub use pipeline::Pipeline;
pub use quirks::MAX_LOOP_ITERATIONS;
pub use recorder::{PassScope, Recorder};
pub use reload::NO_COMPILER;
pub use split_buffer::{Chunk, SplitBuffer};
pub use timeline::{HostSpan, PassSpan, SubmissionSpan, Trace};
pub use timing::PassTiming;
pub use tuning::{CHOICES, Choice, Tuned, Tuning, TuningChange, TuningSource};

use crate::error::{Error, Result};
use ash::vk;

/// Converts the result of a Vulkan call to the crate's, with the name of the call.
trait VkResultExt<T> {
    fn vk(self, call: &'static str) -> Result<T>;
}

impl<T> VkResultExt<T> for ash::prelude::VkResult<T> {
    fn vk(self, call: &'static str) -> Result<T> {
        self.map_err(|result: vk::Result| Error::Vulkan { call, result, pass: None })
    }
}
