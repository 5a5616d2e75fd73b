//! Transfers: fills, copies, updates.

use std::any::Any;
use std::ops::Range;
use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;

use super::super::barrier::Places;
use super::super::hazard::Use;
use super::super::schedule::Command;
use super::super::{Buffer, Context, HostBlock, HostUpload};
use super::Recorder;

impl Recorder {
    /// Sets every byte of the buffer to zero. A transfer.
    pub fn fill_zero(&mut self, buffer: &Buffer) {
        if self.leaves_out {
            return;
        }
        self.in_use.push(buffer.allocated.clone());
        let (buffer_handle, bytes) = (buffer.allocated.handle, buffer.allocated.bound_bytes);
        self.command(Command::Fill { buffer: buffer_handle, bytes }, |_| vec![transfer(buffer, true)]);
    }

    /// Copies the whole of `from` to the start of `to`. A transfer. Panics if `to` is smaller.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) {
        self.copy_bytes(from, 0, to, 0, from.bytes());
    }

    pub(in crate::gpu) fn copy_bytes(
        &mut self,
        from: &Buffer,
        first: u64,
        to: &Buffer,
        to_first: u64,
        bytes: u64,
    ) {
        let uses = |_: &Context| vec![transfer(from, false), transfer(to, true)];
        self.copy_range(from, first, to, to_first, bytes, uses);
    }

    fn copy_range(
        &mut self,
        from: &Buffer,
        first: u64,
        to: &Buffer,
        to_first: u64,
        bytes: u64,
        uses: impl FnOnce(&Context) -> Vec<Use>,
    ) {
        assert!(
            first + bytes <= from.bytes() && to_first + bytes <= to.bytes(),
            "cannot copy {bytes} bytes from `{}` to `{}`",
            from.allocated.name,
            to.allocated.name
        );
        if bytes == 0 || self.leaves_out {
            return;
        }
        self.in_use.extend([from, to].map(|buffer| buffer.allocated.clone() as Arc<dyn Any>));
        let region = vk::BufferCopy { src_offset: first, dst_offset: to_first, size: bytes };
        let (from, to) = (from.allocated.handle, to.allocated.handle);
        self.command(Command::Copy { from, to, region }, uses);
    }

    /// Overwrites the start of the buffer with `data`, which travels within the commands. For small
    /// data: edits, not scenes. A transfer. Panics if the data are longer than the buffer.
    pub fn upload<T: Pod>(&mut self, buffer: &Buffer, data: &[T]) {
        let (bytes, name) = (bytemuck::cast_slice::<T, u8>(data), &buffer.allocated.name);
        assert!(bytes.len() as u64 <= buffer.bytes(), "`{name}` is shorter than {} bytes", bytes.len());
        assert!(bytes.len().is_multiple_of(4), "`{name}`: the device updates whole words");
        if bytes.is_empty() || self.leaves_out {
            return;
        }
        self.in_use.push(buffer.allocated.clone());
        let update = Command::Update { buffer: buffer.allocated.handle, data: bytes.to_vec() };
        self.command(update, |_| vec![transfer(buffer, true)]);
    }

    /// Copies some elements of a list that the host has written to the start of `to`. A transfer.
    /// Panics if one of them is too short.
    pub fn copy_from_host<T: Pod>(&mut self, from: &HostUpload, elements: Range<u32>, to: &Buffer) {
        let [first, end] = [elements.start, elements.end].map(|place| bytes_of::<T>(place));
        self.copy_bytes(&from.buffer, first, to, 0, end - first);
    }

    /// Copies as many elements from the start of `from` to these places of a block that the host
    /// reads. A transfer. Panics if one of them is too short.
    pub fn copy_elements_to_host<T: Pod>(&mut self, from: &Buffer, block: &HostBlock, places: Range<u32>) {
        let [first, end] = [places.start, places.end].map(|place| (bytes_of::<T>(place) / 4) as u32);
        self.copy_to_host(from, 0, block, first, end - first);
    }

    /// Copies `words` words from a byte offset of `from` to word `to` of a block that the host
    /// reads. A transfer. Panics if one of them is too short.
    pub fn copy_to_host(&mut self, from: &Buffer, offset: u64, block: &HostBlock, to: u32, words: u32) {
        // The check tracks neither the host nor words of a buffer: copies go to different words.
        let uses = |_: &Context| vec![transfer(from, false)];
        self.copy_range(from, offset, &block.buffer, 4 * u64::from(to), 4 * u64::from(words), uses);
        self.copies_to_host |= !self.leaves_out;
        self.host_copy_bytes += 4 * u64::from(words);
    }

    /// Keeps a buffer until the commands are done.
    #[cfg(feature = "window")]
    pub(in crate::gpu) fn keep(&mut self, buffer: &Buffer) {
        self.in_use.push(buffer.allocated.clone());
    }
}

fn bytes_of<T>(count: u32) -> u64 {
    u64::from(count) * size_of::<T>() as u64
}

/// How a transfer uses a buffer.
pub(super) fn transfer(buffer: &Buffer, writes: bool) -> Use {
    Use {
        buffer: vk::Handle::as_raw(buffer.allocated.handle),
        name: buffer.allocated.name.clone(),
        place: Places::TRANSFER,
        reads: !writes,
        writes,
    }
}
