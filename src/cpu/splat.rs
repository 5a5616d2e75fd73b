//! Reference of the splat weights: tests every record at every pixel.

use crate::cpu::records::{Tolerance, record_weight};
use crate::types::{CachePoint, PixelSurface};
use glam::Vec3;

/// Records of a pixel in ascending order, with weights that are not normalised yet; `facet` is the
/// geometric normal at the pixel.
pub fn splat(
    pixel: &PixelSurface,
    facet: Vec3,
    records: &[CachePoint],
    within: Tolerance,
) -> Vec<(u32, f32)> {
    let weight = |record| record_weight(pixel.position, pixel.normal, facet, record, within);
    let weights = (0..).zip(records).map(|(index, record)| (index, weight(record)));
    weights.filter(|&(_, weight)| weight > 0.0).collect()
}

/// Fitness of a record for an uncovered pixel without a relaxed record: it falls with the distance
/// and the angle. Mirrors `splat_nearest`, which takes the best record.
pub fn fitness(pixel: &PixelSurface, record: &CachePoint) -> f32 {
    -pixel.position.distance(record.position) * (20.0 - 19.0 * pixel.normal.dot(record.normal))
}
