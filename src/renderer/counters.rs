//! Counters of a frame that the host wants: the device copies them into one block, which the host
//! reads after the wait for the frame.

use super::plan::{FramePlan, Gathering};
use crate::error::Result;
use crate::gpu::{Context, HostBlock, Recorder};
use crate::passes::frame::antialias::Antialias;
use crate::passes::frame::needed_records::NeededRecords;
use crate::passes::frame::splat::Splat;
use crate::passes::frame::splat_capacity::SplatCounts;
use std::sync::Arc;

const EDGE_PIXELS: u32 = SplatCounts::WORDS;
const LISTED: u32 = EDGE_PIXELS + 1;
const WORDS: u32 = LISTED + 1;

/// The counters. A frame that does not count something leaves its counter.
pub(super) struct FrameCounters(HostBlock);

impl FrameCounters {
    pub(super) fn new(context: &Arc<Context>) -> Result<Self> {
        HostBlock::new(context, "frame counters", WORDS).map(Self)
    }

    /// Copies what the frame counts. Transfers.
    pub(super) fn record(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        (splat, antialias, needed): (&Splat, &Antialias, &NeededRecords),
    ) {
        if plan.view {
            splat.copy_counts(rec, &self.0, 0);
            let (groups, offset) = antialias.edge_count_at();
            rec.copy_to_host(groups, offset, &self.0, EDGE_PIXELS, 1);
        }
        if let Gathering::List(_) = plan.gather {
            let (offsets, offset) = needed.listed_at();
            rec.copy_to_host(offsets, offset, &self.0, LISTED, 1);
        }
    }

    /// Lengths of the splat lists, and uncovered pixels.
    pub(super) fn splat(&self) -> SplatCounts {
        SplatCounts::read(&self.0, 0)
    }

    /// Edge pixels of the view.
    pub(super) fn edge_pixels(&self) -> u32 {
        self.0.word(EDGE_PIXELS)
    }

    /// Length of the list of records that was built last.
    pub(super) fn listed(&self) -> u32 {
        self.0.word(LISTED)
    }
}
