//! Twin of the splat values.

use crate::types::{PixelSurface, Record};
use glam::DVec3;

/// Indirect irradiance at a pixel, W/m²: its records, extrapolated, in their shares.
pub fn splat_apply(pixel: &PixelSurface, shares: &[(Record, f32)]) -> DVec3 {
    let mut irradiance = DVec3::ZERO;
    for (record, share) in shares {
        let moved = pixel.position.as_dvec3() - record.position.as_dvec3();
        let turned = pixel.normal.as_dvec3();
        let change = |channel: usize| {
            record.translation.col(channel).as_dvec3().dot(moved)
                + record.rotation.col(channel).as_dvec3().dot(turned)
        };
        let change = DVec3::new(change(0), change(1), change(2));
        irradiance += f64::from(*share) * (record.irradiance.as_dvec3() + change).max(DVec3::ZERO);
    }
    irradiance
}
