//! Keys of clusters while the hierarchy is built: cluster code, then the Morton index of the cell's
//! lowest corner in finest cells, then the half of a split cluster, then the level of the cell. In
//! the order of keys, the surface below any cluster is one range.

use glam::UVec3;

/// See the module.
pub(super) type Key = u128;

/// Items with the key of their cluster.
pub(super) type Keyed<T> = Vec<(Key, T)>;

const LEVEL_BITS: u32 = 5;
const SECOND_HALF: Key = 1 << LEVEL_BITS;
/// The cell's bits begin here.
const CELL: u32 = LEVEL_BITS + 1;
const CODE: u32 = CELL + 96;

/// Key of the cluster with that code in a cell of that level.
pub(super) fn key(code: u32, corner: UVec3, level: u32) -> Key {
    let morton = spread(corner.z) << 2 | spread(corner.y) << 1 | spread(corner.x);
    Key::from(code) << CODE | morton << CELL | Key::from(level)
}

/// The bits of a number, three places apart.
fn spread(v: u32) -> u128 {
    let low = |v: u32| {
        let mut v = u64::from(v & 0x001f_ffff);
        v = (v | v << 32) & 0x001f_0000_0000_ffff;
        v = (v | v << 16) & 0x001f_0000_ff00_00ff;
        v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
        v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
        u128::from((v | v << 2) & 0x1249_2492_4924_9249)
    };
    low(v) | low(v >> 21) << 63
}

/// Every third bit of a number, from the lowest.
fn gathered(morton: u128) -> u32 {
    let low = |v: u64| {
        let mut v = v & 0x1249_2492_4924_9249;
        v = (v | v >> 2) & 0x10c3_0c30_c30c_30c3;
        v = (v | v >> 4) & 0x100f_00f0_0f00_f00f;
        v = (v | v >> 8) & 0x001f_0000_ff00_00ff;
        v = (v | v >> 16) & 0x001f_0000_0000_ffff;
        ((v | v >> 32) & 0x001f_ffff) as u32
    };
    low(morton as u64) | low((morton >> 63) as u64) << 21
}

/// The key of the second half of a split cluster, from that of the first.
pub(super) fn second_half(key: Key) -> Key {
    key | SECOND_HALF
}

/// The key of the first half of a split cluster.
pub(super) fn first_half(key: Key) -> Key {
    key & !SECOND_HALF
}

/// Cluster code of the sides in it.
pub(super) fn code(key: Key) -> u32 {
    (key >> CODE) as u32
}

/// Level of the cell: its width is two to that power, in finest cells.
pub(super) fn level(key: Key) -> u32 {
    key as u32 & ((1 << LEVEL_BITS) - 1)
}

/// Lowest corner of the cell, in finest cells.
pub(super) fn corner(key: Key) -> UVec3 {
    let morton = (key & ((1 << CODE) - 1)) >> CELL;
    UVec3::new(gathered(morton), gathered(morton >> 1), gathered(morton >> 2))
}

/// The key of a cell, without cluster code and half.
pub(super) fn cell(key: Key) -> Key {
    first_half(key) & ((1 << CODE) - 1)
}

/// The key of the cluster that holds this one in a cell of that coarser level.
pub(super) fn above(key: Key, level: u32) -> Key {
    let cleared = CELL + 3 * level;
    key >> cleared << cleared | Key::from(level)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_holds_what_it_was_made_of_and_nests() {
        let places = [[0, 0, 0], [1, 2, 3], [1 << 29, 77, 0x1fff_ffff], [0x2a55_5555, 0x1555_5554, 8]];
        for (code, corner_of) in (7..).zip(places.map(UVec3::from)) {
            for level_of in [0, 3, 20] {
                let key = key(code, corner_of >> level_of << level_of, level_of);
                assert_eq!(code, super::code(key));
                assert_eq!([level(key), level(second_half(key))], [level_of; 2]);
                assert_eq!(corner(second_half(key)), corner_of >> level_of << level_of);
                assert_eq!(first_half(second_half(key)), key);
                let up = above(second_half(key), level_of + 2);
                assert_eq!(corner(up), corner_of >> (level_of + 2) << (level_of + 2));
                assert_eq!((super::code(up), level(up)), (code, level_of + 2));
            }
        }
    }
}
