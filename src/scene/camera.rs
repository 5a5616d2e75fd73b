//! A pinhole camera.

use glam::Vec3;

/// Looks from `position` at `target`; recentred world space, metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Name in the scene file; `"camera"` where the file gives none.
    pub name: String,
    /// Centre of projection.
    pub position: Vec3,
    /// Point in the middle of the image; differs from `position`.
    pub target: Vec3,
    /// Which way is up; not parallel to the viewing direction.
    pub up: Vec3,
    /// Vertical field of view, degrees, in 0..180 exclusive.
    pub fov_y_degrees: f32,
    /// Width and height in pixels, both ≥ 1.
    pub size: [u32; 2],
}

impl Camera {
    /// Right, up and forward unit vectors: image x runs along right, image y against up.
    pub fn frame(&self) -> [Vec3; 3] {
        let forward = (self.target - self.position).normalize();
        let right = forward.cross(self.up).normalize();
        [right, right.cross(forward), forward]
    }
}
