//! Stable radix sort of (tile, record) pairs by tile: eight bits a round, counts and ranks by
//! blocks of 256 pairs. In: pairs in record order, their number on the device. Out: pairs by tile,
//! and by record within a tile. Deterministic.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::prefix_sum::PrefixSum;
use std::sync::Arc;

gpu_struct! {
    /// A record that may touch a tile.
    pub struct TilePair {
        /// Tile, row by row.
        pub tile: u32,
        pub record: u32,
    }
}

gpu_struct! {
    /// Push constants of both kernels.
    pub struct SortPush {
        /// Shift of the eight-bit digit.
        pub shift: u32,
        /// Blocks of 256 pairs.
        pub block_count: u32,
        /// Index of the pair count in `PairOffsets`.
        pub record_count: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[TilePair::LAYOUT, SortPush::LAYOUT];

/// Pairs of one block.
const BLOCK: u32 = 256;

/// The pipelines, two lists of pairs for the passes of the sort, and the digit counts.
pub struct TileSort {
    count: Pipeline,
    scatter: Pipeline,
    prefix_sum: PrefixSum,
    lists: [Buffer; 2],
    digit_counts: Buffer,
    block_count: u32,
}

impl TileSort {
    /// Allocates lists of `capacity` pairs.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, capacity: u32) -> Result<Self> {
        let block_count = capacity.div_ceil(BLOCK).max(1);
        let bytes = u64::from(block_count) * u64::from(BLOCK) * size_of::<TilePair>() as u64;
        Ok(Self {
            count: Pipeline::new(context, "sort_count", &[])?,
            scatter: Pipeline::new(context, "sort_scatter", &[])?,
            prefix_sum: PrefixSum::new(context, block_count * 256)?,
            lists: [
                Buffer::storage(context, GrowsWith::Pixels.named("tile pairs"), bytes)?,
                Buffer::storage(context, GrowsWith::Pixels.named("sorted pairs"), bytes)?,
            ],
            digit_counts: Buffer::storage(
                context,
                GrowsWith::Pixels.named("digit counts"),
                4 * (u64::from(block_count) * 256 + 1),
            )?,
            block_count,
        })
    }

    /// Capacity in pairs.
    pub fn capacity(&self) -> u32 {
        self.block_count * BLOCK
    }

    /// The list for the unsorted pairs.
    pub fn input(&self) -> &Buffer {
        &self.lists[0]
    }

    /// Sorts by the digits that `tile_count` needs and returns the sorted list. The number of pairs
    /// is word `record_count` of `pair_offsets`. Records into an open pass with barriers between
    /// its own dispatches.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        pair_offsets: &Buffer,
        record_count: u32,
        tile_count: u32,
    ) -> &Buffer {
        let bits = u32::BITS - tile_count.saturating_sub(1).leading_zeros();
        let rounds = bits.div_ceil(8).max(1);
        for round in 0..rounds {
            let [from, to] = [round % 2, (round + 1) % 2].map(|list| &self.lists[list as usize]);
            let push = SortPush { shift: 8 * round, block_count: self.block_count, record_count };
            let threads = [self.block_count * BLOCK, 1, 1];
            if round > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            let counted =
                [("PairOffsets", pair_offsets), ("Pairs", from), ("DigitCounts", &self.digit_counts)];
            pass.dispatch(&self.count, threads, &push, &counted);
            pass.barrier(COMPUTE_TO_COMPUTE);
            self.prefix_sum.record(pass, &self.digit_counts, self.block_count * 256);
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.scatter,
                threads,
                &push,
                &[
                    ("PairOffsets", pair_offsets),
                    ("Pairs", from),
                    ("DigitOffsets", &self.digit_counts),
                    ("SortedPairs", to),
                ],
            );
        }
        &self.lists[rounds as usize % 2]
    }
}
