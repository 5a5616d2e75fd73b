//! The layers of a rendered picture.

use std::borrow::Cow;

use clap::ValueEnum;

use crate::error::{Error, Result};
use crate::renderer::Renderer;

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
    Variance,
    Error,
    Lights,
    All,
}

const RGB: &[&str] = &["R", "G", "B"];

/// A layer of the written image.
pub(in crate::app) struct Layer {
    pub(in crate::app) name: Cow<'static, str>,
    pub(in crate::app) channels: &'static [&'static str],
    pub(in crate::app) pixels: Vec<[f32; 3]>,
}

/// The main layer, or the layer of an AOV.
pub(super) fn layer(aov: Option<Aov>, pixels: Vec<[f32; 3]>) -> Layer {
    let (name, channels): (_, &[&str]) = match aov {
        None => ("", RGB),
        Some(Aov::Direct) => ("direct", RGB),
        Some(Aov::Indirect) => ("indirect", RGB),
        Some(Aov::Irradiance) => ("irradiance", RGB),
        Some(Aov::Albedo) => ("albedo", RGB),
        Some(Aov::Position) => ("position", &["X", "Y", "Z"]),
        Some(Aov::Normal) => ("normal", &["X", "Y", "Z"]),
        Some(Aov::Depth) => ("depth", &["Z"]),
        Some(Aov::Variance) => ("variance", RGB),
        Some(Aov::Error) => ("error", &["Y"]),
        Some(Aov::Lights | Aov::All) => unreachable!("these are several layers"),
    };
    Layer { name: name.into(), channels, pixels }
}

impl Aov {
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
