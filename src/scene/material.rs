//! Surface reflectance: Lambert plus an energy-normalised modified Phong lobe.

use glam::Vec3;

/// BRDF `diffuse/π + specular·(exponent+2)/(2π)·cosⁿα`, linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the MTL or scene file.
    pub name: String,
    /// Diffuse albedo ρ_d, each channel in 0..=1.
    pub diffuse: Vec3,
    /// Specular albedo ρ_s; ρ_d + ρ_s ≤ 1 in each channel.
    pub specular: Vec3,
    /// Phong exponent n ≥ 1; meaningless where specular is zero.
    pub exponent: f32,
    /// Light paths over it are cosine sampled, so that it may change its reflectance at run time.
    pub editable: bool,
}
