//! `lightpaths tune`: measures the values that are tuned for a device, and stores the fastest.

use std::fmt::Write;
use std::sync::Arc;

use clap::Args;

use super::args::{CacheArgs, DeviceArgs, SceneArgs, device_label};
use super::numbers::whole;
use super::time::measure::Summary;
use crate::error::Result;
use crate::gpu::{CHOICES, Choice, Context, ContextOptions, TuningChange, TuningSource};
use crate::renderer::{Renderer, Store, Work};
use crate::scene::{Scene, builtin};

/// Measure the values that are tuned for the device, and store the fastest for it and its driver
///
/// For each choice in turn, times frames with each value, in alternating order. A value is kept if
/// it takes 3 % less time than the value before, and less in nine of ten rounds. All commands use
/// the stored values from then on; --tune replaces them. Only the order of sums may change.
///
/// Scenes have preset draft and 480x360 pixels unless --preset and --size state others. Each value
/// precomputes the scenes anew; with --cache, once in all.
#[derive(Debug, Args)]
pub(super) struct Tune {
    /// Scenes, as for render [default: every built-in one]
    scenes: Vec<String>,
    /// Rounds of frames that are timed for each choice
    #[arg(long, value_name = "N", default_value_t = 10, allow_negative_numbers = true, value_parser = whole(1..=10_000, "10"))]
    frames: u32,
    /// Measures this choice only; may be repeated. Others keep their stored values [default: all]
    #[arg(long, value_name = "NAME", value_parser = parse_choice)]
    choice: Vec<&'static Choice>,
    /// Measures and stores nothing
    #[arg(long)]
    dry_run: bool,
    /// Deletes what is stored for the device and measures nothing
    #[arg(long, conflicts_with_all = ["scenes", "frames", "choice", "dry_run"])]
    reset: bool,
    #[command(flatten)]
    cache: CacheArgs,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

/// Preset and image size of the scenes.
const PRESET: &str = "draft";
const SIZE: [u32; 2] = [480, 360];
/// Warm-up rounds, which are not timed. The first compiles pipelines.
const WARM_UP: u32 = 2;
/// The edits whose frames are timed, with the headings of their columns.
const EDITS: [(&str, Work); 2] = [("all", Work::Everything), ("light", Work::Light(0))];
/// A value is kept if its times are below this fraction of those before.
const KEPT: f64 = 0.97;

/// Times of one value in one scene, milliseconds: those of each round.
type Rounds = Vec<[f64; EDITS.len()]>;

impl Tune {
    pub(super) fn run(self) -> Result<()> {
        let context = self.device_args.open()?;
        if self.reset {
            let path = context.store_tuning(&[])?;
            return super::print_line(&format!("{} is deleted", path.display()));
        }
        if !self.dry_run {
            context.tuning_path()?;
        }
        let scenes = self.load()?;
        let store = self.cache.store()?;
        if cfg!(debug_assertions) {
            self.device_args.warn("this is a debug build; its times mean little");
        }
        super::print_line(&format!("{}, {}", device_label(&context), context.driver()))?;
        super::print(&heading(&scenes))?;
        let (choices, mut kept) = self.plan(&context);
        for choice in choices {
            let values = candidates(choice, &context);
            let times = self.measure(&scenes, store.as_ref(), choice, &values, &kept)?;
            let best = fastest(&times);
            super::print(&rows(&scenes, choice, &values, &times, best))?;
            kept.extend(best.map(|best| choice.change(values[best])));
        }
        self.finish(&context, &kept)
    }

    fn load(&self) -> Result<Vec<Scene>> {
        let args = self.scene_args.clone().or(PRESET, SIZE);
        let specs = if self.scenes.is_empty() {
            builtin::NAMES.map(str::to_owned).to_vec()
        } else {
            self.scenes.clone()
        };
        let scenes = specs.iter().map(|spec| args.load_lit(spec)).collect::<Result<Vec<_>>>()?;
        scenes.iter().flat_map(|scene| &scene.warnings).for_each(|warning| self.device_args.warn(warning));
        Ok(scenes)
    }

