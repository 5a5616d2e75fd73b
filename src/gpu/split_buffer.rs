//! Split buffers: lists that may be longer than a binding of the device. They are cut into chunks,
//! a buffer each.

use super::{Buffer, BufferName, Context};
use crate::error::Result;
use bytemuck::Pod;
use std::ops::Range;
use std::sync::Arc;

/// A list in one or more buffers.
pub struct SplitBuffer(Vec<Chunk>);

/// One chunk of the list.
pub struct Chunk {
    /// Range of the chunk's items.
    pub items: Range<u32>,
    /// Buffer of these items.
    pub buffer: Buffer,
}

impl SplitBuffer {
    /// Maximum number of items in one binding of the device.
    pub fn longest<T>(context: &Context) -> u32 {
        let most = context.limits().storage_range_bytes / size_of::<T>() as u64;
        u32::try_from(most).unwrap_or(u32::MAX)
    }

    /// A list in chunks of `most` items; the last may be shorter.
    ///
    /// # Errors
    /// As [`Buffer::from_slice`].
    pub fn cut<'a, T: Pod>(
        context: &Arc<Context>,
        name: impl Into<BufferName<'a>>,
        items: &[T],
        most: u32,
    ) -> Result<Self> {
        let name = name.into();
        let count = items.len().div_ceil(most as usize).max(1);
        let chunk = |index: usize| {
            let start = index * most as usize;
            let own = start..items.len().min(start + most as usize);
            let buffer = Buffer::from_slice(context, name, &items[own.clone()])?;
            Ok(Chunk { items: own.start as u32..own.end as u32, buffer })
        };
        Ok(Self((0..count).map(chunk).collect::<Result<_>>()?))
    }

    /// The chunks, in order.
    pub fn iter(&self) -> std::slice::Iter<'_, Chunk> {
        self.0.iter()
    }

    /// All items in order, in spans of at most `most` items, each with its chunk. If the list is
    /// empty, one empty span.
    pub fn spans(&self, most: u32) -> impl Iterator<Item = (&Chunk, Range<u32>)> {
        self.iter().flat_map(move |chunk| {
            let Range { start, end } = chunk.items;
            let count = (end - start).div_ceil(most).max(1);
            (0..count).map(move |index| {
                let first = start + index * most;
                (chunk, first..end.min(first.saturating_add(most)))
            })
        })
    }

    /// The buffer of a list with one chunk. Panics if it has several.
    pub fn whole(&self) -> &Buffer {
        assert!(self.0.len() == 1, "the list is in {} chunks", self.0.len());
        &self.0[0].buffer
    }

    /// Reads the item with this index. Panics if there is none.
    ///
    /// # Errors
    /// As [`Buffer::read`].
    pub fn read_one<T: Pod>(&self, item: u32) -> Result<T> {
        let chunk = self.iter().find(|chunk| chunk.items.contains(&item)).expect("the list has such an item");
        Ok(chunk.buffer.read_range((item - chunk.items.start) as usize, 1)?[0])
    }

    /// Bytes of all chunks.
    pub fn bytes(&self) -> u64 {
        self.iter().map(|chunk| chunk.buffer.bytes()).sum()
    }

    /// Reads the list. Panics if a chunk's size is no multiple of an item's.
    ///
    /// # Errors
    /// As [`Buffer::read`].
    pub fn read<T: Pod>(&self) -> Result<Vec<T>> {
        let chunks: Vec<Vec<T>> = self.iter().map(|chunk| chunk.buffer.read()).collect::<Result<_>>()?;
        Ok(chunks.concat())
    }
}
