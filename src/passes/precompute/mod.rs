//! Passes that run once, before the first frame. Each keeps its dispatches short, so that no watchdog bites and a
//! desktop stays usable, and reports its progress.

mod budget;
pub mod cache_points;
pub mod clearance;
pub mod cluster_views;
mod coverage;
pub mod entry_points;
pub mod gather_rays;
pub mod gloss;
pub mod light_paths;
pub mod narrow_gaps;
pub mod near_clusters;
pub mod near_hits;
pub mod neighbours;
pub mod occlusion;
pub mod open_shares;
pub mod openness;
pub mod path_orders;
mod piece_points;
pub mod ray_bundles;
pub mod rays;
mod reaches;
pub mod reads;
pub mod separated;
mod shares;
pub mod sides;

use crate::error::Result;

/// How long one dispatch should take, milliseconds: half of what is meant to be the longest, for items differ by as much.
const DISPATCH_MS: f64 = 25.0;

/// Told how the precomputation gets on.
pub trait Progress {
    /// A stage begins that consists of `total` steps.
    fn stage(&mut self, name: &str, total: u64);
    /// `done` of the stage's steps are done.
    fn advance(&mut self, done: u64);
    /// All stages are done.
    fn finish(&mut self);
}

/// Keeps quiet.
pub struct Silent;

impl Progress for Silent {
    fn stage(&mut self, _name: &str, _total: u64) {}
    fn advance(&mut self, _done: u64) {}
    fn finish(&mut self) {}
}

/// Cuts a batch into dispatches of 50 ms at the most, or little more, from the device time of those before.
pub struct Chunks {
    size: u32,
    limit: u32,
}

impl Chunks {
    /// Starts with dispatches of `size` items and never goes beyond `limit`.
    pub fn new(size: u32, limit: u32) -> Self {
        Self { size: size.min(limit), limit }
    }

    /// Runs all items; `dispatch` takes the first item and their number, and returns its device time in milliseconds.
    ///
    /// # Errors
    /// The first failure of a dispatch.
    pub fn run(&mut self, total: u32, mut dispatch: impl FnMut(u32, u32) -> Result<f64>) -> Result<()> {
        let mut first = 0;
        while first < total {
            let count = self.size.min(total - first);
            let ms = dispatch(first, count)?;
            first += count;
            // At most doubled at a time: the first dispatch of a kind may include its compilation.
            let ideal = f64::from(count) * DISPATCH_MS / ms.max(1e-3);
            self.size = (ideal.min(2.0 * f64::from(self.size)) as u32).clamp(1, self.limit);
        }
        Ok(())
    }
}
