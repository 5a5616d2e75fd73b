//! Twin of the splat weights: asks every record about every pixel.

use crate::cpu::records::record_weight;
use crate::types::{CachePoint, PixelSurface};

/// Records that serve a pixel, in ascending order, with the weights that they claim, not yet normalised.
pub fn splat(pixel: &PixelSurface, records: &[CachePoint]) -> Vec<(u32, f32)> {
    let weights =
        (0..).zip(records).map(|(index, r)| (index, record_weight(pixel.position, pixel.normal, r)));
    weights.filter(|&(_, weight)| weight > 0.0).collect()
}

/// How well a record fits a pixel that none covers; twin of `splat_nearest`, which takes the best.
pub fn fitness(pixel: &PixelSurface, record: &CachePoint) -> f32 {
    let weight = record_weight(pixel.position, pixel.normal, record);
    // Behind its wall, in front of or behind its plane: the further, the worse.
    if weight == 0.0 { -1e10 * pixel.position.distance(record.position) } else { weight }
}
