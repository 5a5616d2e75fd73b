//! Reference of the samples and rays of glossy pixels.

use crate::cpu::brdf::{lobe_term, sample_phong_lobe};
use crate::cpu::direct::lit_samples;
use crate::cpu::gather_rays::Tracing;
use crate::cpu::lights::{LightSample, is_lit};
use crate::cpu::primary::seen_through;
use crate::cpu::receivers::receiver;
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::{LIGHT_AREA, LightSource, PixelSurface, Reflectance, View};
use glam::{DMat3, DVec2, DVec3, UVec2, Vec3};
use std::f64::consts::{PI, TAU};

/// Surface at sample `number` of pixel `index`, if it has the centre's material; else
/// the centre's surface.
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
    /// Cluster and material that it reads. `None` if it left the scene, met an inactive side or
    /// would start below the surface.
    pub target: Option<(u32, u32)>,
    /// (n+2)/(n+1)·cosθ; zero if it left the scene or would start below the surface.
    pub weight: f64,
    /// Colour of the image at the hit; white if there is none.
    pub colour: DVec3,
    /// Unit direction of the ray.
    pub direction: DVec3,
}

/// Ray `number` of `rays` of pixel `index`, from a point visible from `eye`, on a surface
/// of that exponent.
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

/// Radiance that sample `number` of pixel `index` reflects to `eye` by its Phong lobe, straight
/// from a light, per unit of its emission. It uses the light's point samples, or directions from
/// the lobe if an area light looks larger than the lobe and few of its samples lie there.
pub fn highlight(
    tracing: &Tracing<'_>,
    point: &PixelSurface,
    eye: Vec3,
    material: &Reflectance,
    light: &LightSource,
    [index, number]: [u32; 2],
) -> DVec3 {
    let (geometry, exponent) = (tracing.geometry, f64::from(material.exponent));
    let at = receiver(geometry, point.position, point.side, point.normal);
    let (position, shading) = (at.position.as_dvec3(), point.normal.as_dvec3());
    let mirror = (point.position - eye).as_dvec3().normalize().reflect(shading);
    let [corner, edge_u, edge_v, axis] =
        [light.position, light.edge_u, light.edge_v, light.axis].map(Vec3::as_dvec3);
    let to_light = corner + 0.5 * (edge_u + edge_v) - position;
    let seen = f64::from(light.area) * (-axis.dot(to_light)).max(0.0) / to_light.length().powi(3);
    let lobe_samples = (f64::from(light.samples) / f64::from(LOBE_RAYS)).max(1.0);
    if light.kind != LIGHT_AREA || seen * (exponent + 1.0) <= TAU * lobe_samples {
        let samples = lit_samples(geometry, light, at.position, at.normal, point.normal, point.footprint);
        let fractions =
            samples.iter().map(|(_, direction, factor)| lobe_term(material, mirror, *direction) * *factor);
        return fractions.sum::<DVec3>() / PI;
    }
    let seed = hash_pair(tracing.seed, index);
    let gloss = |ray: u32| {
        let u = sample_3d(number * LOBE_RAYS + ray, seed).truncate().as_dvec2();
        let direction = sample_phong_lobe(mirror, exponent, u);
        let distance = (corner - position).dot(axis) / direction.dot(axis);
        let inside = position + distance * direction - corner;
        let place = DMat3::from_cols(edge_u, edge_v, axis).inverse() * inside;
        let is_met = direction.dot(axis) < 0.0
            && distance > 0.0
            && place.truncate().cmpge(DVec2::ZERO).all()
            && place.truncate().cmple(DVec2::ONE).all();
        let is_above = direction.dot(shading) > 0.0 && direction.dot(at.normal.as_dvec3()) > 0.0;
        let found = LightSample { direction, distance, irradiance: DVec3::ZERO };
        let is_seen = is_met && is_above && is_lit(geometry, at.position, at.normal, &found);
        if is_seen { direction.dot(shading) * (exponent + 2.0) / (exponent + 1.0) } else { 0.0 }
    };
    let mean = (0..LOBE_RAYS).map(gloss).sum::<f64>() / f64::from(LOBE_RAYS);
    mean * material.specular.as_dvec3()
}

/// Rays from each sample.
const LOBE_RAYS: u32 = 4;
