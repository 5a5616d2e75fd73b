//! Surface reflectance: Lambert plus an energy-normalised modified Phong lobe.

use glam::Vec3;

use super::cutouts::Coverage;
use super::keys;
use super::texture::Texture;
use super::value::{POWER, Section, unknown};
use crate::Result;

/// Default diffuse albedo of a model.
pub(super) const NEUTRAL: Vec3 = Vec3::splat(0.7);

/// Largest albedo of a material, per texel and channel. A path between surfaces of albedo ρ has
/// 1/(1 − ρ) vertices in the mean, and does not end at ρ = 1. `docs/decisions/` has the cost
/// of each bound.
pub const MAX_ALBEDO: f32 = 0.99;

/// BRDF `diffuse/π + specular·(exponent+2)/(2π)·cosⁿα`, linear Rec.709.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Name in the MTL or scene file.
    pub name: String,
    /// Diffuse albedo ρ_d, each channel in 0..=1.
    pub diffuse: Vec3,
    /// An image that multiplies `diffuse`, per texel.
    pub texture: Option<Texture>,
    /// Specular albedo ρ_s; ρ_d + ρ_s ≤ 1 in each channel.
    pub specular: Vec3,
    /// Phong exponent n ≥ 1; meaningless where specular is zero.
    pub exponent: f32,
    /// Light paths over it are cosine sampled, so that its reflectance may change at run time.
    pub editable: bool,
    /// Emitted radiance, W/m²/sr.
    pub emission: Vec3,
    /// Sides that emit. `None` before loading has chosen them.
    pub emitting_sides: Option<Sides>,
}

/// Sides of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The side from which the corners run counter-clockwise.
    Front,
    /// The other side.
    Back,
    /// The front and the back.
    Both,
}

impl Sides {
    fn read(section: &Section) -> Result<Option<Self>> {
        const WORDS: [&str; 3] = ["front", "back", "both"];
        let Some(word) = section.text("emitting_sides")? else { return Ok(None) };
        match WORDS.iter().position(|known| *known == word) {
            Some(index) => Ok(Some([Self::Front, Self::Back, Self::Both][index])),
            None => Err(section.fault_at("emitting_sides", unknown("side", &WORDS, word))),
        }
    }
}

impl Material {
    pub(super) fn neutral(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            diffuse: NEUTRAL,
            texture: None,
            specular: Vec3::ZERO,
            exponent: 1.0,
            editable: false,
            emission: Vec3::ZERO,
            emitting_sides: None,
        }
    }

    /// Whether the material has a Phong lobe or may get one at run time.
    pub fn may_be_glossy(&self) -> bool {
        self.editable || self.specular != Vec3::ZERO
    }

    /// Largest fraction, over the channels, of the reflected light that the Phong
    /// lobe reflects; 0..=1.
    pub fn gloss_fraction(&self) -> f32 {
        (self.specular / (self.diffuse + self.specular).max(Vec3::splat(1e-6))).max_element()
    }

    /// Dims the highlights of a material that would reflect more than it receives. Returns
    /// whether it changed.
    ///
    /// The diffuse albedo is kept up to 1. All channels of the specular albedo are scaled alike,
    /// which keeps its hue, until no channel reflects more than [`MAX_ALBEDO`]. Exporters write
    /// such materials by default.
    pub fn conserve_energy(&mut self) -> bool {
        if (self.diffuse + self.specular).max_element() <= 1.0 {
            return false;
        }
        let most = MAX_ALBEDO * (1.0 - 2.0 * f32::EPSILON);
        let brightest = self.diffuse.max_element();
        if brightest > 1.0 {
            self.diffuse *= most / brightest;
        }
        let left = (Vec3::splat(most) - self.diffuse).max(Vec3::ZERO);
        let scales = (0..3).filter(|&channel| self.specular[channel] > 0.0);
        let scale = scales.map(|channel| left[channel] / self.specular[channel]).fold(1.0, f32::min);
        self.specular *= scale;
        true
    }

    /// Scales a material that reflects more than [`MAX_ALBEDO`] at its image's brightest texel.
    /// Returns whether it changed.
    pub fn clamp_albedo(&mut self) -> bool {
        // Tested without the image first: few materials need a pass over all texels.
        if (self.diffuse + self.specular).max_element() <= MAX_ALBEDO {
            return false;
        }
        let texel = self.texture.as_ref().map_or(Vec3::ONE, |texture| texture.image.brightest());
        let albedo = (self.diffuse * texel + self.specular).max_element();
        if albedo <= MAX_ALBEDO {
            return false;
        }
        let scale = MAX_ALBEDO * (1.0 - 2.0 * f32::EPSILON) / albedo;
        self.diffuse *= scale;
        self.specular *= scale;
        true
    }
}

