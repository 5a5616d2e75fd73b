//! The picture as a sum over its lights.

use super::{Layer, Renderer};
use crate::error::Result;

/// Light of one light in the picture, linear Rec.709, W/m²/sr.
#[derive(Clone, Debug, PartialEq)]
pub struct LightPicture {
    /// Index of the light.
    pub light: usize,
    /// Its direct light, row by row from the top.
    pub direct: Vec<[f32; 3]>,
    /// Its indirect light.
    pub indirect: Vec<[f32; 3]>,
}

impl Renderer {
    /// Layers of each active light, which add up to the picture of the last frame. Each is a frame
    /// with the other lights off; light paths stay. A last frame restores the picture.
    ///
    /// Extrapolated records are clamped at zero, so that indirect light of single lights is a
    /// little more than that of all: up to 2.5e-4 in the mean. Each pixel's difference is spread
    /// over the lights in proportion to them.
    ///
    /// # Errors
    /// The device lacks memory or failed. The lights are then on as before.
    pub fn light_pictures(&mut self) -> Result<Vec<LightPicture>> {
        let lights: Vec<[bool; 2]> =
            self.scene().lights.iter().map(|light| [light.is_on, light.is_active()]).collect();
        let whole = self.layer(Layer::Indirect)?;
        let found = self.each_light_alone(&lights);
        for (light, [is_on, _]) in lights.into_iter().enumerate() {
            self.switch_light(light, is_on)?;
        }
        let mut found = found?;
        self.frame()?;
        scale_to(&whole, found.iter_mut().map(|layers| &mut layers.indirect[..]).collect());
        Ok(found)
    }

    /// Frames of single lights. `lights` has whether each is on and whether it is active.
    fn each_light_alone(&mut self, lights: &[[bool; 2]]) -> Result<Vec<LightPicture>> {
        let mut found = Vec::new();
        for (light, _) in lights.iter().enumerate().filter(|(_, [_, is_active])| *is_active) {
            for other in 0..lights.len() {
                self.switch_light(other, other == light)?;
            }
            self.frame()?;
            let [direct, indirect] = [self.layer(Layer::Direct)?, self.layer(Layer::Indirect)?];
            found.push(LightPicture { light, direct, indirect });
        }
        Ok(found)
    }
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
