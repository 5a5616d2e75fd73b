//! Small geometry; twin of `glsl/include/math.glsl`.

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

/// Moves a ray origin off its surface, towards `normal`, by 32 units in the last place of the scene's largest coordinate
/// `reach`; twin of `offset_origin` in `glsl/include/bvh.glsl`. Metres.
pub fn offset_origin(p: Vec3, normal: Vec3, reach: f32) -> Vec3 {
    p + normal * (reach / 262_144.0)
}
