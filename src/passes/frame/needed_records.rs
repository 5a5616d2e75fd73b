//! Needed records of a view: the records that its splat weights use, and the neighbours that
//! blending reads for them. In: splat weights, lists of neighbours. Out: a list of records, in
//! order, with the sizes of the dispatches that gather them.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::blend::Blend;
use crate::passes::frame::prefix_sum::PrefixSum;
use crate::passes::frame::splat::{SeenSurfaces, Splat};
use std::sync::Arc;

gpu_struct! {
    /// Push constants of the first step.
    pub struct NeededMarkPush {
        pub pixel_count: u32,
        /// Capacity of the list of weights.
        pub weight_capacity: u32,
    }
}

gpu_struct! {
    /// Push constants of the second step.
    pub struct NeededNeighboursPush {
        pub record_count: u32,
        /// 1: takes all records as seen.
        pub takes_all: u32,
    }
}

gpu_struct! {
    /// Push constants of the third step.
    pub struct NeededListPush {
        pub record_count: u32,
        /// Records of one buffer of the table of gather rays.
        pub records_per_chunk: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] =
    &[NeededMarkPush::LAYOUT, NeededNeighboursPush::LAYOUT, NeededListPush::LAYOUT];

/// Records in ascending order, ready to be gathered.
pub struct RecordList {
    /// Exclusive prefix sum of the listed records, and the total.
    pub offsets: Buffer,
    /// Indices of the listed records.
    pub records: Buffer,
    /// Dispatch size for each buffer of the table of gather rays.
    pub groups: Buffer,
}

impl RecordList {
    /// A constant list of some of `record_count` records, in ascending order.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn fixed(
        context: &Arc<Context>,
        record_count: u32,
        records_per_chunk: u32,
        records: &[u32],
    ) -> Result<Self> {
        let before = |end: u32| records.partition_point(|&record| record < end) as u32;
        let offsets: Vec<u32> = (0..=record_count).map(before).collect();
        let firsts = (0..record_count).step_by(records_per_chunk.max(1) as usize);
        let tuning = context.tuning();
        let groups = firsts.flat_map(|first| {
            tuning.swizzled(tuning.record_groups(before(first + records_per_chunk) - before(first)))
        });
        Ok(Self {
            offsets: Buffer::from_slice(context, GrowsWith::GatherRays.named("record offsets"), &offsets)?,
            groups: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("gather groups"),
                &groups.collect::<Vec<_>>(),
            )?,
            records: Buffer::from_slice(context, GrowsWith::GatherRays.named("listed records"), records)?,
        })
    }

    /// Number of records, listed or not.
    pub fn record_count(&self) -> u32 {
        (self.offsets.bytes() / 4) as u32 - 1
    }

    /// A constant list of all records.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn all(context: &Arc<Context>, record_count: u32, records_per_chunk: u32) -> Result<Self> {
        Self::fixed(context, record_count, records_per_chunk, &(0..record_count).collect::<Vec<_>>())
    }
}

/// A request for a list of records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RecordRequest {
    /// The splat weights are new.
    pub view_is_new: bool,
    /// All records are stale.
    pub none_is_current: bool,
    /// List all stale records, not only those of the view.
    pub all: bool,
}

/// The pipelines, the marks and the list.
pub struct NeededRecords {
    mark: Pipeline,
    neighbours: Pipeline,
    compact: Pipeline,
    sums: PrefixSum,
    record_count: u32,
    records_per_chunk: u32,
    /// One for records that splat weights use; zero for others.
    pub is_seen: Buffer,
    /// One for records that were listed since they became stale.
    is_current: Buffer,
    /// The records that must be gathered.
    pub list: RecordList,
}

impl NeededRecords {
    /// Stem of reference and timing.
    pub const STEM: &str = "needed_records";

    /// Allocates lists of `record_count` records, with `records_per_chunk` in each buffer of the
    /// table of gather rays.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, record_count: u32, records_per_chunk: u32) -> Result<Self> {
        let none = vec![0_u32; record_count as usize];
        Ok(Self {
            mark: Pipeline::new(context, "needed_mark", &[])?,
            neighbours: Pipeline::new(context, "needed_neighbours", &[])?,
            compact: Pipeline::new(context, "needed_list", &[])?,
            sums: PrefixSum::new(context, record_count)?,
            record_count,
            records_per_chunk,
            is_seen: Buffer::from_slice(context, GrowsWith::GatherRays.named("seen records"), &none)?,
            is_current: Buffer::from_slice(context, GrowsWith::GatherRays.named("current records"), &none)?,
            list: RecordList::all(context, record_count, records_per_chunk)?,
        })
    }

    /// Lists the requested stale records and marks them as current.
    pub fn record(
        &self,
        rec: &mut Recorder,
        request: RecordRequest,
        (splat, seen): (&Splat, SeenSurfaces<'_>),
        blend: &Blend,
    ) {
        let RecordList { offsets, records: listed, groups } = &self.list;
        let record_count = self.record_count;
        let mut pass = rec.pass(Self::STEM);
        pass.fill_zero(offsets);
        if request.none_is_current {
            pass.fill_zero(&self.is_current);
        }
        if request.view_is_new {
            pass.fill_zero(&self.is_seen);
        }
        pass.barrier(TRANSFER_TO_COMPUTE);
        if request.view_is_new {
            let ([weight_ranges, weights], [pixel_count, weight_capacity]) =
                (splat.lists(), splat.capacity());
            pass.dispatch(
                &self.mark,
                [pixel_count, 1, 1],
                &NeededMarkPush { pixel_count, weight_capacity },
                &[("WeightRanges", weight_ranges), ("Weights", weights), ("IsSeen", &self.is_seen)],
            );
            pass.barrier(COMPUTE_TO_COMPUTE);
            let push = NeededMarkPush { pixel_count: splat.edge_capacity(), weight_capacity };
            pass.dispatch_indirect(
                &self.mark,
                (seen.point_groups, 0),
                &push,
                &[("WeightRanges", splat.edge_ranges()), ("Weights", weights), ("IsSeen", &self.is_seen)],
            );
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
        let [neighbour_offsets, neighbours] = blend.lists();
        pass.dispatch(
            &self.neighbours,
            [record_count, 1, 1],
            &NeededNeighboursPush { record_count, takes_all: u32::from(request.all) },
            &[
                ("IsSeen", &self.is_seen),
                ("IsCurrent", &self.is_current),
                ("NeighbourOffsets", neighbour_offsets),
                ("Neighbours", neighbours),
                ("IsNeeded", offsets),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.sums.record(&mut pass, offsets, record_count);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.compact,
            [record_count, 1, 1],
            &NeededListPush { record_count, records_per_chunk: self.records_per_chunk },
            &[
                ("RecordOffsets", offsets),
                ("ListedRecords", listed),
                ("IsCurrent", &self.is_current),
                ("GatherGroups", groups),
            ],
        );
    }

    /// Buffer and byte offset of the length of the list.
    pub fn listed_at(&self) -> (&Buffer, u64) {
        (&self.list.offsets, 4 * u64::from(self.record_count))
    }

    /// Length of the list.
    ///
    /// # Errors
    /// The device failed.
    pub fn listed(&self) -> Result<u32> {
        Ok(self.list.offsets.read_range::<u32>(self.record_count as usize, 1)?[0])
    }
}
