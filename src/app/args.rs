//! Arguments that several commands share.

use std::sync::Arc;

use clap::Args;

use super::{note, progress};
use crate::error::{Error, Result};
use crate::gpu::{Context, ContextOptions};
use crate::renderer::{Progress, Renderer};
use crate::scene::{LoadOptions, Quality, Scene};

/// Largest image side in pixels; what a device can hold is asked of the device.
const SIZE_MAX: u32 = 16_384;

/// How a scene is read.
#[derive(Clone, Debug, Args)]
pub(super) struct SceneArgs {
    /// Quality preset: draft, paper or high [default: the scene's own, else paper]
    #[arg(long, value_name = "NAME", value_parser = parse_preset)]
    preset: Option<String>,
    /// Image size in pixels [default: the camera's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<[u32; 2]>,
    /// Camera by name [default: the scene's first]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Overrides one key of the scene file, as in --set quality.cache_points=8000; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Where the work is done and what is said about it.
#[derive(Clone, Debug, Args)]
pub(super) struct DeviceArgs {
    /// Vulkan device: its index or part of its name, as `info` lists them
    #[arg(long, value_name = "NAME|INDEX")]
    device: Option<String>,
    /// Turns on the Vulkan validation layers and the check for missing barriers (slow)
    #[arg(long)]
    validation: bool,
    /// Prints no progress, notes or warnings
    #[arg(long, short)]
    quiet: bool,
}

impl SceneArgs {
    /// Reads a scene: a file or the name of a built-in one.
    pub(super) fn load(&self, spec: &str) -> Result<Scene> {
        Scene::load(spec, &self.options())
    }

    /// The size that was asked for.
    #[cfg(feature = "window")]
    pub(super) fn size(&self) -> Option<[u32; 2]> {
        self.size
    }

    /// What they change about a scene.
    pub(super) fn options(&self) -> LoadOptions {
        let Self { preset, size, camera, set } = self.clone();
        LoadOptions { set, preset, size, camera }
    }

    /// These arguments as they would be typed, each after a blank.
    pub(super) fn typed(&self) -> String {
        let size = self.size.map(|[width, height]| format!("{width}x{height}"));
        let once = [("preset", &self.preset), ("size", &size), ("camera", &self.camera)];
        let once = once.into_iter().filter_map(|(flag, value)| value.as_ref().map(|value| (flag, value)));
        let all = once.chain(self.set.iter().map(|value| ("set", value)));
        all.map(|(flag, value)| format!(" --{flag} {}", shell_word(value))).collect()
    }
}

impl DeviceArgs {
    /// Whether nothing is to be said that was not asked for.
    #[cfg(feature = "window")]
    pub(super) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Opens the device.
    pub(super) fn open(&self) -> Result<Arc<Context>> {
        Context::new(&self.context_options())
    }

    /// How they want the device opened.
    pub(super) fn context_options(&self) -> ContextOptions {
        ContextOptions {
            device: self.device.clone(),
            validation: self.validation,
            hazard_check: self.validation || ContextOptions::default().hazard_check,
            statistics: false,
        }
    }

    /// Passes on what the validation layers had to say, which is nothing unless the program has a fault.
    pub(super) fn report_validation(&self, context: &Context) {
        for message in context.take_validation_messages() {
            note(&format!("lightpaths: validation: {}\n", message.replace('\n', " ")));
        }
    }

    /// A progress bar, where somebody can see it.
    pub(super) fn progress(&self) -> Box<dyn Progress> {
        progress::for_stderr(self.quiet)
    }

    /// Says on stderr how far the work is.
    pub(super) fn say(&self, message: &str) {
        if !self.quiet {
            note(&format!("lightpaths: {message}\n"));
        }
    }

    /// Precomputes a scene, with progress, and passes on what is to be said of it then.
    pub(super) fn renderer(&self, context: &Arc<Context>, scene: Scene) -> Result<Renderer> {
        let said = scene.warnings.len();
        let renderer = Renderer::new(context, scene, self.progress().as_mut())?;
        renderer.scene().warnings.iter().skip(said).for_each(|warning| self.warn(warning));
        Ok(renderer)
    }

    /// Says something on stderr that the result does not depend on.
    pub(super) fn warn(&self, message: &str) {
        if !self.quiet {
            note(&format!("lightpaths: warning: {message}\n"));
        }
    }
}

fn parse_preset(name: &str) -> std::result::Result<String, String> {
    match Quality::preset(name) {
        Some(quality) => Ok(quality.preset.to_owned()),
        None => Err("expected draft, paper or high".to_owned()),
    }
}

fn parse_size(text: &str) -> std::result::Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(size @ [1..=SIZE_MAX, 1..=SIZE_MAX]) => Ok(size),
        Some(_) => Err(format!("each side must be 1 to {SIZE_MAX} pixels")),
        None => Err("expected WIDTHxHEIGHT, as in 640x480".to_owned()),
    }
}

/// Refuses a number that is not finite.
pub(super) fn parse_finite(text: &str) -> std::result::Result<f32, String> {
    match text.parse::<f32>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("expected a finite number".to_owned()),
    }
}

/// Takes a length of time that can be waited for.
pub(super) fn parse_seconds(text: &str) -> std::result::Result<f32, String> {
    match text.parse::<f32>() {
        Ok(seconds) if seconds.is_finite() && seconds > 0.0 => Ok(seconds),
        _ => Err("expected a positive number of seconds".to_owned()),
    }
}

/// The name of the device as tables and files show it: nobody shall mistake a processor for a GPU.
pub(super) fn device_label(context: &Context) -> String {
    format!("{}{}", context.name(), if context.is_cpu() { " (a CPU)" } else { "" })
}

/// A word as a shell wants it.
pub(super) fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Refuses two outputs under one name.
pub(super) fn refuse_same_output(
    first: Option<&std::path::Path>,
    second: Option<&std::path::Path>,
) -> Result<()> {
    match (first, second) {
        (Some(a), Some(b)) if a == b => {
            Err(Error::Usage(format!("{} is named for two outputs", a.display())))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(parse_size("640x480"), Ok([640, 480]));
        assert_eq!(parse_size("1X16384"), Ok([1, 16_384]));
        for bad in ["", "5", "x", "0x0", "0x5", "5x0", "-1x5", "5x5x5", "1.5x2", "16385x1", "99999999999x1"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn numbers_must_be_finite() {
        assert_eq!(parse_finite("-1.5"), Ok(-1.5));
        for bad in ["nan", "inf", "1e99", "", "one"] {
            assert!(parse_finite(bad).is_err(), "{bad}");
        }
    }
}
