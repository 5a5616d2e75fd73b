//! Shortest decimal numbers that are read back as the same f32.

/// The accepted number with the fewest digits nearest to `value`. `value` itself if
/// none is accepted.
fn shortest(value: f64, is_accepted: impl Fn(f64) -> bool) -> f64 {
    let mut rounded = (0..17).filter_map(|digits| format!("{value:.digits$e}").parse().ok());
    rounded.find(|number| is_accepted(*number)).unwrap_or(value)
}

/// The shortest number that is read as `value`.
pub(super) fn plain(value: f32) -> f64 {
    shortest(f64::from(value), |number| (number as f32).to_bits() == value.to_bits())
}

/// The world coordinate that recentres to `value` on `origin`, metres.
///
/// Far from the world's origin f64 is too coarse for some values next to zero (below 1e-4 m at 1e5
/// m). The nearest is taken, which is off by half the spacing of f64 there (7e-12 m).
pub(super) fn place(value: f32, origin: f64) -> f64 {
    if origin == 0.0 {
        return plain(value);
    }
    // Zero and negative zero are equal here: after adding the origin they do not differ.
    let is_same = |number: f64| (number - origin) as f32 == value;
    shortest(f64::from(value) + origin, is_same)
}

/// The angle in degrees, at most `most`, that converts to `radians`.
pub(super) fn degrees(radians: f32, most: f64) -> f64 {
    let is_same = |number: f64| number <= most && (number.to_radians() as f32).to_bits() == radians.to_bits();
    shortest(f64::from(radians).to_degrees(), is_same)
}

/// A number in TOML syntax.
pub(super) fn text(number: f64) -> String {
    format!("{number:?}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [0.1, 1.5, -2.0, 1e-7, 3e12].map(|value| text(plain(value))),
            ["0.1", "1.5", "-2.0", "1e-7", "3000000000000.0"]
        );
        assert_eq!(text(plain(-0.0)), "-0.0");
        assert_eq!(text(place(0.05, 1000.25)), "1000.3");
        assert_eq!(text(degrees(30.0_f32.to_radians(), 90.0)), "30.0");
        assert_eq!(text(degrees(90.0_f64.to_radians() as f32, 90.0)), "90.0");
    }

    #[test]
    fn numbers_come_back() {
        let mut state = 1_u64;
        let mut between = |low: f64, high: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (low + (high - low) * (state >> 11) as f64 / (1_u64 << 53) as f64) as f32
        };
        for _ in 0..20_000 {
            let value = between(-1.0, 1.0) * 10.0_f32.powf(between(-3.0, 4.0));
            let origin = f64::from(between(-1e5, 1e5));
            assert_eq!(plain(value) as f32, value);
            let read = (place(value, origin) - origin) as f32;
            assert!(read == value || value.abs() < 2.5e-4, "{value:?} at {origin}");
            assert!((read - value).abs() < 1e-11, "{value:?} at {origin}");
            let angle = between(2e-4, 1.57);
            assert_eq!(degrees(angle, 90.0).to_radians() as f32, angle);
        }
    }
}
