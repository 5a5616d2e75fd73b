//! Small geometry; mirrors `glsl/include/math.glsl`.

use crate::scene::CellSizes;
use crate::types::Node;
use glam::{Mat3, Vec3};

/// Orthonormal frame around a unit vector; columns tangent, bitangent, n. [Duff 2017]
pub fn frame_around(n: Vec3) -> Mat3 {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    let b = n.x * n.y * a;
    Mat3::from_cols(
        Vec3::new(1.0 + s * n.x * n.x * a, s * b, -s * n.x),
        Vec3::new(b, s + n.y * n.y * a, -n.y),
        n,
    )
}

/// Offset of ray origins from surfaces; mirrors `clear_distance` in `glsl/include/bvh.glsl`.
#[derive(Clone, Copy, Debug)]
pub struct ClearDistance {
    /// Largest coordinate; in a scene with regions of small cells, the least that counts, metres.
    coordinate_m: f32,
    /// Whether the offset follows the position.
    is_local: bool,
}

impl ClearDistance {
    /// That of a scene whose tree has this root.
    pub fn new(root: &Node, sizes: &CellSizes) -> Self {
        let cell = |axis: u32| f32::from_bits((root.frame.w >> (8 * axis) & 0xff) << 23);
        let low = root.origin();
        let high = low + 255.0 * Vec3::new(cell(0), cell(1), cell(2));
        let scene = || low.abs().max(high.abs()).max_element();
        let least = sizes.least_side_m();
        Self { coordinate_m: least.unwrap_or_else(scene), is_local: least.is_some() }
    }

    /// The offset at a position, metres: some 32 units in the last place.
    pub fn at(self, position: Vec3) -> f32 {
        let own = if self.is_local { position.abs().max_element() } else { 0.0 };
        own.max(self.coordinate_m) / 262_144.0
    }
}
