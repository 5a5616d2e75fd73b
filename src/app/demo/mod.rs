//! `lightpaths demo`: the window.

mod actions;
mod cells;
mod document;
mod files;
mod films;
mod gizmos;
mod host_picture;
mod navigate;
mod overlays;
mod panels;
mod rebase;
mod reference;
mod session;
mod shortcuts;
mod stage;
mod ui_state;
mod viewport;
mod watch;
mod window;
mod window_state;

use clap::Args;
use winit::event_loop::EventLoop;

use super::args::{CacheArgs, DeviceArgs, SceneArgs};
use crate::error::{Error, Result};
use crate::scene::LoadOptions;
use session::Source;
use watch::Watch;
use window::{App, WakeUp, keep_edits};

/// Open the window: move lights, edit materials, walk, and see the light follow
///
/// Direct light is shown at once, all light when the light paths are traced. F1 lists the keys.
#[derive(Debug, Args)]
pub(super) struct Demo {
    /// A .toml scene file, an .obj model, or a built-in scene
    #[arg(default_value = "box")]
    scene: String,
    /// Fills the screen
    #[arg(long)]
    fullscreen: bool,
    /// Presents frames as soon as they are done
    #[arg(long)]
    no_vsync: bool,
    #[command(flatten, next_help_heading = "Kept light paths")]
    cache_args: CacheArgs,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

impl Demo {
    pub(super) fn run(self) -> Result<()> {
        let store = self.cache_args.store()?;
        let watch = Watch::new(&self.scene);
        let scene = self.scene_args.load(&self.scene)?;
        let events =
            EventLoop::<WakeUp>::with_user_event().build().map_err(|error| no_display(&error.to_string()))?;
        // The window sets the size of pictures.
        let options = LoadOptions { size: None, ..self.scene_args.options() };
        let source = Source { spec: self.scene.clone(), options, store };
        keep_edits(events.create_proxy());
        let mut app = App::new(self, (source, scene, watch), events.create_proxy());
        let ended = events.run_app(&mut app);
        app.into_result()?;
        ended.map_err(|error| no_display(&error.to_string()))
    }
}

/// The reason why no window opens, without the source position in the library.
fn no_display(said: &str) -> Error {
    let after_place = said.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": "));
    Error::NoDisplay(after_place.map_or(said, |(_, why)| why).trim_end_matches('.').to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_users_read_names_no_line_of_a_library() {
        let line = no_display("os error at a/b-1.0/src/mod.rs:765: DISPLAY is not set.").to_string();
        assert!(line.contains("no window can be opened: DISPLAY is not set; `lightpaths render`"), "{line}");
        assert!(no_display("exit code 3").to_string().contains("opened: exit code 3;"));
    }
}
