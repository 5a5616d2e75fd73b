//! Films in the window: playback on the open scene, and recording of the user's edits.

use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::{DVec3, Vec3};

use super::document::{Document, MaterialEdit};
use super::session::Session;
use crate::app::output::OutputFile;
use crate::error::{Error, Result};
use crate::scene::film::{Film, Recording, Reflectance, Snapshot, builtin};
use crate::scene::{Camera, Light, LoadOptions, Scene};

/// Frames a second of a recorded film.
const FPS: f64 = 24.0;

/// A film during playback.
pub(super) struct Player {
    film: Film,
    /// The lights of the film's scene, in its order.
    lights: Vec<Light>,
    materials: Vec<String>,
    start: Instant,
    /// Restored when the film ends.
    before: (Document, Camera),
}

impl Player {
    /// Starts playback of the given file, else of the built-in film of the scene's name. Returns a
    /// scene as well if it must be prepared first: the film makes a material glossy that is diffuse
    /// in the open scene.
    pub(super) fn begin(session: &Session, recorded: Option<&Path>) -> Result<(Self, Option<Scene>)> {
        let spec = match recorded {
            Some(path) => path.display().to_string(),
            None if builtin::names().contains(&session.source.spec.as_str()) => session.source.spec.clone(),
            None => {
                let none = "there is no film of this scene: record one (Ctrl+R)";
                return Err(Error::Usage(none.to_owned()));
            }
        };
        // The user recorded this file here, and the open scene is its scene.
        let allow_outside = session.source.options.allow_outside || recorded.is_some();
        let options = LoadOptions { allow_outside, ..session.source.options.clone() };
        let (film, scene) = Film::load(&spec, &options)?;
        if film.moves_models() {
            let message =
                "the film moves models, which the window does not play: `lightpaths film` renders it";
            return Err(Error::Usage(message.to_owned()));
        }
        let player = Self {
            film,
            lights: scene.lights.clone(),
            materials: scene.materials.iter().map(|material| material.name.clone()).collect(),
            start: Instant::now(),
            before: (session.document.clone(), session.camera.clone()),
        };
        let mut open = session.scene.clone();
        let mut must_prepare = false;
        for (film, open) in scene.materials.iter().zip(&mut open.materials) {
            if film.may_be_glossy() && !open.may_be_glossy() {
                (open.editable, must_prepare) = (true, true);
            }
        }
        Ok((player, must_prepare.then_some(open)))
    }

    /// Applies the film's current frame to the scene. False if the film has ended.
    pub(super) fn advance(&self, session: &mut Session) -> bool {
        let frame = (self.start.elapsed().as_secs_f64() * self.film.fps) as u32;
        if frame >= self.film.frame_count {
            return false;
        }
        let state = self.film.state(frame);
        session.camera = Camera { size: session.camera.size, ..state.camera };
        for (index, kind, is_on) in state.lights {
            let light = Light { kind, is_on, ..self.lights[index].clone() };
            let lights = &mut session.document.lights;
            match lights.iter().position(|entry| entry.light.name == light.name) {
                Some(place) => lights[place].light = light,
                // A light that the film adds; it appears when it is switched on.
                None if is_on => drop(session.document.add(light)),
                None => (),
            }
        }
        for state in state.materials {
            let name = &self.materials[state.material];
            let named = session.scene.materials.iter().zip(&mut session.document.materials);
            for (_, edit) in named.filter(|(material, _)| material.name == *name) {
                let (diffuse, specular, exponent) = (state.diffuse, state.specular, state.exponent);
                *edit = MaterialEdit { diffuse, specular, exponent, ..*edit };
            }
        }
        true
    }

    /// Restores the scene from before playback.
    pub(super) fn end(self, session: &mut Session) {
        let size = session.camera.size;
        (session.document, session.camera) = self.before;
        session.camera.size = size;
    }
}

/// Records the user's edits as a film.
pub(super) struct FilmRecorder {
    recording: Recording,
    /// Of the scene at the start; models that move may shift it.
    origin: DVec3,
    start: Instant,
    version: u64,
}

impl FilmRecorder {
    pub(super) fn begin(session: &Session) -> Self {
        // The film names the scene file, which lacks the session's edits of models.
        let models = session.file_models().to_vec();
        let first = Snapshot { models, ..Snapshot::from_scene(&session.scene) };
        let recording = Recording::new(&session.source.spec, &first, session.scene.origin, FPS);
        let origin = session.scene.origin;
        let mut recorder = Self { recording, origin, start: Instant::now(), version: u64::MAX };
        recorder.note(session);
        recorder
    }

    /// Adds a key frame if the picture has changed.
    pub(super) fn note(&mut self, session: &Session) {
        if self.version == session.version {
            return;
        }
        let is_first = self.version == u64::MAX;
        self.version = session.version;
        let seconds = if is_first { 0.0 } else { self.start.elapsed().as_secs_f64() };
        self.recording.add(seconds, &snapshot(session, self.origin));
    }

    /// Saves the film beside the scene; returns its path.
    pub(super) fn end(mut self, session: &Session, scene_to: &str) -> Result<PathBuf> {
        self.recording.add(self.start.elapsed().as_secs_f64(), &snapshot(session, self.origin));
        let path = PathBuf::from(format!("{}-film.toml", Path::new(scene_to).with_extension("").display()));
        let output = OutputFile::check(&path)?;
        let text = self.recording.finish(&path)?;
        output.write(|out| std::io::Write::write_all(out, text.as_bytes()))?;
        Ok(path)
    }
}

/// The state of the session, recentred about `origin`.
fn snapshot(session: &Session, origin: DVec3) -> Snapshot {
    let shift = (session.scene.origin - origin).as_vec3();
    let camera = Camera {
        position: session.camera.position + shift,
        target: session.camera.target + shift,
        ..session.camera.clone()
    };
    let moved = |light: &Light| match light.kind.position() {
        Some(place) if shift != Vec3::ZERO => {
            Light { kind: light.kind.moved_to(place + shift), ..light.clone() }
        }
        _ => light.clone(),
    };
    let materials = session.scene.materials.iter().zip(&session.document.materials);
    let materials = materials.map(|(material, edit)| Reflectance {
        name: material.name.clone(),
        diffuse: edit.diffuse,
        specular: edit.specular,
        exponent: edit.exponent,
    });
    Snapshot {
        camera,
        lights: session.document.lights.iter().map(|entry| moved(&entry.light)).collect(),
        materials: materials.collect(),
        models: session.document.parts.models.clone(),
    }
}
