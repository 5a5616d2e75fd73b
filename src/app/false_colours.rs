//! Illuminance and luminance as colours. The map is perceptually uniform, and grows brighter
//! with the values.

use crate::scene::photometry::lux;
use clap::ValueEnum;
use glam::Vec3;

/// What false colours show.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Quantity {
    /// Illuminance of the surface, lx.
    Lux,
    /// Luminance towards the camera, cd/m².
    Nits,
}

impl Quantity {
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Lux => "lx",
            Self::Nits => "cd/m²",
        }
    }
}

/// Range of a legend.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scale {
    /// Zero: the scale is linear; otherwise logarithmic.
    pub(super) low: f64,
    pub(super) high: f64,
}

/// Fraction of the pixels below the end of a scale that follows the picture.
const BELOW: f64 = 0.995;
/// Low over high end of such a scale.
const DECADES: f64 = 1e-3;

/// The value of each pixel, from its irradiance or radiance.
pub(super) fn values(pixels: &[[f32; 3]]) -> Vec<f64> {
    pixels.iter().map(|&pixel| lux(Vec3::from(pixel))).collect()
}

impl Scale {
    /// Three decades whose end, 1, 2 or 5 times a power of ten, is above nearly all values.
    pub(super) fn of(values: &[f64]) -> Self {
        let mut positive: Vec<f64> = values.iter().copied().filter(|value| *value > 0.0).collect();
        positive.sort_by(f64::total_cmp);
        let place = (BELOW * positive.len() as f64) as usize;
        let most = positive.get(place.min(positive.len().saturating_sub(1))).copied().unwrap_or(1.0);
        let decade = 10f64.powf(most.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
        let high = steps.into_iter().find(|step| *step >= most).unwrap_or(most);
        Self { low: DECADES * high, high }
    }

    /// Parses the text `MIN:MAX`.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let ends = text.split_once(':').and_then(|(low, high)| Some((low.parse().ok()?, high.parse().ok()?)));
        match ends {
            Some((low, high)) if 0.0 <= low && low < high && f64::is_finite(high) => Ok(Self { low, high }),
            _ => Err("expected MIN:MAX, as in 1:1000, or 0:500 for a linear scale".to_owned()),
        }
    }

    /// Place of a value on the scale, 0..=1.
    pub(super) fn place(self, value: f64) -> f64 {
        let place = match self.low {
            0.0 => value / self.high,
            low => (value / low).ln() / (self.high / low).ln(),
        };
        place.clamp(0.0, 1.0)
    }

    /// The value at a place, 0..=1.
    #[cfg(any(test, feature = "window"))]
    pub(super) fn value(self, place: f64) -> f64 {
        match self.low {
            0.0 => place * self.high,
            low => low * (self.high / low).powf(place),
        }
    }

    /// sRGB codes R, G, B, 255 of a value.
    pub(super) fn colour(self, value: f64) -> [u8; 4] {
        let colorous::Color { r, g, b } = colorous::VIRIDIS.eval_continuous(self.place(value));
        [r, g, b, 255]
    }

    /// The legend in words.
    pub(super) fn words(self, quantity: Quantity) -> String {
        let kind = if self.low == 0.0 { "linear" } else { "logarithmic" };
        let (low, high, unit) = (self.low, self.high, quantity.unit());
        format!("{kind} from {low} {unit} (dark violet) to {high} {unit} (yellow), colours viridis")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_follow_the_picture() {
        let values: Vec<f64> = (0..1000).map(|i| 0.37 * f64::from(i)).collect();
        assert_eq!(Scale::of(&values), Scale { low: 0.5, high: 500.0 });
        assert_eq!(Scale::of(&[0.0, 200.0]).high, 200.0);
        assert_eq!(Scale::of(&[]), Scale { low: 1e-3, high: 1.0 });
    }

    #[test]
    fn places_and_values_are_inverse() {
        for scale in [Scale { low: 0.0, high: 500.0 }, Scale { low: 1.0, high: 1000.0 }] {
            for place in [0.0, 0.25, 0.5, 1.0] {
                assert!((scale.place(scale.value(place)) - place).abs() < 1e-12);
            }
        }
        let scale = Scale::parse("1:1000").unwrap();
        assert!((scale.place(10.0) - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!((scale.place(0.0), scale.place(1e9)), (0.0, 1.0));
        for bad in ["", "5", "5:", "5:1", "-1:5", "1:inf", "a:b"] {
            assert!(Scale::parse(bad).is_err(), "{bad}");
        }
    }
}
