//! Arguments that several commands share.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Once};

use clap::Args;

use super::{note, progress};
use crate::cache_file::{Folder, misnamed};
use crate::error::{Error, Result};
use crate::gpu::{Context, ContextOptions, TuningChange};
use crate::renderer::{Kept, Progress, Renderer, Store};
use crate::scene::{LoadOptions, Place, Quality, Scene, Up};

/// Largest image side in pixels; the device may hold less.
const SIZE_MAX: u32 = 16_384;

/// Default limit of the light paths in a folder, bytes.
const CACHE_LIMIT: u64 = 4 << 30;

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
    /// Places the camera inside of a scene without one, a room [default: rays decide]
    #[arg(long, conflicts_with = "outside")]
    inside: bool,
    /// Places the camera outside of a scene without one [default: rays decide]
    #[arg(long)]
    outside: bool,
    /// Which way is up for that camera: y or z [default: the model's shape decides]
    #[arg(long, value_name = "AXIS", value_parser = parse_up)]
    up: Option<Up>,
    /// Overrides one key of the scene file, as in --set quality.cache_points=8000; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Allows a scene or film to read files outside of its folder. Only for files that you trust
    #[arg(long)]
    allow_outside: bool,
    /// Makes each warning about the scene's files an error: what is passed over, repaired or chosen
    #[arg(long)]
    strict: bool,
}

/// Where light paths are kept.
#[derive(Clone, Debug, Args)]
pub(super) struct CacheArgs {
    /// Folder in which light paths are stored, and reused while nothing that they depend on
    /// changes; or a file that `precompute` wrote
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Size of the folder at most, as in 500M or 8G. Files that were unused for longest are
    /// deleted [default: 4G]
    #[arg(long, value_name = "SIZE", requires = "cache", value_parser = parse_bytes)]
    cache_limit: Option<u64>,
}

impl CacheArgs {
    /// The store of light paths. `None` without `--cache`.
    pub(super) fn store(&self) -> Result<Option<Store>> {
        let Some(path) = &self.cache else { return Ok(None) };
        if path.is_file() {
            return match self.cache_limit {
                Some(_) => {
                    Err(Error::Usage("--cache-limit is for a folder, and --cache names a file".into()))
                }
                // The file would be overwritten.
                None => match misnamed(path) {
                    Some(why) => Err(Error::input(path, format!("--cache: {why}"))),
                    None => Ok(Some(Store::File(path.clone()))),
                },
            };
        }
        let limit_bytes = self.cache_limit.unwrap_or(CACHE_LIMIT);
        Ok(Some(Store::Folder(Folder { path: path.clone(), limit_bytes })))
    }

    /// The file or folder as the user named it.
    pub(super) fn path(&self) -> Option<&Path> {
        self.cache.as_deref()
    }
}

/// Where the work is done and what is said about it.
#[derive(Clone, Debug, Args)]
pub(super) struct DeviceArgs {
    /// Vulkan device: its index or part of its name, as `info` lists them
    #[arg(long, value_name = "NAME|INDEX")]
    device: Option<String>,
    /// Replaces a value that is tuned for the device, as in --tune record_lanes=8; may be repeated.
    /// `info` lists the values
    #[arg(long, value_name = "NAME=VALUE")]
    tune: Vec<TuningChange>,
    /// Turns on the Vulkan validation layers and the check for missing barriers (slow)
    #[arg(long)]
    validation: bool,
    /// Prints no progress, notes or warnings
    #[arg(long, short)]
    quiet: bool,
}

impl SceneArgs {
    /// Loads a scene without its meters: no picture needs them.
    ///
    /// # Errors
    /// As [`Scene::load`]; and, with `--strict`, the first warning.
    pub(super) fn load(&self, spec: &str) -> Result<Scene> {
        Ok(Scene { meters: Vec::new(), ..self.load_with_meters(spec)? })
    }

    /// As [`Self::load`], for commands that time frames after a light has moved.
    ///
    /// # Errors
    /// The scene has no light.
    pub(super) fn load_lit(&self, spec: &str) -> Result<Scene> {
        let scene = self.load(spec)?;
        if scene.lights.is_empty() {
            return Err(Error::Usage(format!("{spec}: is dark: without lights there is nothing to measure")));
        }
        Ok(scene)
    }

