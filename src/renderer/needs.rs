//! Which records a frame gathers. After an edit of the light, those that the view needs; when the
//! camera moves, those that it needs besides; when nothing is to be done, once, the others: then a
//! camera finds all records current.

use super::changes::Stages;
use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_INDIRECT;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::frame::blend::Blend;
use crate::passes::frame::gather::Gather;
use crate::passes::frame::needed_records::{NeededRecords, RecordList, RecordRequest};
use crate::passes::frame::splat::Splat;
use std::sync::Arc;

/// What a frame gathers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gathering {
    /// Nothing: all that the view needs is current.
    Nothing,
    All,
    /// What the last list holds: all that this view needs.
    Listed,
    /// What a new list will hold.
    List(RecordRequest),
}

/// The lists, and what is known of them.
pub(super) struct Needs {
    pass: NeededRecords,
    all: RecordList,
    record_count: u32,
    /// The marks of seen records are those of the view.
    knows_view: bool,
    /// The list holds all that the view needs.
    has_list: bool,
    /// Some records may be out of date.
    lags: bool,
    /// Records that the last frame to gather any gathered.
    gathered: u32,
    /// The last list was made for a new view.
    marked_view: bool,
}

impl Needs {
    pub(super) fn new(context: &Arc<Context>, gather: &Gather) -> Result<Self> {
        let (record_count, rows) = (gather.point_count(), gather.merged_rays.rows_per_part);
        Ok(Self {
            pass: NeededRecords::new(context, record_count, rows)?,
            all: RecordList::all(context, record_count, rows)?,
            record_count,
            knows_view: false,
            has_list: false,
            lags: false,
            gathered: 0,
            marked_view: false,
        })
    }

    /// What a frame of those stages has to gather.
    pub(super) fn of(&self, stages: Stages, skips: bool) -> Gathering {
        let request = RecordRequest {
            view_is_new: stages.view || !self.knows_view,
            none_is_current: stages.energy,
            all: false,
        };
        match stages.energy {
            true if !skips => Gathering::All,
            true if self.has_list && !request.view_is_new => Gathering::Listed,
            true => Gathering::List(request),
            false if !self.lags => Gathering::Nothing,
            false if stages.view => Gathering::List(request),
            false if stages.is_idle() => {
                Gathering::List(RecordRequest { view_is_new: false, all: true, ..request })
            }
            false => Gathering::Nothing,
        }
    }

    /// Makes the list, if one is to be made; it is ready for what follows. Returns the list to
    /// gather and marks of the records to blend, none where these are all; none at all where there
    /// is nothing to gather.
    pub(super) fn record(
        &self,
        rec: &mut Recorder,
        gathering: Gathering,
        splat: &Splat,
        blend: &Blend,
    ) -> Option<(&RecordList, Option<&Buffer>)> {
        match gathering {
            Gathering::Nothing => None,
            Gathering::All => Some((&self.all, None)),
            Gathering::Listed => Some((&self.pass.list, Some(&self.pass.is_seen))),
            Gathering::List(request) => {
                self.pass.record(rec, request, splat, blend);
                rec.barrier(COMPUTE_TO_INDIRECT);
                Some((&self.pass.list, (!request.all).then_some(&self.pass.is_seen)))
            }
        }
    }

    /// Takes note of what a frame has done; returns how many records it gathered.
    pub(super) fn settle(&mut self, stages: Stages, gathering: Gathering) -> Result<u32> {
        self.knows_view &= !stages.view;
        self.has_list &= !stages.view;
        match gathering {
            Gathering::Nothing => return Ok(0),
            Gathering::All => (self.has_list, self.lags, self.gathered) = (false, false, self.record_count),
            Gathering::Listed => self.lags = true,
            Gathering::List(request) => {
                self.gathered = self.pass.listed()?;
                self.marked_view = request.view_is_new;
                self.knows_view |= request.view_is_new;
                self.has_list = request.none_is_current;
                self.lags = !request.all;
            }
        }
        if self.gathered == self.record_count {
            self.lags = false;
        }
        Ok(self.gathered)
    }

    /// Whether the last list was made for a new view, whose splat weights were read.
    pub(super) fn marked_view(&self) -> bool {
        self.marked_view
    }

    /// Records that the last frame to gather any gathered, ahead of others or not.
    pub(super) fn gathered(&self) -> u32 {
        self.gathered
    }

    pub(super) fn all(&self) -> &RecordList {
        &self.all
    }

    /// Records that the view needs, where that is known.
    pub(super) fn of_view(&self) -> Option<u32> {
        self.has_list.then_some(self.gathered)
    }
}
