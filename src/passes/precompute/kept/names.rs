//! Names of results: hashes of what they follow from beside the surface around them.

use crate::cache_file::hash;
use crate::types::CachePoint;
use glam::Vec3;

/// Name of a result.
pub type Name = [u64; 2];

/// Name of what follows from some vectors and words.
pub fn name_of(vectors: impl IntoIterator<Item = Vec3>, words: [u32; 2]) -> Name {
    let vectors = vectors.into_iter().flat_map(|v| v.to_array().map(f32::to_bits));
    let words: Vec<u32> = vectors.chain(words).collect();
    hash(bytemuck::cast_slice(&words))
}

/// Name of what follows from a point of the surface.
pub fn name_of_point(point: &CachePoint) -> Name {
    name_of([point.position, point.facet, point.normal], [point.side & 1, point.stream])
}
