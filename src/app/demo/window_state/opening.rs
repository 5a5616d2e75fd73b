//! Another scene in the same window.

use super::WindowState;
use crate::app::demo::autosave::Autosave;
use crate::app::demo::session::{Session, Source};
use crate::app::demo::viewport::Viewport;
use crate::app::demo::watch::Watch;
use crate::app::exposure::Exposure;
use crate::error::Result;
use crate::scene::{LoadOptions, Scene};

impl WindowState {
    /// Opens the scene that the user has chosen. Asks if edits of this one are unsaved.
    pub(super) fn open_or_ask(&mut self) -> Result<()> {
        if let Some(player) = self.player.take() {
            // The changes that a film makes are no edits.
            player.end(&mut self.session);
            self.ui_state.is_playing = false;
        }
        if self.session.has_unsaved_edits() {
            self.ui_state.asks_to_open = true;
            self.window.request_redraw();
            return Ok(());
        }
        self.open()
    }

    /// Opens that scene. Edits of this one are lost. If it cannot be loaded, this one stays.
    pub(super) fn open(&mut self) -> Result<()> {
        self.ui_state.asks_to_open = false;
        let Some(spec) = self.ui_state.to_open.take() else { return Ok(()) };
        let own = &self.session.source.options;
        // A camera and changes by name belong to the scene of the command line.
        let options = LoadOptions {
            preset: own.preset.clone(),
            allow_outside: own.allow_outside,
            ..LoadOptions::default()
        };
        let watch = Watch::new(&spec);
        let scene = match Scene::load(&spec, &options) {
            Ok(scene) => Scene { meters: Vec::new(), ..scene },
            Err(error) => {
                self.tell_alarm(&error);
                return Ok(());
            }
        };
        if self.recorder.is_some() {
            self.record();
        }
        let exposure = Exposure::of_scene(&spec, &scene.picture);
        let (store, display) = (self.session.source.store.clone(), scene.picture.over(self.session.display));
        self.show_scene(Source { spec, options, store, exposure, display }, scene, watch)
    }

    fn show_scene(&mut self, source: Source, scene: Scene, watch: Watch) -> Result<()> {
        self.restart_reference();
        self.session.end_frames(0)?;
        let (spec, name) = (source.spec.clone(), scene.name.clone());
        let mut session = Session::new(&self.context, source, scene, watch, self.wake.clone())?;
        session.camera.size = self.session.camera.size;
        // Pictures of both scenes have different versions.
        (session.version, session.generation) = (self.session.version, self.session.generation);
        self.session = session;
        self.autosave.end();
        self.autosave = Autosave::new(&spec);
        self.ui_state = self.ui_state.of_scene(&name);
        self.ui_state.asks_to_restore = self.autosave.found().is_some();
        self.ui_state.recent.add(&spec);
        self.viewport = Viewport::new();
        (self.over.of, self.beside.of, self.zebra.of) = (None, None, None);
        (self.recorded, self.plays_when_ready, self.was_ready) = (None, false, false);
        self.window.set_title(&format!("{name} – lightpaths"));
        self.is_marked = false;
        self.tell(format!("opened {spec}"));
        Ok(())
    }
}
