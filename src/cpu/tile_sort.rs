//! Reference of the tile sort.

/// Sorts (tile, record) pairs by tile; pairs of one tile keep their order.
pub fn tile_sort(pairs: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let mut sorted = pairs.to_vec();
    sorted.sort_by_key(|pair| pair[0]);
    sorted
}