    /// As [`Self::load`], with meters.
    pub(super) fn load_with_meters(&self, spec: &str) -> Result<Scene> {
        let scene = Scene::load(spec, &self.options())?;
        match scene.warnings.first() {
            Some(first) if self.strict => {
                let count = scene.warnings.len();
                let more = if count > 1 { format!(" ({count} such warnings)") } else { String::new() };
                Err(Error::input(spec, format!("--strict: {first}{more}")))
            }
            _ => Ok(scene),
        }
    }

    /// These arguments with a preset and an image size in place of the scene's own.
    pub(super) fn or(self, preset: &str, size: [u32; 2]) -> Self {
        let preset = self.preset.or_else(|| Some(preset.to_owned()));
        Self { preset, size: self.size.or(Some(size)), ..self }
    }

    /// The requested image size, if any.
    #[cfg(feature = "window")]
    pub(super) fn size(&self) -> Option<[u32; 2]> {
        self.size
    }

    /// The scene changes that the arguments request.
    pub(super) fn options(&self) -> LoadOptions {
        let Self { preset, size, camera, inside, outside, up, set, allow_outside, strict: _ } = self.clone();
        let place = inside.then_some(Place::Inside).or(outside.then_some(Place::Outside));
        LoadOptions { set, preset, size, camera, allow_outside, place, up, memory: None }
    }

    /// These arguments as typed, each after a blank.
    pub(super) fn typed(&self) -> String {
        let size = self.size.map(|[width, height]| format!("{width}x{height}"));
        let up = self.up.map(|up| format!("{up:?}").to_lowercase());
        let once = [("preset", &self.preset), ("size", &size), ("camera", &self.camera), ("up", &up)];
        let once = once.into_iter().filter_map(|(flag, value)| value.as_ref().map(|value| (flag, value)));
        let all = once.chain(self.set.iter().map(|value| ("set", value)));
        let all = all.map(|(flag, value)| format!(" --{flag} {}", shell_word(value)));
        let switches = [
            ("inside", self.inside),
            ("outside", self.outside),
            ("allow-outside", self.allow_outside),
            ("strict", self.strict),
        ];
        let switches = switches.into_iter().filter(|(_, is_on)| *is_on);
        all.chain(switches.map(|(flag, _)| format!(" --{flag}"))).collect()
    }
}

impl DeviceArgs {
    /// Whether unrequested output is suppressed.
    #[cfg(feature = "window")]
    pub(super) fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Opens the device.
    pub(super) fn open(&self) -> Result<Arc<Context>> {
        let context = Context::new(&self.context_options())?;
        self.report_tuning(&context);
        Ok(context)
    }

    /// Warns once if the stored tuning is ignored.
    pub(super) fn report_tuning(&self, context: &Context) {
        static WARNED: Once = Once::new();
        if let Some(warning) = &context.tuned().warning {
            WARNED.call_once(|| self.warn(warning));
        }
    }

    /// The context options that the arguments request.
    pub(super) fn context_options(&self) -> ContextOptions {
        ContextOptions {
            device: self.device.clone(),
            validation: self.validation,
            hazard_check: self.validation || ContextOptions::default().hazard_check,
            statistics: false,
            stored_tuning: true,
            tuning: self.tune.clone(),
        }
    }

    /// Prints the messages of the validation layers. There are none unless the program has a fault.
    pub(super) fn report_validation(&self, context: &Context) {
        for message in context.take_validation_messages() {
            note(&format!("lightpaths: validation: {}", message.replace('\n', " ")));
        }
    }

    /// A progress bar if stderr is a terminal, else none.
    pub(super) fn progress(&self) -> Box<dyn Progress> {
        progress::for_stderr(self.quiet)
    }

    /// Prints the progress of the work to stderr.
    pub(super) fn say(&self, message: &str) {
        if !self.quiet {
            note(&format!("lightpaths: {message}"));
        }
    }

    /// Precomputes a scene with progress output, and prints its warnings.
    pub(super) fn renderer(&self, context: &Arc<Context>, scene: Scene) -> Result<Renderer> {
        self.renderer_from(None, context, scene)
    }

