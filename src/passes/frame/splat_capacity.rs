//! Capacity of the lists between records and pixels, and the counts of a view.

use super::splat::{Splat, SplatTally, TILE};
use super::tile_sort::TileSort;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, HostBlock, Recorder};
use crate::passes::GrowsWith;

/// Counts of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SplatCounts {
    /// (Tile, record) pairs that the view needs.
    pub pairs: u32,
    /// (Pixel, record) weights that the view needs.
    pub weights: u32,
    /// Uncovered pixels that take relaxed records.
    pub relaxed: u32,
    /// Some invocation had a truncated loop.
    pub is_truncated: bool,
    /// Uncovered pixels that take the nearest record.
    pub uncovered: u32,
}

impl SplatCounts {
    /// Words of a block that hold the counts.
    pub const WORDS: u32 = 5;

    /// Reads what [`Splat::copy_counts`] has copied to the words from `first` on.
    pub fn read(block: &HostBlock, first: u32) -> Self {
        let [pairs, weights, relaxed, is_truncated, uncovered] =
            std::array::from_fn(|word| block.word(first + word as u32));
        Self { pairs, weights, relaxed, is_truncated: is_truncated != 0, uncovered }
    }
}

impl Splat {
    /// Copies the counts of the view to a block that the host reads. Transfers.
    pub fn copy_counts(&self, rec: &mut Recorder, block: &HostBlock, first: u32) {
        rec.copy_to_host(&self.pair_offsets, 4 * u64::from(self.record_count), block, first, 1);
        rec.copy_to_host(&self.tally, 0, block, first + 1, size_of::<SplatTally>() as u32 / 4);
        rec.copy_to_host(&self.uncovered, 12, block, first + 4, 1);
    }

    /// Enlarges the lists that were too short for the last view. Returns whether one was: the frame
    /// must then be repeated.
    ///
    /// # Errors
    /// The device lacks memory, or a tile of pixels has more records than it goes through.
    pub fn grow(&mut self, counts: SplatCounts) -> Result<bool> {
        if counts.is_truncated {
            let tile = format!("{TILE}×{TILE} pixels");
            return Err(Error::OutOfMemory(format!(
                "some {tile} have more of the {} cache points to weigh than the device goes through: lower quality.cache_points, or render a \
                 larger image",
                self.record_count
            )));
        }
        let lacks_pairs = counts.pairs > self.sort.capacity();
        if lacks_pairs {
            self.sort = TileSort::new(&self.context, with_reserve(counts.pairs))?;
        }
        // Without all pairs the number of weights is not final: the repeated frame checks it again.
        let lacks_weights = counts.weights > self.weight_capacity;
        if lacks_weights {
            let capacity = with_reserve(counts.weights);
            self.weights = Buffer::storage(
                &self.context,
                GrowsWith::Pixels.named("splat weights"),
                8 * u64::from(capacity),
            )?;
            self.weight_capacity = capacity;
        }
        Ok(lacks_pairs || lacks_weights)
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
