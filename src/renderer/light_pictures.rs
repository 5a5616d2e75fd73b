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
        let whole = self.layer(Layer::Indirect)?;
        let mut found = self.each_light_alone(|renderer, light| {
            let [direct, indirect] = [renderer.layer(Layer::Direct)?, renderer.layer(Layer::Indirect)?];
            Ok(LightPicture { light, direct, indirect })
        })?;
        scale_to(&whole, found.iter_mut().map(|layers| &mut layers.indirect[..]).collect());
        Ok(found)
    }

    /// Each active light's index and its irradiance of each pixel, W/m² in linear Rec.709.
    /// It is rendered as [`Self::light_pictures`] are.
    ///
    /// # Errors
    /// The device lacks memory or failed. The lights are then on as before.
    pub fn light_irradiances(&mut self) -> Result<Vec<(usize, Vec<[f32; 3]>)>> {
        self.each_light_alone(|renderer, light| Ok((light, renderer.layer(Layer::Irradiance)?)))
    }

    /// What `read` finds in a frame of each active light alone. Then the lights are on as before,
    /// and a frame restores the picture.
    fn each_light_alone<T>(&mut self, read: impl Fn(&Self, usize) -> Result<T>) -> Result<Vec<T>> {
        let lights: Vec<[bool; 2]> =
            self.scene().lights.iter().map(|light| [light.is_on, light.is_active()]).collect();
        let active = (0..lights.len()).filter(|&light| lights[light][1]);
        let alone = active.map(|light| {
            for other in 0..lights.len() {
                self.switch_light(other, other == light)?;
            }
            self.frame()?;
            read(self, light)
        });
        let found = alone.collect::<Result<Vec<T>>>();
        for (light, [is_on, _]) in lights.iter().enumerate() {
            self.switch_light(light, *is_on)?;
        }
        let found = found?;
        self.frame()?;
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
