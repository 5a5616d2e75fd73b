//! What the frame of an edit costs, without a clock: equal numbers in every run.

use crate::gpu::CommandCounts;
use crate::passes::frame::primary::Primary;
use crate::renderer::{FrameCounts, FrameReport};

/// A pass of the frame, all of its occurrences together.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub(super) struct PassCost {
    pub(super) name: &'static str,
    pub(super) dispatches: u32,
    /// Barriers from the begin of the pass to the begin of the next one.
    pub(super) barriers: u32,
    /// Bytes by the pass cost model; zero for passes that it leaves out.
    pub(super) bytes: u64,
    /// Rays by the same model.
    pub(super) rays: u64,
}

/// The frame of an edit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EditCost {
    pub(super) name: &'static str,
    /// Commands of the edit and of its frame.
    pub(super) commands: CommandCounts,
    /// Barriers of the same frame without waits between passes.
    pub(super) free_barriers: u64,
    pub(super) counts: FrameCounts,
    /// Records gathered, without the records gathered ahead of them.
    pub(super) gathered: u32,
    /// The passes in the order in which they begin.
    pub(super) passes: Vec<PassCost>,
}

impl EditCost {
    pub(super) fn new(
        name: &'static str,
        report: &FrameReport,
        commands: CommandCounts,
        free_barriers: u64,
    ) -> Self {
        let mut passes: Vec<PassCost> = Vec::new();
        for pass in &report.passes {
            // The report has the mean of the occurrences of a pass.
            let [bytes, rays] =
                [&report.bytes, &report.rays].map(|cost| cost.get(pass.name).copied().unwrap_or(0));
            let (name, dispatches, barriers) = (pass.name, pass.dispatches, pass.barriers);
            match passes.iter_mut().find(|cost| cost.name == name) {
                Some(cost) => {
                    cost.dispatches += dispatches;
                    cost.barriers += barriers;
                    cost.bytes += bytes;
                    cost.rays += rays;
                }
                None => passes.push(PassCost { name, dispatches, barriers, bytes, rays }),
            }
        }
        Self { name, commands, free_barriers, counts: report.counts, gathered: report.gathered, passes }
    }

    /// Bytes of all passes.
    pub(super) fn bytes(&self) -> u64 {
        self.passes.iter().map(|pass| pass.bytes).sum()
    }

    /// Camera rays and shadow rays of all passes.
    pub(super) fn rays(&self) -> [u64; 2] {
        [true, false].map(|of_camera| {
            let passes = self.passes.iter().filter(|pass| is_closest(pass.name) == of_camera);
            passes.map(|pass| pass.rays).sum()
        })
    }
}

/// Whether a pass traces closest hits. In frames those are camera rays; all other rays go
/// to a light.
pub(super) fn is_closest(pass: &str) -> bool {
    pass == Primary::STEM
}
