//! The direction bins of outgoing radiance: an equal-area map of the sphere to the unit
//! square. [Clarberg 2008]

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// A grid of `side`² bins of equal solid angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Directions {
    /// Bins along an edge of the square.
    pub side: u32,
}

impl Directions {
    /// The largest square grid of at most `count` bins; one bin at least.
    pub fn new(count: u32) -> Self {
        Self { side: count.isqrt().max(1) }
    }

    /// Number of bins.
    pub fn count(self) -> u32 {
        self.side * self.side
    }

    /// The bin of a unit direction.
    pub fn bin(self, direction: DVec3) -> u32 {
        let side = f64::from(self.side);
        let place = (square(direction) * side).clamp(DVec2::ZERO, DVec2::splat(side - 1.0)).as_uvec2();
        place.y * self.side + place.x
    }

    /// Unit direction through the middle of a bin.
    pub fn middle(self, bin: u32) -> DVec3 {
        let place = DVec2::new(f64::from(bin % self.side), f64::from(bin / self.side)) + 0.5;
        sphere(place / f64::from(self.side))
    }
}

/// Exponent of the sharpest Phong lobe that this number of directions resolves: a bin is as wide as
/// the lobe at half its height.
///
/// cosⁿα falls to a half at α² ≈ 2 ln 2/n; the cap of that radius covers the fraction α²/4
/// of the sphere.
pub fn resolved_exponent(directions: u32) -> f32 {
    (f64::from(directions) * 2.0 * std::f64::consts::LN_2 / 4.0) as f32
}

/// Number of directions that resolves a Phong lobe of that exponent: the next square.
pub fn directions_for(exponent: f32) -> u32 {
    let count = f64::from(exponent) * 2.0 / std::f64::consts::LN_2;
    (count.sqrt().ceil() as u32).pow(2)
}

/// Maps a unit direction to the unit square.
fn square(direction: DVec3) -> DVec2 {
    let flat = direction.truncate().abs();
    let radius = (1.0 - direction.z.abs()).max(0.0).sqrt();
    let along = radius * flat.y.atan2(flat.x) / FRAC_PI_2;
    let inner = DVec2::new(radius - along, along);
    let place = if direction.z < 0.0 { 1.0 - DVec2::new(inner.y, inner.x) } else { inner };
    0.5 + 0.5 * place.copysign(direction.truncate())
}

/// Maps a point of the unit square to its direction.
fn sphere(place: DVec2) -> DVec3 {
    let place = 2.0 * place - 1.0;
    let flat = place.abs();
    let height = 1.0 - flat.element_sum();
    let radius = 1.0 - height.abs();
    let angle = if radius > 0.0 { ((flat.y - flat.x) / radius + 1.0) * FRAC_PI_4 } else { 0.0 };
    let width = radius * (2.0 - radius * radius).max(0.0).sqrt();
    let around = DVec2::new(angle.cos(), angle.sin()).copysign(place) * width;
    around.extend((1.0 - radius * radius).copysign(height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_their_middles_and_equal_shares_of_the_sphere() {
        for side in [1, 2, 3, 12, 16] {
            let directions = Directions { side };
            for bin in 0..directions.count() {
                let middle = directions.middle(bin);
                assert!((middle.length() - 1.0).abs() < 1e-12);
                // The middle of an odd grid is the pole, where four bins meet.
                assert!(directions.bin(middle) == bin, "{bin} of {side}²");
            }
            let mut counts = vec![0_u32; directions.count() as usize];
            let samples = 400 * directions.count();
            for index in 0..samples {
                // A spherical Fibonacci lattice.
                let z = 1.0 - (2.0 * f64::from(index) + 1.0) / f64::from(samples);
                let azimuth = f64::from(index) * 2.399_963_229_728_653;
                let radius = (1.0 - z * z).sqrt();
                counts[directions.bin(DVec3::new(radius * azimuth.cos(), radius * azimuth.sin(), z))
                    as usize] += 1;
            }
            assert!(counts.iter().all(|&count| (360..=440).contains(&count)), "{side}: {counts:?}");
        }
        assert_eq!(Directions::new(256).side, 16);
        assert_eq!(Directions::new(255).side, 15);
    }

    #[test]
    fn the_papers_directions_resolve_the_papers_exponent() {
        assert!(resolved_exponent(256) > 40.0 && resolved_exponent(100) < 40.0);
        for exponent in [1.0, 40.0, 88.0, 1000.0] {
            let count = directions_for(exponent);
            assert!(count.isqrt().pow(2) == count && resolved_exponent(count) >= exponent);
        }
    }
}
