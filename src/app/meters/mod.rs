//! The commands that measure: `measure` and `solve`.

mod least_squares;
pub(super) mod measure;
mod search;
pub(super) mod solve;

use super::args::{CacheArgs, DeviceArgs, SceneArgs};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::renderer::{Measured, Renderer};
use crate::scene::{Scene, photometry::lux};
use glam::Vec3;
use std::sync::Arc;

/// Side of the picture, which is not shown.
const SIDE: u32 = 16;

/// Opens a scene for its meters.
fn open(
    spec: &str,
    scene_args: &SceneArgs,
    cache_args: &CacheArgs,
    device_args: &DeviceArgs,
) -> Result<(Arc<Context>, Renderer)> {
    let store = cache_args.store()?;
    let mut scene = scene_args.load_with_meters(spec)?;
    if scene.meters.is_empty() {
        return Err(Error::Usage(format!(
            "{spec} has no meter: add [[meter]] with kind, position and normal to the scene file, \
             see `lightpaths help scene`"
        )));
    }
    scene.cameras[0].size = [SIDE; 2];
    scene.quality.edge_samples = 0;
    scene.warnings.iter().for_each(|warning| device_args.warn(warning));
    let context = device_args.open()?;
    let renderer = device_args.renderer_from(store.as_ref(), &context, scene)?;
    Ok((context, renderer))
}

/// Illuminance of a meter, lx, over its points outside of solids.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Reading {
    mean: f64,
    min: f64,
    max: f64,
    /// Mean of the light that comes straight from lights.
    direct: f64,
    /// Points in solids.
    in_solids: usize,
}

impl Reading {
    fn new(points: &[Measured]) -> Self {
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
    fn uniformity(&self) -> f64 {
        self.min / self.mean.max(f64::MIN_POSITIVE)
    }
}

/// Cuts the points of all meters into the points of each.
fn by_meter<'a>(scene: &Scene, mut points: &'a [Measured]) -> Vec<&'a [Measured]> {
    let mut cut = |count: usize| {
        let (own, rest) = points.split_at(count);
        points = rest;
        own
    };
    scene.meters.iter().map(|meter| cut(meter.count())).collect()
}

/// Renders a frame with these lights on and all others off, and measures.
fn measure_with(renderer: &mut Renderer, is_on: impl Fn(usize) -> bool) -> Result<Vec<Measured>> {
    for light in 0..renderer.scene().lights.len() {
        renderer.switch_light(light, is_on(light))?;
    }
    renderer.frame()?;
    renderer.measured()
}

/// The lights that are on and not black.
fn active(scene: &Scene) -> Vec<usize> {
    let is_active = |&light: &usize| {
        let light = &scene.lights[light];
        light.is_on && light.kind.emission() != Vec3::ZERO
    };
    (0..scene.lights.len()).filter(is_active).collect()
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
