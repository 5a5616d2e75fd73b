//! Small geometry; mirrors `glsl/include/math.glsl`.

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

/// Offset of ray origins from surfaces, metres: some 32 units in the last place of the root node's
/// largest coordinate; mirrors `clear_distance` in `glsl/include/bvh.glsl`.
pub fn clear_distance(root: &Node) -> f32 {
    let cell = |axis: u32| f32::from_bits((root.frame.w >> (8 * axis) & 0xff) << 23);
    let low = root.origin();
    let high = low + 255.0 * Vec3::new(cell(0), cell(1), cell(2));
    low.abs().max(high.abs()).max_element() / 262_144.0
}