    /// Precomputes a scene, or reads its light paths from the store; and prints its warnings.
    pub(super) fn renderer_from(
        &self,
        store: Option<&Store>,
        context: &Arc<Context>,
        scene: Scene,
    ) -> Result<Renderer> {
        let (renderer, warnings) = self.renderer_with_warnings(store, context, scene)?;
        warnings.iter().for_each(|warning| self.warn(warning));
        Ok(renderer)
    }

    /// The same with what the precomputation before left.
    pub(super) fn renderer_keeping(
        &self,
        context: &Arc<Context>,
        scene: Scene,
        kept: &mut Kept,
    ) -> Result<Renderer> {
        let said = scene.warnings.len();
        let mut progress = self.progress();
        let renderer = Renderer::new_keeping(context, scene, kept, progress.as_mut())?;
        progress.finish();
        renderer.scene().warnings[said..].iter().for_each(|warning| self.warn(warning));
        Ok(renderer)
    }

    /// The same, without printing the warnings.
    pub(super) fn renderer_with_warnings(
        &self,
        store: Option<&Store>,
        context: &Arc<Context>,
        scene: Scene,
    ) -> Result<(Renderer, Vec<String>)> {
        let said = scene.warnings.len();
        let mut progress = self.progress();
        let renderer = match store {
            None => Renderer::new(context, scene, progress.as_mut())?,
            Some(store) => {
                let mut say = |line: &str| self.say(line);
                Renderer::cached(context, scene, store, progress.as_mut(), &mut say)?
            }
        };
        let warnings = renderer.scene().warnings[said..].to_vec();
        Ok((renderer, warnings))
    }

    /// Prints a warning to stderr that does not affect the result.
    pub(super) fn warn(&self, message: &str) {
        if !self.quiet {
            note(&format!("lightpaths: warning: {message}"));
        }
    }
}

fn parse_preset(name: &str) -> std::result::Result<String, String> {
    match Quality::preset(name) {
        Some(quality) => Ok(quality.preset.to_owned()),
        None => Err("expected draft, paper or high".to_owned()),
    }
}

fn parse_up(axis: &str) -> std::result::Result<Up, String> {
    match axis {
        "y" | "Y" => Ok(Up::Y),
        "z" | "Z" => Ok(Up::Z),
        _ => Err("expected y or z".to_owned()),
    }
}

fn parse_size(text: &str) -> std::result::Result<[u32; 2], String> {
    let sides = text.split_once(['x', 'X']).and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    match sides {
        Some(size @ [1..=SIZE_MAX, 1..=SIZE_MAX]) => Ok(size),
        Some(_) => Err(format!("each side must be 1 to {SIZE_MAX} pixels, as in 640x480")),
        None => Err("expected WIDTHxHEIGHT, as in 640x480".to_owned()),
    }
}

/// Parses a number of bytes; K, M or G multiply it by powers of 1024.
fn parse_bytes(text: &str) -> std::result::Result<u64, String> {
    let (digits, shift) = match text.as_bytes().last() {
        Some(b'k' | b'K') => (&text[..text.len() - 1], 10),
        Some(b'm' | b'M') => (&text[..text.len() - 1], 20),
        Some(b'g' | b'G') => (&text[..text.len() - 1], 30),
        _ => (text, 0),
    };
    let bytes = digits.parse::<u64>().ok().filter(|_| !digits.starts_with('+'));
    let bytes = bytes.and_then(|count| count.checked_mul(1 << shift));
    bytes.ok_or_else(|| "expected a number of bytes, as in 500M or 8G".to_owned())
}

/// The name of the device in tables and files; it marks a CPU, so that it is not taken for a GPU.
pub(super) fn device_label(context: &Context) -> String {
    format!("{}{}", context.name(), if context.is_cpu() { " (a CPU)" } else { "" })
}

/// A word quoted for a shell.
pub(super) fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
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
    fn bytes_have_units() {
        for (text, bytes) in [("0", 0), ("700", 700), ("3k", 3 << 10), ("500M", 500 << 20), ("8G", 8 << 30)] {
            assert_eq!(parse_bytes(text), Ok(bytes), "{text}");
        }
        for bad in ["", "G", "-1G", "+1G", "1.5G", "1T", "99999999999G"] {
            assert!(parse_bytes(bad).is_err(), "{bad}");
        }
    }
}
