//! The reflectance of an animated material.

use glam::Vec3;

/// The reflectance of a material at some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialState {
    /// Index into the scene's materials.
    pub material: usize,
    /// Diffuse albedo, which multiplies the material's image.
    pub diffuse: Vec3,
    /// Specular albedo of the lobe.
    pub specular: Vec3,
    /// Exponent of the Phong lobe.
    pub exponent: f32,
}
