//! Words that recordings copy to the host.

use std::sync::Arc;

use super::{Buffer, Context};
use crate::error::Result;

/// A block of words in host memory. Recordings copy counters into it
/// ([`Recorder::copy_to_host`](super::Recorder::copy_to_host)), and the host reads them without a
/// submission of its own.
pub struct HostBlock {
    pub(super) buffer: Buffer,
}

impl HostBlock {
    /// Creates a block of `words` words, all zero.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn new(context: &Arc<Context>, name: &str, words: u32) -> Result<Self> {
        Ok(Self { buffer: Buffer::host_words(context, name, words)? })
    }

    /// Number of words.
    pub fn len(&self) -> u32 {
        (self.buffer.bytes() / 4) as u32
    }

    /// Whether the block has no words.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A word, after the recordings that are done. Panics if the block is shorter.
    pub fn word(&self, index: u32) -> u32 {
        self.buffer.mapped_word(index)
    }
}
