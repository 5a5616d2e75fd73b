//! The device: the only code that talks to Vulkan and the only code that is `unsafe`.
//!
//! Compute on one queue; only `window` draws, on the same one. A [`Context`] owns device and
//! memory, a [`Buffer`] is storage on it, a [`Pipeline`] is a shader made ready, all it needs to
//! know read from its SPIR-V. [`Context::run`] records, submits and waits: within it
//! [`Recorder::pass`] opens a pass, which is a label, two timestamps and a row in the returned
//! timings. Barriers are explicit, from the vocabulary in [`barrier`], and checked while recording.

pub mod barrier;
mod buffer;
mod capture;
mod context;
mod device;
pub mod hash;
mod hazard;
mod instance;
mod optional;
mod pipeline;
mod pipeline_store;
mod pipelines;
mod recorder;
pub mod shaders;
pub mod spirv;
mod split_buffer;
mod submission;
mod timeline;
mod timing;
mod tuning;
#[cfg(feature = "window")]
pub mod window;

pub use barrier::Barrier;
pub use buffer::Buffer;
pub use capture::Capture;
pub use context::{Context, ContextOptions, MemoryUse};
pub use device::{DeviceSummary, Limits};
pub use optional::{PipelineStatistics, Statistic};
pub use pipeline::Pipeline;
pub use recorder::{PassScope, Recorder};
pub use split_buffer::{SplitBuffer, SplitPart};
pub use timeline::{HostSpan, PassSpan, SubmissionSpan, Trace};
pub use timing::PassTiming;
pub use tuning::Tuning;

use crate::error::{Error, Result};
use ash::vk;

/// Turns the result of a Vulkan call into ours, keeping the call's name.
trait VkResultExt<T> {
    fn vk(self, call: &'static str) -> Result<T>;
}

impl<T> VkResultExt<T> for ash::prelude::VkResult<T> {
    fn vk(self, call: &'static str) -> Result<T> {
        self.map_err(|result: vk::Result| Error::Vulkan { call, result, pass: None })
    }
}
