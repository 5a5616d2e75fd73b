//! The device layer: transfers, dispatch, limits, errors.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::sync::Arc;

use common::{assert_silent, context, random_words};
use lightpaths::Error;
use lightpaths::gpu::barrier::{COMPUTE_TO_COMPUTE, TRANSFER_TO_TRANSFER};
use lightpaths::gpu::{Buffer, Context, ContextOptions, Pipeline, SplitBuffer};
use lightpaths::passes::GrowsWith;
use lightpaths::passes::frame::prefix_sum::PrefixSumPush;

#[test]
fn data_comes_back_as_it_went() {
    let context = context();
    // Larger than the staging buffer of 16 MiB, and no multiple of its size.
    let words = random_words(1, (16 << 18) + 12_345);
    let buffer = Buffer::from_slice(&context, "words", &words).unwrap();
    assert!(buffer.read::<u32>().unwrap() == words);
    assert!(buffer.read_range::<u32>(7, 100).unwrap() == words[7..107]);

    buffer.write(&[1_u32, 2, 3]).unwrap();
    assert!(buffer.read_range::<u32>(0, 4).unwrap() == [1, 2, 3, words[3]]);
    buffer.write_range(50, &[4_u32, 5]).unwrap();
    assert!(buffer.read_range::<u32>(49, 4).unwrap() == [words[49], 4, 5, words[52]]);
    assert_silent(&context);
}

#[test]
fn odd_and_empty_buffers_work() {
    let context = context();
    let empty = Buffer::from_slice::<u32>(&context, "empty", &[]).unwrap();
    assert_eq!((empty.bytes(), empty.read::<u32>().unwrap()), (0, vec![]));
    let odd = Buffer::from_slice(&context, "odd", &[1_u8, 2, 3, 4, 5]).unwrap();
    assert_eq!(odd.read::<u8>().unwrap(), [1, 2, 3, 4, 5]);
    let copy = Buffer::storage(&context, "copy", 7).unwrap();
    let record = |rec: &mut lightpaths::gpu::Recorder| {
        rec.fill_zero(&copy);
        rec.barrier(TRANSFER_TO_TRANSFER);
        rec.copy(&odd, &copy);
    };
    context.run(record).unwrap();
    assert_eq!(copy.read::<u8>().unwrap(), [1, 2, 3, 4, 5, 0, 0]);
    assert_silent(&context);
}

#[test]
fn work_beyond_the_workgroups_along_x_is_spread_over_the_other_axes() {
    let context = context();
    let most = context.limits().workgroup_count[0];
    // Devices differ: the limit is 65 535 here and 2^31 - 1 elsewhere, where this tests
    // a plain dispatch.
    let blocks = most.min(65_535) + 2;
    let count = (blocks - 1) * 256 + 1;
    let words = random_words(2, count as usize);
    let expected: Vec<u32> = words
        .chunks(256)
        .map(|block| block.iter().fold(0, |sum: u32, word| sum.wrapping_add(*word)))
        .collect();

    let pipeline =
        Pipeline::new(&context, "prefix_sum_reduce", &[("local_size_x", 256), ("ITEMS", 1)]).unwrap();
    let values = Buffer::from_slice(&context, "values", &words).unwrap();
    let sums = Buffer::storage(&context, "sums", 4 * u64::from(blocks)).unwrap();
    let bindings = [("Values", &values), ("BlockSums", &sums)];
    let push = PrefixSumPush { count };
    context
        .run(|rec| {
            rec.pass("sums").dispatch(&pipeline, [count, 1, 1], &push, &bindings);
        })
        .unwrap();
    assert!(sums.read::<u32>().unwrap() == expected);
    assert_silent(&context);
}

/// Dispatches the sum of two words in `passes` passes. The buffers are dropped before
/// the commands run.
fn sum_twice(context: &Arc<Context>, passes: u32, threads: u32) -> Vec<lightpaths::gpu::PassTiming> {
    let record = |rec: &mut lightpaths::gpu::Recorder| {
        let pipeline =
            Pipeline::new(context, "prefix_sum_reduce", &[("local_size_x", 256), ("ITEMS", 1)]).unwrap();
        let values = Buffer::storage(context, "values", 8).unwrap();
        let sums = Buffer::storage(context, "sums", 4).unwrap();
        let bindings = [("Values", &values), ("BlockSums", &sums)];
        for _ in 0..passes {
            rec.pass("sum").dispatch(&pipeline, [threads, 1, 1], &PrefixSumPush { count: 2 }, &bindings);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    };
    context.run(record).unwrap().1
}

#[test]
fn passes_are_timed_whatever_their_number() {
    let context = context();
    // A pool has 256 timestamps: 300 passes take three pools.
    let timings = sum_twice(&context, 300, 2);
    assert_eq!(timings.len(), 300);
    assert!(timings.iter().all(|timing| timing.ms > 0.0 && timing.ms < 1e4 && timing.dispatches == 1));
    assert_silent(&context);
}

#[test]
fn no_threads_record_nothing() {
    let context = context();
    let timings = sum_twice(&context, 1, 0);
    assert_eq!((timings[0].name, timings[0].dispatches), ("sum", 0));
    assert_silent(&context);
}

#[test]
#[should_panic(
    expected = "`sum`: `prefix_sum_reduce` binds [\"Values\", \"BlockSums\"], given [\"BlockSums\", \"Values\"]"
)]
fn swapped_bindings_are_named() {
    let context = context();
    let pipeline =
        Pipeline::new(&context, "prefix_sum_reduce", &[("local_size_x", 256), ("ITEMS", 1)]).unwrap();
    let buffer = Buffer::storage(&context, "buffer", 4).unwrap();
    let bindings = [("BlockSums", &buffer), ("Values", &buffer)];
    let push = PrefixSumPush { count: 1 };
    let _ = context.run(|rec| {
        rec.pass("sum").dispatch(&pipeline, [1, 1, 1], &push, &bindings);
    });
}

