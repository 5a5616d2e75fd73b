//! Twin of the splat weights: asks every record about every pixel.

use crate::cpu::records::record_weight;
use crate::types::{CachePoint, PixelSurface};

/// Records that serve a pixel, in ascending order, with the weights that they claim, not yet normalised.
pub fn splat(pixel: &PixelSurface, records: &[CachePoint]) -> Vec<(u32, f32)> {
    let weights =
        (0..).zip(records).map(|(index, r)| (index, record_weight(pixel.position, pixel.normal, r)));
    weights.filter(|&(_, weight)| weight > 0.0).collect()
}
