//! Frames whose submission the caller makes: recorded, checked, ended.
//!
//! The host may record a frame while the device executes the one before. They share all buffers: on
//! one queue, each submission begins with a barrier behind the earlier ones. Edits travel in the
//! commands. What the host reads of a frame is in `counters.rs`.

use super::Renderer;
use super::dirty::Work;
use super::plan::FramePlan;
use super::report::{Columns, FrameCounts, FrameReport, FrameWatch};
use crate::error::Result;
use crate::gpu::{PassTiming, Recorder};
use std::collections::BTreeMap;

/// A frame that was recorded and has not ended.
pub struct RecordedFrame {
    pub(super) plan: FramePlan,
    number: u64,
    is_serialised: bool,
    lights_unchanged: [f64; 2],
    needs_precompute: bool,
    /// Wall-clock time of recording, and of the pipelines compiled in it, milliseconds.
    recording_ms: [f64; 2],
}

impl RecordedFrame {
    /// Whether the frame computes lists whose lengths are known only when it is done. It may be
    /// shown once [`Renderer::fits`] returns true.
    pub fn has_lists(&self) -> bool {
        self.plan.view
    }

    /// Whether the scene must be precomputed again, as [`FrameReport::needs_precompute`] describes.
    pub fn needs_precompute(&self) -> bool {
        self.needs_precompute
    }
}

#[doc(hidden)]
impl Renderer {
    /// Records the next frame, as [`Self::frame`] renders it. The caller submits it, then calls
    /// [`Self::fits`] if the frame has lists, [`Self::frame_is_valid`], and at last
    /// [`Self::end_frame`]. At most one earlier frame may not have ended.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn begin_frame(&mut self) -> Result<(Recorder, RecordedFrame)> {
        self.begin_frame_then(|_, _| ())
    }

    /// Records the next frame, and then further commands.
    pub(super) fn begin_frame_then(
        &mut self,
        then: impl Fn(&Self, &mut Recorder),
    ) -> Result<(Recorder, RecordedFrame)> {
        if self.dirty.changes.view {
            self.own_records.view_changed();
        }
        if !self.dirty.skips {
            self.force(Work::Everything);
        }
        let watch = FrameWatch::start(&self.context);
        let plan = self.plan();
        self.lights.prepare_near(&plan, &mut self.transport.near_lights)?;
        self.transport.live_sets.prepare(plan.is_whole)?;
        let mut frame = RecordedFrame {
            lights_unchanged: self.lights.unchanged(&plan),
            plan,
            number: self.counters.begin_frame(),
            is_serialised: self.is_serialised,
            needs_precompute: self.needs_precompute(),
            recording_ms: [0.0; 2],
        };
        let recorder = self.context.record(frame.is_serialised, |rec| {
            self.record(rec, &frame.plan);
            then(self, rec);
        })?;
        frame.recording_ms = watch.stop(&self.context);
        Ok((recorder, frame))
    }

    /// Records the last frame again, after [`Self::fits`] has returned false.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn record_frame(&self, frame: &RecordedFrame) -> Result<Recorder> {
        self.context.record(frame.is_serialised, |rec| self.record(rec, &frame.plan))
    }

    /// Whether the lists of the last frame fit. If not, they are longer now, and the frame must be
    /// recorded again. The frame's submission must be done.
    ///
    /// # Errors
    /// The device lacks memory or failed, or its loops were truncated.
    pub fn fits(&mut self, frame: &RecordedFrame) -> Result<bool> {
        self.world.buffers.refuse_truncated_loops("frame", 0)?;
        Ok(!frame.plan.view || !self.splat.grow(self.counters.splat())?)
    }

    /// Marks clean what the last frame computes. It is submitted, and its lists fit.
    pub fn frame_is_valid(&mut self, frame: &RecordedFrame) {
        self.dirty.clean(&frame.plan, &self.lights.traced());
    }

    /// Ends a frame whose submission is done, with the time of each pass. `frame_ms` of the report
    /// is the time of recording and of the device, without waiting. Bytes, rays and counts are left
    /// out of it.
    ///
    /// # Errors
    /// The device's loops were truncated.
    pub fn end_frame(&mut self, frame: &RecordedFrame, timings: Vec<PassTiming>) -> Result<FrameReport> {
        self.world.buffers.refuse_truncated_loops("frame", 0)?;
        let device_ms = timings.iter().map(|pass| pass.ms).sum();
        let passes = if frame.is_serialised { timings } else { Vec::new() };
        let listed = self.counters.listed(frame.number);
        let (record_count, is_last) =
            (self.transport.gather.point_count(), frame.number == self.counters.frame());
        let gathered = self.dirty.records.count(&frame.plan, listed, record_count, is_last);
        let [recording_ms, pipelines_ms] = frame.recording_ms;
        Ok(FrameReport {
            columns: Columns::from_passes(&passes),
            passes,
            frame_ms: recording_ms + device_ms,
            pipelines_ms,
            bytes: BTreeMap::new(),
            rays: BTreeMap::new(),
            counts: FrameCounts::default(),
            gathered,
            lights_unchanged: frame.lights_unchanged,
            device_ms,
            needs_precompute: frame.needs_precompute,
        })
    }
}
