//! `lightpaths demo`: the window.

mod actions;
mod autosave;
mod canvas;
mod cells;
mod choice;
mod coarse;
mod contact_sheet;
mod dialogs;
mod differences;
mod dimming;
mod document;
mod files;
mod films;
mod gizmos;
mod host_picture;
mod images;
mod levels;
mod light_edit;
mod light_map;
mod meter_marks;
mod meters;
mod mixer;
mod model_gizmo;
mod navigate;
mod overlays;
mod painting;
mod panels;
mod placing;
mod pointer;
mod rebase;
mod recent;
mod reference;
mod session;
#[cfg(test)]
mod session_tests;
mod shader_sources;
mod shortcuts;
mod snapshots;
mod stage;
mod start;
mod ui_state;
mod view_request;
mod viewport;
mod watch;
mod window;
mod window_state;

use winit::event_loop::EventLoop;

use crate::app::exposure::Exposure;
use crate::error::Result;
use crate::scene::LoadOptions;
use session::Source;
use shader_sources::ShaderSources;
use start::{WakeUp, no_display};
use watch::Watch;
use window::{App, keep_edits};

pub(super) use start::Demo;

impl Demo {
    pub(super) fn run(self) -> Result<()> {
        let store = self.cache_args.store()?;
        let shaders = ShaderSources::new(self.shaders.as_deref())?;
        let watch = Watch::new(&self.scene);
        let scene = self.scene_args.load_with_meters(&self.scene)?;
        let events =
            EventLoop::<WakeUp>::with_user_event().build().map_err(|error| no_display(&error.to_string()))?;
        // The window sets the size of pictures.
        let options = LoadOptions { size: None, ..self.scene_args.options() };
        let exposure = self.exposure.unwrap_or_else(|| Exposure::of_scene(&self.scene, &scene.picture));
        let display = self.display_args.transform(0.0, &scene.picture);
        let source = Source { spec: self.scene.clone(), options, store, exposure, display };
        keep_edits(events.create_proxy());
        let mut app = App::new(self, (source, scene, watch), shaders, events.create_proxy());
        let ended = events.run_app(&mut app);
        app.into_result()?;
        ended.map_err(|error| no_display(&error.to_string()))
    }
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
