//! Reference of the irradiance probe: one path at a time.

use crate::cpu::hemisphere::{Strata, frame};
use crate::cpu::path_trace::Paths;
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::CachePoint;
use glam::DVec3;
use std::f64::consts::PI;

/// Inputs of the probe paths.
#[derive(Clone, Copy)]
pub struct Probe<'a> {
    /// Scene, lights, seed and roulette; its camera is unused.
    pub paths: Paths<'a>,
    /// Strata of the hemisphere.
    pub strata: Strata,
    /// Seed of the gather rays whose directions the paths take. `None`: new directions
    /// in each stratum.
    pub gather_seed: Option<u32>,
}

impl Probe<'_> {
    /// Indirect irradiance at cache point number `index` from `samples` paths of
    /// each stratum, W/m².
    pub fn irradiance(&self, point: &CachePoint, index: u32, samples: u32) -> DVec3 {
        let rays = (0..self.strata.rays()).flat_map(|ray| (0..samples).map(move |sample| (ray, sample)));
        let sum: DVec3 = rays.map(|(ray, sample)| self.radiance(point, index, ray, sample)).sum();
        PI / f64::from(self.strata.rays()) / f64::from(samples) * sum
    }

    /// Radiance of path number `sample` of a stratum, W/m²/sr.
    fn radiance(&self, point: &CachePoint, index: u32, ray: u32, sample: u32) -> DVec3 {
        let geometry = self.paths.scene.geometry;
        let point_seed = hash_pair(self.paths.seed, index);
        let local = match self.gather_seed {
            Some(seed) => self.strata.direction(ray, point.stream, seed),
            None => self.strata.direction(ray, sample, point_seed),
        };
        let mut origin = geometry.offset_origin(point.position, point.facet);
        let mut direction = frame(point.normal) * local;
        let (mut throughput, mut radiance) = (DVec3::ONE, DVec3::ZERO);
        if direction.dot(point.facet.as_dvec3()) <= 0.0 {
            return radiance;
        }
        for depth in 1.. {
            let Some(hit) = geometry.closest(origin, direction) else { break };
            let vertex = self.paths.scene.vertex(&hit, direction, false);
            let seed = hash_pair(hash_pair(point_seed, ray), depth);
            radiance += throughput * self.paths.reflected_light(&vertex, sample, seed, &mut 0);
            let u = sample_3d(sample, seed).as_dvec3();
            let Some(next) = self.paths.reflect(&vertex, u, &mut throughput) else { break };
            origin = geometry.offset_origin(vertex.position, vertex.geometric);
            direction = next;
        }
        radiance
    }
}
