//! LDR-FLIP: the difference that a viewer notices when flipping between two
//! images. [Andersson 2020]
//!
//! Implemented from the publication. The filters are separable: the paper's second-order
//! colour filter is a sum of two separable ones. This gives the same values as the
//! published two-dimensional filters.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

/// The publication's viewing conditions: 0.7 m before a monitor of 3840 pixels on 0.7 m.
pub const PIXELS_PER_DEGREE: f64 = 0.7 * (3840.0 / 0.7) * (PI / 180.0);

/// Exponents and knees of the publication's table.
const COLOR_EXPONENT: f64 = 0.7;
const COLOR_KNEE: f64 = 0.4;
const COLOR_KNEE_ERROR: f64 = 0.95;
const FEATURE_EXPONENT: f64 = 0.5;
/// Width of the feature detectors, degrees.
const FEATURE_WIDTH: f64 = 0.082;

/// The FLIP error of each pixel, 0..=1, at that many pixels per degree of view. Pixels are sRGB
/// values (not linear), row by row, clamped to 0..=1.
pub fn flip_map(
    image: &[[f32; 3]],
    reference: &[[f32; 3]],
    size: [u32; 2],
    pixels_per_degree: f64,
) -> Vec<f64> {
    Flip::new(reference, size, pixels_per_degree).map(image)
}

/// A prepared reference for comparison with many images.
pub struct Flip {
    size: [usize; 2],
    filters: ColorFilters,
    detectors: [Detector; 2],
    reference: View,
}

impl Flip {
    /// Prepares the reference, as for [`flip_map`].
    pub fn new(reference: &[[f32; 3]], size: [u32; 2], pixels_per_degree: f64) -> Self {
        let size = size.map(|side| side as usize);
        assert!(reference.len() == size[0] * size[1], "pixel count");
        let filters = ColorFilters::new(pixels_per_degree);
        let detectors = [edge_detector(pixels_per_degree), point_detector(pixels_per_degree)];
        let reference = View::new(reference, size, &filters, &detectors);
        Self { size, filters, detectors, reference }
    }

    /// The FLIP error of each pixel of an image, 0..=1.
    pub fn map(&self, image: &[[f32; 3]]) -> Vec<f64> {
        assert!(image.len() == self.reference.colors.len(), "pixel count");
        let image = View::new(image, self.size, &self.filters, &self.detectors);
        let largest = largest_color_difference().powf(COLOR_EXPONENT);
        let error = |pixel: usize| {
            let color = hyab(image.colors[pixel], self.reference.colors[pixel]).powf(COLOR_EXPONENT);
            let differences =
                [0, 1].map(|kind| (image.features[kind][pixel] - self.reference.features[kind][pixel]).abs());
            let feature = (differences[0].max(differences[1]) / 2f64.sqrt()).powf(FEATURE_EXPONENT).min(1.0);
            redistribute(color, largest).powf(1.0 - feature)
        };
        (0..image.colors.len()).map(error).collect()
    }
}

/// Filtered data of one of the two images.
struct View {
    /// Filtered with the contrast sensitivity, in Hunt-adjusted CIELAB.
    colors: Vec<DVec3>,
    /// Strength of edges and of points.
    features: [Vec<f64>; 2],
}

impl View {
    fn new(pixels: &[[f32; 3]], size: [usize; 2], filters: &ColorFilters, detectors: &[Detector; 2]) -> Self {
        let opponent: Vec<DVec3> = pixels
            .iter()
            .map(|pixel| opponent_from_linear(DVec3::from(pixel.map(|v| linear_from_srgb(f64::from(v))))))
            .collect();
        let plane = |channel: usize| -> Vec<f64> { opponent.iter().map(|color| color[channel]).collect() };
        let lightness: Vec<f64> = plane(0).iter().map(|y| (y + 16.0) / 116.0).collect();
        let colors = || {
            let filtered = [0, 1, 2].map(|channel| filters.apply(channel, &plane(channel), size));
            let colors = (0..pixels.len()).map(|pixel| {
                let color = DVec3::from_array([0, 1, 2].map(|channel| filtered[channel][pixel]));
                hunt_lab(linear_from_opponent(color).clamp(DVec3::ZERO, DVec3::ONE))
            });
            colors.collect()
        };
        // Colours and features take about equal time.
        let features = || detectors.each_ref().map(|detector| detector.strength(&lightness, size));
        let (colors, features) = rayon::join(colors, features);
        Self { colors, features }
    }
}

