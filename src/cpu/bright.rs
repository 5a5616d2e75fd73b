//! Reference of the rays to bright clusters, and of which clusters are bright.

use crate::cpu::rays::Geometry;
use crate::types::CachePoint;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// Where a base cluster is sampled, and the light that it reflects.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    /// The site at which rays end.
    pub position: Vec3,
    /// 2·triangle + (1 if the back side).
    pub side: u32,
    /// Nearer points read the cluster by their gather rays, metres.
    pub reach: f64,
    /// Direct light that it reflects, W.
    pub light: DVec3,
}

/// Least radiant exitance of bright clusters, W/m²; infinite if none may be bright. `watched`:
/// light (W) and area (m²) of each watched cluster. `bright`: least exitance over the mean;
/// `contrast`: least mean exitance of light over that of area.
pub fn threshold(watched: &[(f64, f64)], bright: f64, contrast: f64) -> f64 {
    let light: f64 = watched.iter().map(|(light, _)| light).sum();
    let area: f64 = watched.iter().map(|(_, area)| area).sum();
    let of_light: f64 = watched.iter().map(|(light, area)| light * light / area).sum::<f64>() / light;
    let mean = light / area;
    if of_light > contrast * mean { bright * mean } else { f64::INFINITY }
}

impl Source {
    /// Whether a ray from a cache point to the site counts and meets nothing.
    pub fn is_seen_from(&self, point: &CachePoint, geometry: &Geometry<'_>) -> bool {
        let facet = geometry.normal(self.side);
        let origin = geometry.offset_origin(point.position, point.facet);
        let end = geometry.offset_origin(self.position, facet).as_dvec3();
        let to_site = end - origin.as_dvec3();
        let is_facing = [point.normal, point.facet].iter().all(|n| n.as_dvec3().dot(to_site) > 0.0)
            && facet.as_dvec3().dot(to_site) < 0.0;
        is_facing
            && to_site.length() > self.reach
            && geometry.closest(origin, to_site).is_none_or(|hit| hit.t >= 1.0)
    }

    /// Irradiance of a point with a shading normal from a site that it sees, W/m².
    pub fn irradiance(&self, (position, normal): (DVec3, DVec3), geometry: &Geometry<'_>) -> DVec3 {
        let facet = geometry.normal(self.side);
        let to_site = geometry.offset_origin(self.position, facet).as_dvec3() - position;
        let cosines = normal.dot(to_site) * -facet.as_dvec3().dot(to_site);
        self.light * cosines / (PI * to_site.length_squared().powi(2))
    }
}
