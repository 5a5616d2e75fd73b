//! The layers of a rendered picture.

use std::borrow::Cow;

use clap::ValueEnum;

use crate::error::{Error, Result};
use crate::image::cryptomatte::Cryptomatte;
use crate::passes::frame::coverage::Coverage;
use crate::renderer::Renderer;
use crate::scene::{Scene, Triangle};

/// Lights of one picture with layers: two a light, 24 bytes a pixel.
const MAX_LIGHTS: usize = 256;
/// Characters of a light's name in that of its layers: EXR readers accept 255 in all.
const NAME_CHARS: usize = 200;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Aov {
    Direct,
    Indirect,
    Irradiance,
    Albedo,
    Normal,
    Position,
    Depth,
    Alpha,
    Cryptomatte,
    Variance,
    Error,
    Lights,
    All,
}

/// Depth where nothing is hit, metres. Compositors sort and blur by depth. Infinity would give NaN
/// there, and zero would be in front of everything. Blender writes the same number.
const BEYOND_M: f32 = 1e10;

const RGB: &[&str] = &["R", "G", "B"];

/// A layer of the written image.
pub(in crate::app) struct Layer {
    pub(in crate::app) name: Cow<'static, str>,
    pub(in crate::app) channels: &'static [&'static str],
    pub(in crate::app) pixels: Vec<[f32; 3]>,
}

/// The main layer, or the layer of an AOV.
pub(super) fn layer(aov: Option<Aov>, pixels: Vec<[f32; 3]>) -> Layer {
    let pixels = match aov {
        Some(Aov::Depth) => pixels.iter().map(|pixel| pixel.map(within)).collect(),
        _ => pixels,
    };
    let (name, channels): (_, &[&str]) = match aov {
        None => ("", RGB),
        Some(Aov::Direct) => ("direct", RGB),
        Some(Aov::Indirect) => ("indirect", RGB),
        Some(Aov::Irradiance) => ("irradiance", RGB),
        Some(Aov::Albedo) => ("albedo", RGB),
        Some(Aov::Position) => ("position", &["X", "Y", "Z"]),
        Some(Aov::Normal) => ("normal", &["X", "Y", "Z"]),
        Some(Aov::Depth) => ("depth", &["Z"]),
        // It belongs to the picture itself.
        Some(Aov::Alpha) => ("", &["A"]),
        Some(Aov::Variance) => ("variance", RGB),
        Some(Aov::Error) => ("error", &["Y"]),
        Some(Aov::Cryptomatte | Aov::Lights | Aov::All) => unreachable!("these are several layers"),
    };
    Layer { name: name.into(), channels, pixels }
}

fn within(depth_m: f32) -> f32 {
    if depth_m.is_finite() { depth_m } else { BEYOND_M }
}

/// Adds the layers that are counted from the samples of edge pixels, if any is wanted. `coverage`
/// finds what pixels show of the sides of the scene's triangles. Returns texts for the header.
pub(super) fn add_covered(
    layers: &mut Vec<Layer>,
    aovs: &[Aov],
    scene: &Scene,
    coverage: impl FnOnce() -> Result<Coverage>,
) -> Result<Vec<(String, String)>> {
    let [wants_alpha, wants_mattes] = [Aov::Alpha, Aov::Cryptomatte].map(|aov| aovs.contains(&aov));
    if !wants_alpha && !wants_mattes {
        return Ok(Vec::new());
    }
    let coverage = coverage()?;
    if wants_alpha {
        layers.push(layer(Some(Aov::Alpha), coverage.alpha().map(|alpha| [alpha; 3]).collect()));
    }
    if !wants_mattes {
        return Ok(Vec::new());
    }
    let objects: Vec<&str> = scene.objects.iter().map(String::as_str).collect();
    let materials: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    let matte = |name, names: &[&str], index: fn(&Triangle) -> u32| {
        let of_side =
            |&(side, fraction): &(u32, f32)| (index(&scene.triangles[side as usize / 2]) as usize, fraction);
        Cryptomatte::new(name, names, coverage.pixels().map(|sides| sides.iter().map(of_side)))
    };
    let mattes = [
        matte("CryptoObject", &objects, |triangle| triangle.object),
        matte("CryptoMaterial", &materials, |triangle| triangle.material),
    ];
    for matte in &mattes {
        for (number, ranks) in matte.ranks.chunks(2).enumerate() {
            let name = format!("{}{number:02}", matte.name);
            let pairs = ranks[0].iter().zip(&ranks[1]);
            let (colours, alphas) = pairs.map(|(&[a, b], &[c, d])| ([a, b, c], [d; 3])).unzip();
            layers.push(Layer { name: name.clone().into(), channels: RGB, pixels: colours });
            layers.push(Layer { name: name.into(), channels: &["A"], pixels: alphas });
        }
    }
    Ok(mattes.iter().flat_map(Cryptomatte::attributes).collect())
}

impl Aov {
    /// Whether [`add_covered`] makes it.
    pub(super) fn is_covered(self) -> bool {
        matches!(self, Self::Alpha | Self::Cryptomatte)
    }

    /// The layers of a file, in order, without repetition. `all` are the layers that cost no paths.
    pub(super) fn in_order(wanted: &[Self], of_lightpaths: bool, has_indirect: bool) -> Vec<Self> {
        let is_cheap = |aov: Self| match aov {
            Self::Error | Self::Variance | Self::All => false,
            Self::Irradiance | Self::Lights => of_lightpaths,
            Self::Indirect => has_indirect,
            _ => true,
        };
        let takes_all = wanted.contains(&Self::All);
        let is_wanted =
            |aov: &Self| *aov != Self::All && (wanted.contains(aov) || takes_all && is_cheap(*aov));
        Self::value_variants().iter().copied().filter(is_wanted).collect()
    }
}

/// Direct and indirect light of each active light, which add up to the picture.
pub(in crate::app) fn of_lights(renderer: &mut Renderer) -> Result<Vec<Layer>> {
    let count = renderer.scene().lights.iter().filter(|light| light.is_active()).count();
    if count > MAX_LIGHTS {
        return Err(Error::Usage(format!(
            "--aov lights is for {MAX_LIGHTS} lights at most, and {count} are on"
        )));
    }
    let of_lights = renderer.light_pictures()?;
    let lights = &renderer.scene().lights;
    let names = layer_names(of_lights.iter().map(|layers| lights[layers.light].name.as_str()));
    let both = names.into_iter().zip(of_lights).map(|(name, layers)| {
        [("direct", layers.direct), ("indirect", layers.indirect)].map(|(kind, pixels)| Layer {
            name: format!("light.{name}.{kind}").into(),
            channels: RGB,
            pixels,
        })
    });
    Ok(both.flatten().collect())
}

/// Names of lights as parts of layer names, where a point separates parts. Equal names get numbers.
fn layer_names<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for name in names {
        let plain = |c: char| if c == '.' || c.is_control() { '_' } else { c };
        let own: String = name.chars().take(NAME_CHARS).map(plain).collect();
        let numbered = (2..).map(|number| format!("{own}_{number}"));
        let free = std::iter::once(own.clone()).chain(numbered).find(|name| !all.contains(name));
        all.extend(free);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_light_has_layers_of_its_own() {
        let names = layer_names(["lamp", "a.b", "a_b", "a\nb", ""].into_iter());
        assert_eq!(names, ["lamp", "a_b", "a_b_2", "a_b_3", ""]);
    }
}