/// Contrast sensitivity filters of the three opponent channels.
struct ColorFilters {
    /// For each channel, the terms of a sum: weight and a kernel of sum 1.
    terms: [Vec<(f64, Vec<f64>)>; 3],
}

impl ColorFilters {
    /// Amplitudes and scales (square degrees) of the Gaussians of luminance,
    /// red–green and blue–yellow.
    const GAUSSIANS: [&'static [(f64, f64)]; 3] =
        [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];

    fn new(pixels_per_degree: f64) -> Self {
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let terms = Self::GAUSSIANS.map(|gaussians| {
            let mut terms: Vec<(f64, Vec<f64>)> = gaussians
                .iter()
                .map(|&(amplitude, scale)| {
                    let value =
                        |x: i32| (-PI * PI * (f64::from(x) / pixels_per_degree).powi(2) / scale).exp();
                    let kernel: Vec<f64> = (-radius..=radius).map(value).collect();
                    let sum: f64 = kernel.iter().sum();
                    // The weight is the sum of the term's two-dimensional kernel.
                    let weight = amplitude * (PI / scale).sqrt() * sum * sum;
                    (weight, kernel.into_iter().map(|value| value / sum).collect())
                })
                .collect();
            let whole: f64 = terms.iter().map(|(weight, _)| weight).sum();
            terms.iter_mut().for_each(|(weight, _)| *weight /= whole);
            terms
        });
        Self { terms }
    }

    fn apply(&self, channel: usize, plane: &[f64], size: [usize; 2]) -> Vec<f64> {
        let mut sum = vec![0.0; plane.len()];
        for (weight, kernel) in &self.terms[channel] {
            let filtered = convolve_y(&convolve_x(plane, size, kernel), size, kernel);
            sum.iter_mut().zip(filtered).for_each(|(sum, value)| *sum += weight * value);
        }
        sum
    }
}

/// A derivative of a Gaussian along one axis, smoothed along the other.
struct Detector {
    derivative: Vec<f64>,
    smooth: Vec<f64>,
}

fn edge_detector(pixels_per_degree: f64) -> Detector {
    Detector::new(pixels_per_degree, |x, _| -x)
}

fn point_detector(pixels_per_degree: f64) -> Detector {
    Detector::new(pixels_per_degree, |x, deviation| x * x / (deviation * deviation) - 1.0)
}

impl Detector {
    /// `factor(x, standard deviation)` times a Gaussian. Its positive weights sum to 1, its
    /// negative ones to −1.
    fn new(pixels_per_degree: f64, factor: fn(f64, f64) -> f64) -> Self {
        let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * deviation).ceil() as i32;
        let places = || (-radius..=radius).map(f64::from);
        let gaussian = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let smooth: Vec<f64> = places().map(gaussian).collect();
        let derivative: Vec<f64> = places().map(|x| factor(x, deviation) * gaussian(x)).collect();
        let sum = |is_kept: fn(f64) -> bool| derivative.iter().filter(|v| is_kept(**v)).sum::<f64>().abs();
        let (positive, negative) = (sum(|v| v > 0.0), sum(|v| v < 0.0));
        let whole: f64 = smooth.iter().sum();
        Self {
            derivative: derivative.iter().map(|v| v / if *v < 0.0 { negative } else { positive }).collect(),
            smooth: smooth.iter().map(|v| v / whole).collect(),
        }
    }

