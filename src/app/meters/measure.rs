//! `lightpaths measure`: illuminance at the light meters of a scene.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;

use clap::{Args, ValueEnum};
use serde_json::json;

use super::{active, measure_with, open};
use crate::app::args::{CacheArgs, DeviceArgs, SceneArgs};
use crate::app::numbers::whole;
use crate::app::output::OutputFile;
use crate::app::overlap;
use crate::error::{Error, Result};
use crate::renderer::{Measured, Reading, Renderer};
use crate::scene::{Scene, photometry::lux};

/// Measure illuminance at the light meters of a scene
///
/// Meters are the sections [[meter]] of the scene file: points, or planes with a grid of points.
/// Illuminance is 683 lm/W times the luminance of the irradiance (linear Rec.709). Uniformity is
/// minimum over mean. Points in solids are left out.
#[derive(Debug, Args)]
pub(in crate::app) struct Measure {
    /// A .toml scene file with meters
    scene: String,
    /// Measures each light alone, too
    #[arg(long)]
    by_light: bool,
    /// lightpaths, or path: path tracing of the indirect light, the reference
    #[arg(long, value_enum, default_value = "lightpaths")]
    method: Method,
    /// Paths from each point, for the method path [default: 65536]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = whole(256..=1 << 24, "65536"))]
    spp: Option<u32>,
    /// Prints the figures as JSON
    #[arg(long)]
    json: bool,
    /// Writes all points as a table of comma-separated values
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Kept light paths")]
    cache_args: CacheArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

/// Paths from each point unless the user states their number.
const PATHS: u32 = 1 << 16;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Method {
    Lightpaths,
    Path,
}

/// The results: of all lights together, and of each alone.
struct Results {
    all: Vec<Measured>,
    by_light: Vec<(String, Vec<Measured>)>,
}

impl Measure {
    pub(in crate::app) fn run(self) -> Result<()> {
        if self.spp.is_some() && self.method == Method::Lightpaths {
            return Err(Error::Usage("--spp is for --method path; light paths take no samples".to_owned()));
        }
        let csv = self.csv.as_deref().map(OutputFile::check).transpose()?;
        let (context, mut renderer) =
            open(&self.scene, &self.scene_args, &self.cache_args, &self.device_args)?;
        overlap::refuse_inputs(self.csv.as_deref(), &renderer.scene().inputs)?;
        let results = self.results(&mut renderer)?;
        let scene = renderer.scene();
        if let Some(csv) = csv {
            csv.write(|out| out.write_all(table(scene, &results).as_bytes()))?;
        }
        let text = match self.json {
            true => {
                serde_json::to_string_pretty(&document(scene, &results)).expect("numbers and texts") + "\n"
            }
            false => text(scene, &results),
        };
        self.device_args.report_validation(&context);
        crate::app::print(&text)
    }

