//! Counters of a frame that the host wants: the device copies them into one block, which the host
//! reads once the frame is done. Two frames may be in flight: each has its own word for its list.
//! Only frames with a new view write the other words, and no frame begins before they are read.

use super::plan::{FramePlan, Gathering};
use crate::error::Result;
use crate::gpu::{Buffer, Context, HostBlock, Recorder};
use crate::passes::frame::antialias::Antialias;
use crate::passes::frame::bright::Bright;
use crate::passes::frame::needed_records::NeededRecords;
use crate::passes::frame::splat::Splat;
use crate::passes::frame::splat_capacity::SplatCounts;
use std::sync::Arc;

const EDGE_PIXELS: u32 = SplatCounts::WORDS;
const EDGE_POINTS: u32 = EDGE_PIXELS + 1;
const FRAGMENTS: u32 = EDGE_POINTS + 1;
const LISTED: u32 = FRAGMENTS + 1;
const BRIGHT: u32 = LISTED + FRAMES as u32;
const RAYS: u32 = BRIGHT + 1;
/// Words of the ray counts of a set of points: rays, and rays that a neighbour's ray replaces.
const RAY_WORDS: u32 = 2;
const WORDS: u32 = RAYS + 3 * RAY_WORDS;

/// Number of frames in flight.
const FRAMES: u64 = 2;

/// The counters. A frame that does not count something leaves its counter.
pub(super) struct FrameCounters {
    block: HostBlock,
    /// Number of frames recorded so far.
    frames: u64,
}

impl FrameCounters {
    pub(super) fn new(context: &Arc<Context>) -> Result<Self> {
        Ok(Self { block: HostBlock::new(context, "frame counters", WORDS)?, frames: 0 })
    }

    /// Begins the next frame. Returns its number.
    pub(super) fn begin_frame(&mut self) -> u64 {
        self.frames += 1;
        self.frames
    }

    /// Number of the frame that was begun last.
    pub(super) fn frame(&self) -> u64 {
        self.frames
    }

    /// Copies what the last frame counts. `bright`: if it gathered. Transfers.
    pub(super) fn record(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        (splat, antialias, needed): (&Splat, &Antialias, &NeededRecords),
        bright: Option<&Bright>,
    ) {
        if plan.view {
            splat.copy_counts(rec, &self.block, 0);
            let (groups, offset) = antialias.edge_count_at();
            rec.copy_to_host(groups, offset, &self.block, EDGE_PIXELS, 1);
            rec.copy_to_host(&antialias.fragments.point_groups, 12, &self.block, EDGE_POINTS, 1);
            let (groups, offset) = antialias.fragment_count_at();
            rec.copy_to_host(groups, offset, &self.block, FRAGMENTS, 1);
        }
        if let Gathering::List(_) = plan.gather {
            let (offsets, offset) = needed.listed_at();
            rec.copy_to_host(offsets, offset, &self.block, listed_at(self.frames), 1);
        }
        if let Some(bright) = bright {
            rec.copy_to_host(&bright.state, 0, &self.block, BRIGHT, 1);
        }
    }

    /// Copies the numbers of shadow rays, after a frame that traced any. Transfers.
    pub(super) fn copy_rays(&self, rec: &mut Recorder, counts: &[Buffer; 3]) {
        for (word, count) in (RAYS..).step_by(RAY_WORDS as usize).zip(counts) {
            rec.copy_to_host(count, 0, &self.block, word, RAY_WORDS);
        }
    }

    /// Numbers of shadow rays from pixels, fragments and entry points, in the last frame with any.
    /// Zero unless points that see a light alike take common rays.
    pub(super) fn rays(&self) -> [u32; 3] {
        [0, 1, 2].map(|set| self.block.word(RAYS + RAY_WORDS * set))
    }

    /// Number of shadow rays that a neighbour's ray spares: those of points that see a light alike.
    pub(super) fn spared_rays(&self) -> u64 {
        [0, 1, 2].map(|set| u64::from(self.block.word(RAYS + RAY_WORDS * set + 1))).iter().sum()
    }

    /// Lengths of the splat lists, and uncovered pixels.
    pub(super) fn splat(&self) -> SplatCounts {
        SplatCounts::read(&self.block, 0)
    }

    /// Number of bright clusters in the last frame that gathered.
    pub(super) fn bright_clusters(&self) -> u32 {
        self.block.word(BRIGHT)
    }

    /// Edge pixels of the view.
    pub(super) fn edge_pixels(&self) -> u32 {
        self.block.word(EDGE_PIXELS)
    }

    /// Edge points of the view.
    pub(super) fn edge_points(&self) -> u32 {
        self.block.word(EDGE_POINTS)
    }

    /// Fragments of the view.
    pub(super) fn fragments(&self) -> u32 {
        self.block.word(FRAGMENTS)
    }

    /// Length of the list of records that frame number `frame` built. Undefined if it built none.
    pub(super) fn listed(&self, frame: u64) -> u32 {
        self.block.word(listed_at(frame))
    }
}

fn listed_at(frame: u64) -> u32 {
    LISTED + (frame % FRAMES) as u32
}
