//! Twin of the splat weights: asks every record about every pixel.

use crate::cpu::records::record_weight;
use crate::types::{CachePoint, PixelSurface};
use glam::Vec3;

/// Records that serve a pixel, which lies on a facet with that geometric normal, in ascending order, with the weights that they claim, not yet normalised.
pub fn splat(pixel: &PixelSurface, facet: Vec3, records: &[CachePoint]) -> Vec<(u32, f32)> {
    let weights =
        (0..).zip(records).map(|(index, r)| (index, record_weight(pixel.position, pixel.normal, facet, r)));
    weights.filter(|&(_, weight)| weight > 0.0).collect()
}

/// How well a record fits a pixel that none covers; twin of `splat_nearest`, which takes the best.
pub fn fitness(pixel: &PixelSurface, facet: Vec3, record: &CachePoint) -> f32 {
    let weight = record_weight(pixel.position, pixel.normal, facet, record);
    // Behind its wall, in front of or behind its plane: the further, the worse.
    if weight == 0.0 { -1e10 * pixel.position.distance(record.position) } else { weight }
}
