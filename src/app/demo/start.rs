//! How the window starts: arguments, scene, and events from outside.

use std::path::PathBuf;
use std::sync::mpsc::SyncSender;

use clap::Args;

use super::session::Source;
use super::watch::Watch;
use crate::app::args::{CacheArgs, DeviceArgs, SceneArgs};
use crate::app::display_args::DisplayArgs;
use crate::app::exposure::Exposure;
use crate::error::Error;
use crate::scene::Scene;

/// Open the window: move lights, edit materials, walk, and see the light follow
///
/// Direct light is shown at once, then all light as a draft, then with the scene's own settings. F1
/// lists the keys.
#[derive(Debug, Args)]
pub(in crate::app) struct Demo {
    /// A .toml scene file, a .glb, .gltf, .obj, .ply or .stl model, or a built-in scene
    #[arg(default_value = "box")]
    pub(super) scene: String,
    /// Brightens the picture by this many stops; auto: its mean becomes middle grey once all light
    /// is there [default: 0; for a model alone: auto]
    #[arg(long, value_name = "STOPS|auto", allow_negative_numbers = true, value_parser = Exposure::parse)]
    pub(super) exposure: Option<Exposure>,
    #[command(flatten)]
    pub(super) display_args: DisplayArgs,
    /// Fills the screen
    #[arg(long)]
    pub(super) fullscreen: bool,
    /// Presents frames as soon as they are done
    #[arg(long)]
    pub(super) no_vsync: bool,
    /// Folder of shader sources; shaders are reloaded when it changes. Only in programs built with
    /// `--features shaderc` [default: glsl/ of the source tree]
    #[arg(long, value_name = "DIR")]
    pub(super) shaders: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Kept light paths")]
    pub(super) cache_args: CacheArgs,
    #[command(flatten, next_help_heading = "Scene")]
    pub(super) scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    pub(super) device_args: DeviceArgs,
}

/// A scene, its source, and the state of its files before they were read.
pub(super) type Start = (Source, Scene, Watch);

/// Events from outside the window.
#[derive(Debug)]
pub(super) enum WakeUp {
    /// The worker has a new state to show.
    Shows,
    /// A signal ends the program after an answer.
    Ends(SyncSender<()>),
}

/// The reason why no window opens, without the source position in the library.
pub(super) fn no_display(said: &str) -> Error {
    let after_place = said.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    Error::NoDisplay(after_place.map_or(said, |(_, why)| why).trim_end_matches('.').to_owned())
}
