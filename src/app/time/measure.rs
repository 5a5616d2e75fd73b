//! Renders frames and summarises their times.

use super::edit_costs::EditCost;
use super::paper::COLUMNS;
use crate::error::Result;
use crate::gpu::{CommandCounts, Context, PassTiming};
use crate::renderer::{FrameReport, Renderer, Work};
use glam::Vec3;

/// Window of the warm-up test: this many frames are compared with as many before.
const WINDOW: usize = 3;

/// Medians of two successive windows that differ by less than this fraction count as settled.
const SETTLED: f64 = 0.05;

/// Number of columns before the whole-frame columns.
pub(super) const STAGES: usize = 5;

/// Number of timed edits: those of the whole-frame columns.
const TIMED: usize = COLUMNS.len() - STAGES;
/// The edits whose frames are counted; the timed ones come first. `None`: nothing has changed.
const EDITS: [(&str, Option<Work>); TIMED + 2] = [
    (COLUMNS[STAGES], Some(Work::Everything)),
    (COLUMNS[STAGES + 1], Some(Work::Light(0))),
    (COLUMNS[STAGES + 2], Some(Work::View)),
    (COLUMNS[STAGES + 3], Some(Work::Material)),
    ("colour", Some(Work::Colour)),
    ("idle", None),
];
/// Index of the camera step in `EDITS`.
const STEP_FRAME: usize = 2;

/// Order statistics of a set of times, milliseconds.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub(in crate::app) struct Summary {
    pub(in crate::app) median: f64,
    pub(in crate::app) p10: f64,
    pub(in crate::app) p90: f64,
    pub(in crate::app) min: f64,
}

impl Summary {
    /// Summary of at least one time.
    pub(in crate::app) fn from_times(times: impl IntoIterator<Item = f64>) -> Self {
        let mut times: Vec<f64> = times.into_iter().collect();
        times.sort_by(f64::total_cmp);
        let quantile = |fraction: f64| {
            let place = fraction * (times.len() - 1) as f64;
            let (low, high) = (times[place.floor() as usize], times[place.ceil() as usize]);
            low + (high - low) * place.fract()
        };
        Self { median: quantile(0.5), p10: quantile(0.1), p90: quantile(0.9), min: times[0] }
    }
}

/// One pass of a frame in which everything is stale.
#[derive(Debug)]
pub(super) struct PassSummary {
    pub(super) name: &'static str,
    pub(super) ms: Summary,
    /// The pass ran concurrently with a neighbour, so its time is not its own.
    pub(super) overlapped: bool,
    /// Bytes read and written, by the pass cost model.
    pub(super) bytes: u64,
    /// Rays traced, if the pass traces.
    pub(super) rays: Option<u64>,
}

impl PassSummary {
    /// Bytes moved per second, in 10⁹. `None` if the pass is too short to time.
    pub(super) fn gbps(&self) -> Option<f64> {
        (self.ms.median > 0.0).then(|| self.bytes as f64 / (self.ms.median * 1e6))
    }

    /// Rays per second, in 10⁶.
    pub(super) fn mrays_per_s(&self) -> Option<f64> {
        self.rays.filter(|_| self.ms.median > 0.0).map(|rays| rays as f64 / (self.ms.median * 1e3))
    }
}

/// Times of one scene's frames.
#[derive(Debug)]
pub(super) struct Measurement {
    /// Device time, by [`COLUMNS`].
    pub(super) columns: [Summary; COLUMNS.len()],
    /// Wall-clock time of the whole frames, by the columns from `Ttot` on.
    pub(super) wall: [Summary; TIMED],
    /// Device time of the same frames without waits between passes.
    pub(super) free: [Summary; TIMED],
    /// Wall-clock time of these frames.
    pub(super) free_wall: [Summary; TIMED],
    /// Passes in execution order.
    pub(super) passes: Vec<PassSummary>,
    /// What the frame of each edit costs, without a clock.
    pub(super) edits: Vec<EditCost>,
    /// Records gathered by a camera step in addition to those of the last light move, median.
    pub(super) step_records: f64,
    /// Whether the warm-up ended because times had settled.
    pub(super) settled: bool,
}

/// Sideways step of the camera, as a fraction of its distance to the target.
const STEP: f32 = 0.01;

/// A camera that steps aside and back again.
struct Walk {
    position: Vec3,
    target: Vec3,
    step: Vec3,
    is_aside: bool,
}

impl Walk {
    fn new(renderer: &Renderer) -> Self {
        let camera = &renderer.scene().cameras[0];
        let (position, target) = (camera.position, camera.target);
        let step = STEP * (target - position).cross(camera.up.normalize());
        Self { position, target, step, is_aside: false }
    }

    fn step(&mut self, renderer: &mut Renderer) {
        self.is_aside ^= true;
        let step = if self.is_aside { self.step } else { Vec3::ZERO };
        renderer.move_camera(self.position + step, self.target + step);
        // Forced because the step may be zero.
        renderer.force(Work::View);
    }

    /// Goes back to the start.
    fn end(&mut self, renderer: &mut Renderer) -> Result<()> {
        if self.is_aside {
            self.step(renderer);
            renderer.frame()?;
        }
        Ok(())
    }
}

/// The frame of an edit.
struct Edited {
    report: FrameReport,
    /// Commands of the edit and of its frame.
    commands: CommandCounts,
}

