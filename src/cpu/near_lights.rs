//! Reference of the near-light correction of form factors.

use crate::cpu::rays::Geometry;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// An entry point near the light.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Position on the surface, metres.
    pub position: DVec3,
    /// Unit geometric normal.
    pub normal: DVec3,
    /// Area that the entry point stands for.
    pub area_m2: f64,
}

/// A light and the entry points around it.
pub struct Near<'a> {
    /// Position of the light, metres.
    pub light: Vec3,
    /// Unit direction and flux, sr, of each ray from the light.
    pub rays: &'a [(Vec3, f64)],
    /// Entry points that the correction may change.
    pub points: &'a [Point],
    /// Mean spacing of all entry points, metres.
    pub mean_spacing: f64,
    /// Spacing of entry points beside the light, metres.
    pub spacing: f64,
    /// Mean area of an entry point.
    pub area_m2: f64,
}

/// Factor of each point's form factor, and the form factor that is added to it, 1/m². `is_diffuse`
/// reports whether a side takes part in transport and is diffuse.
pub fn corrections(
    geometry: Geometry<'_>,
    is_diffuse: impl Fn(u32) -> bool,
    near: &Near<'_>,
) -> Vec<[f64; 2]> {
    let reach = 8.0 * near.mean_spacing;
    let mut hits: Vec<(f64, DVec3, DVec3, f64)> = Vec::new();
    for &(direction, flux) in near.rays {
        let Some(hit) = geometry.closest(near.light, direction.as_dvec3()) else { continue };
        let side = geometry.side(hit.triangle, direction.as_dvec3());
        if is_diffuse(side) {
            hits.push((hit.t, hit.position, geometry.normal(side).as_dvec3(), flux));
        }
    }
    let nearest = hits.iter().fold(f64::INFINITY, |least, hit| least.min(hit.0));
    let strength = ((4.0 - nearest / near.mean_spacing) / 2.0).clamp(0.0, 1.0);
    if strength == 0.0 {
        return vec![[1.0, 0.0]; near.points.len()];
    }
    hits.retain(|hit| hit.0 < reach);
    let by_rays = |distance: f64| match distance < reach {
        true => strength * (2.0 - 2.0 * distance / reach).clamp(0.0, 1.0),
        false => 0.0,
    };
    let clearance = |&(_, position, normal, _): &(f64, DVec3, DVec3, f64)| {
        let over = 0.01 * near.spacing;
        let covering = geometry.closest((position + over * normal).as_vec3(), normal);
        covering.map_or(2.0 * near.spacing, |hit| (0.5 * (hit.t + over)).min(2.0 * near.spacing))
    };
    let clearances: Vec<f64> = hits.iter().map(clearance).collect();
    let height = clearances.iter().copied().fold(2.0 * near.spacing, f64::min);
    let is_seen = |point: &Point| {
        let origin = near.light + (height * point.normal).as_vec3();
        let towards = point.position - near.light.as_dvec3();
        geometry.closest(origin, towards).is_none_or(|hit| hit.t >= 1.0)
    };
    let seen: Vec<bool> = near.points.iter().map(is_seen).collect();
    let mut added = vec![0.0; near.points.len()];
    for (&(distance, position, normal, flux), clearance) in hits.iter().zip(clearances) {
        let weight = |point: &Point| {
            let off = point.position.distance_squared(position) / (16.0 * near.spacing).powi(2);
            let is_level = (point.position - position).dot(normal).abs() < clearance;
            if off < 1.0 && is_level && point.normal.dot(normal) > 0.7 { 1.0 - off } else { 0.0 }
        };
        let sharing = || near.points.iter().zip(&seen).enumerate().filter(|(_, (_, seen))| **seen);
        let sum: f64 = sharing().map(|(_, (point, _))| weight(point) * point.area_m2).sum();
        for (index, (point, _)) in sharing().filter(|_| sum > 0.0) {
            added[index] += weight(point) / sum * by_rays(distance) * flux;
        }
    }
    let correction = |(point, added): (&Point, f64)| {
        let distance = point.position.distance(near.light.as_dvec3());
        let by_rays = by_rays(distance);
        // The clamp of 1/d² loses light, which the correction restores here.
        let excess = if distance < reach { strength * near.area_m2 / PI / distance.powi(2) } else { 0.0 };
        [if by_rays < 1.0 { (1.0 - by_rays) * (1.0 + excess) } else { 0.0 }, added]
    };
    near.points.iter().zip(added).map(correction).collect()
}
