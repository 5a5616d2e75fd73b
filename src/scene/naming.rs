//! What the random decisions of the precomputation are named by.

/// What the random decisions of the precomputation are named by.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Naming {
    /// Numbers: of triangles, paths and records. Those of the whole scene are stratified.
    Number,
    /// Places: surface that does not move keeps its decisions while other surface moves. What lies
    /// in different parts of the scene is not stratified together.
    Place,
}

/// Steps of a rounded sum for a factor of two.
const STEPS: f64 = 32.0;

/// The most that [`Naming::rounded`] changes a sum, relative to it.
pub const HALF_STEP: f64 = 0.5 / STEPS;

impl Naming {
    /// The number or the name of a decision.
    pub fn pick(self, number: u32, name: impl FnOnce() -> u32) -> u32 {
        match self {
            Self::Number => number,
            Self::Place => name(),
        }
    }

    /// Bits of a side, 2·triangle + (1 if the back side), that name it beside its place.
    pub fn side_bits(self) -> u32 {
        self.pick(u32::MAX, || 1)
    }

    /// A sum over the whole scene. Named by place, it is rounded to the nearest multiple of a 32nd
    /// of the power of two below it. Most moves of one model then leave it as it is, and what
    /// follows from it elsewhere.
    pub fn rounded(self, sum: f64) -> f64 {
        if self == Self::Number || sum <= 0.0 || !sum.is_finite() {
            return sum;
        }
        let step = sum.log2().floor().exp2() / STEPS;
        (sum / step).round() * step
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_change_by_at_most_a_64th() {
        for sum in [1e-30, 0.37, 1.0, 1.0 + 1e-9, 5.0 / 3.0, 1.999_999, 2.0, 12_345.6, 7e40] {
            let rounded = Naming::Place.rounded(sum);
            assert!((rounded / sum - 1.0).abs() <= HALF_STEP, "{sum} becomes {rounded}");
            assert_eq!(Naming::Place.rounded(rounded), rounded);
            assert_eq!(Naming::Number.rounded(sum), sum);
        }
        assert_eq!([0.0, f64::INFINITY].map(|sum| Naming::Place.rounded(sum)), [0.0, f64::INFINITY]);
    }
}
