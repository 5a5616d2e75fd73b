//! `lightpaths solve`: powers of lights for wanted illuminances.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::search::{Found, Goal, Wish, is_reached};
use super::{active, open};
use crate::app::args::{CacheArgs, DeviceArgs, SceneArgs};
use crate::app::numbers::parse_positive;
use crate::app::output::OutputFile;
use crate::app::overlap;
use crate::error::{Error, Result};
use crate::renderer::Renderer;
use crate::scene::save::{Edited, SceneText};
use crate::scene::{Light, Scene};

/// Find the powers of lights that give wanted illuminances
///
/// Each light alone is measured at the meters of the scene. The powers then follow from linear
/// least squares of the relative errors, without negative powers. Where several powers fit, those
/// nearest to the scene's own are chosen. Lights that may move take a few Gauss-Newton steps, with
/// the powers solved at each. The result is rendered and measured again.
#[derive(Debug, Args)]
pub(in crate::app) struct Solve {
    /// A .toml scene file with meters
    scene: String,
    /// Wanted mean illuminance of a meter, lx, as in --target desk=500; may be repeated
    #[arg(long = "target", value_name = "METER=LUX", required = true, value_parser = parse_target)]
    targets: Vec<Target>,
    /// A light whose power may change; may be repeated [default: all lights that are on]
    #[arg(long = "light", value_name = "NAME")]
    lights: Vec<String>,
    /// A light whose position may change as well, if powers alone do not suffice; may be repeated
    #[arg(long = "move", value_name = "NAME")]
    moved: Vec<String>,
    /// How far such a light may move, metres [default: 1]
    #[arg(long, value_name = "METRES", requires = "moved", allow_negative_numbers = true, value_parser = parse_positive)]
    reach: Option<f64>,
    /// Greatest factor of a light's power [default: none]
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = parse_positive)]
    max_factor: Option<f64>,
    /// Writes a scene file with these powers
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    /// Prints the figures as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Kept light paths")]
    cache_args: CacheArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

/// A wanted mean illuminance.
#[derive(Clone, Debug, PartialEq)]
struct Target {
    meter: String,
    lux: f64,
}

/// Metres that a light may move unless the user states them.
const REACH_M: f64 = 1.0;

fn parse_target(text: &str) -> std::result::Result<Target, String> {
    let expected = "expected METER=LUX, as in desk=500".to_owned();
    let (meter, lux) = text.rsplit_once('=').ok_or_else(|| expected.clone())?;
    let lux = lux.trim().parse().ok().filter(|lux: &f64| lux.is_finite() && *lux > 0.0).ok_or(expected)?;
    Ok(Target { meter: meter.trim().to_owned(), lux })
}

impl Solve {
    pub(in crate::app) fn run(self) -> Result<()> {
        let output = self.output.as_deref().map(OutputFile::check).transpose()?;
        let (context, mut renderer) =
            open(&self.scene, &self.scene_args, &self.cache_args, &self.device_args)?;
        overlap::refuse_inputs(self.output.as_deref(), &renderer.scene().inputs)?;
        let goals = self.goals(renderer.scene())?;
        let lights = self.lights_of(renderer.scene())?;
        let solution = self.solution(&mut renderer, &goals, &lights)?;
        if let Some(output) = output {
            self.write(&output, &solution)?;
        }
        let scene = renderer.scene();
        let text = match self.json {
            true => serde_json::to_string_pretty(&self.document(scene, &solution)).expect("numbers") + "\n",
            false => self.text(scene, &solution),
        };
        self.device_args.report_validation(&context);
        crate::app::print(&text)
    }

    /// The targets, with the indices of their meters.
    fn goals(&self, scene: &Scene) -> Result<Vec<Goal>> {
        let mut found: Vec<Goal> = Vec::new();
        for Target { meter, lux } in &self.targets {
            let index = scene.meters.iter().position(|known| known.name == *meter);
            let names =
                || scene.meters.iter().map(|meter| meter.name.as_str()).collect::<Vec<_>>().join(", ");
            let index = index.ok_or_else(|| {
                Error::Usage(format!("--target: no meter is named {meter:?}; the scene has {}", names()))
            })?;
            if found.iter().any(|goal| goal.meter == index) {
                return Err(Error::Usage(format!("--target: {meter:?} has two")));
            }
            found.push(Goal { meter: index, lux: *lux });
        }
        Ok(found)
    }

