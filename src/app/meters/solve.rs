//! `lightpaths solve`: powers of lights for wanted illuminances.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::least_squares;
use super::{Reading, active, by_meter, measure_with, open};
use crate::app::args::{CacheArgs, DeviceArgs, SceneArgs};
use crate::app::numbers::parse_positive;
use crate::app::output::OutputFile;
use crate::app::overlap;
use crate::error::{Error, Result};
use crate::renderer::Renderer;
use crate::scene::Scene;
use crate::scene::save::{Edited, SceneText};

/// Find the powers of lights that give wanted illuminances
///
/// Each light alone is measured at the meters of the scene. The powers then follow from linear
/// least squares of the relative errors, without negative powers. Where several powers fit, those
/// nearest to the scene's own are chosen. The result is rendered and measured again.
#[derive(Debug, Args)]
pub(in crate::app) struct Solve {
    /// A .toml scene file with meters
    scene: String,
    /// Wanted mean illuminance of a meter, lx, as in --target desk=500; may be repeated
    #[arg(long = "target", value_name = "METER=LUX", required = true, value_parser = parse_target)]
    targets: Vec<Target>,
    /// A light whose power may change; may be repeated [default: all that are on]
    #[arg(long = "light", value_name = "NAME")]
    lights: Vec<String>,
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

/// Weight of a light's change beside the relative errors: it only chooses among powers that fit
/// equally well.
const KEEP: f64 = 1e-4;
/// Relative error up to which a target is reached.
const REACHED: f64 = 0.02;

/// What was found.
struct Solution {
    /// Light and factor of its power.
    factors: Vec<(usize, f64)>,
    /// Illuminance of each target before and after, lx, as rendered.
    rendered: Vec<[f64; 2]>,
}

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
        let targets = self.targets_of(renderer.scene())?;
        let lights = self.lights_of(renderer.scene())?;
        let solution = self.solution(&mut renderer, &targets, &lights)?;
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

    /// Index of the meter of each target.
    fn targets_of(&self, scene: &Scene) -> Result<Vec<usize>> {
        let mut found = Vec::new();
        for Target { meter, .. } in &self.targets {
            let index = scene.meters.iter().position(|known| known.name == *meter);
            let names =
                || scene.meters.iter().map(|meter| meter.name.as_str()).collect::<Vec<_>>().join(", ");
            let index = index.ok_or_else(|| {
                Error::Usage(format!("--target: no meter is named {meter:?}; the scene has {}", names()))
            })?;
            if found.contains(&index) {
                return Err(Error::Usage(format!("--target: {meter:?} has two")));
            }
            found.push(index);
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

    fn solution(&self, renderer: &mut Renderer, meters: &[usize], lights: &[usize]) -> Result<Solution> {
        let all = active(renderer.scene());
        let means = |renderer: &mut Renderer, on: &[usize]| -> Result<Vec<f64>> {
            let points = measure_with(renderer, |light| on.contains(&light))?;
            let points = by_meter(renderer.scene(), &points);
            Ok(meters.iter().map(|&meter| Reading::new(points[meter]).mean).collect())
        };
        let before = means(renderer, &all)?;
        let others: Vec<usize> = all.iter().copied().filter(|light| !lights.contains(light)).collect();
        let fixed = if others.is_empty() { vec![0.0; meters.len()] } else { means(renderer, &others)? };
        let alone = lights.iter().map(|&light| means(renderer, &[light])).collect::<Result<Vec<_>>>()?;

        let relative = |target: usize, value: f64| value / self.targets[target].lux;
        let mut rows: Vec<Vec<f64>> = (0..meters.len())
            .map(|target| alone.iter().map(|means| relative(target, means[target])).collect())
            .collect();
        let mut wanted: Vec<f64> =
            (0..meters.len()).map(|target| 1.0 - relative(target, fixed[target])).collect();
        for light in 0..lights.len() {
            rows.push((0..lights.len()).map(|other| if other == light { KEEP } else { 0.0 }).collect());
            wanted.push(KEEP);
        }
        let most = self.max_factor.unwrap_or(f64::INFINITY);
        let found = least_squares::solve(&rows, &wanted, 0.0, &vec![most; lights.len()]);
        let factors: Vec<(usize, f64)> = lights.iter().copied().zip(found).collect();

        let mut on = others;
        for &(light, factor) in &factors {
            let kind = renderer.scene().lights[light].kind;
            if factor > 0.0 {
                renderer.set_light(light, kind.with_emission(kind.emission() * factor as f32))?;
                on.push(light);
            }
        }
        let after = means(renderer, &on)?;
        Ok(Solution { factors, rendered: before.into_iter().zip(after).map(|(a, b)| [a, b]).collect() })
    }

    /// Writes the scene file with the factors applied to the powers as loaded.
    fn write(&self, output: &OutputFile, solution: &Solution) -> Result<()> {
        let mut scene = self.scene_args.load_with_meters(&self.scene)?;
        let text = SceneText::new(&self.scene, &self.scene_args.options(), &scene)?;
        for &(light, factor) in &solution.factors {
            let light = &mut scene.lights[light];
            match factor {
                0.0 => light.is_on = false,
                factor => light.kind = light.kind.with_emission(light.kind.emission() * factor as f32),
            }
        }
        let text = text.with_edits(&Edited::from_scene(&scene), output.path())?;
        output.write(|out| std::io::Write::write_all(out, text.as_bytes()))
    }

    fn text(&self, scene: &Scene, solution: &Solution) -> String {
        let names = self.targets.iter().map(|target| target.meter.chars().count());
        let lights = solution.factors.iter().map(|&(light, _)| scene.lights[light].name.chars().count());
        let width = names.chain(lights).max().unwrap_or(0).max(5);
        let mut text = format!("{:width$}  {:>9}\n", "light", "factor");
        for &(light, factor) in &solution.factors {
            text += &format!("{:width$}  {factor:9.4}\n", scene.lights[light].name);
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

    fn document(&self, scene: &Scene, solution: &Solution) -> serde_json::Value {
        let lights = solution
            .factors
            .iter()
            .map(|&(light, factor)| json!({"name": scene.lights[light].name, "factor": factor}));
        let targets = self.targets.iter().zip(&solution.rendered).map(|(target, [before, after])| {
            json!({
                "meter": target.meter, "target_lux": target.lux, "before_lux": before, "after_lux": after,
                "reached": is_reached(*after, target.lux),
            })
        });
        json!({"lights": lights.collect::<Vec<_>>(), "targets": targets.collect::<Vec<_>>()})
    }
}

fn is_reached(after: f64, target: f64) -> bool {
    (after / target - 1.0).abs() <= REACHED
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
