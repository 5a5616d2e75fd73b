//! Twin of the splat values.

use crate::types::{PixelSurface, Record};
use glam::{DMat3, DVec3};

/// Indirect irradiance at a pixel, W/m²: its records, extrapolated, in their shares. Along each way the gradient is the mean of
/// that at the record and that at the pixel, which is the records' own mean: what irradiance bends cancels.
pub fn splat_apply(pixel: &PixelSurface, shares: &[(Record, f32)]) -> DVec3 {
    let (mut irradiance, mut offset, mut translation) = (DVec3::ZERO, DVec3::ZERO, DMat3::ZERO);
    for (record, share) in shares {
        let share = f64::from(*share);
        let moved = pixel.position.as_dvec3() - record.position.as_dvec3();
        let [along, turned] = [record.translation.as_dmat3(), record.rotation.as_dmat3()];
        let change = 0.5 * along.transpose() * moved + turned.transpose() * pixel.normal.as_dvec3();
        irradiance += share * (record.irradiance.as_dvec3() + change).max(DVec3::ZERO);
        offset += share * moved;
        translation += along * share;
    }
    (irradiance + 0.5 * translation.transpose() * offset).max(DVec3::ZERO)
}
