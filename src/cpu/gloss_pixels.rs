//! Reference of the samples and rays of glossy pixels.

use crate::cpu::antialias::seen_on;
use crate::cpu::brdf::{phong_lobe, sample_phong_lobe};
use crate::cpu::direct::lit_samples;
use crate::cpu::gather_rays::Tracing;
use crate::cpu::lights::{LightSample, is_lit};
use crate::cpu::primary::{direction_through, seen_through};
use crate::cpu::rays::Geometry;
use crate::cpu::receivers::receiver;
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::{LIGHT_AREA, LightSource, PixelSurface, Reflectance, View};
use glam::{DMat3, DVec2, DVec3, UVec2, Vec3};
use std::f64::consts::{PI, TAU};

/// A sample of a glossy pixel.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// What it sees.
    pub surface: PixelSurface,
    /// Its point in the image.
    pub point: DVec2,
}

/// Sample `number` of pixel `index`, which is no edge pixel. If another material than the centre's
/// is there, it takes the centre.
pub fn sample(tracing: &Tracing<'_>, view: &View, centre: &PixelSurface, index: u32, number: u32) -> Sample {
    let jitter = sample_3d(number, hash_pair(hash_pair(tracing.seed, index), 1)).truncate();
    let corner = UVec2::new(index % view.width, index / view.width).as_dvec2();
    let material = |side: u32| tracing.geometry.surfaces[side as usize / 2].material;
    let point = corner + jitter.as_dvec2();
    match seen_through(tracing.geometry, view, point) {
        Some(seen) if material(seen.side) == material(centre.side) => {
            let surface = PixelSurface {
                position: seen.hit.position.as_vec3(),
                side: seen.side,
                normal: seen.normal.as_vec3(),
                footprint: seen.footprint as f32,
            };
            Sample { surface, point }
        }
        _ => Sample { surface: *centre, point: corner + 0.5 },
    }
}

/// Which sample of an edge pixel is sample `number` of `samples` for gloss, and its weight in the
/// mean. `members` are the pixel's samples on each fragment; none of a fragment without gloss.
pub fn edge_member(members: &[Vec<u32>], number: u32, samples: u32) -> (u32, f64) {
    let glossy: Vec<&Vec<u32>> = members.iter().filter(|members| !members.is_empty()).collect();
    // If there are enough, each fragment takes one; the rest are in proportion to their area.
    let firsts = if glossy.len() <= samples as usize { glossy.len() } else { 0 };
    let rest = samples as usize - firsts;
    let all: usize = glossy.iter().map(|members| members.len()).sum();
    let of_rank = |mut rank: usize| {
        let mut owner = 0;
        while rank >= glossy[owner].len() {
            rank -= glossy[owner].len();
            owner += 1;
        }
        owner
    };
    let of_rest = |index: usize| of_rank((2 * index + 1) * all / (2 * rest));
    let owners: Vec<usize> = (0..firsts).chain((0..rest).map(of_rest)).collect();
    let own = owners[number as usize];
    let count_in = |owners: &[usize]| owners.iter().filter(|&&owner| owner == own).count();
    let member = glossy[own][count_in(&owners[..number as usize]) % glossy[own].len()];
    let by_area = glossy[own].len() as f64 / (all * count_in(&owners)) as f64;
    (member, if firsts > 0 { by_area } else { 1.0 / f64::from(samples) })
}

/// How the mirror direction turns over the part of a pixel for which one of its `samples` stands:
/// from the sample to the right and to the lower border of that part.
pub fn mirror_turn(geometry: Geometry<'_>, view: &View, sample: &Sample, samples: u32) -> [DVec3; 2] {
    let half_width = 0.5 / f64::from(samples).sqrt();
    let mirror_through = |point: DVec2| {
        let normal = seen_on(geometry, view, point, sample.surface.side).normal;
        direction_through(view, point).normalize().reflect(normal.as_dvec3())
    };
    [DVec2::X, DVec2::Y]
        .map(|axis| mirror_through(sample.point + half_width * axis) - mirror_through(sample.point))
}

fn mirror_at(seen: &PixelSurface, eye: Vec3) -> DVec3 {
    (seen.position - eye).as_dvec3().normalize().reflect(seen.normal.as_dvec3())
}

/// Mean of a lobe towards a direction over the part of a pixel for which a sample stands, as a
/// fraction of the lobe's peak. The lobe at each place is wider by the turn between places.
pub fn mean_lobe(mirror: DVec3, turn: [DVec3; 2], direction: DVec3, exponent: f64) -> f64 {
    let spread = (turn[0].length_squared() + turn[1].length_squared()) / 3.0;
    let along = if 0.5 * exponent * spread > 0.1 { 4_u32 } else { 1 };
    let wider = exponent / (1.0 + 0.5 * exponent * spread / f64::from(along * along));
    let at = |place: u32| {
        let [x, y] = [place % along, place / along].map(|k| f64::from(2 * k + 1) / f64::from(along) - 1.0);
        phong_lobe((mirror + x * turn[0] + y * turn[1]).normalize(), direction, wider)
    };
    let sum: f64 = (0..along * along).map(at).sum();
    sum / f64::from(along * along) * (wider + 2.0) / (exponent + 2.0)
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
    let mirror = mirror_at(point, eye);
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
/// from a light, per unit of its emission; `turn` is [`mirror_turn`]. It uses the light's point
/// samples, or directions from the lobe if an area light looks larger than the lobe and few of its
/// samples lie there.
pub fn highlight(
    tracing: &Tracing<'_>,
    (point, turn): (&PixelSurface, [DVec3; 2]),
    eye: Vec3,
    material: &Reflectance,
    light: &LightSource,
    [index, number]: [u32; 2],
) -> DVec3 {
    let (geometry, exponent) = (tracing.geometry, f64::from(material.exponent));
    let at = receiver(geometry, point.position, point.side, point.normal);
    let (position, shading) = (at.position.as_dvec3(), point.normal.as_dvec3());
    let mirror = mirror_at(point, eye);
    let [corner, edge_u, edge_v, axis] =
        [light.position, light.edge_u, light.edge_v, light.axis].map(Vec3::as_dvec3);
    let to_light = corner + 0.5 * (edge_u + edge_v) - position;
    let seen = f64::from(light.area) * (-axis.dot(to_light)).max(0.0) / to_light.length().powi(3);
    let lobe_samples = (f64::from(light.samples) / f64::from(LOBE_RAYS)).max(1.0);
    if light.kind != LIGHT_AREA || seen * (exponent + 1.0) <= TAU * lobe_samples {
        let samples = lit_samples(geometry, light, at.position, at.normal, point.normal, point.footprint);
        let fraction =
            |direction: DVec3| 0.5 * (exponent + 2.0) * mean_lobe(mirror, turn, direction, exponent);
        let sum = samples.iter().map(|(_, direction, factor)| fraction(*direction) * *factor).sum::<f64>();
        return material.specular.as_dvec3() * sum / PI;
    }
    let seed = hash_pair(tracing.seed, index);
    let gloss = |ray: u32| {
        let [u, place] = [seed, hash_pair(seed, 1)]
            .map(|seed| sample_3d(number * LOBE_RAYS + ray, seed).truncate().as_dvec2());
        let turned = mirror + (2.0 * place.x - 1.0) * turn[0] + (2.0 * place.y - 1.0) * turn[1];
        let direction = sample_phong_lobe(turned.normalize(), exponent, u);
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