    /// The choices to measure, and the stored changes of the others. Given values are not measured.
    fn plan(&self, context: &Context) -> (Vec<&'static Choice>, Vec<TuningChange>) {
        let is_chosen = |choice: &Choice| self.choice.is_empty() || self.choice.contains(&choice);
        let (mut choices, mut kept) = (Vec::new(), Vec::new());
        for (choice, value, source) in context.tuned().values() {
            match source {
                TuningSource::Given => {}
                _ if is_chosen(choice) => choices.push(choice),
                TuningSource::Stored => kept.push(choice.change(value)),
                TuningSource::Class => {}
            }
        }
        (choices, kept)
    }

    /// Times frames of each scene with each value of a choice.
    fn measure(
        &self,
        scenes: &[Scene],
        store: Option<&Store>,
        choice: &'static Choice,
        values: &[u32],
        kept: &[TuningChange],
    ) -> Result<Vec<Vec<Rounds>>> {
        let of_scene = |scene: &Scene| {
            let renderer = |&value: &u32| self.renderer(scene, store, choice.change(value), kept);
            let mut renderers = values.iter().map(renderer).collect::<Result<Vec<_>>>()?;
            let times = time(&mut renderers, self.frames);
            renderers.iter().for_each(|(context, _)| self.device_args.report_validation(context));
            times
        };
        scenes.iter().map(of_scene).collect()
    }

    fn renderer(
        &self,
        scene: &Scene,
        store: Option<&Store>,
        change: TuningChange,
        kept: &[TuningChange],
    ) -> Result<(Arc<Context>, Renderer)> {
        let mut options = ContextOptions { stored_tuning: false, ..self.device_args.context_options() };
        options.tuning.extend(kept);
        options.tuning.push(change);
        let context = Context::new(&options)?;
        let (mut progress, scene) = (self.device_args.progress(), scene.clone());
        let mut renderer = match store {
            Some(store) => Renderer::cached(&context, scene, store, progress.as_mut(), &mut |_| ())?,
            None => Renderer::new(&context, scene, progress.as_mut())?,
        };
        // As `render`, `film` and `demo` run them.
        renderer.set_serialised(false);
        Ok((context, renderer))
    }

    fn finish(&self, context: &Context, kept: &[TuningChange]) -> Result<()> {
        let fastest = match kept {
            [] => "the values of the class are the fastest".to_owned(),
            _ => kept.iter().map(TuningChange::to_string).collect::<Vec<_>>().join(", "),
        };
        let stored = match (self.dry_run, kept) {
            (true, _) => "nothing is stored in a dry run".to_owned(),
            (false, []) => format!("{} is not needed", context.store_tuning(kept)?.display()),
            (false, _) => format!("stored in {}", context.store_tuning(kept)?.display()),
        };
        super::print_line(&format!("{fastest}: {stored}"))
    }
}

fn parse_choice(name: &str) -> std::result::Result<&'static Choice, String> {
    let names = || CHOICES.iter().map(|choice| choice.name).collect::<Vec<_>>().join(", ");
    let choice = CHOICES.iter().find(|choice| choice.name == name);
    choice.ok_or_else(|| format!("expected one of {}", names()))
}

/// The value of the class, then the other values.
fn candidates(choice: &'static Choice, context: &Context) -> Vec<u32> {
    let class = choice.value(&context.tuned().class);
    let others = choice.allowed(context.limits()).into_iter().filter(|&value| value != class);
    std::iter::once(class).chain(others).collect()
}

/// Frames of all renderers in turns, so that clock drift affects all alike. Each round starts with
/// the next renderer.
fn time(renderers: &mut [(Arc<Context>, Renderer)], frames: u32) -> Result<Vec<Rounds>> {
    let count = renderers.len();
    let mut times = vec![Rounds::new(); count];
    for round in 0..WARM_UP + frames {
        for turn in 0..count {
            let index = (round as usize + turn) % count;
            let renderer = &mut renderers[index].1;
            let mut ms = [0.0; EDITS.len()];
            for ((_, work), ms) in EDITS.iter().zip(&mut ms) {
                renderer.force(*work);
                *ms = renderer.frame()?.device_ms;
            }
            if round >= WARM_UP {
                times[index].push(ms);
            }
        }
    }
    Ok(times)
}