    /// The lights that may change.
    fn lights_of(&self, scene: &Scene) -> Result<Vec<usize>> {
        let active = active(scene);
        if self.lights.is_empty() {
            return match active.is_empty() {
                true => {
                    Err(Error::Usage("all lights are off or black: there is no power to change".to_owned()))
                }
                false => Ok(active),
            };
        }
        let find = |name: &String| {
            let index = active.iter().copied().find(|&light| scene.lights[light].name == *name);
            let names = || {
                active.iter().map(|&light| scene.lights[light].name.as_str()).collect::<Vec<_>>().join(", ")
            };
            index.ok_or_else(|| {
                Error::Usage(format!("--light: no light that is on is named {name:?}; on are {}", names()))
            })
        };
        let mut lights = self.lights.iter().map(find).collect::<Result<Vec<_>>>()?;
        lights.sort_unstable();
        lights.dedup();
        Ok(lights)
    }

    fn solution(&self, renderer: &mut Renderer, goals: &[Goal], lights: &[usize]) -> Result<Found> {
        let moved = self.moved_of(renderer.scene(), lights)?;
        let reach = self.reach.unwrap_or(REACH_M) as f32;
        Wish { goals, lights, max_factor: self.max_factor.unwrap_or(f64::INFINITY) }
            .find(renderer, (&moved, reach))
    }

    /// Places in `lights` of the lights that may move.
    fn moved_of(&self, scene: &Scene, lights: &[usize]) -> Result<Vec<usize>> {
        let find = |name: &String| {
            let place = lights.iter().position(|&light| scene.lights[light].name == *name);
            let place = place.ok_or_else(|| {
                Error::Usage(format!("--move: {name:?} is none of the lights whose power may change"))
            })?;
            match scene.lights[lights[place]].kind.position() {
                Some(_) => Ok(place),
                None => Err(Error::Usage(format!("--move: the light {name:?} has no position"))),
            }
        };
        self.moved.iter().map(find).collect()
    }

    /// Writes the scene file with these lights.
    fn write(&self, output: &OutputFile, solution: &Found) -> Result<()> {
        let mut scene = self.scene_args.load_with_meters(&self.scene)?;
        let text = SceneText::new(&self.scene, &self.scene_args.options(), &scene)?;
        for &(light, kind, factor) in &solution.lights {
            scene.lights[light].kind = kind;
            scene.lights[light].is_on = factor > 0.0;
        }
        let text = text.with_edits(&Edited::from_scene(&scene), output.path())?;
        output.write(|out| std::io::Write::write_all(out, text.as_bytes()))
    }

    fn text(&self, scene: &Scene, solution: &Found) -> String {
        let names = self.targets.iter().map(|target| target.meter.chars().count());
        let lights = solution.lights.iter().map(|&(light, ..)| scene.lights[light].name.chars().count());
        let width = names.chain(lights).max().unwrap_or(0).max(5);
        let mut text = format!("{:width$}  {:>9}\n", "light", "factor");
        for &(light, kind, factor) in &solution.lights {
            let Light { name, .. } = &scene.lights[light];
            text += &format!("{name:width$}  {factor:9.4}");
            if let Some(place) = kind.position().filter(|_| self.moved.contains(name)) {
                let [x, y, z] = (place.as_dvec3() + scene.origin).to_array();
                text += &format!("  at [{x:.3}, {y:.3}, {z:.3}]");
            }
            text += "\n";
        }
        text += &format!(
            "\n{:width$}  {:>10}  {:>10}  {:>10}\n",
            "meter", "before, lx", "after, lx", "target, lx"
        );
        for (Target { meter, lux }, [before, after]) in self.targets.iter().zip(&solution.rendered) {
            let missed = if is_reached(*after, *lux) { "" } else { "  not reachable" };
            text += &format!("{meter:width$}  {before:10.1}  {after:10.1}  {lux:10.1}{missed}\n");
        }
        text
    }

    fn document(&self, scene: &Scene, solution: &Found) -> serde_json::Value {
        let lights = solution.lights.iter().map(|&(light, kind, factor)| {
            let place = kind.position().map(|place| (place.as_dvec3() + scene.origin).to_array());
            json!({"name": scene.lights[light].name, "factor": factor, "position": place})
        });
        let targets = self.targets.iter().zip(&solution.rendered).map(|(target, [before, after])| {
            json!({
                "meter": target.meter, "target_lux": target.lux, "before_lux": before, "after_lux": after,
                "reached": is_reached(*after, target.lux),
            })
        });
        json!({"lights": lights.collect::<Vec<_>>(), "targets": targets.collect::<Vec<_>>()})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets() {
        assert_eq!(parse_target("desk=500"), Ok(Target { meter: "desk".to_owned(), lux: 500.0 }));
        assert_eq!(parse_target(" a=b = 1e2 "), Ok(Target { meter: "a=b".to_owned(), lux: 100.0 }));
        for bad in ["", "desk", "desk=", "desk=x", "desk=0", "desk=-1", "desk=inf", "desk=nan"] {
            assert!(parse_target(bad).is_err(), "{bad}");
        }
    }
}
