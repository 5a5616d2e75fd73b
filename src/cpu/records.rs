//! Validity of cache records; twin of `glsl/include/records.glsl`, and what placement decides by.

use crate::types::CachePoint;
use glam::Vec3;

/// 1 / sqrt(1 - cos 10°). [Tabellion]
const INVERSE_NORMAL_ERROR: f32 = 8.1131;

/// Cosine of the angle up to which facets share records.
pub const FACETS_ALIKE: f32 = 0.9;

/// Weight of a record at a point `x` with shading normal `n`, on a facet with that geometric normal: positive inside its validity,
/// 1 at its centre.
pub fn record_weight(x: Vec3, n: Vec3, facet: Vec3, record: &CachePoint) -> f32 {
    let d = x - record.position;
    let distance2 = d.dot(d);
    let height = d.dot(record.normal);
    let reach = 0.01 * record.radius;
    if height * height > 0.1 * (distance2 + reach * reach) || d.dot(record.wall) > 1.0 {
        return 0.0;
    }
    if facet.dot(record.facet) < FACETS_ALIKE {
        return 0.0;
    }
    let position_error = distance2.sqrt() / record.radius;
    let normal_error = (1.0 - n.dot(record.normal)).max(0.0).sqrt() * INVERSE_NORMAL_ERROR;
    1.0 - position_error.max(normal_error)
}
