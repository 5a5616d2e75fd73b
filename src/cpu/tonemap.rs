//! Twin of the tone map.

/// Below this display value the tone map is the identity; above it, highlights roll off.
const SHOULDER: f32 = 0.8;

/// The 8-bit sRGB code of a linear value: the exact sRGB curve up to 0.8, so that mid-grey and everything a
/// diffuse surface shows stay where sRGB puts them; above it a shoulder of continuous slope that reaches white
/// only at infinity, so that highlights keep their shape. Negative values and NaN give 0.
pub fn display_value(linear: f32) -> u8 {
    let toned = if linear > SHOULDER {
        let beyond = (linear - SHOULDER) / (1.0 - SHOULDER);
        1.0 - (1.0 - SHOULDER) / (1.0 + beyond)
    } else {
        linear
    };
    // The cast saturates, and takes NaN to 0.
    (255.0 * srgb_from_linear(toned) + 0.5) as u8
}

/// The sRGB transfer function (IEC 61966-2-1).
fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn greys_stay_where_srgb_puts_them() {
        // Codes of the IEC 61966-2-1 curve: 0.18 gives 117.6, 0.5 gives 187.5, 0.0031308 gives 10.3.
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
}
