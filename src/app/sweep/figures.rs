//! `lightpaths figures`: the paper's figures 4, 5 and 6, each as a self-contained page.

use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;

use super::format::Shown;
use super::measure::measure;
use super::reference::Reference;
use super::report;
use super::{DIRECT, OURS, Preset, ReferenceArgs, baselines, file_stem, settings, shown, titles};
use crate::app::args::{DeviceArgs, SceneArgs, device_label, shell_word};
use crate::app::output::{OutputFile, create_folder};
use crate::app::{overlap, plot};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::scene::{Scene, builtin};

/// Default time of a reference, seconds.
const DEFAULT_SECONDS: f32 = 60.0;

/// Make the paper's figures 4, 5 and 6: direct light only, photon mapping, our method and
/// pure Monte Carlo
///
/// Photon mapping and Monte Carlo get the time that our method takes for its first picture,
/// precomputation included. Under each picture stand its time and its error against a path-traced
/// reference, which is kept for the next time.
#[derive(Debug, Args)]
pub(in crate::app) struct Figures {
    /// Scenes, as for render [default: every built-in one]
    scenes: Vec<String>,
    /// Folder for the pages; created if it is not there
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    reference_args: ReferenceArgs,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

impl Figures {
    pub(in crate::app) fn run(self) -> Result<()> {
        let names = builtin::NAMES.map(str::to_owned);
        let specs = if self.scenes.is_empty() { &names[..] } else { &self.scenes };
        let scenes = specs.iter().map(|spec| self.scene_args.load_lit(spec)).collect::<Result<Vec<_>>>()?;
        let stems: Vec<String> = scenes.iter().map(|scene| stem(&scene.name)).collect();
        if let Some(index) = (1..stems.len()).find(|&index| stems[..index].contains(&stems[index])) {
            let message = format!("two scenes are called {}: name one", scenes[index].name);
            return Err(Error::Usage(message));
        }
        let inputs: Vec<_> = scenes.iter().flat_map(|scene| &scene.inputs).collect();
        let is_written = |name: &str| stems.iter().any(|stem| is_of_figure(stem, name));
        overlap::refuse_in_folder(&self.output, is_written, &inputs)?;
        let cache = self.reference_args.folder()?;
        let context = self.device_args.open()?;
        let device = format!("{}, {}", device_label(&context), context.driver());
        create_folder(&self.output)?;
        let page = |stem: &String| OutputFile::check(&self.output.join(format!("{stem}.html")));
        let pages = stems.iter().map(page).collect::<Result<Vec<_>>>()?;
        if cfg!(debug_assertions) {
            self.device_args.warn("this is a debug build; its times mean little");
        }
        for ((scene, spec), page) in scenes.into_iter().zip(specs).zip(pages) {
            self.device_args.say(&format!("{}: its figure", scene.name));
            scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
            let html = self.figure(&scene, spec, &device, (&context, &cache))?;
            page.write(|out| out.write_all(html.as_bytes()))?;
            crate::app::print_line(&format!("{}", page.path().display()))?;
        }
        Ok(())
    }

    /// Writes the page of a scene, with its pictures beside it.
    fn figure(
        &self,
        scene: &Scene,
        spec: &str,
        device: &str,
        (context, cache): (&Arc<Context>, &std::path::Path),
    ) -> Result<String> {
        let budget = self.reference_args.budget(DEFAULT_SECONDS);
        let mut reference = Reference::find(scene, budget, cache, (context, &self.device_args))?;
        let preset = settings::trials(&scene.quality).swap_remove(0);
        let preset = measure(preset, scene, &reference, context, &self.device_args)?;
        reference.set_scale(preset.picture.pixels.clone());
        let preset = Preset::new(preset, &reference, context, None)?;
        let compare = |method: &baselines::Method| {
            let outcome =
                baselines::compare(method, scene, &preset.setting, &reference, (context, &self.device_args))?;
            Ok((method.name, outcome))
        };
        let outcomes = baselines::METHODS.iter().map(compare).collect::<Result<Vec<_>>>()?;
        let mut shown = shown(&preset, &outcomes, &reference, scene.cameras[0].size)?;
        shown.iter_mut().for_each(|shown| shown.title = as_the_paper(&shown.title).to_owned());
        for picture in &shown {
            let stem = stem(&scene.name);
            let name = format!("{stem}-{}.png", file_stem(&picture.title));
            debug_assert!(is_of_figure(&stem, &name), "{name} is checked before the work");
            OutputFile::check(&self.output.join(name))?.write(|out| out.write_all(&picture.png))?;
        }
        let command = format!("lightpaths figures {}{}", shell_word(spec), self.scene_args.typed());
        Ok(page(scene, &shown, &settings::arguments(&preset.setting.quality), device, &command))
    }
}

/// The paper's figure of a scene, or the scene's name.
fn stem(scene: &str) -> String {
    match scene {
        "box" => "figure-4".to_owned(),
        "atrium" => "figure-5".to_owned(),
        "room" => "figure-6".to_owned(),
        other => format!("figure-{other}"),
    }
}

/// Whether the figure of that stem has a file of that name.
fn is_of_figure(stem: &str, name: &str) -> bool {
    let is_picture = |name: &str| titles().any(|title| file_stem(as_the_paper(&title)) == name);
    let rest = name.strip_prefix(stem);
    rest == Some(".html")
        || rest.is_some_and(|rest| {
            rest.strip_prefix('-').and_then(|rest| rest.strip_suffix(".png")).is_some_and(is_picture)
        })
}

/// The paper's title of a picture.
fn as_the_paper(title: &str) -> &str {
    match title {
        DIRECT => "Direct illumination only",
        OURS => "Our method",
        "Path tracing" => "Pure Monte Carlo",
        title => title,
    }
}

fn page(scene: &Scene, shown: &[Shown], quality: &str, device: &str, command: &str) -> String {
    let name = plot::escape(&scene.name);
    let title = match stem(&scene.name).strip_prefix("figure-").and_then(|number| number.parse::<u32>().ok())
    {
        Some(number) => format!("Figure {number}: {name}"),
        None => format!("Figure: {name}"),
    };
    let [width, height] = scene.cameras[0].size;
    let facts = [
        format!("{} triangles, {width}×{height} pixels", scene.triangles.len()),
        quality.to_owned(),
        device.to_owned(),
        format!("made by {command}"),
    ];
    let facts: String = facts.iter().map(|fact| format!("{}<br>\n", plot::escape(fact))).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{title}</title>\n<style>\n{}</style>\n\
         </head>\n<body>\n<h1>{title}</h1>\n<p class=\"soft\">{facts}</p>\n\
         <p>Photon mapping and Monte Carlo had the time of our first picture, precomputation included. The error is the relative \
         mean square error against the reference, whose own noise is subtracted.</p>\n{}</body>\n</html>\n",
        include_str!("report.css"),
        report::pictures(shown),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_have_the_papers_numbers() {
        let stems = ["box", "atrium", "room", "attic"].map(stem);
        assert_eq!(stems, ["figure-4", "figure-5", "figure-6", "figure-attic"]);
    }
}
