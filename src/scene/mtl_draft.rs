//! A material of an MTL file, and its statements while its lines are read.

use std::path::Path;

use glam::{DVec2, Vec3};

use super::cutouts::{Coverage, Cutout};
use super::material::{Material, NEUTRAL};
use super::material_names::shown;
use super::metallic::Metallic;
use super::reading::Reading;
use super::texture::Texture;
use super::transparency::{IS_PANE, Transparency};
use super::value::excerpt;

/// A material with its texture transform.
pub(super) struct Definition {
    pub(super) material: Material,
    pub(super) coverage: Coverage,
    /// Image coordinates are `scale·vt + offset`.
    pub(super) scale: DVec2,
    /// Offset of image coordinates, see `scale`.
    pub(super) offset: DVec2,
    /// Whether the file states a diffuse albedo or an image.
    pub(super) states_colour: bool,
    /// Whether the scene file gives it an image.
    pub(super) is_given_image: bool,
}

impl Definition {
    pub(super) fn new(material: Material) -> Self {
        let (scale, offset) = (DVec2::ONE, DVec2::ZERO);
        Self {
            material,
            coverage: Coverage::Full,
            scale,
            offset,
            states_colour: false,
            is_given_image: false,
        }
    }

    /// Whether the model gives it an image.
    pub(super) fn has_image(&self) -> bool {
        self.material.texture.is_some() || matches!(self.coverage, Coverage::Cutout(_))
    }

    /// Whether triangles need texture coordinates.
    pub(super) fn needs_coordinates(&self) -> bool {
        self.has_image() || self.is_given_image
    }
}

/// Statements of a material. `None` where the file has none.
#[derive(Default)]
pub(super) struct Draft {
    pub(super) name: String,
    pub(super) diffuse: Option<Vec3>,
    pub(super) specular: Option<Vec3>,
    /// Mean colour of the image of the specular albedo.
    pub(super) specular_colour: Option<Vec3>,
    pub(super) exponent: Option<f32>,
    pub(super) roughness: Option<f32>,
    pub(super) metal: Option<f32>,
    pub(super) texture: Option<(Texture, [DVec2; 2])>,
    pub(super) emission: Option<Vec3>,
    /// Mean colour of the image of the emission.
    pub(super) emission_colour: Option<Vec3>,
    pub(super) opacity: Option<(Cutout, [DVec2; 2])>,
    /// Line of an image whose alpha counts only with `map_d`.
    pub(super) alpha: Option<usize>,
    /// Line of a `d` of zero.
    pub(super) hidden: Option<usize>,
    /// Lines of `Ka` and `Ni`, which are noted only in combination with other statements.
    pub(super) ambient: Option<usize>,
    pub(super) refraction: Option<usize>,
    pub(super) transparency: Transparency,
    /// A statement other than those of [`Transparency`] makes it transparent.
    pub(super) is_transparent: bool,
}

/// Differences of `Ks` from the specular albedo that `Pr` and `Pm` give, and a factor between the
/// exponents, that a note mentions.
const OTHER_ALBEDO: f32 = 0.05;
const OTHER_EXPONENT: f32 = 1.5;

impl Draft {
    /// Notes combinations of statements.
    pub(super) fn note(&self, reading: &mut Reading, path: &Path) {
        let notes = &mut reading.notes;
        let at = |line| place(path, line, Some(self));
        let of_material = || format!("{}: material {:?}", shown(path), self.name);
        let is_coloured = self.diffuse.is_some() || self.texture.is_some();
        if let Some(line) = self.ambient.filter(|_| !is_coloured) {
            notes.add("`Ka` is passed over, and there is no `Kd`: the material is grey", || at(line));
        }
        let pane = self.pane();
        if let Some((_, line)) = pane {
            notes.add(IS_PANE, || at(line));
        }
        let opaque: Vec<_> = self.transparency.without_effect().filter(|_| pane.is_none()).collect();
        for &(keyword, line) in &opaque {
            let what = format!("`{keyword}` is passed over (transparency): surfaces are opaque");
            notes.add(&what, || at(line));
        }
        let is_transparent = self.is_transparent || pane.is_some() || !opaque.is_empty();
        if let Some(line) = self.refraction.filter(|_| is_transparent) {
            notes.add("`Ni` is passed over (refraction)", || at(line));
        }
        let is_black = self.emission.unwrap_or(Vec3::ZERO) == Vec3::ZERO;
        if is_black && self.emission_colour.is_some_and(|colour| colour != Vec3::ZERO) {
            let what = "does not emit: its image of emission is multiplied with a Ke of 0";
            notes.add(what, of_material);
        }
        if let Some(line) = self.alpha.filter(|_| self.opacity.is_none()) {
            notes.add("the transparency of images is passed over", || at(line));
        }
        if let Some(line) = self.hidden.filter(|_| self.opacity.is_none()) {
            notes.add("`d` is 0: surfaces that are not there are left out", || at(line));
        }
        if let (Some((_, place)), Some((_, other))) = (&self.texture, &self.opacity)
            && place != other
        {
            notes.add("`map_d` has other options than `map_Kd`, and is placed like it", of_material);
        }
        if self.texture.is_some() && self.diffuse == Some(Vec3::ZERO) {
            notes.add("is black: its image is multiplied with a Kd of 0", of_material);
        }
        if self.disagrees() {
            notes.add("`Ks` and `Ns` are passed over: `Pr` and `Pm` state another highlight", of_material);
        }
    }

