//! Reference of the density estimate: sums over every photon.

use crate::cpu::photons::{SurfacePoint, is_within_reach, kernel};
use glam::DVec3;

/// Σ flux·kernel over the photons around a point, over the kernel's mass (m²): W/m².
pub fn photon_irradiance(
    point: SurfacePoint,
    reach: [u8; 16],
    photons: &[(SurfacePoint, DVec3)],
    mass: DVec3,
    radius: f64,
) -> DVec3 {
    let fraction = |(photon, flux): &(SurfacePoint, DVec3)| {
        let seen = is_within_reach(reach, point, *photon, radius);
        if seen { kernel(point, *photon, radius) * *flux } else { DVec3::ZERO }
    };
    let sum: DVec3 = photons.iter().map(fraction).sum();
    DVec3::select(mass.cmpgt(DVec3::ZERO), sum / mass, DVec3::ZERO)
}
