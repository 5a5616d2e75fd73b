//! Films in the window: played on the scene that is open, recorded from what is done with it.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::document::{Document, MaterialEdit};
use super::session::Session;
use crate::app::output::OutputFile;
use crate::error::{Error, Result};
use crate::scene::film::{Film, Recording, Reflectance, Snapshot, builtin};
use crate::scene::{Camera, Light, LoadOptions, Scene};

/// Frames a second of a recorded film.
const FPS: f64 = 24.0;

/// A film that plays.
pub(super) struct Player {
    film: Film,
    /// Of the film's scene, in its order.
    lights: Vec<Light>,
    materials: Vec<String>,
    start: Instant,
    /// What was there before, and comes back.
    before: (Document, Camera),
}

impl Player {
    /// Begins to play: the file if there is one, else the built-in film of the scene's name. With
    /// a scene, that must be prepared first: the film makes something glossy that the open one
    /// knows as diffuse.
    pub(super) fn begin(session: &Session, recorded: Option<&Path>) -> Result<(Self, Option<Scene>)> {
        let spec = match recorded {
            Some(path) => path.display().to_string(),
            None if builtin::names().contains(&session.source.spec.as_str()) => session.source.spec.clone(),
            None => {
                let none = "there is no film of this scene: record one (Ctrl+R)";
                return Err(Error::Usage(none.to_owned()));
            }
        };
        // The user has recorded it here, and its scene is the one that is open.
        let allow_outside = session.source.options.allow_outside || recorded.is_some();
        let options = LoadOptions { allow_outside, ..session.source.options.clone() };
        let (film, scene) = Film::load(&spec, &options)?;
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

    /// Brings the scene to where the film is now. False where it has ended.
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
                // One that the film adds, from when it is on.
                None if is_on => drop(session.document.add(light)),
                None => (),
            }
        }
        for state in state.materials {
            let name = &self.materials[state.material];
            let named = session.scene.materials.iter().zip(&mut session.document.materials);
            for (_, edit) in named.filter(|(material, _)| material.name == *name) {
                let (diffuse, specular, exponent) = (state.diffuse, state.specular, state.exponent);
                *edit = MaterialEdit { diffuse, specular, exponent };
            }
        }
        true
    }

    /// The scene as it was before the film began.
    pub(super) fn end(self, session: &mut Session) {
        let size = session.camera.size;
        (session.document, session.camera) = self.before;
        session.camera.size = size;
    }
}

/// What is done, as it is done.
pub(super) struct Recorder {
    recording: Recording,
    start: Instant,
    version: u64,
}

impl Recorder {
    pub(super) fn begin(session: &Session) -> Self {
        let first = Snapshot::of(&session.scene);
        let recording = Recording::new(&session.source.spec, &first, session.scene.origin, FPS);
        let mut recorder = Self { recording, start: Instant::now(), version: u64::MAX };
        recorder.note(session);
        recorder
    }

    /// Takes down how things are, where there is another picture.
    pub(super) fn note(&mut self, session: &Session) {
        if self.version == session.version {
            return;
        }
        let is_first = self.version == u64::MAX;
        self.version = session.version;
        let seconds = if is_first { 0.0 } else { self.start.elapsed().as_secs_f64() };
        self.recording.add(seconds, &snapshot(session));
    }

    /// Saves the film beside the scene; returns where.
    pub(super) fn end(mut self, session: &Session, scene_to: &str) -> Result<PathBuf> {
        self.recording.add(self.start.elapsed().as_secs_f64(), &snapshot(session));
        let path = PathBuf::from(format!("{}-film.toml", Path::new(scene_to).with_extension("").display()));
        let output = OutputFile::check(&path)?;
        let text = self.recording.finish(&path)?;
        output.write(|out| std::io::Write::write_all(out, text.as_bytes()))?;
        Ok(path)
    }
}

fn snapshot(session: &Session) -> Snapshot {
    let materials = session.scene.materials.iter().zip(&session.document.materials);
    let materials = materials.map(|(material, edit)| Reflectance {
        name: material.name.clone(),
        diffuse: edit.diffuse,
        specular: edit.specular,
        exponent: edit.exponent,
    });
    Snapshot {
        camera: session.camera.clone(),
        lights: session.document.lights.iter().map(|entry| entry.light.clone()).collect(),
        materials: materials.collect(),
    }
}