    fn results(&self, renderer: &mut Renderer) -> Result<Results> {
        let active = active(renderer.scene());
        let measure = |renderer: &mut Renderer, lights: &[usize]| {
            let measured = measure_with(renderer, |light| lights.contains(&light))?;
            match self.method {
                Method::Lightpaths => Ok(measured),
                Method::Path => renderer.measured_by_paths(self.spp.unwrap_or(PATHS)),
            }
        };
        let mut by_light = Vec::new();
        for &light in active.iter().filter(|_| self.by_light) {
            let name = renderer.scene().lights[light].name.clone();
            by_light.push((name, measure(renderer, &[light])?));
        }
        Ok(Results { all: measure(renderer, &active)?, by_light })
    }
}

fn text(scene: &Scene, results: &Results) -> String {
    let names = scene.meters.iter().map(|meter| meter.name.chars().count());
    let lights = results.by_light.iter().map(|(name, _)| name.chars().count() + 2);
    let width = names.chain(lights).max().unwrap_or(0).max(5);
    let mut text = format!(
        "{:width$}  {:>7}  {:>10}  {:>10}  {:>10}  {:>10}  {:>6}\n",
        "meter", "points", "mean, lx", "min, lx", "max, lx", "uniformity", "direct"
    );
    let percent = |part: f64, whole: f64| 100.0 * part / whole.max(f64::MIN_POSITIVE);
    let of_lights: Vec<Vec<&[Measured]>> =
        results.by_light.iter().map(|(_, points)| Measured::by_meter(scene, points)).collect();
    for (number, (meter, points)) in
        scene.meters.iter().zip(Measured::by_meter(scene, &results.all)).enumerate()
    {
        let (reading, [columns, rows]) = (Reading::new(points), meter.grid());
        let Reading { mean, min, max, direct, in_solids } = reading;
        let _ = write!(
            text,
            "{:width$}  {:>7}  {mean:10.1}  {min:10.1}  {max:10.1}  {:10.2}  {:5.0} %",
            meter.name,
            format!("{columns}x{rows}"),
            reading.uniformity(),
            percent(direct, mean)
        );
        if in_solids > 0 {
            let _ = write!(text, "  ({in_solids} points in solids)");
        }
        text.push('\n');
        for ((name, _), points) in results.by_light.iter().zip(&of_lights) {
            let own = Reading::new(points[number]).mean;
            let label = format!("  {name}");
            let _ = writeln!(text, "{label:width$}  {:>7}  {own:10.1}  {:8.1} %", "", percent(own, mean));
        }
    }
    text
}

fn document(scene: &Scene, results: &Results) -> serde_json::Value {
    let of_lights: Vec<(&String, Vec<&[Measured]>)> =
        results.by_light.iter().map(|(name, points)| (name, Measured::by_meter(scene, points))).collect();
    let meters = scene.meters.iter().zip(Measured::by_meter(scene, &results.all)).enumerate();
    let meters = meters.map(|(number, (meter, points))| {
        let reading = Reading::new(points);
        let Reading { mean, min, max, direct, in_solids } = reading;
        let lights = of_lights
            .iter()
            .map(|(name, points)| json!({"name": name, "mean_lux": Reading::new(points[number]).mean}));
        json!({
            "name": meter.name, "grid": meter.grid(), "points_in_solids": in_solids,
            "mean_lux": mean, "min_lux": min, "max_lux": max, "uniformity": reading.uniformity(),
            "direct_lux": direct, "lights": lights.collect::<Vec<_>>(),
        })
    });
    json!({"scene": scene.name, "meters": meters.collect::<Vec<_>>()})
}

/// All points as comma-separated values, in the coordinates of the scene file. Points in solids
/// have no values.
fn table(scene: &Scene, results: &Results) -> String {
    let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
    let mut text = "meter,x_m,y_m,z_m,lux,direct_lux,red_w_m2,green_w_m2,blue_w_m2".to_owned();
    for (name, _) in &results.by_light {
        let _ = write!(text, ",{}", quoted(&format!("lux of {name}")));
    }
    text.push('\n');
    let places =
        scene.meters.iter().flat_map(|meter| meter.points().into_iter().map(move |(at, _)| (meter, at)));
    for (number, ((meter, place), point)) in places.zip(&results.all).enumerate() {
        let [x, y, z] = (place.as_dvec3() + scene.origin).to_array();
        let _ = write!(text, "{},{x:.6},{y:.6},{z:.6}", quoted(&meter.name));
        let [red, green, blue] = point.irradiance().to_array();
        let own = [lux(point.irradiance()), lux(point.direct), red.into(), green.into(), blue.into()];
        let by_light = results.by_light.iter().map(|(_, points)| lux(points[number].irradiance()));
        for value in own.into_iter().chain(by_light) {
            let _ = if point.is_in_solid { write!(text, ",") } else { write!(text, ",{value}") };
        }
        text.push('\n');
    }
    text
}
