//! The timeline: actions of host and device, on the host's clock.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use super::device::Limits;
use super::optional::{DeviceClock, Optional};
use super::timing::{PassTiming, milliseconds};
use crate::error::Result;

/// Number of readings of the device's clock; the narrowest counts.
const READINGS: usize = 3;

/// One pass on the device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassSpan {
    /// The pass's stem.
    pub name: &'static str,
    /// Microseconds since the trace began.
    pub begin_us: f64,
    /// End, in microseconds since the trace began.
    pub end_us: f64,
    /// Number of dispatches recorded.
    pub dispatches: u32,
}

/// One submission: all times are microseconds since the trace began.
#[derive(Clone, Debug, PartialEq)]
pub struct SubmissionSpan {
    /// When recording begins, µs.
    pub begun_us: f64,
    /// When recording ends and submitting begins, µs.
    pub recorded_us: f64,
    /// When the submission is made and waiting begins, µs.
    pub submitted_us: f64,
    /// When the device is done and reading of timestamps begins, µs.
    pub done_us: f64,
    /// When the timestamps are read, µs.
    pub read_us: f64,
    /// The passes, in order. Empty in submissions that only copy.
    pub passes: Vec<PassSpan>,
    /// Maximum deviation of the passes on the host's clock. `None` if they are aligned by the
    /// submission's begin, because the device does not relate its clock to others.
    pub deviation_us: Option<f64>,
}

/// An action of the host outside submissions.
#[derive(Clone, Debug, PartialEq)]
pub struct HostSpan {
    /// Name of the action.
    pub name: &'static str,
    /// Buffer that was copied.
    pub buffer: String,
    /// Microseconds since the trace began.
    pub begin_us: f64,
    /// End, in microseconds since the trace began.
    pub end_us: f64,
    /// Number of bytes copied.
    pub bytes: u64,
}

/// Actions between the begin and the end of a trace.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// Submissions in the order in which they were done.
    pub submissions: Vec<SubmissionSpan>,
    /// Host spans in order of time.
    pub host: Vec<HostSpan>,
}

/// Records submissions while a trace is active.
#[derive(Default)]
pub(super) struct Timeline(Mutex<Option<Open>>);

/// An active trace.
struct Open {
    origin: Instant,
    trace: Trace,
}

impl Open {
    /// Microseconds since the trace began.
    fn us(&self, time: Instant) -> f64 {
        time.saturating_duration_since(self.origin).as_secs_f64() * 1e6
    }
}

impl Timeline {
    /// Begins a trace. Times count from `origin`.
    pub(super) fn begin(&self, origin: Instant) {
        let open = Open { origin, trace: Trace::default() };
        *self.0.lock().expect("no holder panics") = Some(open);
    }

    /// Ends the trace and returns it. Empty if none was begun.
    pub(super) fn end(&self) -> Trace {
        let open = self.0.lock().expect("no holder panics").take();
        open.map_or_else(Trace::default, |open| open.trace)
    }

    /// Adds a submission: the host's times, in the order of [`SubmissionSpan`], and the ticks at
    /// which passes began and ended.
    pub(super) fn note_submission(
        &self,
        (optional, limits): (&Optional, &Limits),
        host: [Instant; 5],
        passes: &[PassTiming],
        ticks: &[[u64; 2]],
    ) -> Result<()> {
        let mut timeline = self.0.lock().expect("no holder panics");
        let Some(open) = timeline.as_mut() else { return Ok(()) };
        let [begun_us, recorded_us, submitted_us, done_us, read_us] = host.map(|time| open.us(time));
        let reading = optional.clock.as_ref().map(Reading::take).transpose()?;
        let deviation_us = reading.as_ref().map(|reading| reading.deviation_us);
        let anchor = match (&reading, ticks.first()) {
            (Some(reading), _) => Some(Anchor::Together { ticks: reading.ticks, us: open.us(reading.at) }),
            (None, Some(&[first, _])) => Some(Anchor::Submission { first, us: recorded_us }),
            (None, None) => None,
        };
        let place = |ticks| anchor.map_or(0.0, |anchor| anchor.place(ticks, limits));
        let spans = passes.iter().zip(ticks).map(|(pass, &[begin, end])| PassSpan {
            name: pass.name,
            begin_us: place(begin),
            end_us: place(end),
            dispatches: pass.dispatches,
        });
        open.trace.submissions.push(SubmissionSpan {
            begun_us,
            recorded_us,
            submitted_us,
            done_us,
            read_us,
            passes: spans.collect(),
            deviation_us,
        });
        Ok(())
    }

    /// Adds a copy between the program and mapped memory, which began at `begun` and ends now.
    pub(super) fn note_copy(&self, name: &'static str, buffer: &str, begun: Instant, bytes: u64) {
        let ended = Instant::now();
        let mut timeline = self.0.lock().expect("no holder panics");
        let Some(open) = timeline.as_mut() else { return };
        let (begin_us, end_us) = (open.us(begun), open.us(ended));
        open.trace.host.push(HostSpan { name, buffer: buffer.to_owned(), begin_us, end_us, bytes });
    }
}

/// The device's clock, read between two readings of the host's.
struct Reading {
    ticks: u64,
    at: Instant,
    deviation_us: f64,
}

impl Reading {
    fn take(clock: &DeviceClock) -> Result<Self> {
        let read = || -> Result<(Duration, Self)> {
            let before = Instant::now();
            let (ticks, deviation_ns) = clock.read()?;
            let width = before.elapsed();
            let deviation_us = 0.5e6 * width.as_secs_f64() + deviation_ns as f64 * 1e-3;
            Ok((width, Self { ticks, at: before + width / 2, deviation_us }))
        };
        let mut narrowest = read()?;
        for _ in 1..READINGS {
            let other = read()?;
            if other.0 < narrowest.0 {
                narrowest = other;
            }
        }
        Ok(narrowest.1)
    }
}

/// Relation of device ticks to the host's clock. There is one for each submission, so that drift
/// between the clocks does not accumulate.
#[derive(Clone, Copy)]
enum Anchor {
    /// Both clocks were read together, after the ticks to convert.
    Together { ticks: u64, us: f64 },
    /// The first tick is assumed to be when the host began to submit.
    Submission { first: u64, us: f64 },
}

impl Anchor {
    /// Time since the start, µs.
    fn place(self, ticks: u64, limits: &Limits) -> f64 {
        match self {
            Self::Together { ticks: last, us } => us - 1e3 * milliseconds(ticks, last, limits),
            Self::Submission { first, us } => us + 1e3 * milliseconds(first, ticks, limits),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_fall_before_a_common_reading_and_after_a_submission() {
        let limits = Limits { timestamp_bits: 36, timestamp_period_ns: 2.0, ..Limits::default() };
        let together = Anchor::Together { ticks: 500, us: 1000.0 };
        assert_eq!(together.place(500, &limits), 1000.0);
        assert_eq!(together.place(0, &limits), 999.0);
        // The counter wrapped between the two readings.
        assert_eq!(together.place((1 << 36) - 500, &limits), 998.0);
        let submission = Anchor::Submission { first: (1 << 36) - 500, us: 1000.0 };
        assert_eq!(submission.place((1 << 36) - 500, &limits), 1000.0);
        assert_eq!(submission.place(500, &limits), 1002.0);
    }
}
