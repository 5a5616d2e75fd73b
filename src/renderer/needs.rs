//! Selects the records that a frame gathers.
//!
//! - After a light edit: the records that the view uses.
//! - After a camera movement: further records that the new view uses.
//! - Once, in a frame without a change: all others. All records are then current for any camera.

use super::changes::Stages;
use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_INDIRECT;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::frame::blend::Blend;
use crate::passes::frame::gather::Gather;
use crate::passes::frame::needed_records::{NeededRecords, RecordList, RecordRequest};
use crate::passes::frame::splat::Splat;
use std::sync::Arc;

/// The records that a frame gathers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Gathering {
    /// No record: each record that the view uses is current.
    Nothing,
    All,
    /// The last list again: it holds the records that this view uses.
    Listed,
    /// A new list, built by the frame.
    List(RecordRequest),
}

/// The lists of records, and their state.
pub(super) struct Needs {
    pass: NeededRecords,
    all: RecordList,
    record_count: u32,
    /// The mask of seen records is current for the view.
    knows_view: bool,
    /// The list holds every record that the view uses.
    has_list: bool,
    /// Some records may be stale.
    lags: bool,
    /// Number of records in the last frame that gathered any.
    gathered: u32,
    /// The last list was built for a new view.
    marked_view: bool,
}

impl Needs {
    pub(super) fn new(context: &Arc<Context>, gather: &Gather) -> Result<Self> {
        let (record_count, rows) = (gather.point_count(), gather.merged_rays.records_per_chunk);
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

    /// Returns the records that a frame with these stages gathers.
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

    /// Builds the list of stale records and makes it visible to the gather pass. Returns the list
    /// and a mask of records to blend (`None`: all). Returns `None` if no record is stale.
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

    /// Updates the state after a frame. Returns the number of records that the frame gathered.
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

    /// Whether the last list was built for a new view, so that its pass read the splat weights.
    pub(super) fn marked_view(&self) -> bool {
        self.marked_view
    }

    /// Number of records in the last frame that gathered any, records gathered ahead included.
    pub(super) fn gathered(&self) -> u32 {
        self.gathered
    }

    pub(super) fn all(&self) -> &RecordList {
        &self.all
    }

    /// Number of records that the view uses. `None` if the list does not hold them.
    pub(super) fn of_view(&self) -> Option<u32> {
        self.has_list.then_some(self.gathered)
    }
}