/// Times of a value over those of the first value, one ratio a round: the geometric mean over
/// scenes and edits.
fn ratio(times: &[Vec<Rounds>], value: usize) -> Summary {
    let logs = |round: usize| {
        let pairs = times.iter().flat_map(move |scene| scene[value][round].iter().zip(&scene[0][round]));
        pairs.map(|(ms, before)| (ms / before).ln()).sum::<f64>()
    };
    let count = (times.len() * EDITS.len()) as f64;
    Summary::from_times((0..times[0][0].len()).map(|round| (logs(round) / count).exp()))
}

/// The fastest value. `None` if no value is faster than the first by more than the margin, and in
/// nine of ten rounds.
fn fastest(times: &[Vec<Rounds>]) -> Option<usize> {
    let ratios = (1..times[0].len()).map(|value| (value, ratio(times, value)));
    let faster = ratios.filter(|(_, ratio)| ratio.median < KEPT && ratio.p90 < 1.0);
    faster.min_by(|(_, a), (_, b)| a.median.total_cmp(&b.median)).map(|(value, _)| value)
}

/// The headings of the columns with times.
fn columns(scenes: &[Scene]) -> impl Iterator<Item = String> {
    scenes.iter().flat_map(|scene| EDITS.map(|(edit, _)| format!("{} {edit}", scene.name)))
}

fn heading(scenes: &[Scene]) -> String {
    let times: String = columns(scenes).map(|name| format!("  {name:>9}")).collect();
    format!("{:<14}{:>6}{times}{:>8}{:>8}\n", "median ms", "value", "ratio", "p90")
}

fn rows(
    scenes: &[Scene],
    choice: &Choice,
    values: &[u32],
    times: &[Vec<Rounds>],
    best: Option<usize>,
) -> String {
    let mut text = String::new();
    for (index, value) in values.iter().enumerate() {
        let medians = times.iter().flat_map(|scene| {
            let rounds = &scene[index];
            (0..EDITS.len()).map(|edit| Summary::from_times(rounds.iter().map(|ms| ms[edit])).median)
        });
        let cells = columns(scenes).zip(medians);
        let cells: String = cells
            .map(|(name, ms)| format!("  {ms:>width$.3}", width = name.chars().count().max(9)))
            .collect();
        let ratio = ratio(times, index);
        let name = if index == 0 { choice.name } else { "" };
        let verdict = match best {
            _ if index == 0 => "class",
            Some(best) if best == index => "kept",
            _ => "",
        };
        let line = format!("{name:<14}{value:>6}{cells}{:>8.3}{:>8.3}  {verdict}", ratio.median, ratio.p90);
        writeln!(text, "{}", line.trim_end()).expect("writing to a string cannot fail");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Times of two scenes, where value `v` takes `factors[v]` of the first value's time.
    fn times(factors: &[[f64; 10]]) -> Vec<Vec<Rounds>> {
        let scene = |ms: f64| {
            let rounds = |factors: &[f64; 10]| factors.iter().map(|f| [ms * f, 0.3 * ms * f]).collect();
            factors.iter().map(rounds).collect()
        };
        vec![scene(1.0), scene(70.0)]
    }

    #[test]
    fn a_value_is_kept_if_it_is_faster_by_more_than_margin_and_spread() {
        let class = [1.0; 10];
        let noisy = [0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 1.5, 1.5, 1.5];
        for (factors, best) in [
            (vec![class], None),
            (vec![class, [0.98; 10]], None),
            (vec![class, [0.9; 10]], Some(1)),
            (vec![class, [0.9; 10], [0.8; 10], [1.1; 10]], Some(2)),
            (vec![class, noisy], None),
            (vec![class, noisy, [0.9; 10]], Some(2)),
        ] {
            assert_eq!(fastest(&times(&factors)), best, "{factors:?}");
        }
    }

    #[test]
    fn scenes_and_edits_have_the_same_weight() {
        let mut times = times(&[[1.0; 10], [0.5; 10]]);
        times[1][1].iter_mut().for_each(|ms| *ms = [140.0, 42.0]);
        assert!((ratio(&times, 1).median - 1.0).abs() < 1e-12);
    }
}