    /// Length of the response along x and y.
    fn strength(&self, plane: &[f64], size: [usize; 2]) -> Vec<f64> {
        let x = convolve_y(&convolve_x(plane, size, &self.derivative), size, &self.smooth);
        let y = convolve_y(&convolve_x(plane, size, &self.smooth), size, &self.derivative);
        x.iter().zip(&y).map(|(x, y)| x.hypot(*y)).collect()
    }
}

/// Correlates rows with a kernel; the border values continue outside.
fn convolve_x(plane: &[f64], [width, _]: [usize; 2], kernel: &[f64]) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; plane.len()];
    let mut extended = vec![0.0; width + 2 * radius];
    for (row, out) in plane.chunks_exact(width).zip(out.chunks_exact_mut(width)) {
        extended[..radius].fill(row[0]);
        extended[radius..radius + width].copy_from_slice(row);
        extended[radius + width..].fill(row[width - 1]);
        for (k, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&extended[k..k + width]).for_each(|(out, value)| *out += weight * value);
        }
    }
    out
}

/// Correlates columns with a kernel, likewise.
fn convolve_y(plane: &[f64], [width, height]: [usize; 2], kernel: &[f64]) -> Vec<f64> {
    let radius = kernel.len() / 2;
    let mut out = vec![0.0; plane.len()];
    for (y, out) in out.chunks_exact_mut(width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let from = (y + k).saturating_sub(radius).min(height - 1) * width;
            out.iter_mut().zip(&plane[from..from + width]).for_each(|(out, value)| *out += weight * value);
        }
    }
    out
}

/// Maps the differences that occur to most of 0..=1.
fn redistribute(color: f64, largest: f64) -> f64 {
    let knee = COLOR_KNEE * largest;
    if color < knee {
        COLOR_KNEE_ERROR / knee * color
    } else {
        COLOR_KNEE_ERROR + (color - knee) / (largest - knee) * (1.0 - COLOR_KNEE_ERROR)
    }
}

/// The publication's largest difference: between pure green and pure blue.
fn largest_color_difference() -> f64 {
    hyab(hunt_lab(DVec3::Y), hunt_lab(DVec3::Z))
}

/// HyAB distance: city-block in lightness, Euclidean in colour.
fn hyab(a: DVec3, b: DVec3) -> f64 {
    let difference = a - b;
    difference.x.abs() + difference.y.hypot(difference.z)
}

/// CIELAB of a linear colour, with chroma scaled by lightness for the Hunt effect.
fn hunt_lab(linear: DVec3) -> DVec3 {
    const DELTA: f64 = 6.0 / 29.0;
    let curve =
        |t: f64| if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
    let [x, y, z] = (rgb_to_xyz() * linear / white()).to_array().map(curve);
    let lightness = 116.0 * y - 16.0;
    DVec3::new(lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z))
}

/// The linearised opponent space YCxCz.
fn opponent_from_linear(linear: DVec3) -> DVec3 {
    let DVec3 { x, y, z } = rgb_to_xyz() * linear / white();
    DVec3::new(116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z))
}

fn linear_from_opponent(opponent: DVec3) -> DVec3 {
    let y = (opponent.x + 16.0) / 116.0;
    let xyz = DVec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0);
    rgb_to_xyz().inverse() * (xyz * white())
}

/// XYZ of linear Rec.709, with the publication's exact fractions.
fn rgb_to_xyz() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(10_135_552.0 / 24_577_794.0, 2_613_072.0 / 12_288_897.0, 1_425_312.0 / 73_733_382.0),
        DVec3::new(8_788_810.0 / 24_577_794.0, 8_788_810.0 / 12_288_897.0, 8_788_810.0 / 73_733_382.0),
        DVec3::new(4_435_075.0 / 24_577_794.0, 887_015.0 / 12_288_897.0, 70_074_185.0 / 73_733_382.0),
    )
}

/// XYZ of white, D65.
fn white() -> DVec3 {
    rgb_to_xyz() * DVec3::ONE
}

