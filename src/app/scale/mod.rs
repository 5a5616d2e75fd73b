//! `lightpaths scale`: time and memory against scene sizes.

mod scaling;
mod trials;

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;

use super::args::{DeviceArgs, SceneArgs, device_label};
use super::numbers::each_whole;
use super::output::{OutputFile, create_folder};
use super::overlap;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::scene::Scene;
use trials::{Quantity, Sizes, Trial, measure};

/// Set time and memory against sizes: triangles, entry points, cache points and lights
///
/// Each is varied by itself; the rest stays as the scene and its preset have it. A size that the
/// device has no memory for is listed with what it would need. Prints a table and the powers with
/// which time and memory grow; writes scale.json and plots (SVG).
#[derive(Debug, Args)]
pub(super) struct Scale {
    /// A .toml scene file, a .glb, .gltf, .obj, .ply or .stl model, or a built-in scene
    #[arg(default_value = "room")]
    scene: String,
    /// Folder for the results; created if it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Numbers of triangles, of scenes whose first model is atrium or
    /// room [default: 10000,100000,1000000]
    #[arg(long, value_name = "LIST", value_delimiter = ',', allow_negative_numbers = true, value_parser = each_whole(1..=u32::MAX, "10000,100000"))]
    triangles: Option<Vec<u32>>,
    /// Numbers of entry points
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "100000,1000000,10000000", allow_negative_numbers = true, value_parser = each_whole(1..=1 << 24, "100000,1000000"))]
    entry_points: Vec<u32>,
    /// Numbers of cache points
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "10000,40000,160000", allow_negative_numbers = true, value_parser = each_whole(1..=1_000_000, "10000,40000"))]
    cache_points: Vec<u32>,
    /// Numbers of lights, of which one moves: the scene's lights, and copies if there are fewer
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,16,256", allow_negative_numbers = true, value_parser = each_whole(1..=4096, "1,16,256"))]
    lights: Vec<u32>,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

/// Default numbers of triangles.
const TRIANGLES: [u32; 3] = [10_000, 100_000, 1_000_000];

/// A trial that did not fit the device.
#[derive(Debug, serde::Serialize)]
struct TooLarge {
    quantity: &'static str,
    size: u32,
    why: String,
}

/// The contents of `scale.json`.
#[derive(Debug, serde::Serialize)]
struct Results {
    version: &'static str,
    debug_build: bool,
    scene: String,
    preset: &'static str,
    size: [u32; 2],
    device: String,
    driver: String,
    trials: Vec<Trial>,
    refused: Vec<TooLarge>,
}

impl Scale {
    pub(super) fn run(self) -> Result<()> {
        let scene = self.scene_args.load_lit(&self.scene)?;
        let is_written = |name: &str| name == "scale.json" || scaling::is_plot(name);
        overlap::refuse_in_folder(&self.output, is_written, &scene.inputs)?;
        scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        let lists = self.lists(&scene)?;
        let context = self.device_args.open()?;
        create_folder(&self.output)?;
        let json = OutputFile::check(&self.output.join("scale.json"))?;
        if cfg!(debug_assertions) {
            self.device_args.warn("this is a debug build; its times mean little");
        }
        let mut results = Results {
            version: env!("CARGO_PKG_VERSION"),
            debug_build: cfg!(debug_assertions),
            scene: scene.name.clone(),
            preset: scene.quality.preset,
            size: scene.cameras[0].size,
            device: device_label(&context),
            driver: context.driver().to_owned(),
            trials: Vec::new(),
            refused: Vec::new(),
        };
        for (quantity, sizes) in lists {
            for size in sizes {
                self.attempt(&scene, quantity, size, &context, &mut results)?;
            }
        }
        let text = serde_json::to_string_pretty(&results).expect("results are plain data");
        json.write(|out| writeln!(out, "{text}"))?;
        for (stem, plot) in scaling::plots(&results.trials) {
            debug_assert!(scaling::is_plot(&format!("{stem}.svg")), "{stem} is checked before the work");
            OutputFile::check(&self.output.join(format!("{stem}.svg")))?
                .write(|out| out.write_all(plot.file().as_bytes()))?;
        }
        super::print(&scaling::text(&results))
    }

    /// All quantities with their sizes.
    fn lists(&self, scene: &Scene) -> Result<Vec<(Quantity, Vec<u32>)>> {
        let triangles = match &self.triangles {
            Some(sizes) => sizes.clone(),
            // Only generated scenes come in several sizes.
            None if self.load(TRIANGLES[0]).is_ok() => TRIANGLES.to_vec(),
            None => {
                self.device_args.say(&format!("{}: its triangles are what they are", scene.name));
                Vec::new()
            }
        };
        if let Some(&first) = triangles.first() {
            self.load(first)?;
        }
        Ok(vec![
            (Quantity::Triangles, triangles),
            (Quantity::EntryPoints, self.entry_points.clone()),
            (Quantity::CachePoints, self.cache_points.clone()),
            (Quantity::Lights, self.lights.clone()),
        ])
    }

    /// The scene with about `triangles` triangles.
    fn load(&self, triangles: u32) -> Result<Scene> {
        let mut options = self.scene_args.options();
        options.set.push(format!("model.0.triangles={triangles}"));
        Scene::load(&self.scene, &options)
    }

    /// Measures a size, or records why that is impossible.
    fn attempt(
        &self,
        scene: &Scene,
        quantity: Quantity,
        size: u32,
        context: &Arc<Context>,
        results: &mut Results,
    ) -> Result<()> {
        let name = quantity.name();
        let sized = match quantity {
            Quantity::Triangles => self.load(size)?,
            _ => quantity.sized(scene, size),
        };
        // A size may be in several lists: the scene's own is.
        let sizes = Sizes::from_scene(&sized);
        let known = results.trials.iter().find(|trial| trial.sizes == sizes).cloned();
        let trial = match known {
            Some(known) => Ok(Trial { quantity: name, ..known }),
            None => measure(sized, name, context, &self.device_args),
        };
        match trial {
            Ok(trial) => {
                self.device_args.say(&format!(
                    "{name} {}: precompute {:.2} s, relit frame {:.1} ms, {:.0} MB",
                    quantity.value_in(&trial.sizes),
                    trial.precompute_s,
                    trial.relit_frame_ms,
                    trial.memory_mb,
                ));
                results.trials.push(trial);
                Ok(())
            }
            Err(error @ Error::OutOfMemory(_)) => {
                self.device_args.warn(&format!("left out {name} {size}: {error}"));
                results.refused.push(TooLarge { quantity: name, size, why: error.to_string() });
                Ok(())
            }
            Err(error) => Err(error),
        }
    }
}
