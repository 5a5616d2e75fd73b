//! Levels of the picture: the histogram of its luminance, and pixels without detail.

use crate::cpu::brdf::luminance;
use crate::cpu::tonemap::exposed;
use crate::scene::DisplayConstants;

/// Range of the histogram in stops from middle grey.
pub(super) const STOPS: [f64; 2] = [-10.0, 8.0];
/// Bars of a stop.
const BARS_A_STOP: usize = 4;
/// Bars of the histogram.
pub(super) const BARS: usize = BARS_A_STOP * (STOPS[1] - STOPS[0]) as usize;
/// Linear value of middle grey.
const MIDDLE_GREY: f64 = 0.18;

/// Codes of a channel that show no detail: from `WHITE` on, and up to `BLACK`. Dithering moves a
/// code by one, and two of the tone curves end at 254.
const WHITE: u8 = 254;
const BLACK: u8 = 1;

/// Width of the zebra's stripes, pixels of the picture.
const STRIPE: usize = 4;
/// Colours of the stripes on clipped and on black pixels: R, G, B, A.
const ON_WHITE: [u8; 4] = [0xe0, 0x10, 0x30, 255];
const ON_BLACK: [u8; 4] = [0x20, 0x70, 0xff, 255];

/// Whether a channel has lost its detail in white.
fn is_clipped(codes: [u8; 4]) -> bool {
    codes[..3].iter().any(|code| *code >= WHITE)
}

/// Whether all channels have lost their detail in black.
fn is_black(codes: [u8; 4]) -> bool {
    codes[..3].iter().all(|code| *code <= BLACK)
}

/// Fractions of the pixels of a picture, 0..=1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Levels {
    /// Version of the picture.
    pub(super) version: u64,
    /// Exposed luminance in each bar.
    pub(super) bars: Vec<f64>,
    /// Luminance outside of the bars: below, black included, and above.
    pub(super) outside: [f64; 2],
    /// Red, green and blue codes from 254 on.
    pub(super) clipped: [f64; 3],
    /// Pixels whose codes are all 0 or 1.
    pub(super) black: f64,
}

impl Levels {
    /// The levels of a picture: its radiance, its sRGB codes, and how they are displayed.
    pub(super) fn new(
        version: u64,
        radiance: &[[f32; 3]],
        codes: &[[u8; 4]],
        display: &DisplayConstants,
    ) -> Self {
        let mut counts = [0_usize; BARS];
        let mut outside = [0_usize; 2];
        for pixel in radiance {
            let stops = (luminance(exposed(display, *pixel)) / MIDDLE_GREY).log2();
            // Black and NaN are below.
            let bar = (stops - STOPS[0]) * BARS_A_STOP as f64;
            match bar {
                bar if bar >= BARS as f64 => outside[1] += 1,
                bar if bar >= 0.0 => counts[bar as usize] += 1,
                _ => outside[0] += 1,
            }
        }
        let fraction = |count: usize| count as f64 / radiance.len().max(1) as f64;
        let clipped = |channel: usize| codes.iter().filter(|codes| codes[channel] >= WHITE).count();
        Self {
            version,
            bars: counts.iter().copied().map(fraction).collect(),
            outside: outside.map(fraction),
            clipped: [0, 1, 2].map(clipped).map(fraction),
            black: fraction(codes.iter().filter(|codes| is_black(**codes)).count()),
        }
    }
}

/// Stripes on the pixels of a picture that have no detail, transparent elsewhere: sRGB codes R, G,
/// B, A. Stripes on white and on black lean to different sides.
pub(super) fn zebra(codes: &[[u8; 4]], size: [u32; 2]) -> Vec<[u8; 4]> {
    let width = size[0].max(1) as usize;
    let stripe = |(index, codes): (usize, &[u8; 4])| {
        let (x, y) = (index % width, index / width);
        let is_on = |place: usize| (place / STRIPE).is_multiple_of(2);
        match *codes {
            codes if is_clipped(codes) && is_on(x + y) => ON_WHITE,
            codes if is_black(codes) && is_on(x + 2 * STRIPE - y % (2 * STRIPE)) => ON_BLACK,
            _ => [0; 4],
        }
    };
    codes.iter().enumerate().map(stripe).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::DisplayTransform;

    /// Bar of a number of stops above middle grey.
    fn bar(stops: f64) -> usize {
        ((stops - STOPS[0]) * BARS_A_STOP as f64) as usize
    }

    #[test]
    fn each_pixel_counts_once() {
        let grey = |stops: f32| [0.18 * stops.exp2(); 3];
        let radiance = [
            grey(0.01),
            grey(0.2),
            grey(-3.1),
            grey(30.0),
            grey(-30.0),
            [0.0; 3],
            [f32::NAN; 3],
            [f32::INFINITY; 3],
        ];
        let codes = vec![[9, 9, 9, 255]; radiance.len()];
        let display = DisplayTransform::default();
        let levels = Levels::new(1, &radiance, &codes, &display.constants());
        let total = levels.bars.iter().sum::<f64>() + levels.outside.iter().sum::<f64>();
        assert!((total - 1.0).abs() < 1e-12, "{total}");
        assert_eq!(levels.outside, [3.0 / 8.0, 2.0 / 8.0]);
        assert_eq!((levels.bars[bar(0.0)], levels.bars[bar(-3.1)]), (2.0 / 8.0, 1.0 / 8.0));
        // A stop more moves all bars by a stop.
        let brighter = Levels::new(1, &radiance, &codes, &DisplayTransform::exposed(1.0).constants());
        assert_eq!(brighter.bars[BARS_A_STOP..], levels.bars[..BARS - BARS_A_STOP]);
    }

    #[test]
    fn channels_are_clipped_by_themselves_and_black_needs_all() {
        let codes =
            [[255, 0, 0, 255], [254, 253, 0, 255], [253, 253, 254, 255], [0, 1, 1, 255], [0, 0, 2, 255]];
        let levels = Levels::new(1, &[[0.1; 3]; 5], &codes, &DisplayTransform::default().constants());
        assert_eq!((levels.clipped, levels.black), ([0.4, 0.0, 0.2], 0.2));
    }

    #[test]
    fn stripes_cover_half_of_what_has_no_detail() {
        let size = [32, 16];
        for (codes, colour) in
            [([255, 10, 10, 255], ON_WHITE), ([10, 10, 254, 255], ON_WHITE), ([1, 0, 1, 255], ON_BLACK)]
        {
            let stripes = zebra(&vec![codes; 32 * 16], size);
            let count = stripes.iter().filter(|pixel| **pixel == colour).count();
            assert_eq!(count, 32 * 16 / 2, "{codes:?}");
            assert!(stripes.iter().all(|pixel| *pixel == colour || *pixel == [0; 4]), "{codes:?}");
            // Rows shift by a pixel, to the left on white.
            let row = |y: usize| &stripes[y * 32..][..32];
            let by = if colour == ON_WHITE {
                (row(0)[1..].to_vec(), row(1)[..31].to_vec())
            } else {
                (row(0)[..31].to_vec(), row(1)[1..].to_vec())
            };
            assert_eq!(by.0, by.1, "{codes:?}");
        }
        let plain = zebra(&vec![[253, 2, 0, 255]; 32 * 16], size);
        assert!(plain.iter().all(|pixel| *pixel == [0; 4]));
    }
}
