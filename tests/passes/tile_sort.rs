//! The sort of (tile, record) pairs: exact, and stable.

use crate::common::{assert_silent, context};
use crate::world::Random;
use lightpaths::cpu;
use lightpaths::gpu::Buffer;
use lightpaths::passes::reference::tile_sort::TileSort;

/// Sorts on the device, in a list with capacity for `capacity` pairs; the words after the pairs
/// are no pairs.
fn sort(pairs: &[[u32; 2]], capacity: u32, tile_count: u32) -> Vec<[u32; 2]> {
    let context = context();
    let sort = TileSort::new(&context, capacity).unwrap();
    assert!(sort.capacity() >= capacity);
    let mut list = pairs.to_vec();
    list.resize(sort.capacity() as usize, [0, u32::MAX]);
    sort.input().write(&list).unwrap();
    // The number of pairs is the last of the running counts.
    let pair_offsets = Buffer::from_slice(&context, "pair offsets", &[9, 9, pairs.len() as u32]).unwrap();
    let (sorted, _) =
        context.run(|rec| sort.record(&mut rec.pass("splat"), &pair_offsets, 2, tile_count)).unwrap();
    sorted.read_range(0, pairs.len()).unwrap()
}

#[test]
fn sorted_pairs_equal_the_reference() {
    let mut random = Random::new(4);
    for tile_count in [1, 2, 255, 256, 257, 70_000] {
        for count in [0, 1, 2, 255, 256, 257, 4_099] {
            let pairs: Vec<_> = (0..count).map(|record| [random.below(tile_count), record]).collect();
            for capacity in [count, count + 1_000] {
                let sorted = sort(&pairs, capacity, tile_count);
                assert!(sorted == cpu::tile_sort::tile_sort(&pairs), "{count} pairs on {tile_count} tiles");
            }
        }
    }
    assert_silent(&context());
}

#[test]
fn pairs_of_one_tile_keep_their_order() {
    // Records descend, so that a sort by both keys would show. The first digit distinguishes some
    // tiles, the second digit others.
    for [low, high] in [[0x10, 0x20], [0x101, 0x201]] {
        let pairs: Vec<_> =
            (0..3_000_u32).map(|i| [if i % 3 == 0 { low } else { high }, 9_999 - i]).collect();
        let of = |tile: u32| pairs.iter().copied().filter(move |pair| pair[0] == tile);
        assert!(sort(&pairs, 3_000, high + 1) == Vec::from_iter(of(low).chain(of(high))));
    }
    assert_silent(&context());
}
