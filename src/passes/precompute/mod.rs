//! Passes that run once, before the first frame. Their dispatches are short, so that no watchdog
//! ends them and a desktop stays usable. They report progress.

mod budget;
pub mod cache_points;
mod coverage;
pub mod entry_points;
mod fragment_points;
pub mod gather_rays;
pub mod geometry;
pub mod gloss;
mod gradient_packing;
pub mod kept;
pub mod light_paths;
pub mod live_clusters;
pub mod merged_rays;
pub mod neighbours;
pub mod path_orders;
pub mod rays;
mod reaches;
pub mod visibility;

use crate::error::{Error, Result};
use crate::gpu::barrier::TRANSFER_TO_TRANSFER;
use crate::gpu::{PassTiming, Recorder};
use std::ops::Range;

/// Target duration of a dispatch, milliseconds: a fifth of the intended maximum. Items are in
/// surface order, and beyond a region of cheap items they may take four times as long.
const DISPATCH_MS: f64 = 10.0;

/// Dispatches of a submission at most. The host is needed once for each submission.
const DISPATCHES: usize = 8;

/// Stems of the shaders of these passes.
pub const STEMS: [&str; 6] = [
    rays::Rays::STEM,
    visibility::clearance::STEM,
    entry_points::STEM,
    light_paths::STEM,
    visibility::accessibility::STEM,
    gather_rays::STEM,
];

/// Receiver of the precomputation's progress.
pub trait Progress {
    /// Starts a precomputation stage of `total` steps.
    fn stage(&mut self, name: &str, total: u64);
    /// `done` of the stage's steps are done.
    fn advance(&mut self, done: u64);
    /// All stages are done.
    fn finish(&mut self);
    /// Whether the precomputation shall end early, with [`Error::Cancelled`]. It is called several
    /// times a second, between submissions.
    fn is_cancelled(&mut self) -> bool {
        false
    }
}

/// Reports steps that are done.
///
/// # Errors
/// [`Error::Cancelled`] if the caller wants no more.
fn advance(progress: &mut dyn Progress, done: u64) -> Result<()> {
    progress.advance(done);
    if progress.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
}

/// Starts a stage of `total` steps.
///
/// # Errors
/// [`Error::Cancelled`] if the caller wants no more.
pub fn begin_stage(progress: &mut dyn Progress, name: &str, total: u64) -> Result<()> {
    progress.stage(name, total);
    if progress.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
}

/// Progress that reports nothing.
pub struct Silent;

impl Progress for Silent {
    fn stage(&mut self, _name: &str, _total: u64) {}
    fn advance(&mut self, _done: u64) {}
    fn finish(&mut self) {}
}

/// Factor by which the remembered worst duration of an item decays in each dispatch: costly items
/// come in groups.
const REMEMBERED: f64 = 0.9;

/// Divides batches into dispatches of at most about 50 ms, longer if items differ by more than five
/// times. The size follows from the device times of earlier dispatches.
pub struct Chunks {
    size: u32,
    limit: u32,
    /// Estimated duration of an item, milliseconds.
    each_ms: f64,
}

impl Chunks {
    /// Starts with dispatches of `size` items and never exceeds `limit`.
    pub fn new(size: u32, limit: u32) -> Self {
        Self { size: size.min(limit), limit, each_ms: 0.0 }
    }

    /// Runs all items; `dispatch` takes the first item and their number, and returns its device
    /// time in milliseconds.
    ///
    /// # Errors
    /// The first failure of a dispatch.
    pub fn run(&mut self, total: u32, mut dispatch: impl FnMut(u32, u32) -> Result<f64>) -> Result<()> {
        let mut first = 0;
        while first < total {
            let count = self.size.min(total - first);
            let ms = dispatch(first, count)?;
            first += count;
            self.observe(count, ms);
        }
        Ok(())
    }

