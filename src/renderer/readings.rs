//! Illuminance of a light meter, over its points.

use super::Measured;
use crate::scene::{Scene, photometry::lux};
use glam::Vec3;

/// Illuminance of a meter, lx, over its points outside of solids.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Mean of all light.
    pub mean: f64,
    /// Smallest illuminance of a point.
    pub min: f64,
    /// Largest illuminance of a point.
    pub max: f64,
    /// Mean of the light that comes straight from lights.
    pub direct: f64,
    /// Points in solids.
    pub in_solids: usize,
}

impl Reading {
    /// Summarises the points of one meter.
    pub fn new(points: &[Measured]) -> Self {
        let open: Vec<&Measured> = points.iter().filter(|point| !point.is_in_solid).collect();
        let count = open.len().max(1) as f64;
        let mean =
            |of: &dyn Fn(&Measured) -> Vec3| open.iter().map(|point| lux(of(point))).sum::<f64>() / count;
        let all = open.iter().map(|point| lux(point.irradiance()));
        Self {
            mean: mean(&Measured::irradiance),
            min: all.clone().reduce(f64::min).unwrap_or(0.0),
            max: all.fold(0.0, f64::max),
            direct: mean(&|point| point.direct),
            in_solids: points.len() - open.len(),
        }
    }

    /// The minimum over the mean. [EN 12464-1]
    pub fn uniformity(&self) -> f64 {
        self.min / self.mean.max(f64::MIN_POSITIVE)
    }
}

impl Measured {
    /// Cuts the points of all meters of a scene into the points of each.
    pub fn by_meter<'a>(scene: &Scene, mut points: &'a [Self]) -> Vec<&'a [Self]> {
        let mut cut = |count: usize| {
            let (own, rest) = points.split_at(count);
            points = rest;
            own
        };
        scene.meters.iter().map(|meter| cut(meter.count())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_in_solids_do_not_count() {
        let lit = |value: f32| Measured { direct: Vec3::splat(value), ..Measured::default() };
        let hidden = Measured { is_in_solid: true, ..Measured::default() };
        let reading = Reading::new(&[lit(1.0), hidden, lit(3.0)]);
        assert_eq!(reading.in_solids, 1);
        let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-6, "{found}");
        near(reading.mean, 2.0 * 683.0);
        near(reading.min, 683.0);
        near(reading.max, 3.0 * 683.0);
        near(reading.uniformity(), 0.5);
        assert_eq!(Reading::new(&[hidden]), Reading { in_solids: 1, ..Reading::default() });
    }
}
