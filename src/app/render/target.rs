//! Settings by wish: goes from coarse settings to finer ones until the picture's error is below a
//! bound, or until a frame takes longer than one.

use std::sync::Arc;

use super::Rendered;
use super::lightpaths::{self, Job, RELIT_FRAMES};
use super::path_judge::{PathJudge, StatedError, Wanted};
use super::sampled::Budget;
use crate::app::args::DeviceArgs;
use crate::app::sweep::settings::{arguments, coarse_to_fine};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::scene::{Quality, Scene};

/// What the user asks for; at least one of both.
#[derive(Clone, Copy, Debug)]
pub(super) struct Target {
    /// relMSE at most.
    pub(super) error: Option<f64>,
    /// Milliseconds of a frame after a light has moved, at most.
    pub(super) ms: Option<f64>,
}

/// Growth of error and time from step to step that is rarely exceeded. It is 1.2 to 1.5 in
/// most scenes: so a jump ends before the step that is sought.
const GROWTH: f64 = 1.6;

/// A step that was tried.
#[derive(Clone, Debug, serde::Serialize)]
struct Tried {
    settings: String,
    relmse: Option<f64>,
    uncertainty: Option<f64>,
    frame_ms: Option<f64>,
}

impl Tried {
    fn new(quality: &Quality, error: Option<&StatedError>, frame_ms: Option<f64>) -> Self {
        Self {
            settings: arguments(quality),
            relmse: error.map(|error| error.relmse),
            uncertainty: error.map(|error| error.uncertainty),
            frame_ms,
        }
    }

    fn words(&self) -> String {
        let error = self.relmse.zip(self.uncertainty);
        let error = error.map(|(relmse, uncertainty)| format!(", relMSE {relmse:.1e} ± {uncertainty:.0e}"));
        let ms = self.frame_ms.map(|ms| format!(", light moved in {ms:.1} ms"));
        format!("{}{}{}", self.settings, error.unwrap_or_default(), ms.unwrap_or_default())
    }
}

/// What is done after a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// It is what was asked for.
    Take,
    /// Settings that are finer by this many steps may be better.
    Finer(usize),
    /// Its frames are too slow, and those of finer settings are slower.
    TooSlow,
}

impl Target {
    fn verdict(self, tried: &Tried) -> Verdict {
        let slack = |(most, ms): (f64, f64)| most / ms;
        let slack = self.ms.zip(tried.frame_ms).map_or(f64::INFINITY, slack);
        if slack < 1.0 {
            return Verdict::TooSlow;
        }
        let excess = |(most, relmse): (f64, f64)| relmse / most;
        let excess = self.error.zip(tried.relmse).map_or(f64::INFINITY, excess);
        match excess <= 1.0 {
            true => Verdict::Take,
            false => Verdict::Finer((excess.min(slack).ln() / GROWTH.ln()).max(1.0) as usize),
        }
    }

    fn words(self) -> String {
        match (self.error, self.ms) {
            (Some(error), Some(ms)) => format!("relMSE {error:.1e} in frames of {ms} ms"),
            (Some(error), None) => format!("relMSE {error:.1e}"),
            (None, ms) => format!("a frame in {} ms", ms.unwrap_or_default()),
        }
    }
}

/// What is known of the steps.
#[derive(Clone, Copy, Debug)]
struct Search {
    /// Number of steps known to be fast enough; the last of them was tried.
    fitting: usize,
    /// The first step that is known to be too slow, or to need too much memory.
    end: usize,
}

impl Search {
    /// The next step to try. `None` at the end.
    fn next(&mut self, step: usize, verdict: Verdict) -> Option<usize> {
        match verdict {
            Verdict::Take => return None,
            Verdict::TooSlow => self.end = step,
            Verdict::Finer(steps) => {
                self.fitting = step + 1;
                let next = step + steps;
                return (self.fitting < self.end).then(|| next.min(self.end - 1));
            }
        }
        // Between a step that is fast enough and one that is not.
        (self.fitting < self.end).then(|| self.fitting.midpoint(self.end - 1))
    }
}

