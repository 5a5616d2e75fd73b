//! Exclusive prefix sum of `u32` values in place, followed by the total: counts become CSR offsets.
//! [Merrill and Grimshaw 2009, reduce-then-scan] Wrapping; deterministic.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};

gpu_struct! {
    /// Push constants of both shaders.
    pub struct PrefixSumPush {
        /// Values to sum.
        pub count: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[PrefixSumPush::LAYOUT];

/// Values of one workgroup. Each invocation sums a segment of them before the workgroup
/// combines the sums.
const BLOCK_LENGTH: u32 = 2048;

/// The pipelines and the buffers of block sums.
pub struct PrefixSum {
    reduce: Pipeline,
    scan: Pipeline,
    /// Values that one invocation adds up.
    items: u32,
    capacity: u32,
    /// Block sums of the values, then of the block sums, and so on, down to one block.
    block_sums: Vec<Buffer>,
    /// The offset of the only block of the last level.
    zero: Buffer,
}

impl PrefixSum {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "prefix_sum";

    /// Prepares sums of up to `capacity` values.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, capacity: u32) -> Result<Self> {
        let group = context.tuning().scan_group;
        let items = BLOCK_LENGTH / group;
        let constants = [("local_size_x", group), ("ITEMS", items)];
        let mut block_sums = Vec::new();
        let mut count = capacity;
        while count > BLOCK_LENGTH {
            count = count.div_ceil(BLOCK_LENGTH);
            // One more element, because the scan appends the total.
            block_sums.push(Buffer::storage(context, "block sums", 4 * (u64::from(count) + 1))?);
        }
        Ok(Self {
            reduce: Pipeline::new(context, "prefix_sum_reduce", &constants)?,
            scan: Pipeline::new(context, Self::STEM, &constants)?,
            items,
            capacity,
            block_sums,
            zero: Buffer::from_slice(context, "zero", &[0_u32])?,
        })
    }

    /// Replaces each of the first `count` words of `values` by the sum of the words before
    /// it, and word `count` by the total. Records into an open pass with barriers between
    /// its own dispatches.
    ///
    /// Panics if `count` is above the capacity, or `values` shorter than `count + 1` words.
    pub fn record(&self, pass: &mut PassScope<'_>, values: &Buffer, count: u32) {
        assert!(count <= self.capacity, "{count} values, prepared for {}", self.capacity);
        assert!(values.bytes() >= 4 * (u64::from(count) + 1), "the total has no place behind {count} values");

        // Level 0 are the values, level l + 1 the sums of the blocks of level l, the last level is
        // one block.
        let mut counts = vec![count];
        while let Some(&last) = counts.last().filter(|&&last| last > BLOCK_LENGTH) {
            counts.push(last.div_ceil(BLOCK_LENGTH));
        }
        let level = |index: usize| if index == 0 { values } else { &self.block_sums[index - 1] };
        let top = counts.len() - 1;

        for (index, &count) in counts.iter().enumerate().take(top) {
            let bindings = [("Values", level(index)), ("BlockSums", level(index + 1))];
            pass.dispatch(
                &self.reduce,
                [count.div_ceil(self.items), 1, 1],
                &PrefixSumPush { count },
                &bindings,
            );
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
        for (index, &count) in counts.iter().enumerate().rev() {
            let offsets = if index == top { &self.zero } else { level(index + 1) };
            let bindings = [("Values", level(index)), ("BlockOffsets", offsets)];
            // At least one workgroup, which writes the total of an empty list.
            let threads = count.div_ceil(self.items).max(1);
            pass.dispatch(&self.scan, [threads, 1, 1], &PrefixSumPush { count }, &bindings);
            if index > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
        }
    }
}
