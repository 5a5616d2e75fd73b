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
use tracks::{CameraTrack, LightTrack, MaterialTrack};
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
    /// range of frames.
    ///
    /// # Errors
    /// As [`Scene::load`]; [`Error::Input`] with file, line and key for each fault in the film.
    pub fn load(spec: &str, options: &LoadOptions) -> Result<(Self, Scene)> {
        let (film, scene) = read::load(spec, options)?;
        film.check(&scene)?;
        Ok((film, scene))
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
