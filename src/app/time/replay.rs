//! `time --repeat`: replays one pass of the frame.

use std::fmt::Write;

use super::Time;
use super::measure::Summary;
use crate::app::args::device_label;
use crate::error::{Error, Result};
use crate::gpu::PassTiming;
use crate::renderer::{FrameReport, Renderer, Work};
use crate::scene::Scene;

/// Whole frames before the replay; the last ones give the pass's time within a frame.
const FRAMES: usize = 4;
/// Untimed frames at the start.
const WARM_UP: usize = 1;

/// A pass and its number of repetitions.
pub(super) struct Replay {
    pass: &'static str,
    times: u32,
}

/// Largest number of repetitions.
const MAX_TIMES: u32 = 100_000;

impl Replay {
    /// Refuses unknown passes and numbers out of range.
    pub(super) fn parse(pass: &str, times: &str) -> Result<Self> {
        let known = Renderer::pass_names();
        let refuse = |message| Err(Error::Usage(message));
        let Some(name) = known.clone().find(|name| *name == pass) else {
            return refuse(format!(
                "--repeat: there is no pass `{pass}`; there are {}",
                known.collect::<Vec<_>>().join(", ")
            ));
        };
        match times.parse() {
            Ok(times @ 1..=MAX_TIMES) => Ok(Self { pass: name, times }),
            _ => refuse(format!(
                "--repeat: `{times}` is not a number of repetitions, 1 to {MAX_TIMES}, as in --repeat gather 100"
            )),
        }
    }

    pub(super) fn run(&self, time: &Time, scene: Scene) -> Result<()> {
        let name = scene.name.clone();
        let context = time.device_args.open()?;
        let mut renderer = time.device_args.renderer(&context, scene)?;
        renderer.set_skipping(!time.no_skip);
        let mut frames = Vec::new();
        for _ in 0..FRAMES {
            renderer.force(Work::Everything);
            frames.push(renderer.frame()?);
        }
        if !frames[0].passes.iter().any(|pass| pass.name == self.pass) {
            let mut names: Vec<_> = frames[0].passes.iter().map(|pass| pass.name).collect();
            names.sort_unstable();
            names.dedup();
            let names = names.join(", ");
            return Err(Error::Usage(format!(
                "--repeat: frames of {name} have no pass `{}`; they have {names}",
                self.pass
            )));
        }
        let before = renderer.display()?;
        let one = renderer.replay(self.pass)?;
        let mut times_ms = vec![own_ms(self.pass, &one)];
        while times_ms.len() < self.times as usize {
            times_ms.push(own_ms(self.pass, &renderer.replay(self.pass)?));
        }
        let stands = renderer.display()? == before;
        renderer.frame()?;
        if !stands || renderer.display()? != before {
            return Err(Error::Comparison(format!("{name}: `{}` alone changed the picture", self.pass)));
        }
        time.device_args.report_validation(&context);
        let [width, height] = renderer.size();
        let head = format!("{name} {width}x{height}, {}: `{}`", device_label(&context), self.pass);
        crate::app::print(&format!("{head}{}", table(self.pass, &frames[WARM_UP..], &one, times_ms)))
    }
}

/// The timings of the pass in a report.
fn own<'a>(pass: &'a str, report: &'a FrameReport) -> impl Iterator<Item = &'a PassTiming> {
    report.passes.iter().filter(move |timing| timing.name == pass)
}

/// Total time of the pass, milliseconds.
fn own_ms(pass: &str, report: &FrameReport) -> f64 {
    own(pass, report).map(|timing| timing.ms).sum()
}

/// Times of the pass alone and within frames.
fn table(pass: &str, frames: &[FrameReport], one: &FrameReport, times_ms: Vec<f64>) -> String {
    let times = times_ms.len() as u64;
    let Summary { median, p10, p90, .. } = Summary::from_times(times_ms);
    let occurrences = own(pass, one).count() as u64;
    let dispatches = own(pass, one).map(|timing| timing.dispatches).sum::<u32>();
    let plural = |count: u64| if count == 1 { "" } else { "s" };
    let mut text = format!(
        " alone, {} time{}; {occurrences} occurrence{} a frame, {dispatches} dispatch{}\n",
        times,
        plural(times),
        plural(occurrences),
        if dispatches == 1 { "" } else { "es" },
    );
    let mut row = |label: &str, value: String| {
        writeln!(text, "{label:<16}{value}").expect("writing to a string cannot fail");
    };
    row("ms alone", format!("median {median:.4}, p10 {p10:.4}, p90 {p90:.4}"));
    let within = Summary::from_times(frames.iter().map(|frame| own_ms(pass, frame))).median;
    row("ms in frames", format!("median {within:.4} of {}", frames.len()));
    // A pass that is too short to time has no rate.
    let rate = |amount: u64, per_ms: f64, unit: &str| match median > 0.0 {
        true => format!("{amount}, {:.2} {unit}", amount as f64 / (median * per_ms)),
        false => format!("{amount}, too short to tell a rate"),
    };
    match one.bytes.get(pass).map(|bytes| bytes * occurrences) {
        Some(bytes) => row("bytes", rate(bytes, 1e6, "GB/s")),
        None => row("bytes", "not counted for this pass".to_owned()),
    }
    if let Some(rays) = one.rays.get(pass).map(|rays| rays * occurrences) {
        row("rays", rate(rays, 1e3, "Mrays/s"));
    }
    text
}
