//! Twin of the path flux.

use crate::types::LightSource;
use glam::DVec3;

/// Flux of each path's first vertex, W; `factors` has a row of form factors for each light.
pub fn path_flux(lights: &[LightSource], factors: &[f32], path_count: usize, area_m2: f32) -> Vec<DVec3> {
    let flux = |path: usize| {
        let light = |(row, light): (usize, &LightSource)| {
            f64::from(factors[row * path_count + path]) * light.emission.as_dvec3()
        };
        f64::from(area_m2) * lights.iter().enumerate().map(light).sum::<DVec3>()
    };
    (0..path_count).map(flux).collect()
}
