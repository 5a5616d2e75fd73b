//! Reference of the tone map.

use super::sampling::hash;
use super::tone_curves::{bounded, standard, toned};
use crate::scene::DisplayConstants;
use glam::Vec3;

/// The 8-bit sRGB code of a linear value, by the standard tone curve. Negative and NaN give 0.
///
/// Rounds to the nearest code, for measurements. Images use [`dithered`].
pub fn display_value(linear: f32) -> u8 {
    rounded(code(standard(linear)))
}

/// The 8-bit sRGB codes of a radiance, rounded to the nearest.
pub fn display_values(display: &DisplayConstants, radiance: [f32; 3]) -> [u8; 3] {
    display_codes(display, radiance).map(rounded)
}

fn rounded(code: f32) -> u8 {
    (code + 0.5) as u8
}

/// The exposed and balanced value of a radiance: input of the tone curve.
pub fn exposed(display: &DisplayConstants, radiance: [f32; 3]) -> Vec3 {
    let linear = display.scale * Vec3::from(radiance);
    match display.white_balance {
        Some(matrix) => matrix * bounded(linear),
        None => linear,
    }
}

/// The codes before they are rounded, 0..=255.
fn display_codes(display: &DisplayConstants, radiance: [f32; 3]) -> [f32; 3] {
    toned(display.tone, exposed(display, radiance)).to_array().map(code)
}

/// The sRGB code of a display value. Negative values and NaN give 0.
fn code(toned: f32) -> f32 {
    // White stays exact, whatever the error of a device's `pow`.
    if toned >= 1.0 {
        return 255.0;
    }
    let code = 255.0 * srgb_from_linear(toned);
    if code > 0.0 { code.min(255.0) } else { 0.0 }
}

/// Uniform in [0, 1), of 16 bits: a sum with a code is exact.
fn dither_noise(pixel: u32, channel: u32) -> f32 {
    (hash(pixel.wrapping_mul(3).wrapping_add(channel)) >> 16) as f32 / 65_536.0
}

/// The sRGB codes R, G, B, 255 of a pixel, given by its index in the image: as [`display_values`],
/// but rounded up or down so that the mean over an area is the value. Gradients of less than a code
/// a pixel show no bands.
///
/// The noise is triangular: the difference between a pixel's uniform number and its right
/// neighbour's, which is high-frequency noise. Near black and white it narrows to the uniform
/// number alone, because clamping a triangle would shift the mean. Black and white are exact. The
/// same image always has the same codes.
pub fn dithered(pixel: u32, display: &DisplayConstants, radiance: [f32; 3]) -> [u8; 4] {
    let codes = display_codes(display, radiance);
    let [r, g, b] = [0, 1, 2].map(|channel| {
        let code = codes[channel as usize];
        let width = (2.0 * code.min(255.0 - code)).clamp(0.0, 1.0);
        let next = dither_noise(pixel.wrapping_add(1), channel);
        let noise = dither_noise(pixel, channel) + width * (0.5 - next);
        (code + noise).floor().clamp(0.0, 255.0) as u8
    });
    [r, g, b, 255]
}

