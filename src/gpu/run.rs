//! Runs recordings: records, submits, waits.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Instant;

use super::Context;
use super::recorder::Recorder;
use super::timeline::Trace;
use super::timing::PassTiming;
use crate::error::Result;

impl Context {
    /// Records commands, submits them and waits. Returns the result of `record` and the time of
    /// each pass in order. If a recording uses pipelines that are not compiled yet, it is not
    /// submitted: they are compiled in parallel, and `record` is called again.
    ///
    /// # Errors
    /// A Vulkan call failed; after the loss of the device the error names the last pass recorded.
    pub fn run<T>(self: &Arc<Self>, record: impl Fn(&mut Recorder) -> T) -> Result<(T, Vec<PassTiming>)> {
        self.run_with(Recorder::begin, record)
    }

    /// As [`Self::run`], but commands wait only for their data, not for the barriers of the caller,
    /// and independent ones may run at once. Returns the device time of all passes, milliseconds.
    ///
    /// # Errors
    /// As [`Self::run`].
    pub fn run_free<T>(self: &Arc<Self>, record: impl Fn(&mut Recorder) -> T) -> Result<(T, f64)> {
        let (value, timings) = self.run_with(Recorder::begin_free, record)?;
        Ok((value, timings.iter().map(|timing| timing.ms).sum()))
    }

    fn run_with<T>(
        self: &Arc<Self>,
        begin: impl Fn(&Arc<Self>) -> Result<Recorder>,
        record: impl Fn(&mut Recorder) -> T,
    ) -> Result<(T, Vec<PassTiming>)> {
        let mut recorder = begin(self)?;
        let mut value = record(&mut recorder);
        let missing = recorder.take_missing()?;
        if !missing.is_empty() {
            drop(recorder);
            self.pipelines.make((&self.device, &self.names, &self.optional), &missing)?;
            recorder = begin(self)?;
            value = record(&mut recorder);
        }
        self.submission_count.fetch_add(1, Ordering::Relaxed);
        let (timings, redundant) = recorder.submit_and_wait()?;
        self.redundant_barriers.lock().expect("no holder panics").extend(redundant);
        Ok((value, timings))
    }

    /// Begins a trace of host and device. Times count from `origin`.
    pub fn begin_trace(&self, origin: Instant) {
        self.timeline.begin(origin);
    }

    /// Ends the trace and returns it. Empty if none was begun.
    pub fn end_trace(&self) -> Trace {
        self.timeline.end()
    }
}
