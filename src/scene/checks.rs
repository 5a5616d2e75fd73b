//! Checks of values that a caller edits: the bounds are those of a scene file.

use std::ops::RangeInclusive;

use glam::{DVec3, Vec3};

use super::camera::FOV_Y;
use super::value::{COORDINATE, POWER};
use super::{Camera, Light, LightKind, Material};
use crate::{Error, Result};

impl Light {
    /// Whether a scene file may hold this light.
    ///
    /// # Errors
    /// The property that it may not hold, and its bounds.
    pub fn check(&self) -> Result<()> {
        let mut kind = self.kind;
        if let (Some(_), LightKind::Spot { angle, .. }) = (&self.luminaire, &mut kind) {
            // Its cone is that of the measurement.
            *angle = 1.0;
        }
        kind.check()
    }
}

impl LightKind {
    /// Whether a scene file may hold such a light.
    ///
    /// # Errors
    /// The property that it may not hold, and its bounds.
    pub fn check(&self) -> Result<()> {
        let emission = match self {
            Self::Point { .. } | Self::Spot { .. } => "intensity",
            Self::Directional { .. } => "irradiance",
            Self::Area { .. } | Self::Surface { .. } | Self::Sky { .. } => "radiance",
        };
        within(emission, self.emission(), POWER)?;
        self.position().map_or(Ok(()), |position| within("position", position, COORDINATE))?;
        match *self {
            Self::Spot { direction, angle, penumbra, .. } => {
                unit(direction)?;
                // Rounding of radians.
                number("angle", f64::from(angle.to_degrees()), 0.0099..=90.001)?;
                number("penumbra", penumbra.into(), 0.0..=1.0)
            }
            Self::Directional { direction, .. } => unit(direction),
            Self::Area { corner, edge_u, edge_v, samples, .. } => {
                number("samples", samples.into(), 1.0..=4096.0)?;
                within("corner", corner, COORDINATE)?;
                within("edge_u", edge_u, COORDINATE)?;
                within("edge_v", edge_v, COORDINATE)?;
                let [u, v] = [edge_u, edge_v].map(Vec3::as_dvec3);
                if u.cross(v).length() > 1e-6 * u.length() * v.length() {
                    return Ok(());
                }
                Err(Error::Usage("edge_v must be neither zero nor parallel to edge_u".to_owned()))
            }
            Self::Sky { turn, .. } => number("rotate", turn.into(), COORDINATE),
            Self::Point { .. } | Self::Surface { .. } => Ok(()),
        }
    }
}

impl Camera {
    /// Whether a scene file may hold this camera.
    ///
    /// # Errors
    /// The property that it may not hold, and its bounds.
    pub fn check(&self) -> Result<()> {
        within("position", self.position, COORDINATE)?;
        within("target", self.target, COORDINATE)?;
        within("up", self.up, COORDINATE)?;
        number("fov_y", self.fov_y_degrees.into(), FOV_Y)?;
        self.aim().map_or(Ok(()), |why| Err(Error::Usage(why.to_owned())))
    }

    /// The reason why the directions give no view. `None` if they do.
    fn aim(&self) -> Option<&'static str> {
        let (forward, up) = ((self.target - self.position).as_dvec3(), self.up.as_dvec3());
        if forward == DVec3::ZERO {
            return Some("target must differ from the position");
        }
        let is_parallel = forward.normalize().cross(up).length() < 1e-5 * up.length();
        (is_parallel || up == DVec3::ZERO).then_some("up must not be parallel to the viewing direction")
    }
}

impl Material {
    /// Whether a scene file may hold these reflectances.
    ///
    /// # Errors
    /// The property that it may not hold, and its bounds.
    pub fn check(&self) -> Result<()> {
        within("diffuse", self.diffuse, 0.0..=1.0)?;
        within("specular", self.specular, 0.0..=1.0)?;
        number("exponent", self.exponent.into(), 1.0..=1e6)
    }
}

fn number(what: &str, value: f64, range: RangeInclusive<f64>) -> Result<()> {
    if range.contains(&value) {
        return Ok(());
    }
    let (low, high) = range.into_inner();
    Err(Error::Usage(format!("{what} must be from {low} to {high}, found {value}")))
}

fn within(what: &str, value: Vec3, range: RangeInclusive<f64>) -> Result<()> {
    value.to_array().into_iter().try_for_each(|part| number(what, part.into(), range.clone()))
}

fn unit(direction: Vec3) -> Result<()> {
    if (direction.length() - 1.0).abs() < 1e-4 {
        return Ok(());
    }
    Err(Error::Usage(format!("direction must have length 1, found {direction}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, Scene};

    #[test]
    fn values_that_no_scene_file_may_hold_are_refused() {
        let scene = Scene::load("box", &LoadOptions::default()).unwrap();
        let lamp = scene.lights[0].kind;
        lamp.check().unwrap();
        for (kind, word) in [
            (lamp.moved_to(Vec3::new(f32::NAN, 0.0, 0.0)), "position"),
            (lamp.moved_to(Vec3::splat(1e13)), "position"),
            (lamp.with_emission(Vec3::new(1.0, -1.0, 1.0)), "intensity"),
            (LightKind::Directional { direction: Vec3::ZERO, irradiance: Vec3::ONE }, "direction"),
        ] {
            let line = kind.check().unwrap_err().to_string();
            assert!(line.contains(word), "{line}");
        }
        let camera = &scene.cameras[0];
        camera.check().unwrap();
        for camera in [
            Camera { target: camera.position, ..camera.clone() },
            Camera { up: camera.target - camera.position, ..camera.clone() },
            Camera { up: Vec3::ZERO, ..camera.clone() },
            Camera { fov_y_degrees: 180.0, ..camera.clone() },
            Camera { position: Vec3::INFINITY, ..camera.clone() },
        ] {
            assert!(camera.check().is_err(), "{camera:?}");
        }
        let material = &scene.materials[0];
        material.check().unwrap();
        for material in [
            Material { diffuse: Vec3::splat(1.5), ..material.clone() },
            Material { exponent: f32::INFINITY, ..material.clone() },
        ] {
            assert!(material.check().is_err(), "{material:?}");
        }
    }
}
