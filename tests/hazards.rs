//! The checks for missing barriers: each must report a planted fault by itself.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::Arc;

use common::{assert_silent, context};
use lightpaths::gpu::barrier::{
    COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE,
};
use lightpaths::gpu::{Barrier, Buffer, Context, ContextOptions, Pipeline, Recorder};
use lightpaths::passes::frame::prefix_sum::{PrefixSum, PrefixSumPush};

/// Two shaders and the buffers between them.
struct Chain {
    context: Arc<Context>,
    reduce: Pipeline,
    scan: Pipeline,
    values: Buffer,
    sums: Buffer,
    zero: Buffer,
    other: Buffer,
}

const COUNT: u32 = 1000;

impl Chain {
    fn new(context: Arc<Context>) -> Self {
        Self {
            reduce: Pipeline::new(&context, "prefix_sum_reduce", &[("ITEMS", 1)]).unwrap(),
            scan: Pipeline::new(&context, "prefix_sum", &[("ITEMS", 1)]).unwrap(),
            values: Buffer::from_slice(&context, "values", &[1; COUNT as usize + 1]).unwrap(),
            sums: Buffer::from_slice(&context, "sums", &[0_u32; 8]).unwrap(),
            zero: Buffer::from_slice(&context, "zero", &[0_u32]).unwrap(),
            other: Buffer::from_slice(&context, "other", &[0_u32; 8]).unwrap(),
            context,
        }
    }

    /// Sums each of the four blocks of the values.
    fn up(&self, rec: &mut Recorder) {
        let bindings = [("Values", &self.values), ("BlockSums", &self.sums)];
        rec.pass("up").dispatch(&self.reduce, [COUNT, 1, 1], &PrefixSumPush { count: COUNT }, &bindings);
    }

    /// Reads the sums of the blocks.
    fn down(&self, rec: &mut Recorder) {
        let bindings = [("Values", &self.other), ("BlockOffsets", &self.sums)];
        rec.pass("down").dispatch(&self.scan, [4, 1, 1], &PrefixSumPush { count: 4 }, &bindings);
    }

    /// As [`Self::up`], with the number of workgroups at word 4 of the values.
    fn up_indirect(&self, rec: &mut Recorder) {
        let bindings = [("Values", &self.zero), ("BlockSums", &self.sums)];
        let push = PrefixSumPush { count: 1 };
        rec.pass("up").dispatch_indirect(&self.reduce, (&self.values, 16), &push, &bindings);
    }

    /// Writes the counts of one workgroup to the values, from word 4 on.
    fn count(&self, rec: &mut Recorder) {
        let bindings = [("Values", &self.values), ("BlockOffsets", &self.zero)];
        rec.pass("count").dispatch(&self.scan, [3, 1, 1], &PrefixSumPush { count: 3 }, &bindings);
    }

    fn up_down(&self, barrier: Option<Barrier>) {
        let record = |rec: &mut Recorder| {
            self.up(rec);
            barrier.into_iter().for_each(|barrier| rec.barrier(barrier));
            self.down(rec);
        };
        self.context.run(record).unwrap();
    }
}

#[test]
#[should_panic(expected = "`down` reads `BlockOffsets` after `up` wrote it with no barrier between")]
fn the_recorder_reports_a_missing_barrier() {
    Chain::new(context()).up_down(None);
}

#[test]
#[should_panic(expected = "`down` reads `BlockOffsets` after `up` wrote it with no barrier between")]
fn the_recorder_reports_a_wrong_barrier() {
    Chain::new(context()).up_down(Some(COMPUTE_TO_TRANSFER));
}

#[test]
#[should_panic(expected = "`up` reads `values` after `count` wrote it with no barrier between")]
fn the_recorder_reports_an_unordered_fetch_of_workgroup_counts() {
    let chain = Chain::new(context());
    let record = |rec: &mut Recorder| {
        chain.count(rec);
        rec.barrier(COMPUTE_TO_COMPUTE);
        chain.up_indirect(rec);
    };
    chain.context.run(record).unwrap();
}

#[test]
#[should_panic(expected = "`up` writes `BlockSums` after `transfer` wrote it with no barrier between")]
fn the_recorder_reports_an_unordered_fill() {
    let chain = Chain::new(context());
    let record = |rec: &mut Recorder| {
        rec.fill_zero(&chain.sums);
        chain.up(rec);
    };
    chain.context.run(record).unwrap();
}

