//! The layers of a rendered picture.

use std::borrow::Cow;

use clap::ValueEnum;

use crate::error::{Error, Result};
use crate::renderer::{self, Renderer};
use crate::scene::Light;
use glam::{DVec3, Vec3};

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
pub(super) struct Layer {
    pub(super) name: Cow<'static, str>,
    pub(super) channels: &'static [&'static str],
    pub(super) pixels: Vec<[f32; 3]>,
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

/// Places in the coordinates of the scene file; zero where there is none, as before.
pub(super) fn in_file(mut layer: Vec<[f32; 3]>, normals: &[[f32; 3]], origin: DVec3) -> Vec<[f32; 3]> {
    for (place, _) in layer.iter_mut().zip(normals).filter(|(_, normal)| **normal != [0.0; 3]) {
        *place = (DVec3::from(place.map(f64::from)) + origin).as_vec3().to_array();
    }
    layer
}

/// Layers of each light that is on: its direct light and its indirect light, which add up to the
/// picture. Each is a frame with the others off; light paths stay.
///
/// Extrapolated records are clamped at zero, so that indirect light of single lights is a little
/// more than that of all: up to 2.5e-4 in the mean. Each pixel's difference is spread over the
/// lights in proportion to them.
pub(super) fn of_lights(renderer: &mut Renderer) -> Result<Vec<Layer>> {
    let lights = renderer.scene().lights.clone();
    let is_active = |light: &Light| light.is_on && light.kind.emission() != Vec3::ZERO;
    let active: Vec<usize> = (0..lights.len()).filter(|&light| is_active(&lights[light])).collect();
    if active.len() > MAX_LIGHTS {
        let count = active.len();
        return Err(Error::Usage(format!(
            "--aov lights is for {MAX_LIGHTS} lights at most, and {count} are on"
        )));
    }
    let names = layer_names(active.iter().map(|&light| lights[light].name.as_str()));
    let whole = renderer.layer(renderer::Layer::Indirect)?;
    let mut layers = Vec::with_capacity(2 * active.len());
    for (&light, name) in active.iter().zip(names) {
        for other in 0..lights.len() {
            renderer.switch_light(other, other == light)?;
        }
        renderer.frame()?;
        for (kind, source) in [("direct", renderer::Layer::Direct), ("indirect", renderer::Layer::Indirect)] {
            let name = format!("light.{name}.{kind}").into();
            layers.push(Layer { name, channels: RGB, pixels: renderer.layer(source)? });
        }
    }
    scale_to(&whole, layers.iter_mut().skip(1).step_by(2).map(|layer| &mut layer.pixels[..]).collect());
    Ok(layers)
}

/// Scales the layers at each pixel so that they add up to the whole.
fn scale_to(whole: &[[f32; 3]], mut layers: Vec<&mut [[f32; 3]]>) {
    for (pixel, whole) in whole.iter().enumerate() {
        for (channel, &whole) in whole.iter().enumerate() {
            let sum: f64 = layers.iter().map(|layer| f64::from(layer[pixel][channel])).sum();
            let factor = if sum > 0.0 { f64::from(whole) / sum } else { 1.0 };
            for layer in &mut layers {
                layer[pixel][channel] = (factor * f64::from(layer[pixel][channel])) as f32;
            }
        }
    }
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
