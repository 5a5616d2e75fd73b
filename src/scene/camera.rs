//! A pinhole camera.

use glam::{DVec3, Vec3};

use super::keys;
use super::value::{COORDINATE, Section};
use crate::Result;

/// Pixels along either axis of an image.
pub const SIZE: std::ops::RangeInclusive<u32> = 1..=16384;
/// Vertical fields of view, degrees.
pub(super) const FOV_Y: std::ops::RangeInclusive<f64> = 0.01..=179.0;

/// Default vertical field of view, degrees.
pub(super) const FOV_Y_DEFAULT: f64 = 40.0;

/// A pinhole camera at `position` that looks at `target`; recentred world space, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the scene file; `"camera"` where the file gives none.
    pub name: String,
    /// Centre of projection.
    pub position: Vec3,
    /// Point in the middle of the image; differs from `position`.
    pub target: Vec3,
    /// Up direction; not parallel to the viewing direction.
    pub up: Vec3,
    /// Vertical field of view, degrees, in 0..180 exclusive.
    pub fov_y_degrees: f32,
    /// Width and height in pixels, both ≥ 1.
    pub size: [u32; 2],
}

impl Camera {
    /// Unit vectors right, up and forward: image x runs along right, image y against up.
    pub fn frame(&self) -> [Vec3; 3] {
        let forward = (self.target - self.position).normalize();
        let right = forward.cross(self.up).normalize();
        [right, right.cross(forward), forward]
    }

    /// Reads a camera in world space and moves it to the scene recentred on `origin`.
    pub(super) fn read(section: &Section, origin: DVec3) -> Result<Self> {
        section.only(&keys::names("camera", None))?;
        let point = |key| {
            let point = section.need(section.vector(key, COORDINATE)?, key, "three numbers, metres")?;
            Ok((point - origin).as_vec3())
        };
        let camera = Self {
            name: section.text("name")?.unwrap_or("camera").to_owned(),
            position: point("position")?,
            target: point("target")?,
            up: section.direction("up")?.unwrap_or(DVec3::Y).as_vec3(),
            fov_y_degrees: section.number("fov_y", FOV_Y)?.unwrap_or(FOV_Y_DEFAULT) as f32,
            size: section.size("size", SIZE)?.unwrap_or([512, 512]),
        };
        let forward = (camera.target - camera.position).as_dvec3();
        if forward == DVec3::ZERO {
            return Err(section.fault_at("target", "must differ from the position"));
        }
        if forward.normalize().cross(camera.up.as_dvec3()).length() < 1e-5 {
            return Err(section.fault_at("up", "must not be parallel to the viewing direction"));
        }
        Ok(camera)
    }
}
