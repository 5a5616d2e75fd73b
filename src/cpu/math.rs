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

/// Moves a ray origin off its surface by a few units in the last place of the coordinate.
pub fn offset_origin(p: Vec3, normal: Vec3) -> Vec3 {
    // [WaechterBinder]
    let component = |p: f32, n: f32| {
        if p.abs() < 1.0 / 32.0 {
            return p + n / 65536.0;
        }
        let steps = (256.0 * n) as i32;
        f32::from_bits((p.to_bits() as i32 + if p < 0.0 { -steps } else { steps }) as u32)
    };
    Vec3::new(component(p.x, normal.x), component(p.y, normal.y), component(p.z, normal.z))
}
