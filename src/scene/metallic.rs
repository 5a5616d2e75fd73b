//! Metalness and roughness, as glTF defines them, as a diffuse albedo and a Phong lobe.

use glam::Vec3;

use super::material::Material;

/// Reflectance of a dielectric at normal incidence, as glTF defines it.
const DIELECTRIC: f32 = 0.04;

/// Lobes of smaller exponents count as diffuse. That of a dielectric is weak, and may be sharper.
const DIFFUSE_METAL: f32 = 2.0;
const DIFFUSE_DIELECTRIC: f32 = 10.0;

/// Largest exponent; sharper lobes are mirrors.
const SHARPEST: f32 = 10_000.0;

/// A Phong lobe reflects less at grazing angles than at normal incidence, by this factor in the
/// mean over 0°, 30° and 60°. Its albedo is raised by the inverse.
const PHONG_MEAN: f32 = 0.87;

/// A surface of the metallic-roughness model.
pub(super) struct Metallic {
    /// Base colour without its image.
    pub(super) base: Vec3,
    /// Mean of its image. One without an image.
    pub(super) image: Vec3,
    /// Metalness and roughness, 0..=1.
    pub(super) metal: f32,
    pub(super) roughness: f32,
}

impl Metallic {
    /// Sets the reflectance of a material, which may have the image.
    pub(super) fn apply(&self, material: &mut Material) {
        let Self { base, image, metal, roughness } = *self;
        let colour = base * image;
        let exponent = exponent(roughness);
        let of_dielectric = Vec3::splat((1.0 - metal) * DIELECTRIC);
        (material.specular, material.exponent) = (Vec3::ZERO, exponent);
        material.diffuse = (1.0 - metal) * (1.0 - DIELECTRIC) * base;
        // A broad lobe joins the diffuse albedo, which the image multiplies.
        let of_base = |albedo: Vec3| albedo * base / colour.max(Vec3::splat(1e-4));
        if exponent < DIFFUSE_METAL {
            material.diffuse += metal * metal_albedo(roughness) * base;
        } else {
            material.specular += metal * (metal_albedo(roughness) / PHONG_MEAN).min(1.0) * colour;
        }
        if exponent < DIFFUSE_DIELECTRIC {
            material.diffuse = (material.diffuse + of_base(of_dielectric)).min(Vec3::ONE);
        } else {
            material.specular += of_dielectric;
        }
    }
}

/// The exponent whose lobe is as wide as that of GGX: with α = roughness², the half vector's
/// Blinn exponent is 2/α² − 2 [Walter 2007], and about the mirror direction a lobe is twice as
/// wide, which divides the exponent by four.
fn exponent(roughness: f32) -> f32 {
    let alpha = (roughness * roughness).max(1e-4);
    (0.25 * (2.0 / (alpha * alpha) - 2.0)).clamp(1.0, SHARPEST)
}

/// Directional albedo of GGX facets that reflect once, as glTF defines its BRDF. A line through the
/// means over 0°, 30° and 60°, within 0.02 for roughnesses above 0.5.
fn metal_albedo(roughness: f32) -> f32 {
    (1.49 - 1.14 * roughness).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_are_between_diffuse_and_mirror() {
        assert_eq!(exponent(1.0), 1.0);
        assert_eq!(exponent(0.0), SHARPEST);
        // α = 1/4.
        assert!((exponent(0.5) - 7.5).abs() < 1e-5);
    }
}
