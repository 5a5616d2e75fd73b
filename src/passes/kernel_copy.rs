//! A kernel that copies a list. No frame uses it: it measures the throughput limit of kernels that
//! move data. In: words. Out: the same words.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};

gpu_struct! {
    pub struct KernelCopyPush {
        /// Invocations that copy.
        pub count: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[KernelCopyPush::LAYOUT];

/// The pipeline of the copying kernel.
pub struct KernelCopy {
    pipeline: Pipeline,
    words: u32,
}

impl KernelCopy {
    /// Stem of shader and timing.
    pub const STEM: &str = "kernel_copy";

    /// Creates the pipeline whose invocations copy four words each.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn of_texels(context: &Arc<Context>) -> Result<Self> {
        Self::with(context, 4)
    }

    /// Creates the pipeline whose invocations copy a word each.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn of_words(context: &Arc<Context>) -> Result<Self> {
        Self::with(context, 1)
    }

    fn with(context: &Arc<Context>, words: u32) -> Result<Self> {
        let constants = [("WORDS", u32::from(words == 1))];
        Ok(Self { pipeline: Pipeline::new(context, Self::STEM, &constants)?, words })
    }

    /// Copies the first `words` words of a buffer, a multiple of four, to another.
    pub fn record(&self, rec: &mut Recorder, from: &Buffer, to: &Buffer, words: u32) {
        let push = KernelCopyPush { count: words / self.words };
        let bindings = [("From", from), ("To", to)];
        rec.pass(Self::STEM).dispatch(&self.pipeline, [push.count, 1, 1], &push, &bindings);
    }
}
