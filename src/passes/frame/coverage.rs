//! What each pixel shows, and how much of it: counted on the host from the samples that antialias
//! the picture. In: pixels, samples of edge pixels. Out: sides with fractions.

use crate::cpu::antialias::samples_per_edge;
use crate::error::Result;
use crate::passes::frame::antialias::{NO_EDGE, SeenFragments};
use crate::types::{NO_SIDE, PixelSurface};

/// The sides that each pixel shows. A pixel without an edge shows the side at its centre.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    /// First entry of each pixel, row by row from the top; then the number of entries.
    firsts: Vec<u32>,
    /// Sides, each with its fraction of the pixel.
    entries: Vec<(u32, f32)>,
}

impl Coverage {
    /// Reads the samples of the last view.
    ///
    /// # Errors
    /// The device failed.
    pub fn read(seen: SeenFragments<'_>) -> Result<Self> {
        let SeenFragments { pixels, antialias } = seen;
        let centres: Vec<PixelSurface> = pixels.read()?;
        let mut numbers: Vec<u32> = antialias.numbers.read()?;
        let edge_count = numbers.pop().unwrap_or(0);
        let capacity = antialias.capacity;
        let count = match antialias.is_on() {
            true => {
                let all = [capacity.samples, capacity.fragments];
                samples_per_edge(edge_count, capacity.light_samples, all) as usize
            }
            false => 0,
        };
        let samples: Vec<u32> = antialias.edge_samples.read_range(0, edge_count as usize * count)?;
        let mut coverage = Self { firsts: Vec::with_capacity(centres.len() + 1), entries: Vec::new() };
        let mut sorted = Vec::with_capacity(count);
        for (centre, number) in centres.iter().zip(numbers) {
            coverage.firsts.push(coverage.entries.len() as u32);
            if number == NO_EDGE || count == 0 {
                coverage.entries.extend((centre.side != NO_SIDE).then_some((centre.side, 1.0)));
                continue;
            }
            sorted.clear();
            sorted.extend_from_slice(&samples[number as usize * count..][..count]);
            sorted.sort_unstable();
            let of_side = sorted.chunk_by(|a, b| a == b).filter(|same| same[0] != NO_SIDE);
            let fraction = |same: &[u32]| (same[0], same.len() as f32 / count as f32);
            coverage.entries.extend(of_side.map(fraction));
        }
        coverage.firsts.push(coverage.entries.len() as u32);
        Ok(coverage)
    }

    /// The sides of each pixel with their fractions, row by row from the top.
    pub fn pixels(&self) -> impl Iterator<Item = &[(u32, f32)]> {
        self.firsts.windows(2).map(|pair| &self.entries[pair[0] as usize..pair[1] as usize])
    }

    /// Fraction of each pixel that shows a surface.
    pub fn alpha(&self) -> impl Iterator<Item = f32> {
        self.pixels().map(|sides| sides.iter().map(|(_, fraction)| fraction).sum())
    }
}
