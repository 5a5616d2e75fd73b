//! The exposure that suits a picture.

/// Display value of the mean of a picture: middle grey.
const MIDDLE_GREY: f64 = 0.18;
/// Fraction of the pixels, the brightest ones, that do not count: highlights and mirrored lights.
const BRIGHTEST: f64 = 0.01;
/// Darker pixels count as this fraction of the median: unlit corners have any logarithm.
const DARKEST: f64 = 1e-3;

/// Stops that bring the log-average luminance of a picture (linear Rec.709) to middle grey, in
/// hundredths [Reinhard 2002]. Black pixels do not count. Zero if all are black.
pub fn automatic_stops(pixels: &[[f32; 3]]) -> f32 {
    let luminance =
        |[r, g, b]: &[f32; 3]| 0.2126 * f64::from(*r) + 0.7152 * f64::from(*g) + 0.0722 * f64::from(*b);
    let mut lit: Vec<f64> =
        pixels.iter().map(luminance).filter(|value| value.is_finite() && *value > 0.0).collect();
    lit.sort_by(f64::total_cmp);
    lit.truncate((lit.len() as f64 * (1.0 - BRIGHTEST)).ceil() as usize);
    let Some(median) = lit.get(lit.len() / 2) else { return 0.0 };
    let least = DARKEST * median;
    let mean = lit.iter().map(|value| value.max(least).log2()).sum::<f64>() / lit.len() as f64;
    let hundredths = (100.0 * (MIDDLE_GREY.log2() - mean)).round();
    // Without negative zero.
    (hundredths / 100.0 + 0.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_becomes_middle_grey() {
        for (value, stops) in [(0.18, 0.0), (0.09, 1.0), (0.72, -2.0), (1.8e-7, 19.93)] {
            let stops_found = automatic_stops(&[[value; 3]; 50]);
            assert!((stops_found - stops).abs() < 1e-5, "{value}: {stops_found}");
        }
        // The logarithms' mean: half a stop below and above.
        let halves: Vec<_> = (0..200).map(|pixel| [0.18 * [0.5, 2.0][pixel % 2]; 3]).collect();
        assert!(automatic_stops(&halves).abs() < 0.02);
    }

    #[test]
    fn background_highlights_and_odd_pixels_do_not_count() {
        let grey = vec![[0.18; 3]; 1000];
        let with = |count: usize, pixel| [grey.clone(), vec![[pixel; 3]; count]].concat();
        for (count, pixel) in [(9000, 0.0), (8, 1e6), (10, f32::NAN), (10, f32::INFINITY), (10, -1.0)] {
            assert_eq!(automatic_stops(&with(count, pixel)), 0.0, "{pixel}");
        }
        // A few nearly black pixels weigh ten stops each, not a hundred.
        assert!(automatic_stops(&with(10, 1e-30)) < 0.11);
        assert_eq!(automatic_stops(&[[0.0; 3]; 4]), 0.0);
        assert_eq!(automatic_stops(&[]), 0.0);
    }
}