/// A `[[material]]` of the scene file, which replaces properties of the model. A diffuse albedo
/// also replaces an image. A tint keeps the image and multiplies it.
pub(super) struct Override {
    /// Name of the material.
    pub(super) name: String,
    diffuse: Option<Vec3>,
    /// White beside an image that the section states.
    tint: Option<Vec3>,
    specular: Option<Vec3>,
    exponent: Option<f32>,
    editable: Option<bool>,
    emission: Option<Vec3>,
    emitting_sides: Option<Sides>,
    hidden: Option<bool>,
    thin: Option<bool>,
    opacity: Option<f32>,
}

impl Override {
    pub(super) fn read(section: &Section) -> Result<Self> {
        section.only(&keys::names("material", None))?;
        if section.get("diffuse").is_some() && section.get("tint").is_some() {
            return Err(section.fault_at(
                "tint",
                "belongs to the model's image, which `diffuse` replaces: state one of them",
            ));
        }
        let image = section.text("image")?;
        if image.is_some() && section.get("diffuse").is_some() {
            return Err(section.fault_at("image", "takes the place of `diffuse`: state one of them"));
        }
        if section.number("image_width", 1e-6..=1e6)?.is_some() && image.is_none() {
            return Err(section.fault_at("image_width", "belongs to an image: state `image`"));
        }
        Ok(Self {
            name: section.need(section.text("name")?, "name", "of a material of the model")?.to_owned(),
            diffuse: section.vector("diffuse", 0.0..=1.0)?.map(|albedo| albedo.as_vec3()),
            tint: section
                .vector("tint", 0.0..=1.0)?
                .map(|albedo| albedo.as_vec3())
                .or(image.map(|_| Vec3::ONE)),
            specular: section.vector("specular", 0.0..=1.0)?.map(|albedo| albedo.as_vec3()),
            exponent: section.number("exponent", 1.0..=1e6)?.map(|exponent| exponent as f32),
            editable: section.flag("editable")?,
            emission: section.vector("emission", POWER)?.map(|radiance| radiance.as_vec3()),
            emitting_sides: Sides::read(section)?,
            hidden: section.flag("hidden")?,
            thin: section.flag("thin")?,
            opacity: section.number("opacity", 0.0..=1.0)?.map(|opacity| opacity as f32),
        })
    }

    /// Whether it replaces images and vertex colours.
    pub(super) fn replaces_colour(&self) -> bool {
        self.diffuse.is_some()
    }

    pub(super) fn apply(&self, material: &mut Material, coverage: &mut Coverage) {
        match (self.hidden, &coverage) {
            (Some(true), _) => *coverage = Coverage::Hidden,
            (Some(false), Coverage::Hidden) => *coverage = Coverage::Full,
            _ => (),
        }
        if let Some(diffuse) = self.diffuse {
            (material.diffuse, material.texture) = (diffuse, None);
        }
        material.diffuse = self.tint.unwrap_or(material.diffuse);
        material.specular = self.specular.unwrap_or(material.specular);
        material.exponent = self.exponent.unwrap_or(material.exponent);
        material.editable = self.editable.unwrap_or(material.editable);
        material.emission = self.emission.unwrap_or(material.emission);
        material.emitting_sides = self.emitting_sides.or(material.emitting_sides);
        self.make_pane(material.diffuse, coverage);
    }

    /// Makes the surface a pane, or opaque, as `thin` and `opacity` state it.
    fn make_pane(&self, diffuse: Vec3, coverage: &mut Coverage) {
        let passes = 1.0 - self.opacity.unwrap_or(if self.thin == Some(true) { 0.0 } else { 1.0 });
        match (self.thin, self.opacity, &coverage) {
            (Some(true), ..) => *coverage = Coverage::Pane(passes * diffuse),
            (None, Some(_), _) if passes > 0.0 => *coverage = Coverage::Pane(Vec3::splat(passes)),
            (Some(false), ..) | (None, Some(_), _) if matches!(coverage, Coverage::Pane(_)) => {
                *coverage = Coverage::Full;
            }
            _ => (),
        }
    }
}
