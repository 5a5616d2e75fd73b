//! Validity of cache records; twin of `glsl/include/records.glsl`, and what placement decides by.

use crate::types::CachePoint;
use glam::Vec3;

/// Cosine of the angle up to which facets share records.
pub const FACETS_ALIKE: f32 = 0.9;

/// How far from its own a point may lie, in height and normals, that a record speaks for.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    above2: f32,
    below2: f32,
    facets: f32,
    inverse_normal_error: f32,
}

impl Tolerance {
    /// What a record is valid for: 1 / sqrt(1 - cos 10°) between normals, 12° over the plane between both and 4° under it.
    /// [Tabellion §4; Ward]
    pub const VALID: Self =
        Self { above2: 0.04, below2: 0.004, facets: FACETS_ALIKE, inverse_normal_error: 8.1131 };
    /// Where no other record does: 45° over the plane, 30° under it, 60° between facets, 30° between normals.
    pub const STRETCHED: Self = Self { above2: 0.5, below2: 0.25, facets: 0.5, inverse_normal_error: 2.7321 };
}

/// Weight of a record at a point `x` with shading normal `n`, on a facet with that geometric normal: positive inside its validity,
/// 1 at its centre.
pub fn record_weight(x: Vec3, n: Vec3, facet: Vec3, record: &CachePoint) -> f32 {
    record_weight_within(x, n, facet, record, Tolerance::VALID)
}

/// The same with another tolerance.
pub fn record_weight_within(x: Vec3, n: Vec3, facet: Vec3, record: &CachePoint, within: Tolerance) -> f32 {
    let d = x - record.position;
    let distance2 = d.dot(d);
    let height = 0.5 * d.dot(record.normal + n);
    let reach = 0.01 * record.radius;
    let height2 = if height > 0.0 { within.above2 } else { within.below2 };
    if height * height > height2 * (distance2 + reach * reach) || d.dot(record.wall) > 1.0 {
        return 0.0;
    }
    if facet.dot(record.facet) < within.facets {
        return 0.0;
    }
    let position_error = distance2.sqrt() / record.radius;
    let normal_error = (1.0 - n.dot(record.normal)).max(0.0).sqrt() * within.inverse_normal_error;
    1.0 - position_error.max(normal_error)
}
