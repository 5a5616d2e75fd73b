//! Reference of the splat values.

use crate::types::{PixelSurface, Record};
use glam::{DMat3, DVec3};

/// Indirect irradiance at a pixel, W/m²: the weighted mean of its extrapolated records. The
/// gradient along each offset is the mean of those at the record and at the pixel, so that
/// curvature terms cancel; the latter is the records' own mean. A negative weight marks a
/// record that does not cover the pixel: its extrapolated value is clamped between half and
/// double its irradiance.
pub fn splat_apply(pixel: &PixelSurface, weights: &[(Record, f32)]) -> DVec3 {
    let (mut irradiance, mut offset, mut translation) = (DVec3::ZERO, DVec3::ZERO, DMat3::ZERO);
    for (record, weight) in weights {
        let is_uncovered = *weight < 0.0;
        let weight = f64::from(weight.abs());
        let moved = pixel.position.as_dvec3() - record.position.as_dvec3();
        let [mut along, turned] = [record.translation.as_dmat3(), record.rotation.as_dmat3()];
        let mut change = 0.5 * along.transpose() * moved + turned.transpose() * pixel.normal.as_dvec3();
        if is_uncovered {
            let irradiance = record.irradiance.as_dvec3();
            change = change.clamp(-0.5 * irradiance, irradiance);
            along = DMat3::ZERO;
        }
        irradiance += weight * (record.irradiance.as_dvec3() + change).max(DVec3::ZERO);
        offset += weight * moved;
        translation += along * weight;
    }
    (irradiance + 0.5 * translation.transpose() * offset).max(DVec3::ZERO)
}
