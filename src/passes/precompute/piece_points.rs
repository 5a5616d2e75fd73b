//! Points on pieces of the surface.

use crate::cpu::sampling::hash;
use glam::Vec3;

/// Uniform point in a convex polygon.
pub(super) fn point_in_polygon(corners: &[Vec3], u: [f32; 2]) -> Vec3 {
    let area = |i: usize| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]).length();
    let total: f32 = (1..corners.len() - 1).map(area).sum();
    let mut rest = u[0] * total;
    let mut fan = 1;
    while fan + 2 < corners.len() && rest > area(fan) {
        rest -= area(fan);
        fan += 1;
    }
    let along = (rest / area(fan).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0).sqrt();
    let side = corners[fan].lerp(corners[fan + 1], u[1]);
    corners[0].lerp(side, along)
}

/// Point of the two-dimensional additive recurrence on the plastic number, shifted by a seed.
pub(super) fn plane_sequence(index: u32, seed: u32) -> [f32; 2] {
    // 1/g and 1/g², g³ = g + 1.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let shift = [f64::from(seed), f64::from(hash(seed))].map(|bits| bits / 4_294_967_296.0);
    [0, 1].map(|axis| (shift[axis] + f64::from(index) * STEPS[axis]).fract() as f32)
}
