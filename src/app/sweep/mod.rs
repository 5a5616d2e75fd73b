//! `lightpaths sweep`: error against time, for our settings and for baselines.

mod baselines;
mod cache;
pub(super) mod figures;
mod format;
pub(super) mod judge;
mod measure;
mod plots;
mod reference;
mod report;
mod results;
pub(super) mod settings;
mod stages;
#[cfg(test)]
mod tests;

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;

use super::args::{DeviceArgs, SceneArgs, device_label, shell_word};
use super::numbers::{parse_seconds, whole};
use super::output::{OutputFile, create_folder};
use super::render::sampled::Budget;
use super::{heatmap, overlap};
use crate::cpu::tonemap::dithered;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::image::write_png;
use crate::renderer::Layer;
use crate::scene::{DisplayTransform, Scene};
use baselines::Outcome;
use format::Shown;
use measure::{Judged, Measured, judge, measure};
use reference::Reference;
use results::{Machine, Results, SceneFacts, Setting, StageError, mark_pareto_front};

/// Default time of the reference, seconds.
const DEFAULT_SECONDS: f32 = 10.0;

/// Set error against time: vary the settings, compare with other methods, write a report
///
/// Entry points, cells, cache points and gather rays are varied one at a time around the preset,
/// then together. Every picture is held against a path-traced reference, which is kept for the next
/// time. Writes report.html, sweep.json, plots (SVG) and pictures (PNG).
#[derive(Debug, Args)]
pub(super) struct Sweep {
    /// A .toml scene file, a .glb, .gltf, .obj, .ply or .stl model, or a built-in scene
    #[arg(default_value = "box")]
    scene: String,
    /// Folder for the report; created if it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    reference_args: ReferenceArgs,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

/// How long path tracing may work on a reference, and where it is kept.
#[derive(Debug, Args)]
struct ReferenceArgs {
    /// Samples of each pixel of a reference [default: what --seconds allows]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(4..=u32::MAX, "256"))]
    spp: Option<u32>,
    /// Ends a reference after this time; with --spp, at whichever comes first [default, without
    /// --spp: 10; of figures 60]
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = parse_seconds)]
    seconds: Option<f32>,
    /// Folder where references are kept [default: the user's cache folder]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
}

impl ReferenceArgs {
    /// The user's budget, or `seconds` by default.
    fn budget(&self, seconds: f32) -> Budget {
        Budget { spp: self.spp, seconds: self.seconds.or_else(|| self.spp.is_none().then_some(seconds)) }
    }

    fn folder(&self) -> Result<PathBuf> {
        self.cache.clone().map_or_else(cache::default_folder, Ok)
    }
}

/// Additional results of the preset.
struct Preset {
    setting: Setting,
    picture: Judged,
    /// The picture of direct light.
    direct: Judged,
    stages: Vec<StageError>,
}

impl Preset {
    /// Measures the preset's renderer before it is dropped. Stage errors are measured if
    /// `stages` is given.
    fn new(
        measured: Measured,
        reference: &Reference,
        context: &Arc<Context>,
        stages: Option<&DeviceArgs>,
    ) -> Result<Self> {
        let Measured { setting, picture, mut renderer } = measured;
        let direct = judge(renderer.layer(Layer::Direct)?, None, reference)?;
        let stages = match stages {
            Some(device_args) => stages::measure(context, &mut renderer, reference, device_args)?,
            None => Vec::new(),
        };
        Ok(Self { setting, picture, direct, stages })
    }
}

