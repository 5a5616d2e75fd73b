//! Twin of the samples and rays of shining pixels.

use crate::cpu::brdf::{lobe_share, sample_phong_lobe};
use crate::cpu::direct::lit_samples;
use crate::cpu::gather_rays::Tracing;
use crate::cpu::primary::seen_through;
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::{LightSource, PixelSurface, Reflectance, View};
use glam::{DVec3, UVec2, Vec3};
use std::f64::consts::{PI, TAU};

/// What sample `number` of pixel `index` shows, if that is of the centre's material; else the centre itself.
pub fn sample(
    tracing: &Tracing<'_>,
    view: &View,
    centre: &PixelSurface,
    index: u32,
    number: u32,
) -> PixelSurface {
    let jitter = sample_3d(number, hash_pair(hash_pair(tracing.seed, index), 1)).truncate();
    let corner = UVec2::new(index % view.width, index / view.width);
    let material = |side: u32| tracing.geometry.surfaces[side as usize / 2].material;
    match seen_through(tracing.geometry, view, corner.as_dvec2() + jitter.as_dvec2()) {
        Some(seen) if material(seen.side) == material(centre.side) => PixelSurface {
            position: seen.hit.position.as_vec3(),
            side: seen.side,
            normal: seen.normal.as_vec3(),
            footprint: seen.footprint as f32,
        },
        _ => *centre,
    }
}

/// A ray into the lobe of a pixel.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Cluster and material that it reads; none where it left the scene, met a side without light or would start below the surface.
    pub target: Option<(u32, u32)>,
    /// (n+2)/(n+1)·cosθ; zero where it left the scene or would start below the surface.
    pub weight: f64,
    /// Of the image that it met; white where it met none.
    pub colour: DVec3,
    /// Unit, towards what it meets.
    pub direction: DVec3,
}

/// Ray `number` of `rays` of pixel `index`, from a point that `eye` sees on a surface of that exponent.
pub fn trace(
    tracing: &Tracing<'_>,
    point: &PixelSurface,
    index: u32,
    eye: Vec3,
    exponent: f64,
    [number, rays]: [u32; 2],
) -> Ray {
    let (geometric, shading) = (tracing.geometry.normal(point.side), point.normal.as_dvec3());
    let mirror = (point.position - eye).as_dvec3().normalize().reflect(shading);
    let u = sample_3d(number, hash_pair(tracing.seed, index)).truncate().as_dvec2();
    let direction = sample_phong_lobe(mirror, exponent, u);
    let cosine = direction.dot(shading);
    let nothing = Ray { target: None, weight: 0.0, colour: DVec3::ONE, direction };
    if cosine <= 0.0 || direction.dot(geometric.as_dvec3()) <= 0.0 {
        return nothing;
    }
    let origin = tracing.geometry.offset_origin(point.position, geometric);
    let Some(hit) = tracing.geometry.closest(origin, direction) else { return nothing };
    let footprint = 0.5 * hit.t * (TAU / ((exponent + 1.0) * f64::from(rays))).sqrt();
    let target = tracing.target(&hit, direction, footprint);
    let colour = tracing.geometry.colour(hit.triangle, hit.barycentric);
    Ray { target, weight: cosine * (exponent + 2.0) / (exponent + 1.0), colour, direction }
}

/// Radiance that a point sends to `eye` of a light, straight from it, by its Phong lobe: per unit of the light's emission.
pub fn highlight(
    tracing: &Tracing<'_>,
    point: &PixelSurface,
    eye: Vec3,
    material: &Reflectance,
    light: &LightSource,
) -> DVec3 {
    let normal = tracing.geometry.normal(point.side);
    let mirror = (point.position - eye).as_dvec3().normalize().reflect(point.normal.as_dvec3());
    let samples = lit_samples(tracing.geometry, light, point.position, normal, point.normal, point.footprint);
    samples.iter().map(|(_, direction, factor)| lobe_share(material, mirror, *direction) * *factor / PI).sum()
}
