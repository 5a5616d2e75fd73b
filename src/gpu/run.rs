//! Runs recordings: records, submits, waits.

use std::sync::Arc;
use std::time::Instant;

use super::Context;
use super::recorder::Recorder;
use super::timeline::Trace;
use super::timing::PassTiming;
use crate::error::Result;

#[doc(hidden)]
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

    /// Records commands for one submission, which the caller makes. `is_serialised`: as for
    /// [`Self::run`], else as for [`Self::run_free`].
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn record(self: &Arc<Self>, is_serialised: bool, record: impl Fn(&mut Recorder)) -> Result<Recorder> {
        let begin = if is_serialised { Recorder::begin } else { Recorder::begin_free };
        Ok(self.record_with(begin, record)?.0)
    }

    fn run_with<T>(
        self: &Arc<Self>,
        begin: impl Fn(&Arc<Self>) -> Result<Recorder>,
        record: impl Fn(&mut Recorder) -> T,
    ) -> Result<(T, Vec<PassTiming>)> {
        let (recorder, value) = self.record_with(begin, record)?;
        Ok((value, recorder.submit()?.wait()?))
    }

    fn record_with<T>(
        self: &Arc<Self>,
        begin: impl Fn(&Arc<Self>) -> Result<Recorder>,
        record: impl Fn(&mut Recorder) -> T,
    ) -> Result<(Recorder, T)> {
        let mut recorder = begin(self)?;
        let mut value = record(&mut recorder);
        let missing = recorder.take_missing()?;
        if !missing.is_empty() {
            drop(recorder);
            self.pipelines.make((&self.device, &self.names, &self.optional), &missing)?;
            recorder = begin(self)?;
            value = record(&mut recorder);
        }
        Ok((recorder, value))
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
