//! The running sum: integers, exact.

use crate::common::{assert_silent, context, random_words};
use lightpaths::cpu;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::prefix_sum::PrefixSum;

/// Sums random words on the device; the words after the total must stay.
fn prefix_sum_on_device(prefix_sum: &PrefixSum, values: &[u32]) -> Vec<u32> {
    const UNTOUCHED: u32 = 0xdead_beef;
    let context = context();
    let mut words = values.to_vec();
    words.extend([UNTOUCHED; 3]);
    let buffer = Buffer::from_slice(&context, "values", &words).unwrap();
    let count = values.len() as u32;
    context.run(|rec| prefix_sum.record(&mut rec.pass(PrefixSum::STEM), &buffer, count)).unwrap();
    let mut sums = buffer.read::<u32>().unwrap();
    assert_eq!(
        sums.split_off(values.len() + 1),
        [UNTOUCHED; 2],
        "{count} values: nothing is written past the total"
    );
    sums
}

#[test]
fn prefix_sum_equals_its_reference() {
    let context = context();
    // Around an invocation's 8 or 256 values, a block's 2048, two blocks, and three
    // levels of blocks.
    let sizes = [
        0,
        1,
        2,
        7,
        8,
        9,
        255,
        256,
        257,
        2047,
        2048,
        2049,
        4096,
        4099,
        99_991,
        (1 << 22) - 1,
        1 << 22,
        (1 << 22) + 1,
    ];
    context.take_redundant_barriers();
    let prefix_sum = PrefixSum::new(&context, (1 << 22) + 1).unwrap();
    for (seed, size) in sizes.into_iter().enumerate() {
        let values = random_words(seed as u64, size);
        let sums = prefix_sum_on_device(&prefix_sum, &values);
        assert!(sums == cpu::prefix_sum::prefix_sum(&values), "{size} values");
    }
    assert_silent(&context);
    assert_eq!(context.take_redundant_barriers(), [""; 0], "every barrier is needed");
}

#[test]
fn prefix_sum_works_at_its_exact_capacity() {
    let context = context();
    for size in [0, 1, 2048, 2049] {
        let prefix_sum = PrefixSum::new(&context, size).unwrap();
        let values = vec![1; size as usize];
        assert_eq!(prefix_sum_on_device(&prefix_sum, &values), Vec::from_iter(0..=size));
    }
    assert_silent(&context);
}
