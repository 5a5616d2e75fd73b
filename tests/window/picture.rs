//! Differences between captures.

use image::RgbImage;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

impl Area {
    pub fn from_image(image: &RgbImage) -> Self {
        Self { x: 0, y: 0, width: image.width(), height: image.height() }
    }

    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    fn places(self) -> impl Iterator<Item = (u32, u32)> {
        (self.y..self.y + self.height).flat_map(move |y| (self.x..self.x + self.width).map(move |x| (x, y)))
    }

    fn assert_within(&self, image: &RgbImage) {
        let (width, height) = image.dimensions();
        assert!(
            self.x + self.width <= width && self.y + self.height <= height,
            "{self:?} within {width}x{height}"
        );
    }
}

/// Mean absolute difference of all codes in `area`.
pub fn mean_difference(a: &RgbImage, b: &RgbImage, area: Area) -> f64 {
    let sum: u64 = differences(a, b, area).flatten().map(u64::from).sum();
    sum as f64 / (3 * area.pixels()) as f64
}

/// Number of pixels in `area` with a code that differs by more than `codes`; all if
/// the sizes differ.
pub fn changed_pixels(a: &RgbImage, b: &RgbImage, area: Area, codes: u8) -> usize {
    if a.dimensions() != b.dimensions() {
        return area.pixels();
    }
    differences(a, b, area).filter(|pixel| pixel.iter().any(|&difference| difference > codes)).count()
}

/// Number of different colours in `area`.
pub fn colours(image: &RgbImage, area: Area) -> usize {
    area.assert_within(image);
    let mut colours = area.places().map(|(x, y)| image.get_pixel(x, y).0).collect::<Vec<_>>();
    colours.sort_unstable();
    colours.dedup();
    colours.len()
}

fn differences<'a>(a: &'a RgbImage, b: &'a RgbImage, area: Area) -> impl Iterator<Item = [u8; 3]> + 'a {
    area.assert_within(a);
    area.assert_within(b);
    area.places().map(|(x, y)| {
        let (a, b) = (a.get_pixel(x, y).0, b.get_pixel(x, y).0);
        [0, 1, 2].map(|channel| a[channel].abs_diff(b[channel]))
    })
}
