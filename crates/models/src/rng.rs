//! Seeded random numbers, the same on every machine.

/// A linear congruential generator (Knuth's MMIX constants); it uses the upper bits.
#[derive(Debug)]
pub(super) struct Rng(u64);

impl Rng {
    /// A sequence that depends on the seed.
    pub(super) fn new(seed: u64) -> Self {
        let mut rng = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        rng.fraction();
        rng
    }

    /// Uniform in 0..1.
    pub(super) fn fraction(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 32) as f64 / f64::from(u32::MAX).mul_add(1.0, 1.0)
    }

    /// Uniform between two numbers.
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.fraction()
    }

    /// A uniform integer below `count`.
    pub(super) fn pick(&mut self, count: usize) -> usize {
        (self.fraction() * count as f64) as usize
    }
}