/// Warms up until the medians of the whole frame settle. Then runs `frames` rounds of all kinds of
/// work, so that clock drift affects all columns alike.
pub(super) fn measure(context: &Context, renderer: &mut Renderer, frames: usize) -> Result<Measurement> {
    let mut walk = Walk::new(renderer);
    let mut warm_up = Vec::new();
    while !settled(&warm_up) && warm_up.len() < frames.max(2 * WINDOW) {
        warm_up.push(round(context, renderer, &mut walk, TIMED)?[0].report.frame_ms);
    }
    let rounds = rounds(context, renderer, &mut walk, frames)?;
    renderer.set_serialised(false);
    let free = self::rounds(context, renderer, &mut walk, frames);
    renderer.set_serialised(true);
    let free = free?;
    let whole: Vec<&FrameReport> = rounds.iter().map(|round| &round[0].report).collect();
    let sum_ms = |edited: &Edited| stages_ms(&edited.report).iter().sum();
    let columns = std::array::from_fn(|column| match column {
        0..STAGES => Summary::from_times(whole.iter().map(|frame| stages_ms(frame)[column])),
        _ => Summary::from_times(rounds.iter().map(|round| sum_ms(&round[column - STAGES]))),
    });
    let by_edit = |rounds: &[Vec<Edited>], time: fn(&FrameReport) -> f64| {
        std::array::from_fn(|edit| Summary::from_times(rounds.iter().map(|round| time(&round[edit].report))))
    };
    // Every run counts the same frames: the first round begins at the start of the walk.
    let counted = EDITS.iter().zip(rounds[0].iter().zip(&free[0]));
    let edits = counted.map(|((name, _), (edited, free))| {
        EditCost::new(name, &edited.report, edited.commands, free.commands.barriers)
    });
    let edits = edits.collect();
    let wall = by_edit(&rounds, |report| report.frame_ms);
    let free_wall = by_edit(&free, |report| report.frame_ms);
    let free = by_edit(&free, |report| report.device_ms);
    let steps = rounds.iter().map(|round| f64::from(round[STEP_FRAME].report.gathered));
    let step_records = Summary::from_times(steps).median;
    let (passes, settled) = (passes(&whole), settled(&warm_up));
    Ok(Measurement { columns, wall, free, free_wall, passes, edits, step_records, settled })
}

/// Rounds of all timed edits, which begin and end at the start of the walk. The first round has the
/// other edits, too.
fn rounds(
    context: &Context,
    renderer: &mut Renderer,
    walk: &mut Walk,
    count: usize,
) -> Result<Vec<Vec<Edited>>> {
    walk.end(renderer)?;
    let edits = |index| if index == 0 { EDITS.len() } else { TIMED };
    let rounds =
        (0..count).map(|index| round(context, renderer, walk, edits(index))).collect::<Result<Vec<_>>>()?;
    walk.end(renderer)?;
    Ok(rounds)
}

/// A frame of each of the first edits of [`EDITS`]. The camera really moves, so that its frame
/// gathers new records.
fn round(context: &Context, renderer: &mut Renderer, walk: &mut Walk, edits: usize) -> Result<Vec<Edited>> {
    let mut frames = Vec::with_capacity(edits);
    for (_, work) in &EDITS[..edits] {
        let before = context.command_counts();
        match work {
            Some(Work::View) => walk.step(renderer),
            Some(work) => renderer.force(*work),
            None => {}
        }
        let report = renderer.frame()?;
        frames.push(Edited { report, commands: context.command_counts() - before });
    }
    Ok(frames)
}

fn settled(times: &[f64]) -> bool {
    let Some(start) = times.len().checked_sub(2 * WINDOW) else { return false };
    let (before, after) = times[start..].split_at(WINDOW);
    let [before, after] = [before, after].map(|window| Summary::from_times(window.iter().copied()).median);
    (after - before).abs() <= SETTLED * before
}

fn stages_ms(frame: &FrameReport) -> [f64; STAGES] {
    let columns = &frame.columns;
    [columns.Tdi, columns.Tlpe, columns.Thvds, columns.Tfg, columns.Tsplat]
}

fn passes(frames: &[&FrameReport]) -> Vec<PassSummary> {
    let last = frames.last().expect("at least one frame is timed");
    let summarise = |pass: &PassTiming| {
        let times = frames.iter().flat_map(|frame| &frame.passes).filter(|other| other.name == pass.name);
        PassSummary {
            name: pass.name,
            ms: Summary::from_times(times.map(|other| other.ms)),
            overlapped: pass.overlapped,
            bytes: last.bytes.get(pass.name).copied().unwrap_or(0),
            rays: last.rays.get(pass.name).copied(),
        }
    };
    last.passes.iter().map(summarise).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_interpolate_between_order_statistics() {
        let summary = Summary::from_times((0..=10).rev().map(f64::from));
        assert_eq!(summary, Summary { median: 5.0, p10: 1.0, p90: 9.0, min: 0.0 });
        assert_eq!(Summary::from_times([3.0, 1.0]).median, 2.0);
        assert_eq!(Summary::from_times([7.0]), Summary { median: 7.0, p10: 7.0, p90: 7.0, min: 7.0 });
    }

    #[test]
    fn times_settle_when_two_windows_agree() {
        assert!(!settled(&[1.0; 5]));
        assert!(settled(&[1.0; 6]));
        assert!(!settled(&[40.0, 2.0, 2.0, 1.0, 1.0, 1.0]));
        assert!(settled(&[40.0, 9.0, 1.0, 1.0, 1.0, 1.0, 1.04, 1.02]));
    }
}