/// Renders with the coarsest settings found that reach the error, or with the finest whose frames
/// are fast enough.
pub(super) fn render(
    context: &Arc<Context>,
    scene: &Scene,
    job: &Job<'_>,
    (target, budget): (Target, Budget),
    device_args: &DeviceArgs,
) -> Result<Rendered> {
    let mut judge = match target.error {
        Some(_) => Some(PathJudge::new(context, scene.clone(), budget, device_args)?),
        None => None,
    };
    let job = Job { relit_frames: if target.ms.is_some() { RELIT_FRAMES } else { 0 }, ..*job };
    let steps = coarse_to_fine(&scene.quality);
    let mut search = Search { fitting: 0, end: steps.len() };
    let (mut tried, mut best, mut next) = (Vec::new(), None, Some(0));
    while let Some(step) = next {
        let quality = &steps[step];
        let settings = Scene { quality: quality.clone(), ..scene.clone() };
        let mut rendered = match lightpaths::render(context, settings, &job, device_args) {
            Err(error) if error.is_out_of_memory() && step > 0 => {
                device_args.warn(&format!("{} need too much memory: {error}", arguments(quality)));
                next = search.next(step, Verdict::TooSlow);
                continue;
            }
            result => result?,
        };
        let error = match (&mut judge, target.error) {
            (Some(judge), Some(most)) => {
                Some(judge.judge(&rendered.layers[0].pixels, Wanted::Picture(most))?)
            }
            _ => None,
        };
        let found = Tried::new(quality, error.as_ref(), rendered.relit_ms);
        device_args.say(&found.words());
        rendered.line = format!("{}, {}", found.words(), rendered.line);
        let verdict = target.verdict(&found);
        next = search.next(step, verdict);
        if verdict != Verdict::TooSlow {
            best = Some((tried.len(), verdict, rendered));
        }
        tried.push(found);
    }
    match best {
        Some((index, verdict, mut rendered)) if verdict == Verdict::Take || target.error.is_none() => {
            rendered.document["target"] = serde_json::json!({
                "relmse": target.error, "frame_ms": target.ms, "tried": tried, "taken": index,
            });
            Ok(rendered)
        }
        best => {
            let best = match best {
                Some((index, ..)) => format!("the best is {}", tried[index].words()),
                None => format!("the coarsest settings are too slow: {}", tried[0].words()),
            };
            Err(Error::Comparison(format!("{} is not reached: {best}; nothing was written", target.words())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Goes through nine steps whose errors and times are given.
    fn searched(target: Target, of: impl Fn(usize) -> (f64, f64)) -> (Vec<usize>, Option<usize>) {
        let mut search = Search { fitting: 0, end: 9 };
        let (mut steps, mut best, mut next) = (Vec::new(), None, Some(0));
        while let Some(step) = next {
            assert!(!steps.contains(&step), "{steps:?} {step}");
            steps.push(step);
            let (relmse, ms) = of(step);
            let tried = Tried {
                settings: String::new(),
                relmse: target.error.map(|_| relmse),
                uncertainty: None,
                frame_ms: target.ms.map(|_| ms),
            };
            let verdict = target.verdict(&tried);
            if verdict != Verdict::TooSlow {
                best = (verdict == Verdict::Take || target.error.is_none()).then_some(step);
            }
            next = search.next(step, verdict);
        }
        (steps, best)
    }

    /// Error falls and time grows by 1.4 from step to step.
    fn usual(step: usize) -> (f64, f64) {
        (0.1 / 1.4f64.powi(step as i32), 10.0 * 1.4f64.powi(step as i32))
    }

    #[test]
    fn the_coarsest_step_with_the_error_is_taken() {
        for wanted in 0..9 {
            let target = Target { error: Some(1.01 * usual(wanted).0), ms: None };
            let (steps, best) = searched(target, usual);
            assert_eq!(best, Some(wanted), "{steps:?}");
            assert!(steps.len() <= 4, "jumps shorten the search: {steps:?}");
        }
        assert_eq!(searched(Target { error: Some(1e-9), ms: None }, usual).1, None);
    }

    #[test]
    fn the_finest_step_within_the_time_is_taken() {
        for wanted in 0..9 {
            let target = Target { error: None, ms: Some(1.01 * usual(wanted).1) };
            assert_eq!(searched(target, usual).1, Some(wanted));
            // Times that double: a jump may go too far, and is taken back.
            let steep = |step: usize| (0.1, 2f64.powi(step as i32));
            let target = Target { error: None, ms: Some(1.01 * steep(wanted).1) };
            assert_eq!(searched(target, steep).1, Some(wanted));
        }
        let (steps, best) = searched(Target { error: None, ms: Some(5.0) }, usual);
        assert_eq!((steps, best), (vec![0], None));
    }

    #[test]
    fn time_limits_the_search_for_an_error() {
        let target = |error, ms| Target { error: Some(error), ms: Some(ms) };
        assert_eq!(searched(target(1.01 * usual(4).0, 1.01 * usual(4).1), usual).1, Some(4));
        assert_eq!(searched(target(1.01 * usual(4).0, 1.01 * usual(3).1), usual).1, None);
        assert_eq!(searched(target(1.01 * usual(4).0, 1e9), usual).1, Some(4));
    }
}