impl Sweep {
    pub(super) fn run(self) -> Result<()> {
        let scene = self.scene_args.load_lit(&self.scene)?;
        overlap::refuse_in_folder(&self.output, is_written, &scene.inputs)?;
        scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        let cache = self.reference_args.folder()?;
        let context = self.device_args.open()?;
        create_folder(&self.output)?;
        let [json, html] =
            ["sweep.json", "report.html"].map(|name| OutputFile::check(&self.output.join(name)));
        let (json, html) = (json?, html?);
        if cfg!(debug_assertions) {
            self.device_args.warn("this is a debug build; its times mean little");
        }

        let machine = Machine {
            device: device_label(&context),
            driver: context.driver().to_owned(),
            cpu: processor(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
        };
        let budget = self.reference_args.budget(DEFAULT_SECONDS);
        let mut reference = Reference::find(&scene, budget, &cache, (&context, &self.device_args))?;
        let (mut preset, others) = self.try_settings(&scene, &mut reference, &context)?;
        let mut settings = vec![preset.setting.clone()];
        settings.extend(others);
        mark_pareto_front(&mut settings);
        let outcomes = self.try_baselines(&scene, &preset, &reference, &context)?;
        let shown = shown(&preset, &outcomes, &reference, scene.cameras[0].size)?;
        let results = Results {
            version: env!("CARGO_PKG_VERSION"),
            debug_build: cfg!(debug_assertions),
            machine,
            commands: self.commands(&preset, &outcomes, &reference),
            scene: SceneFacts {
                name: scene.name.clone(),
                triangles: scene.triangles.len(),
                lights: scene.lights.len(),
                size: scene.cameras[0].size,
                preset: scene.quality.preset,
            },
            reference: reference.facts.clone(),
            settings,
            baselines: outcomes.into_iter().flat_map(|(_, outcome)| outcome.baselines).collect(),
            stages: std::mem::take(&mut preset.stages),
        };
        self.write_pictures(&shown, &results)?;
        let text = serde_json::to_string_pretty(&results).expect("results are plain data");
        json.write(|out| writeln!(out, "{text}"))?;
        html.write(|out| out.write_all(report::html(&results, &shown).as_bytes()))?;
        super::print_line(&format!("{}", html.path().display()))
    }

    /// Measures the preset and the other settings. A setting that does not fit the device is
    /// skipped with a warning.
    fn try_settings(
        &self,
        scene: &Scene,
        reference: &mut Reference,
        context: &Arc<Context>,
    ) -> Result<(Preset, Vec<Setting>)> {
        let trials = settings::trials(&scene.quality);
        let count = trials.len();
        let (mut preset, mut others) = (None, Vec::new());
        for (number, trial) in trials.into_iter().enumerate() {
            let arguments = settings::arguments(&trial.quality);
            match measure(trial, scene, reference, context, &self.device_args) {
                Ok(measured) => {
                    let setting = &measured.setting;
                    self.device_args.say(&format!(
                        "{}/{count} {arguments}: precompute {:.2} s, relit frame {:.1} ms, relMSE {:.2e}",
                        number + 1,
                        setting.precompute_s,
                        setting.relit_frame_ms,
                        setting.error.relmse_debiased,
                    ));
                    if preset.is_none() {
                        reference.set_scale(measured.picture.pixels.clone());
                        preset = Some(Preset::new(measured, reference, context, Some(&self.device_args))?);
                    } else {
                        others.push(measured.setting);
                    }
                }
                Err(error @ (Error::OutOfMemory(_) | Error::Usage(_))) if preset.is_some() => {
                    self.device_args.warn(&format!("left out {arguments}: {error}"));
                }
                Err(error) => return Err(error),
            }
        }
        Ok((preset.expect("the preset comes first, or an error"), others))
    }

    fn try_baselines(
        &self,
        scene: &Scene,
        preset: &Preset,
        reference: &Reference,
        context: &Arc<Context>,
    ) -> Result<Vec<(&'static str, Outcome)>> {
        let compare = |method: &baselines::Method| {
            self.device_args.say(&format!("{}: at equal time and equal error", method.name));
            let outcome =
                baselines::compare(method, scene, &preset.setting, reference, (context, &self.device_args))?;
            Ok((method.name, outcome))
        };
        baselines::METHODS.iter().map(compare).collect()
    }

    /// The command as typed, and the commands that render the report's pictures.
    fn commands(
        &self,
        preset: &Preset,
        outcomes: &[(&'static str, Outcome)],
        reference: &Reference,
    ) -> Vec<String> {
        let typed = std::env::args().skip(1).map(|word| shell_word(&word)).collect::<Vec<_>>().join(" ");
        let scene = format!("lightpaths render {}{}", shell_word(&self.scene), self.scene_args.typed());
        let quality = settings::arguments(&preset.setting.quality);
        let mut commands = vec![
            format!("lightpaths {typed}"),
            format!("{scene} -o light-paths.exr  # {quality}"),
            format!("{scene} --method direct -o direct-only.exr"),
            format!("{scene} --method path --spp {} -o reference.exr", reference.facts.spp),
        ];
        let word = |name: &'static str| name.split(' ').next().unwrap_or(name);
        commands.extend(outcomes.iter().map(|(name, outcome)| {
            format!("{scene} --method {} --spp {} -o {}.exr", word(name), outcome.spp, name.replace(' ', "-"))
        }));
        commands
    }

    /// Writes pictures, heat maps and plots as separate files.
    fn write_pictures(&self, shown: &[Shown], results: &Results) -> Result<()> {
        let write = |name: String, bytes: &[u8]| {
            debug_assert!(is_written(&name), "{name} is checked before the work");
            OutputFile::check(&self.output.join(name))?.write(|out| out.write_all(bytes))
        };
        for picture in shown {
            let stem = file_stem(&picture.title);
            write(format!("{stem}.png"), &picture.png)?;
            if let Some(map) = &picture.heatmap {
                write(format!("{stem}-flip.png"), map)?;
            }
        }
        for (stem, plot) in plots::all(results) {
            write(format!("{stem}.svg"), plot.file().as_bytes())?;
        }
        Ok(())
    }
}

/// Titles of the pictures.
const DIRECT: &str = "Direct only";
const OURS: &str = "Light paths";
const REFERENCE: &str = "Reference";

/// Title of a baseline's picture.
fn title(method: &str) -> String {
    method[..1].to_uppercase() + &method[1..]
}

/// The file stem of a picture.
fn file_stem(title: &str) -> String {
    title.to_lowercase().replace(' ', "-")
}

/// Titles of all pictures.
fn titles() -> impl Iterator<Item = String> {
    let methods = baselines::METHODS.iter().map(|method| title(method.name));
    [DIRECT, OURS, REFERENCE].map(str::to_owned).into_iter().chain(methods)
}

/// Whether `sweep` writes a file of that name.
fn is_written(name: &str) -> bool {
    let is_picture = |stem: &str| {
        let stem = stem.strip_suffix("-flip").unwrap_or(stem);
        titles().any(|title| file_stem(&title) == stem)
    };
    ["sweep.json", "report.html"].contains(&name)
        || name.strip_suffix(".svg").is_some_and(|stem| plots::STEMS.contains(&stem))
        || name.strip_suffix(".png").is_some_and(is_picture)
}

/// The pictures in the order of the paper's figures 4 and 5, and the reference.
fn shown(
    preset: &Preset,
    outcomes: &[(&'static str, Outcome)],
    reference: &Reference,
    size: [u32; 2],
) -> Result<Vec<Shown>> {
    let show = |title: &str, time: String, picture: &Judged| -> Result<Shown> {
        let error = &picture.error;
        Ok(Shown {
            title: title.to_owned(),
            lines: vec![
                time,
                format!("relMSE {}, FLIP {:.3}", format::figure(error.relmse_debiased), error.flip),
            ],
            png: png(&display(&picture.pixels), size)?,
            heatmap: Some(png(&heatmap::of_flip(&picture.flip), size)?),
        })
    };
    let setting = &preset.setting;
    let mut shown =
        vec![show(DIRECT, format!("{} a frame", format::seconds(1e-3 * setting.ms.Tdi)), &preset.direct)?];
    let sampled = |(name, outcome): &(&str, Outcome)| {
        let title = title(name);
        let samples = if outcome.spp == 1 { "sample" } else { "samples" };
        let time = format!("{} {samples} a pixel, {}", outcome.spp, format::seconds(outcome.seconds));
        show(&title, time, &outcome.picture)
    };
    // Photon mapping before ours, path tracing after it.
    let (path, others): (Vec<_>, Vec<_>) = outcomes.iter().partition(|(name, _)| *name == "path tracing");
    shown.extend(others.into_iter().map(sampled).collect::<Result<Vec<_>>>()?);
    let time = format!(
        "{} with precomputation, then {} a relit frame",
        format::seconds(setting.first_picture_s()),
        format::seconds(setting.relit_s())
    );
    shown.push(show(OURS, time, &preset.picture)?);
    shown.extend(path.into_iter().map(sampled).collect::<Result<Vec<_>>>()?);
    let facts = &reference.facts;
    shown.push(Shown {
        title: REFERENCE.to_owned(),
        lines: vec![
            format!("{} samples a pixel, {}", facts.spp, format::seconds(facts.seconds)),
            format!("noise {} relMSE", format::figure(facts.noise_relmse)),
        ],
        png: png(&display(reference.picture()), size)?,
        heatmap: None,
    });
    Ok(shown)
}

/// Tone-mapped sRGB codes.
fn display(pixels: &[[f32; 3]]) -> Vec<[u8; 4]> {
    let display = DisplayTransform::default().constants();
    (0..).zip(pixels).map(|(pixel, &radiance)| dithered(pixel, &display, radiance)).collect()
}

fn png(pixels: &[[u8; 4]], size: [u32; 2]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    write_png(&mut bytes, size, pixels).map_err(|error| Error::output("a picture", error.to_string()))?;
    Ok(bytes)
}

/// The processor's name in the operating system.
fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("model name"));
    let name = line.and_then(|line| line.split_once(':')).map(|(_, name)| name.trim().to_owned());
    name.unwrap_or_else(|| format!("{} ({})", std::env::consts::ARCH, std::env::consts::OS))
}