/// The inverse of the sRGB transfer function, clamped to 0..=1.
fn linear_from_srgb(srgb: f64) -> f64 {
    let srgb = srgb.clamp(0.0, 1.0);
    if srgb <= 0.04045 { srgb / 12.92 } else { ((srgb + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [40, 33];

    /// A 64-bit linear congruential generator's upper 24 bits.
    fn noise(mut state: u64) -> Vec<[f32; 3]> {
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f32 / (1u32 << 24) as f32
        };
        (0..SIZE[0] * SIZE[1]).map(|_| std::array::from_fn(|_| next())).collect()
    }

    fn picture(of: impl Fn(u32, u32) -> [f32; 3]) -> Vec<[f32; 3]> {
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).map(|(x, y)| of(x, y)).collect()
    }

    fn ramp() -> Vec<[f32; 3]> {
        picture(|x, y| [x as f32 / 39.0, y as f32 / 32.0, 0.5])
    }

    fn mixed(a: &[[f32; 3]], b: &[[f32; 3]], fraction: f32) -> Vec<[f32; 3]> {
        let mix = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| a[c] + fraction * (b[c] - a[c]));
        a.iter().zip(b).map(mix).collect()
    }

    /// Mean, a corner, a pixel in the middle and the opposite corner, by the authors' program
    /// (flip-evaluator 1.7, `LDR`).
    #[test]
    fn the_authors_program_gives_the_same_values() {
        let checks = picture(|x, y| [((x / 8 + y / 8) % 2) as f32; 3]);
        let dimmed: Vec<[f32; 3]> = ramp().iter().map(|pixel| pixel.map(|value| 0.9 * value)).collect();
        let checkered: Vec<[f32; 3]> = dimmed
            .iter()
            .zip(&checks)
            .map(|(pixel, check)| pixel.map(|value| (value + 0.1 * check[0]).min(1.0)))
            .collect();
        let constant = |color: [f32; 3]| picture(|_, _| color);
        for (image, reference, expected) in [
            (noise(1), noise(2), [0.462_935_8, 0.843_396_8, 0.497_630_5, 0.613_137_1]),
            (checkered, ramp(), [0.271_762_4, 0.167_926_7, 0.174_702_8, 0.449_352_7]),
            (mixed(&ramp(), &noise(1), 0.25), ramp(), [0.373_865_6, 0.331_666, 0.171_169, 0.568_927_9]),
            (constant([1.0; 3]), constant([0.0; 3]), [0.967_397_8, 0.967_388_3, 0.967_388_3, 0.967_388_3]),
            (constant([0.0, 1.0, 0.0]), constant([0.0, 0.0, 1.0]), [1.0; 4]),
        ] {
            let map = flip_map(&image, &reference, SIZE, PIXELS_PER_DEGREE);
            let mean = map.iter().sum::<f64>() / map.len() as f64;
            for (found, expected) in [mean, map[0], map[16 * 40 + 20], map[32 * 40 + 39]].iter().zip(expected)
            {
                assert!((found - expected).abs() < 2e-5, "{found}, expected {expected}");
            }
        }
    }

    #[test]
    fn an_image_does_not_differ_from_itself_and_order_does_not_matter() {
        let (a, b) = (noise(3), ramp());
        assert!(flip_map(&a, &a, SIZE, PIXELS_PER_DEGREE).iter().all(|&error| error == 0.0));
        let [ab, ba] = [(&a, &b), (&b, &a)].map(|(a, b)| flip_map(a, b, SIZE, PIXELS_PER_DEGREE));
        assert!(ab.iter().zip(&ba).all(|(ab, ba)| (ab - ba).abs() < 1e-12));
        assert!(ab.iter().all(|error| (0.0..=1.0).contains(error)));
    }

    #[test]
    fn the_smallest_images_are_taken() {
        let map = flip_map(&[[1.0; 3]], &[[0.0; 3]], [1, 1], PIXELS_PER_DEGREE);
        assert!((map[0] - 0.967_388_3).abs() < 2e-5, "a pixel among its like: {}", map[0]);
    }
}