#[test]
fn memory_is_counted() {
    let context = context();
    let before = context.memory();
    let buffer = Buffer::storage(&context, "large", 64 << 20).unwrap();
    let during = context.memory();
    drop(buffer);
    let after = context.memory();
    assert_eq!(during.current_bytes, before.current_bytes + (64 << 20));
    assert_eq!(after.current_bytes, before.current_bytes);
    assert!(after.peak_bytes >= during.current_bytes && after.largest_binding_bytes >= 64 << 20);
    assert!(after.peak_staging_bytes <= 32 << 20, "transfers pass in pieces");
}

#[test]
fn a_buffer_beyond_the_device_is_refused_with_need_and_limit() {
    let context = context();
    let limit = context.limits().storage_range_bytes;
    let error = Buffer::storage(&context, "rays", limit + 1).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::OutOfMemory(_)) && error.exit_code() == 4);
    let message = error.to_string();
    assert!(message.contains("buffer `rays` needs") && message.contains("binds at most"), "{message}");
    assert!(message.ends_with("; a smaller preset or image needs less"), "{message}");
    let named = GrowsWith::EntryPoints.named("rays");
    let error = Buffer::storage(&context, named, limit + 1).map(|_| ()).unwrap_err().to_string();
    assert!(error.ends_with("; lower quality.entry_points"), "{error}");
    assert_silent(&context);
}

#[test]
fn an_unknown_device_is_refused_with_what_there_is() {
    let options = ContextOptions { device: Some("no such device".into()), ..ContextOptions::default() };
    let error = Context::new(&options).map(|_| ()).unwrap_err();
    assert_eq!(error.exit_code(), 3);
    let message = error.to_string();
    assert!(
        message.contains("`no such device`") && message.contains(&Context::devices().unwrap()[0].name),
        "{message}"
    );
}

#[test]
fn a_device_can_be_chosen_by_index_and_by_part_of_its_name() {
    let devices = Context::devices().unwrap();
    let usable = devices.iter().find(|device| device.unmet.is_none()).expect("the tests need a device");
    for wanted in [usable.index.to_string(), usable.name.to_uppercase()] {
        let options = ContextOptions { device: Some(wanted), ..ContextOptions::default() };
        assert_eq!(Context::new(&options).unwrap().name(), usable.name);
    }
}

/// `Recorder::only` skips the commands outside the named passes.
#[test]
fn passes_copy_and_clear_and_others_are_left_out() {
    let context = context();
    let from = Buffer::from_slice(&context, "from", &[1_u32, 2]).unwrap();
    let [in_pass, cleared, between] = ["in a pass", "cleared", "between"]
        .map(|name| Buffer::from_slice(&context, name, &[7_u32, 8]).unwrap());
    for only_one in [false, true] {
        let record = |rec: &mut lightpaths::gpu::Recorder| {
            if only_one {
                rec.only(&["one"]);
            }
            rec.pass("one").copy(&from, &in_pass).fill_zero(&cleared);
            rec.copy(&from, &between);
        };
        for buffer in [&in_pass, &cleared, &between] {
            buffer.write(&[7_u32, 8]).unwrap();
        }
        context.run(record).unwrap();
        let found = [&in_pass, &cleared, &between].map(|buffer| buffer.read::<u32>().unwrap());
        let copied = if only_one { [7, 8] } else { [1, 2] };
        assert_eq!(found, [vec![1, 2], vec![0, 0], copied.to_vec()], "alone: {only_one}");
    }
    assert_silent(&context);
}

/// The allocator reuses memory without clearing it.
#[test]
fn a_host_flag_begins_as_zero() {
    let context = context();
    let ones = Buffer::from_slice(&context, "ones", &[1_u32]).unwrap();
    for _ in 0..2 {
        let word = Buffer::host_flag(&context, "word").unwrap();
        assert_eq!(word.read_flag(), 0);
        context.run(|rec| rec.copy(&ones, &word)).unwrap();
        assert_eq!(word.read_flag(), 1);
    }
    assert_silent(&context);
}

/// A part with one more item would not fit.
#[test]
fn a_part_is_as_long_as_a_binding_may_be() {
    fn check<T>(context: &Context) {
        let (longest, size) = (u64::from(SplitBuffer::longest::<T>(context)), size_of::<T>() as u64);
        let most = context.limits().storage_range_bytes;
        assert!(longest * size <= most, "{longest} items of {size} bytes in {most}");
        assert!(
            (longest + 1) * size > most || longest == u64::from(u32::MAX),
            "{longest} of {size} in {most}"
        );
    }
    let context = context();
    check::<[u32; 1]>(&context);
    check::<[u32; 3]>(&context);
    check::<[u32; 8]>(&context);
}