/// The sRGB transfer function (IEC 61966-2-1).
fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{DisplayTransform, ToneCurve, WhiteBalance};

    fn plain() -> DisplayConstants {
        DisplayTransform::default().constants()
    }

    /// The code of a grey before it is rounded.
    fn display_code(linear: f32) -> f32 {
        display_codes(&plain(), [linear; 3])[0]
    }

    #[test]
    fn greys_stay_where_srgb_puts_them() {
        // Codes of the IEC 61966-2-1 curve: 0.18 gives 117.6, 0.5 gives 187.5, 0.0031308 gives
        // 10.3.
        for (linear, code) in [(0.0, 0), (0.003_130_8, 10), (0.18, 118), (0.5, 188), (0.8, 231)] {
            assert_eq!(display_value(linear), code, "{linear}");
        }
    }

    #[test]
    fn highlights_roll_off_monotonically_and_odd_values_are_safe() {
        let codes: Vec<u8> = (0..4000).map(|i| display_value(i as f32 * 0.01)).collect();
        assert!(codes.is_sorted());
        assert!(display_value(1.0) < display_value(2.0) && display_value(2.0) < display_value(8.0));
        let slope = |v: f32| (f32::from(display_value(v + 0.05)) - f32::from(display_value(v - 0.05))) / 0.1;
        assert!((slope(0.7) - slope(0.82)).abs() < 40.0, "the shoulder starts without a kink");
        assert_eq!([f32::NAN, -1.0, f32::NEG_INFINITY].map(display_value), [0; 3]);
        assert_eq!([f32::INFINITY, f32::MAX].map(display_value), [255; 2]);
    }

    #[test]
    fn odd_values_are_safe_in_all_transforms() {
        for tone in ToneCurve::ALL {
            for kelvin in [6504.0, 3000.0] {
                let white_balance = WhiteBalance { kelvin, ..WhiteBalance::default() };
                let display = DisplayTransform { tone, white_balance, exposure_stops: 1.0 }.constants();
                let codes = |value: f32| display_values(&display, [value; 3]);
                for black in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY, f32::MIN] {
                    assert_eq!(codes(black), [0; 3], "{tone:?} {black}");
                }
                for white in [1e12, f32::MAX, f32::INFINITY] {
                    let [red, ..] = codes(white);
                    assert!(red >= 254, "{tone:?} {white}: {red}");
                }
            }
        }
    }

    #[test]
    fn none_clips_at_one() {
        let display = DisplayTransform { tone: ToneCurve::None, ..DisplayTransform::default() }.constants();
        let codes = display_values(&display, [0.18, 0.99, 1.0]);
        assert_eq!(codes, [118, 254, 255], "the curve of IEC 61966-2-1");
    }

    /// Codes of an area of one value, each channel by itself.
    fn area(linear: f32, size: u32) -> Vec<[u8; 3]> {
        (0..size * size)
            .map(|pixel| dithered(pixel, &plain(), [linear; 3]))
            .map(|[r, g, b, _]| [r, g, b])
            .collect()
    }

    #[test]
    fn dithering_keeps_the_mean_and_stays_within_a_code() {
        for step in 0..400 {
            let linear = 1.3 * (step as f32 / 400.0).powi(3);
            let (code, area) = (f64::from(display_code(linear)), area(linear, 48));
            for channel in 0..3 {
                let codes = area.iter().map(|codes| f64::from(codes[channel]));
                let mean = codes.clone().sum::<f64>() / area.len() as f64;
                assert!((mean - code).abs() < 0.05, "{linear}: {mean}, {code} expected");
                assert!(codes.clone().all(|found| (found - code).abs() < 1.5), "{linear}");
            }
        }
    }

    #[test]
    fn black_and_white_are_exact_and_channels_differ() {
        for linear in [0.0, -1.0, f32::NAN, f32::NEG_INFINITY] {
            assert!(area(linear, 256).iter().all(|&codes| codes == [0; 3]), "{linear}");
        }
        for linear in [f32::INFINITY, f32::MAX, 1e12] {
            assert!(area(linear, 256).iter().all(|&codes| codes == [255; 3]), "{linear}");
        }
        let area = area(0.01, 64);
        let coloured = area.iter().filter(|[r, g, b]| r != g || g != b).count();
        assert!(coloured > area.len() / 4, "grey noise would be twice as visible");
        assert_eq!(area, self::area(0.01, 64), "the same bytes");
    }

    /// A dark gradient across 1024 pixels: 40 codes, each some 25 pixels wide, with hard
    /// borders unless dithered.
    #[test]
    fn a_dark_ramp_has_no_bands() {
        const WIDTH: usize = 1024;
        const HEIGHT: usize = 128;
        let linear = |x: usize| 0.02 * x as f32 / WIDTH as f32;
        let column = |x: usize| -> Vec<u8> {
            (0..HEIGHT).map(|y| dithered((y * WIDTH + x) as u32, &plain(), [linear(x); 3])[0]).collect()
        };
        let mean = |codes: &[u8]| codes.iter().map(|&code| f64::from(code)).sum::<f64>() / HEIGHT as f64;
        let mut before = 0.0;
        for x in 0..WIDTH {
            let (codes, code) = (column(x), display_code(linear(x)));
            // Without dithering all rows have one code, and all change at once at a border.
            if code >= 1.0 {
                let same = codes.iter().filter(|&&found| found == display_value(linear(x))).count();
                assert!(same < HEIGHT * 9 / 10, "{same} of {HEIGHT} rows have one code at {x}");
            }
            let step = mean(&codes) - before;
            assert!(step.abs() < 0.5, "a step of {step} codes at {x}");
            before = mean(&codes);
        }
        let plain: Vec<u8> = (WIDTH / 2..WIDTH).map(|x| display_value(linear(x))).collect();
        let longest = plain.chunk_by(|a, b| a == b).map(<[u8]>::len).max();
        assert!(longest > Some(20), "without noise the ramp has bands");
    }
}
