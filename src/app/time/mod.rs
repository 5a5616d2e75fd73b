//! `lightpaths time`: the paper's tables on this machine.

mod bandwidth;
mod edit_costs;
mod edit_tables;
mod floors;
mod host_rays;
pub(super) mod lights;
pub(super) mod measure;
mod moved;
mod paper;
mod predict;
mod rates;
mod ray_rates;
mod refined;
mod replay;
mod report;
mod session;
mod statistics;
mod tables;
mod text;
mod trace;
mod verify;

use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

use clap::Args;

use super::args::{DeviceArgs, SceneArgs};
use super::numbers::{each_whole, whole};
use super::output::OutputFile;
use super::overlap;
use crate::error::{Error, Result};
use crate::renderer::{Layer, Statistics};
use crate::scene::{Scene, builtin};
use lights::Relit;
use measure::Measurement;
use moved::Moved;
use predict::AssumedRates;
use ray_rates::RayRates;
use refined::Refined;
use verify::Energy;

/// Time frames after each kind of edit and set them beside the paper's: its tables 1, 2 and 3
///
/// The picture's energy is first compared with the path tracer's. If it is off by more than 1 % and
/// the tracer's noise, no times are printed and the exit code is 1.
///
/// Times are milliseconds by the device's timestamps, medians over frames after warm-up. "On the
/// clock" includes recording and waiting.
#[derive(Debug, Args)]
pub(super) struct Time {
    /// Scenes, as for render [default: every built-in one]
    scenes: Vec<String>,
    /// Frames timed after each kind of edit
    #[arg(long, value_name = "N", default_value_t = 20, allow_negative_numbers = true, value_parser = whole(1..=100_000, "20"))]
    frames: u32,
    /// Numbers of lights to time, of which one moves: the scene's lights, and copies if
    /// there are fewer
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,2,4,8", allow_negative_numbers = true, value_parser = each_whole(1..=256, "1,2,4,8"))]
    lights: Vec<u32>,
    /// Predicts the frame of each edit, from its counts, on a device with other rates: gbps in 10⁹
    /// bytes/s, grays in 10⁹ rays/s, us in µs for a dispatch with its barrier; rates left out are
    /// those of gbps=3000,grays=1.5,us=3
    #[arg(long, value_name = "RATES")]
    predict: Option<AssumedRates>,
    /// Does all work in every frame, also work that cannot change the picture
    #[arg(long)]
    no_skip: bool,
    /// Writes the tables as JSON too
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    #[command(flatten)]
    session: session::SessionArgs,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

/// The results of one scene.
struct Timed {
    name: String,
    triangles: usize,
    lights: usize,
    size: [u32; 2],
    statistics: Statistics,
    measurement: Measurement,
    energy: Energy,
    rays: RayRates,
    /// Results by number of lights.
    relit: BTreeMap<u32, Relit>,
    /// `None` if no model can move.
    moved: Option<Moved>,
    /// `None` if the view has no own records.
    refined: Option<Refined>,
}

impl Time {
    pub(super) fn run(self) -> Result<()> {
        if let Some(session) = self.session.chosen()? {
            return session.run(&self);
        }
        let json = self.json.as_deref().map(OutputFile::check).transpose()?;
        // All scenes are loaded before any is timed, so that a typing error costs no minutes.
        let specs =
            if self.scenes.is_empty() { builtin::NAMES.map(str::to_owned).to_vec() } else { self.scenes };
        let scenes = specs.iter().map(|spec| self.scene_args.load_lit(spec)).collect::<Result<Vec<_>>>()?;
        for scene in &scenes {
            overlap::refuse_inputs(self.json.as_deref(), &scene.inputs)?;
        }
        if cfg!(debug_assertions) {
            self.device_args.warn("this is a debug build; its times mean little");
        }
        let context = self.device_args.open()?;
        let copies = bandwidth::measure(&context)?;
        super::print(&report::header(&context, &copies))?;

        let (mut all, mut wrong) = (Vec::new(), Vec::new());
        for scene in scenes {
            let name = scene.name.clone();
            match time_scene(scene, self.frames as usize, &self.lights, self.no_skip, &self.device_args)? {
                Ok(timed) => {
                    super::print(&report::table(&timed, copies.device, self.predict.as_ref()))?;
                    all.push(timed);
                }
                Err(energy) => {
                    let line = format!("{name}: the picture's energy is {}", energy.say());
                    self.device_args.warn(&format!("{line}: its times are not printed"));
                    wrong.push(line);
                }
            }
        }
        if !all.is_empty() {
            super::print(&tables::tables(&all))?;
        }
        if let Some(json) = json {
            let text = format!("{:#}\n", report::json(&context, &copies, &all, self.predict.as_ref()));
            json.write(|out| out.write_all(text.as_bytes()))?;
        }
        if wrong.is_empty() { Ok(()) } else { Err(Error::Comparison(wrong.join("; "))) }
    }
}

/// Times a scene whose picture is correct. For an incorrect one, returns its energy error.
fn time_scene(
    scene: Scene,
    frames: usize,
    light_counts: &[u32],
    no_skip: bool,
    device_args: &DeviceArgs,
) -> Result<std::result::Result<Timed, Energy>> {
    let name = scene.name.clone();
    for warning in &scene.warnings {
        device_args.warn(&format!("{name}: {warning}"));
    }
    let (triangles, lights) = (scene.triangles.len(), scene.lights.len());
    let traced = scene.clone();
    // A context per scene, so that its peak memory is that scene's.
    let context = device_args.open()?;
    let mut renderer = device_args.renderer(&context, scene)?;
    renderer.set_skipping(!no_skip);
    renderer.frame()?;
    let energy = verify::energy(traced.clone(), &renderer.layer(Layer::Beauty)?, device_args)?;
    if !energy.agrees() {
        return Ok(Err(energy));
    }
    // On its own context: the reported peak memory is the renderer's.
    let moved = moved::measure(&device_args.open()?, &traced)?;
    let rays = ray_rates::measure(&device_args.open()?, traced)?;
    let measurement = measure::measure(&context, &mut renderer, frames)?;
    if !measurement.settled {
        device_args.warn(&format!("{name}: times had not settled after warm-up; pass more --frames"));
    }
    let (size, statistics) = (renderer.size(), renderer.statistics()?);
    let relit = lights::measure(&mut renderer, light_counts, frames, context.is_cpu())?;
    let refined = refined::measure(&mut renderer, frames)?;
    device_args.report_validation(&context);
    Ok(Ok(Timed {
        name,
        triangles,
        lights,
        size,
        statistics,
        measurement,
        energy,
        rays,
        relit,
        moved,
        refined,
    }))
}
