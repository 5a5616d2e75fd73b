//! Twin of the rays of shining pixels.

use crate::cpu::brdf::sample_phong_lobe;
use crate::cpu::gather_rays::Tracing;
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::PixelSurface;
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// A ray into the lobe of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Cluster and material that it reads; none where it left the scene, met a side without light or would start below the surface.
    pub target: Option<(u32, u32)>,
    /// (n+2)/(n+1)·cosθ; zero where it has no target by leaving or starting below.
    pub weight: f64,
    /// Unit, towards what it meets.
    pub direction: DVec3,
}

/// Ray `number` of `rays` from pixel `index`, seen from `eye`, on a surface of that exponent.
pub fn trace(
    tracing: &Tracing<'_>,
    pixel: &PixelSurface,
    index: u32,
    eye: Vec3,
    exponent: f64,
    [number, rays]: [u32; 2],
) -> Ray {
    let (geometric, shading) = (tracing.geometry.normal(pixel.side), pixel.normal.as_dvec3());
    let mirror = (pixel.position - eye).as_dvec3().normalize().reflect(shading);
    let u = sample_3d(number, hash_pair(tracing.seed, index)).truncate().as_dvec2();
    let direction = sample_phong_lobe(mirror, exponent, u);
    let cosine = direction.dot(shading);
    let nothing = Ray { target: None, weight: 0.0, direction };
    if cosine <= 0.0 || direction.dot(geometric.as_dvec3()) <= 0.0 {
        return nothing;
    }
    let origin = tracing.geometry.offset_origin(pixel.position, geometric);
    let Some(hit) = tracing.geometry.closest(origin, direction) else { return nothing };
    let footprint = 0.5 * hit.t * (TAU / ((exponent + 1.0) * f64::from(rays))).sqrt();
    let target = tracing.target(&hit, direction, footprint);
    Ray { target, weight: cosine * (exponent + 2.0) / (exponent + 1.0), direction }
}
