//! Reference of the blend.

use crate::types::{CachePoint, Record};
use glam::{DMat3, DVec3};

/// Irradiance and gradients at a point: the weighted mean of its neighbours' records, each
/// extrapolated by the mean of the gradients at both ends.
pub fn blend(point: &CachePoint, weights: &[(Record, f32)]) -> (DVec3, DMat3, DMat3) {
    let normal = point.normal.as_dvec3();
    let (mut irradiance, mut offset) = (DVec3::ZERO, DVec3::ZERO);
    let (mut translation, mut rotation) = (DMat3::ZERO, DMat3::ZERO);
    for (record, weight) in weights {
        let weight = f64::from(*weight);
        let moved = point.position.as_dvec3() - record.position.as_dvec3();
        let [along, turned] = [record.translation.as_dmat3(), record.rotation.as_dmat3()];
        let change = 0.5 * along.transpose() * moved + turned.transpose() * normal;
        irradiance += weight * (record.irradiance.as_dvec3() + change).max(DVec3::ZERO);
        offset += weight * moved;
        translation += along * weight;
        rotation += turned * weight;
    }
    irradiance = (irradiance + 0.5 * translation.transpose() * offset).max(DVec3::ZERO);
    // The component of the mean rotation along the point's own normal is no rotation.
    let along_normal = rotation.transpose() * normal;
    rotation -= DMat3::from_cols(normal * along_normal.x, normal * along_normal.y, normal * along_normal.z);
    (irradiance, translation, rotation)
}

/// Whether the blend clamps a value at zero.
pub fn is_limited(point: &CachePoint, weights: &[(Record, f32)]) -> bool {
    let place = point.position.as_dvec3();
    let (mut sum, mut offset, mut translation) = (DVec3::ZERO, DVec3::ZERO, DMat3::ZERO);
    let mut is_limited = false;
    for (record, weight) in weights {
        let (weight, along) = (f64::from(*weight), record.translation.as_dmat3());
        let moved = place - record.position.as_dvec3();
        let turned = record.rotation.as_dmat3().transpose() * point.normal.as_dvec3();
        let value = record.irradiance.as_dvec3() + 0.5 * along.transpose() * moved + turned;
        is_limited |= value.min_element() < 0.0;
        sum += weight * value.max(DVec3::ZERO);
        offset += weight * moved;
        translation += along * weight;
    }
    is_limited || (sum + 0.5 * translation.transpose() * offset).min_element() < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use glam::{Mat3, Vec3};

    #[test]
    fn what_would_fall_below_zero_is_told() {
        let point = CachePoint { position: Vec3::X, normal: Vec3::Z, ..CachePoint::zeroed() };
        // Light that changes by so much a metre along x.
        let record = |x: f32, slope: f32| Record {
            position: x * Vec3::X,
            irradiance: Vec3::ONE,
            translation: Mat3::from_cols(Vec3::new(slope, 0.0, 0.0), Vec3::ZERO, Vec3::ZERO),
            ..Record::zeroed()
        };
        assert!(!is_limited(&point, &[(record(0.0, -0.9), 1.0)]));
        assert!(is_limited(&point, &[(record(0.0, -2.1), 0.5), (record(1.0, 3.0), 0.5)]), "one of them");
        // Each way alone ends above zero, but the mean of the gradients is steeper than that of the
        // one to the left.
        let [left, here] = [record(0.0, 0.0), record(1.0, -9.0)];
        assert!(!is_limited(&point, &[(left, 0.2), (here, 0.8)]));
        assert!(is_limited(&point, &[(left, 0.5), (here, 0.5)]), "their sum");
    }
}
