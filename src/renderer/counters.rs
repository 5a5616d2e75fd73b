//! Counters of a frame that the host wants: the device copies them into one block, which the host
//! reads once the frame is done. Two frames may be in flight: each has its own word for its list.
//! Only frames with a new view write the other words, and no frame begins before they are read.

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
const WORDS: u32 = LISTED + FRAMES as u32;

/// Number of frames in flight.
const FRAMES: u64 = 2;

/// The counters. A frame that does not count something leaves its counter.
pub(super) struct FrameCounters(HostBlock);

impl FrameCounters {
    pub(super) fn new(context: &Arc<Context>) -> Result<Self> {
        HostBlock::new(context, "frame counters", WORDS).map(Self)
    }

    /// Copies what frame number `frame` counts. Transfers.
    pub(super) fn record(
        &self,
        rec: &mut Recorder,
        (plan, frame): (&FramePlan, u64),
        (splat, antialias, needed): (&Splat, &Antialias, &NeededRecords),
    ) {
        if plan.view {
            splat.copy_counts(rec, &self.0, 0);
            let (groups, offset) = antialias.edge_count_at();
            rec.copy_to_host(groups, offset, &self.0, EDGE_PIXELS, 1);
        }
        if let Gathering::List(_) = plan.gather {
            let (offsets, offset) = needed.listed_at();
            rec.copy_to_host(offsets, offset, &self.0, listed_at(frame), 1);
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

    /// Length of the list of records that frame number `frame` built. Undefined if it built none.
    pub(super) fn listed(&self, frame: u64) -> u32 {
        self.0.word(listed_at(frame))
    }
}

fn listed_at(frame: u64) -> u32 {
    LISTED + (frame % FRAMES) as u32
}
