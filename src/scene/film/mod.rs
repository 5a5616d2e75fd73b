//! Films: animations of a scene. A frame depends on its time alone, so that frames can be rendered
//! in any order and on several machines.

pub mod builtin;
mod channels;
mod curve;
mod material_state;
mod read;
mod thin;
mod tracks;
mod write;

pub use material_state::MaterialState;

use super::{Camera, LightKind, LoadOptions, Scene};
use crate::{Error, Result};
use glam::{DVec3, Vec3};
use std::path::PathBuf;
use tracks::{CameraTrack, LightTrack, MaterialTrack, ModelTrack};
pub use write::{Recording, Reflectance, Snapshot};

/// A timeline of a scene.
#[derive(Clone, Debug)]
pub struct Film {
    /// File stem or built-in name; names outputs.
    pub name: String,
    /// Frames per second.
    pub fps: f64,
    /// Number of frames. Frame `i` shows the scene at the time `i / fps`.
    pub frame_count: u32,
    file: PathBuf,
    /// Offset subtracted from all positions, as for the scene.
    origin: DVec3,
    camera: CameraTrack,
    lights: Vec<LightTrack>,
    materials: Vec<MaterialTrack>,
    models: Vec<ModelTrack>,
}

/// The state of a scene's animated properties at some time.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// The first camera.
    pub camera: Camera,
    /// The animated lights: index, kind, and whether it is on.
    pub lights: Vec<(usize, LightKind, bool)>,
    /// The animated materials.
    pub materials: Vec<MaterialState>,
}

impl Film {
    /// Loads a film, by the path of its `.toml` or its built-in name, and its scene, prepared
    /// for all frames. Lights that the film adds are in the scene (a [`State`] has whether they
    /// are on), and animated materials are editable. So light paths are the same for every
    /// range of frames, as long as no model moves.
    ///
    /// # Errors
    /// As [`Scene::load`]; [`Error::Input`] with file, line and key for each fault in the film.
    pub fn load(spec: &str, options: &LoadOptions) -> Result<(Self, Scene)> {
        Self::load_at(spec, options, 0)
    }

    /// The same with the models where they are at frame `frame`.
    ///
    /// # Errors
    /// As [`Self::load`], and a model of that frame is not valid.
    pub fn load_at(spec: &str, options: &LoadOptions, frame: u32) -> Result<(Self, Scene)> {
        let (film, scene) = read::load(spec, options, frame)?;
        film.check(&scene)?;
        Ok((film, scene))
    }

    /// Whether frames differ in where models are. Then light paths are traced for each place.
    pub fn moves_models(&self) -> bool {
        !self.models.is_empty()
    }

    /// The first of the frames before `frame` and itself in which all models are where they are at
    /// `frame`, without a movement between.
    pub fn first_with_models_of(&self, frame: u32) -> u32 {
        if !self.moves_models() {
            return 0;
        }
        let models = self.model_changes(frame);
        (0..frame).rev().find(|earlier| self.model_changes(*earlier) != models).map_or(0, |other| other + 1)
    }

    /// What the models of frame `frame` change in the scene file, as `KEY=VALUE`.
    fn model_changes(&self, frame: u32) -> Vec<String> {
        let time = f64::from(frame) / self.fps;
        self.models.iter().flat_map(|track| track.changes_at(time)).collect()
    }

    /// The state of frame `frame`, a function of that number alone.
    pub fn state(&self, frame: u32) -> State {
        let time = f64::from(frame) / self.fps;
        let lights = self.lights.iter().map(|track| {
            let (kind, is_on) = track.at(time, self.origin);
            (track.light, kind, is_on)
        });
        State {
            camera: self.camera.at(time, self.origin),
            lights: lights.collect(),
            materials: self.materials.iter().map(|track| track.at(time)).collect(),
        }
    }

    /// Whether all frames show the same view.
    pub fn camera_stands(&self) -> bool {
        let camera = |frame: u32| self.camera.at(f64::from(frame) / self.fps, self.origin);
        (1..self.frame_count).all(|frame| camera(frame) == camera(0))
    }

    /// Refuses invalid values between keys.
    fn check(&self, scene: &Scene) -> Result<()> {
        for frame in 0..self.frame_count {
            let time = f64::from(frame) / self.fps;
            let camera = self.camera.at(time, self.origin);
            let fault = |what: String| {
                Err(Error::input(
                    &self.file,
                    format!("frame {frame} ({time:.3} s): {what}; add or move keys"),
                ))
            };
            let forward = (camera.target - camera.position).as_dvec3().normalize_or_zero();
            if forward == DVec3::ZERO {
                return fault("the camera stands at its target".to_owned());
            }
            if forward.cross(camera.up.as_dvec3()).length() < 1e-5 {
                return fault("the camera looks straight up or down".to_owned());
            }
            let areas = self.lights.iter().filter(|track| matches!(track.base, LightKind::Area { .. }));
            for track in areas {
                if let (LightKind::Area { edge_u, edge_v, .. }, _) = track.at(time, self.origin) {
                    let [u, v] = [edge_u, edge_v].map(Vec3::as_dvec3);
                    if u.cross(v).length() <= 1e-6 * u.length() * v.length() {
                        let name = &scene.lights[track.light].name;
                        return fault(format!("the edges of light `{name}` are zero or parallel"));
                    }
                }
            }
        }
        Ok(())
    }
}
