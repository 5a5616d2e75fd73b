//! Reference of the splat weights: asks every record about every pixel.

use crate::cpu::records::{Tolerance, splat_weight};
use crate::types::{CachePoint, PixelSurface};
use glam::Vec3;

/// Records that serve a pixel, which lies on a facet with that geometric normal, in ascending
/// order, with the weights that they claim, not yet normalised.
pub fn splat(
    pixel: &PixelSurface,
    facet: Vec3,
    records: &[CachePoint],
    within: Tolerance,
) -> Vec<(u32, f32)> {
    let weight = |record| splat_weight(pixel.position, pixel.normal, facet, record, within);
    let weights = (0..).zip(records).map(|(index, record)| (index, weight(record)));
    weights.filter(|&(_, weight)| weight > 0.0).collect()
}

/// How well a record fits a pixel that none covers or reaches when relaxed; mirrors
/// `splat_nearest`, which takes the best. The further and the more turned, the worse.
pub fn fitness(pixel: &PixelSurface, record: &CachePoint) -> f32 {
    -pixel.position.distance(record.position) * (20.0 - 19.0 * pixel.normal.dot(record.normal))
}
