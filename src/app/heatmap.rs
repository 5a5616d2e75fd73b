//! Errors as colours. Both colour maps are perceptually uniform and grow brighter with the error,
//! so they are readable without hue.

/// Legend of [`of_flip`].
pub(super) const FLIP_SCALE: &str = "FLIP, linear from 0 (black) to 1 (pale yellow), colours magma";

/// Legend of [`of_relative_error`].
pub(super) const RELATIVE_SCALE: &str =
    "relative error, logarithmic from 0.1 % (dark violet) to 100 % (yellow), colours viridis";

/// Colours of FLIP errors, 0..=1.
pub(super) fn of_flip(errors: &[f64]) -> Vec<[u8; 4]> {
    errors.iter().map(|&error| color(colorous::MAGMA, error)).collect()
}

/// Colours of relative errors; 1 is 100 %.
pub(super) fn of_relative_error(errors: &[f64]) -> Vec<[u8; 4]> {
    const DECADES: f64 = 3.0;
    errors.iter().map(|&error| color(colorous::VIRIDIS, 1.0 + error.log10() / DECADES)).collect()
}

fn color(map: colorous::Gradient, place: f64) -> [u8; 4] {
    let colorous::Color { r, g, b } = map.eval_continuous(place.clamp(0.0, 1.0));
    [r, g, b, 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brightness_grows_with_the_error_and_ends_are_clamped() {
        let luma = |[r, g, b, _]: [u8; 4]| 2 * u32::from(r) + 7 * u32::from(g) + u32::from(b);
        let steps = || (0..=20).map(|i| 0.05 * f64::from(i));
        let linear: Vec<f64> = steps().collect();
        let decades: Vec<f64> = steps().map(|step| 10f64.powf(-3.0 + 3.0 * step)).collect();
        for colors in [of_flip(&linear), of_relative_error(&decades)] {
            assert!(colors.windows(2).all(|pair| luma(pair[0]) < luma(pair[1])), "{colors:?}");
        }
        assert_eq!(of_relative_error(&[0.0, 1e-9]), of_relative_error(&[1e-3, 1e-3]));
        assert_eq!(of_flip(&[7.0]), of_flip(&[1.0]));
    }
}
