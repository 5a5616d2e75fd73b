//! Lists in host memory that recordings copy, so that work on the device and the exchange of its
//! data are one submission.

use std::sync::Arc;

use bytemuck::Pod;

use super::{Buffer, Context};
use crate::error::Result;

/// A list that recordings copy to the host ([`Recorder::copy_to_host`](super::Recorder)): counters,
/// or results. The host reads it without a submission of its own.
pub struct HostBlock {
    pub(super) buffer: Buffer,
}

impl HostBlock {
    /// Creates a block of `words` words, all zero.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn new(context: &Arc<Context>, name: &str, words: u32) -> Result<Self> {
        Ok(Self { buffer: Buffer::host_words(context, name.into(), words)? })
    }

    /// Creates a block for the whole of a buffer.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn of(context: &Arc<Context>, name: &str, buffer: &Buffer) -> Result<Self> {
        let words = buffer.bytes().div_ceil(4) as u32;
        Ok(Self { buffer: Buffer::host_words(context, buffer.named_beside(name), words)? })
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

    /// The first elements, after the recordings that are done. Panics if the block is shorter.
    pub fn read<T: Pod>(&self, count: usize) -> Vec<T> {
        self.buffer.read_mapped(count)
    }
}

/// A list that the host writes. [`Recorder::copy_from_host`](super::Recorder) copies it to the
/// device.
pub struct HostUpload {
    pub(super) buffer: Buffer,
}

impl HostUpload {
    /// Creates a list for the whole of a buffer.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn of(context: &Arc<Context>, name: &str, buffer: &Buffer) -> Result<Self> {
        Ok(Self { buffer: Buffer::host_upload(context, buffer.named_beside(name), buffer.bytes())? })
    }

    /// Overwrites the start of the list. All recordings that copy it must be done. Panics if the
    /// data are longer.
    pub fn write<T: Pod>(&self, data: &[T]) {
        self.buffer.write_mapped(bytemuck::cast_slice(data));
    }
}
