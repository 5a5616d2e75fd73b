//! Capacity of the lists between records and pixels, and the counts of a view.

use super::splat::{Splat, SplatTally, TILE};
use super::tile_sort::TileSort;
use crate::error::{Error, Result};
use crate::gpu::Buffer;

impl Splat {
    /// Enlarges the lists that were too short for the last view. Returns whether one was: the frame
    /// must then be repeated.
    ///
    /// # Errors
    /// The device lacks memory or failed, or a tile of pixels has more records than
    /// it goes through.
    pub fn grow(&mut self) -> Result<bool> {
        let (pairs, weights) = self.list_lengths()?;
        if self.tally.read::<SplatTally>()?[0].is_truncated != 0 {
            let tile = format!("{TILE}×{TILE} pixels");
            return Err(Error::OutOfMemory(format!(
                "some {tile} have more of the {} cache points to weigh than the device goes through: lower quality.cache_points, or render a \
                 larger image",
                self.record_count
            )));
        }
        let lacks_pairs = pairs > self.sort.capacity();
        if lacks_pairs {
            self.sort = TileSort::new(&self.context, with_reserve(pairs))?;
        }
        // Without all pairs the number of weights is not final: the repeated frame checks it again.
        let lacks_weights = weights > self.weight_capacity;
        if lacks_weights {
            let capacity = with_reserve(weights);
            self.weights = Buffer::storage(&self.context, "splat weights", 8 * u64::from(capacity))?;
            self.weight_capacity = capacity;
        }
        Ok(lacks_pairs || lacks_weights)
    }

    /// Numbers of (tile, record) pairs and of (pixel, record) weights that the last view needed.
    ///
    /// # Errors
    /// The device failed.
    pub fn list_lengths(&self) -> Result<(u32, u32)> {
        let pairs = self.pair_offsets.read_range::<u32>(self.record_count as usize, 1)?[0];
        Ok((pairs, self.tally.read::<SplatTally>()?[0].weights))
    }

    /// `WeightRange` of each pixel, and the list of `SplatWeight`s.
    pub fn lists(&self) -> [&Buffer; 2] {
        [&self.weight_ranges, &self.weights]
    }

    /// Number of pixels, and capacity of the list of weights.
    pub fn capacity(&self) -> [u32; 2] {
        [self.size[0] * self.size[1], self.weight_capacity]
    }

    /// Bytes of the lists of pairs and of weights.
    pub fn list_bytes(&self) -> [u64; 2] {
        [self.sort.input().bytes(), self.weights.bytes()]
    }

    /// Uncovered pixels of the last view: those with relaxed records, and those with
    /// the nearest record.
    ///
    /// # Errors
    /// The device failed.
    pub fn uncovered(&self) -> Result<[u32; 2]> {
        Ok([self.tally.read::<SplatTally>()?[0].relaxed, self.uncovered.read_range::<u32>(3, 1)?[0]])
    }
}

/// Adds a quarter to the size of a list, so that most later views fit without a new list.
fn with_reserve(needed: u32) -> u32 {
    needed.saturating_add(needed / 4)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_hold_a_quarter_more_than_is_needed() {
        assert_eq!([0, 3, 1000, u32::MAX].map(with_reserve), [0, 3, 1250, u32::MAX]);
    }
}