    /// Colour of the light that passes, and the line that states it. An opacity map comes first.
    fn pane(&self) -> Option<(Vec3, usize)> {
        self.transparency.pane().filter(|_| self.opacity.is_none() && self.hidden.is_none())
    }

    pub(super) fn definition(self) -> Definition {
        let mut definition = Definition::new(self.material());
        if let Some((colour, _)) = self.pane() {
            definition.coverage = Coverage::Pane(colour);
        }
        if self.hidden.is_some() {
            definition.coverage = Coverage::Hidden;
        }
        definition.states_colour = self.diffuse.is_some() || self.texture.is_some();
        if let Some((cutout, [scale, offset])) = self.opacity {
            (definition.scale, definition.offset) = (scale, offset);
            definition.coverage = Coverage::Cutout(cutout);
        }
        if let Some((texture, [scale, offset])) = self.texture {
            (definition.scale, definition.offset) = (scale, offset);
            definition.material.texture = Some(texture);
        }
        definition
    }

    fn material(&self) -> Material {
        // The image provides the colour.
        let colour = if self.texture.is_some() { Vec3::ONE } else { NEUTRAL };
        let mut material = Material {
            diffuse: self.diffuse.unwrap_or(colour),
            specular: self.specular(),
            exponent: self.exponent.unwrap_or(1.0),
            emission: self.emission.unwrap_or(Vec3::ZERO) * self.emission_colour.unwrap_or(Vec3::ONE),
            ..Material::neutral(&self.name)
        };
        if let Some(metallic) = self.metallic(material.diffuse) {
            metallic.apply(&mut material);
        }
        material
    }

    /// The specular albedo that `Ks` and `map_Ks` state.
    fn specular(&self) -> Vec3 {
        self.specular.unwrap_or(Vec3::ZERO) * self.specular_colour.unwrap_or(Vec3::ONE)
    }

    /// The surface that `Pr` and `Pm` state.
    fn metallic(&self, base: Vec3) -> Option<Metallic> {
        let image = self.texture.as_ref().map_or(Vec3::ONE, |(texture, _)| texture.image.mean());
        // glTF's default of the roughness.
        let (roughness, metal) = (self.roughness.unwrap_or(1.0), self.metal.unwrap_or(0.0));
        let base = base.min(Vec3::ONE);
        (self.roughness.is_some() || self.metal.is_some()).then_some(Metallic {
            base,
            image,
            metal,
            roughness,
        })
    }

    /// Whether `Ks` or `Ns` describe another highlight than `Pr` and `Pm`.
    fn disagrees(&self) -> bool {
        if self.roughness.is_none() && self.metal.is_none() {
            return false;
        }
        let (material, stated) = (self.material(), self.specular());
        let is_other_exponent = self.exponent.is_some_and(|exponent| {
            let factor = exponent / material.exponent;
            !(1.0 / OTHER_EXPONENT..=OTHER_EXPONENT).contains(&factor)
        });
        self.specular.is_some() && (stated - material.specular).abs().max_element() > OTHER_ALBEDO
            || stated != Vec3::ZERO && is_other_exponent
    }
}

/// A position for notes.
pub(super) fn place(path: &Path, line: usize, draft: Option<&Draft>) -> String {
    let material = draft.map(|draft| format!(": material {}", excerpt(&draft.name)));
    format!("{}:{line}{}", shown(path), material.unwrap_or_default())
}
