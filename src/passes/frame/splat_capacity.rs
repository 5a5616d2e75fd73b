//! Capacity of the list of splat weights, and the counts of a view.

use super::splat::{Splat, SplatTally};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, HostBlock, Recorder};
use crate::passes::GrowsWith;

/// Counts of a view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SplatCounts {
    /// (Pixel, record) weights that the view needs.
    pub weights: u32,
    /// Uncovered pixels that take relaxed records.
    pub relaxed: u32,
    /// Some invocation had a truncated loop.
    pub is_truncated: bool,
    /// Records that pixels weighed, with and without weight.
    pub weighed: u32,
    /// Uncovered pixels that take the nearest record.
    pub uncovered: u32,
}

impl SplatCounts {
    /// Words of a block that hold the counts.
    pub const WORDS: u32 = 5;

    /// Reads what [`Splat::copy_counts`] has copied to the words from `first` on.
    pub fn read(block: &HostBlock, first: u32) -> Self {
        let [weights, relaxed, is_truncated, weighed, uncovered] =
            std::array::from_fn(|word| block.word(first + word as u32));
        Self { weights, relaxed, is_truncated: is_truncated != 0, weighed, uncovered }
    }
}

impl Splat {
    /// Copies the counts of the view to a block that the host reads. Transfers.
    pub fn copy_counts(&self, rec: &mut Recorder, block: &HostBlock, first: u32) {
        rec.copy_to_host(&self.tally, 0, block, first, size_of::<SplatTally>() as u32 / 4);
        rec.copy_to_host(&self.at_pixels.uncovered, 12, block, first + SplatCounts::WORDS - 1, 1);
    }

    /// Enlarges the list of weights if it was too short for the last view. Returns whether it was:
    /// the frame must then be repeated.
    ///
    /// # Errors
    /// The device lacks memory, or a pixel has more records than an invocation goes through.
    pub fn grow(&mut self, counts: SplatCounts) -> Result<bool> {
        if counts.is_truncated {
            return Err(Error::OutOfMemory(format!(
                "some pixels have more of the {} cache points to weigh than the device goes through: lower quality.cache_points",
                self.tree.record_count
            )));
        }
        let is_short = counts.weights > self.weight_capacity;
        if is_short {
            let capacity = with_reserve(counts.weights);
            self.weights = Buffer::storage(
                &self.context,
                GrowsWith::Pixels.named("splat weights"),
                8 * u64::from(capacity),
            )?;
            self.weight_capacity = capacity;
        }
        Ok(is_short)
    }

    /// `WeightRange` of each pixel, and the list of `SplatWeight`s.
    pub fn lists(&self) -> [&Buffer; 2] {
        [&self.at_pixels.weight_ranges, &self.weights]
    }

    /// Maximum number of edge points.
    pub fn edge_capacity(&self) -> u32 {
        self.at_edges.capacity
    }

    /// `WeightRange` of each edge point.
    pub fn edge_ranges(&self) -> &Buffer {
        &self.at_edges.weight_ranges
    }

    /// Number of pixels, and capacity of the list of weights.
    pub fn capacity(&self) -> [u32; 2] {
        [self.size[0] * self.size[1], self.weight_capacity]
    }

    /// Bytes of the record tree and of the list of weights.
    pub fn list_bytes(&self) -> [u64; 2] {
        [self.tree.bytes(), self.weights.bytes()]
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