    /// As [`Self::run`], with several dispatches a submission, which has `limit` items at most.
    /// `submit` takes the first item of the submission and the items of each dispatch, counted from
    /// that one. It returns a timing for each dispatch.
    ///
    /// # Errors
    /// The first failure of a submission.
    pub fn run_batches(
        &mut self,
        total: u32,
        mut submit: impl FnMut(u32, &[Range<u32>]) -> Result<Vec<PassTiming>>,
    ) -> Result<()> {
        let mut first = 0;
        while first < total {
            // The duration of the first dispatch is not known.
            let most = if self.each_ms == 0.0 { 1 } else { DISPATCHES };
            let items = self.limit.min(total - first);
            let parts = (0..items).step_by(self.size as usize).take(most);
            let parts: Vec<Range<u32>> = parts.map(|part| part..items.min(part + self.size)).collect();
            let timings = submit(first, &parts)?;
            for (part, timing) in parts.iter().zip(&timings) {
                self.observe(part.end - part.start, timing.ms);
            }
            first += parts.last().map_or(0, |part| part.end);
        }
        Ok(())
    }

    /// Adapts the size to the duration of a dispatch.
    fn observe(&mut self, count: u32, ms: f64) {
        // At most doubled at a time: the first dispatch of a kind may include its compilation.
        self.each_ms = (ms.max(1e-3) / f64::from(count)).max(REMEMBERED * self.each_ms);
        let ideal = DISPATCH_MS / self.each_ms;
        self.size = (ideal.min(2.0 * f64::from(self.size)) as u32).clamp(1, self.limit);
    }
}

/// Records the parts of a submission, which use the same buffers one after another.
fn each_part(rec: &mut Recorder, parts: &[Range<u32>], mut record: impl FnMut(&mut Recorder, Range<u32>)) {
    for (number, part) in parts.iter().enumerate() {
        if number > 0 {
            rec.barrier(TRANSFER_TO_TRANSFER);
        }
        record(rec, part.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costly_items_are_not_forgotten_at_once() {
        // Every fourth batch of items takes ten times as long an item. The first comes as a
        // surprise.
        let mut chunks = Chunks::new(16, 1 << 20);
        let (mut longest, mut dispatches) = (0.0_f64, 0);
        for batch in 0..64 {
            let each = if batch % 4 == 3 { 0.04 } else { 0.004 };
            let dispatch = |_, count: u32| {
                let ms = each * f64::from(count);
                longest = longest.max(if batch > 3 { ms } else { 0.0 });
                dispatches += 1;
                Ok(ms)
            };
            chunks.run(700, dispatch).unwrap();
        }
        assert!(longest < 22.4, "{longest} ms of 28 that forgetting costs");
        assert!(dispatches < 64 * 4, "{dispatches} dispatches");
    }

    #[test]
    fn batches_hold_all_items_in_order() {
        let mut chunks = Chunks::new(16, 1000);
        let (mut next, mut submissions, mut dispatches) = (0, 0, 0);
        let submit = |first: u32, parts: &[Range<u32>]| {
            assert!(parts.len() <= DISPATCHES && parts.last().unwrap().end <= 1000);
            submissions += 1;
            for part in parts {
                assert_eq!(first + part.start, next);
                next = first + part.end;
            }
            dispatches += parts.len();
            let timing = |part: &Range<u32>| PassTiming {
                ms: 0.05 * f64::from(part.end - part.start),
                ..PassTiming::default()
            };
            Ok(parts.iter().map(timing).collect())
        };
        chunks.run_batches(10_007, submit).unwrap();
        assert_eq!(next, 10_007);
        // 200 items take 10 ms.
        assert!((50..60).contains(&dispatches), "{dispatches} dispatches");
        assert!((9..=13).contains(&submissions), "{submissions} submissions");
    }

    #[test]
    fn items_that_take_four_times_as_long_of_a_sudden_keep_to_the_longest() {
        let mut chunks = Chunks::new(16, 1 << 20);
        let mut longest = 0.0_f64;
        let dispatch = |first, count: u32| {
            let ms = (first..first + count).map(|item| if item < 40_000 { 0.003 } else { 0.012 }).sum();
            longest = longest.max(ms);
            Ok(ms)
        };
        chunks.run(80_000, dispatch).unwrap();
        assert!((20.0..50.0).contains(&longest), "{longest} ms");
    }
}
