//! Reference of the composition.

use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Radiance of a pixel, W/m²/sr, from its albedo, its irradiances, W/m², and its
/// glossy radiance, W/m²/sr.
pub fn compose(albedo: Vec3, direct: Vec3, indirect: Vec3, gloss: Vec3) -> DVec3 {
    albedo.as_dvec3() * (direct.as_dvec3() + indirect.as_dvec3()) / PI + gloss.as_dvec3()
}
