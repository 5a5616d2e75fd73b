//! Reference of the near field.

use crate::types::Record;
use glam::{DVec3, Vec3};

/// Irradiance of a small cluster or patch, W/m²: its own direct irradiance, and that of the record
/// beside it, extrapolated by `offset` (m) and clamped at zero.
pub fn near_field(direct_irradiance: DVec3, record: &Record, offset: Vec3) -> DVec3 {
    let change = record.translation.as_dmat3().transpose() * offset.as_dvec3();
    direct_irradiance + (record.irradiance.as_dvec3() + change).max(DVec3::ZERO)
}
