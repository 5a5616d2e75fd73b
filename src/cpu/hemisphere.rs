//! Mirrors `glsl/include/gather.glsl`: the stratified hemisphere.

use crate::cpu::math::frame_around;
use crate::cpu::sampling::{hash_pair, sample_3d, sample_cosine};
use glam::{DMat3, DVec2, DVec3, Vec3};
use std::f64::consts::TAU;

/// Rings of equal cosine-weighted solid angle with sectors; rays are ordered ring by ring.
#[derive(Clone, Copy, Debug)]
pub struct Strata {
    /// Rings of equal projected solid angle.
    pub rings: u32,
    /// Sectors of each ring.
    pub sectors: u32,
}

impl Strata {
    /// Total number of rays.
    pub fn rays(self) -> u32 {
        self.rings * self.sectors
    }

    /// Ring and sector of a ray.
    pub fn of(self, ray: u32) -> [u32; 2] {
        [ray / self.sectors, ray % self.sectors]
    }

    /// Local direction (z = normal) of a ray of the hemisphere that `stream` selects.
    pub fn direction(self, ray: u32, stream: u32, seed: u32) -> DVec3 {
        let [ring, sector] = self.of(ray).map(f64::from);
        let jitter = sample_3d(stream, hash_pair(ray, seed)).as_dvec3();
        sample_cosine(DVec2::new(
            (ring + jitter.x) / f64::from(self.rings),
            (sector + jitter.y) / f64::from(self.sectors),
        ))
    }

    /// Polar angle of the lower edge of a ring; one past the last ring it is the horizon.
    pub fn polar_edge(self, ring: u32) -> f64 {
        (f64::from(ring) / f64::from(self.rings)).sqrt().asin()
    }

    /// Polar angle of the middle of a ring: half of the ring's solid angle lies below.
    pub fn polar_middle(self, ring: u32) -> f64 {
        ((f64::from(ring) + 0.5) / f64::from(self.rings)).sqrt().asin()
    }

    /// Azimuth of the lower edge of a sector.
    pub fn azimuth_edge(self, sector: u32) -> f64 {
        TAU * f64::from(sector) / f64::from(self.sectors)
    }

    /// Azimuth of the middle of a sector.
    pub fn azimuth_middle(self, sector: u32) -> f64 {
        TAU * (f64::from(sector) + 0.5) / f64::from(self.sectors)
    }
}

/// The frame that local directions refer to, in f64.
pub fn frame(normal: Vec3) -> DMat3 {
    frame_around(normal).as_dmat3()
}
