//! Packing of the gradients of merged rays: two numbers with a common exponent.
//! `glsl/gather.comp` reads it. In: gradients in their units. Out: a word's bits.

use crate::cpu::gather::power_of_two;
use glam::DVec2;

/// Packing of two numbers of `mantissa` bits, the first in the low bits, and their
/// common exponent above.
#[derive(Clone, Copy)]
pub(super) struct Pair {
    mantissa: u32,
    exponent: u32,
}

/// In narrow cavities translational weights are large and cancel: they need more bits
/// than rotational ones.
pub(super) const MOVEMENT: Pair = Pair { mantissa: 8, exponent: 5 };
pub(super) const ROTATION: Pair = Pair { mantissa: 4, exponent: 3 };

impl Pair {
    pub(super) fn bits(self) -> u32 {
        2 * self.mantissa + self.exponent
    }

    /// The largest number without an exponent.
    fn most(self) -> f64 {
        f64::from((1 << (self.mantissa - 1)) - 1)
    }

    fn last_exponent(self) -> i32 {
        (1 << self.exponent) - 1
    }

    pub(super) fn largest(self) -> f64 {
        self.most() * 2f64.powi(self.last_exponent())
    }

    /// Rounds to the nearest number, and clamps to the largest.
    pub(super) fn pack(self, values: DVec2) -> u32 {
        let most = self.most();
        let largest = values.abs().max_element();
        let fits = |&exponent: &i32| scaled(largest, exponent) <= most;
        // Smaller exponents cannot fit, because rounding adds at most one half.
        let first = exponent_of(largest / (most + 0.5)).clamp(0, self.last_exponent());
        let exponent = (first..self.last_exponent()).find(fits).unwrap_or(self.last_exponent());
        let mantissa = |value: f64| {
            scaled(value, exponent).clamp(-most, most) as i32 as u32 & ((1 << self.mantissa) - 1)
        };
        mantissa(values.x) | mantissa(values.y) << self.mantissa | (exponent as u32) << (2 * self.mantissa)
    }
}

/// `value` over two to the `exponent`, rounded to the nearest integer.
fn scaled(value: f64, exponent: i32) -> f64 {
    let scaled = value * power_of_two(-exponent);
    // The sum has no fractions. Values from 2^51 on are beyond all pairs and are clamped.
    const ROUND: f64 = 1.5 * (1_u64 << 52) as f64;
    if scaled.abs() < (1_u64 << 51) as f64 { scaled + ROUND - ROUND } else { scaled }
}

/// The largest integer e with 2^e ≤ `value`; -1023 for subnormal numbers and zero.
fn exponent_of(value: f64) -> i32 {
    (value.to_bits() >> 52 & 0x7ff) as i32 - 1023
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::hash;

    /// A smaller exponent would keep more bits; numbers close to powers of two decide.
    #[test]
    fn pairs_take_the_smallest_exponent_that_fits() {
        for pair in [MOVEMENT, ROTATION] {
            for i in 0..40_000 {
                let size = 2f64.powi((hash(i) % 44) as i32 - 6);
                let step = f64::from(hash(i ^ 0x9e37) % 9) - 4.0;
                let value = match i % 3 {
                    0 => size * f64::from(hash(!i)) / f64::from(u32::MAX),
                    1 => size * (1.0 + step * f64::EPSILON),
                    _ => (pair.most() + 0.5) * size * (1.0 + step * f64::EPSILON),
                };
                let fits = |exponent: &i32| (value * 2f64.powi(-exponent)).round_ties_even() <= pair.most();
                let last = pair.last_exponent();
                let wanted = (0..last).find(fits).unwrap_or(last);
                let packed = pair.pack(DVec2::new(0.0, -value));
                assert_eq!((packed >> (2 * pair.mantissa)) as i32, wanted, "{value}");
                let mantissa = (value * 2f64.powi(-wanted)).round_ties_even().min(pair.most());
                let bits = packed >> pair.mantissa & ((1 << pair.mantissa) - 1);
                assert_eq!(bits, -mantissa as i32 as u32 & ((1 << pair.mantissa) - 1), "{value}");
            }
        }
    }
}