/// A context without the recorder's check: only the validation layer reports hazards.
fn unchecked_context() -> Arc<Context> {
    let options = ContextOptions { validation: true, hazard_check: false, ..ContextOptions::default() };
    Context::new(&options).unwrap()
}

#[track_caller]
fn assert_one_sync_hazard(context: &Context) {
    let messages = context.take_validation_messages();
    assert_eq!(messages.len(), 1, "{messages:#?}");
    // The message names the buffer.
    assert!(messages[0].contains("SYNC-HAZARD") && messages[0].contains("[sums]"), "{messages:#?}");
}

/// The layer (1.3.239) misses a write after a write by two dispatches, and a read through a binding
/// that is also written. Only the recorder's check finds these.
#[test]
fn the_validation_layer_reports_missing_and_wrong_barriers() {
    let chain = Chain::new(unchecked_context());
    assert_silent(&chain.context);

    chain.up_down(None);
    assert_one_sync_hazard(&chain.context);

    chain.up_down(Some(COMPUTE_TO_TRANSFER));
    assert_one_sync_hazard(&chain.context);

    let fill_then_up = |rec: &mut Recorder| {
        rec.fill_zero(&chain.sums);
        chain.up(rec);
    };
    chain.context.run(fill_then_up).unwrap();
    assert_one_sync_hazard(&chain.context);
}

#[test]
fn right_barriers_are_silent_and_all_needed() {
    let chain = Chain::new(context());
    chain.context.take_redundant_barriers();
    chain.up_down(Some(COMPUTE_TO_COMPUTE));
    let record = |rec: &mut Recorder| {
        chain.count(rec);
        rec.barrier(COMPUTE_TO_INDIRECT);
        chain.up_indirect(rec);
        rec.barrier(COMPUTE_TO_TRANSFER);
        rec.fill_zero(&chain.sums);
        rec.barrier(TRANSFER_TO_COMPUTE);
        chain.down(rec);
    };
    chain.context.run(record).unwrap();
    assert_silent(&chain.context);
    assert_eq!(chain.context.take_redundant_barriers(), [""; 0]);
    assert_eq!(chain.values.read_range::<u32>(0, 7).unwrap(), [0, 1, 2, 3, 1, 1, 1]);
}

#[test]
fn a_redundant_barrier_is_reported() {
    let chain = Chain::new(context());
    chain.context.take_redundant_barriers();
    let record = |rec: &mut Recorder| {
        chain.up(rec);
        rec.barrier(COMPUTE_TO_COMPUTE);
        rec.barrier(COMPUTE_TO_TRANSFER);
        chain.down(rec);
    };
    chain.context.run(record).unwrap();
    let reported = chain.context.take_redundant_barriers();
    assert_eq!(reported, ["barrier 1, COMPUTE_TO_TRANSFER after `up`, separates nothing"]);
}

#[test]
fn neighbours_without_a_barrier_are_marked_as_overlapped() {
    let chain = Chain::new(context());
    let record = |rec: &mut Recorder| {
        chain.up(rec);
        rec.barrier(COMPUTE_TO_COMPUTE);
        chain.down(rec);
        let mut pass = rec.pass(PrefixSum::STEM);
        let bindings = [("Values", &chain.values), ("BlockOffsets", &chain.zero)];
        pass.dispatch(&chain.scan, [3, 1, 1], &PrefixSumPush { count: 3 }, &bindings);
    };
    let ((), timings) = chain.context.run(record).unwrap();
    let marks: Vec<_> =
        timings.iter().map(|timing| (timing.name, timing.dispatches, timing.overlapped)).collect();
    assert_eq!(marks, [("up", 1, false), ("down", 1, true), (PrefixSum::STEM, 1, true)]);
    assert!(timings.iter().all(|timing| timing.ms > 0.0));
}

/// The device takes 64 KiB of an update at once: these have three parts each.
#[test]
fn long_updates_keep_their_order() {
    let context = context();
    let lists = [1_u32, 2].map(|value| vec![value; 40_000]);
    let [buffer, first, second] = ["buffer", "first", "second"]
        .map(|name| Buffer::storage(&context, name, 4 * lists[0].len() as u64).unwrap());
    let record = |rec: &mut Recorder| {
        for (list, copy) in lists.iter().zip([&first, &second]) {
            rec.upload(&buffer, list);
            rec.copy(&buffer, copy);
        }
    };
    context.run_free(record).unwrap();
    assert!([&first, &second].map(|copy| copy.read::<u32>().unwrap()) == lists);
    assert_silent(&context);
}
