//! Metrics for noisy references and images with known noise.

use super::{EPSILON, mean};

/// [`super::relmse`] of an image against the mean of two independent halves of a reference,
/// without the reference's noise: mean of (v−a)(v−b)/(r+0.01)², r = (a+b)/2. In the numerator the
/// noise of a and b cancels on average. So the figure may be negative if the image is as good as
/// the reference. In the denominator the noise stays, and raises the figure if r is about as small
/// as its noise.
pub fn debiased_relmse(image: &[[f32; 3]], halves: [&[[f32; 3]]; 2]) -> f64 {
    let r = |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|c| 0.5 * (a[c] + b[c]));
    let mean: Vec<[f32; 3]> = halves[0].iter().zip(halves[1]).map(r).collect();
    debiased_relmse_at(image, halves, &mean).mean
}

/// Part of the reference below which a picture does not serve as scale: it counts as nearly black.
/// A quarter is beyond the reference's noise.
const MIN_SCALE: f32 = 0.25;

/// What errors of a picture are relative to: the picture, which has none of the reference's noise.
/// Where it is nearly black, a part of the reference: such a pixel would outweigh all others.
pub fn error_scale(image: &[[f32; 3]], halves: [&[[f32; 3]]; 2]) -> Vec<[f32; 3]> {
    let larger = |(v, (a, b)): (&[f32; 3], (&[f32; 3], &[f32; 3]))| {
        std::array::from_fn(|c| v[c].max(MIN_SCALE * 0.5 * (a[c] + b[c])))
    };
    image.iter().zip(halves[0].iter().zip(halves[1])).map(larger).collect()
}

/// The squared relative error of each pixel, without the reference's noise: the mean over channels
/// of (v−a)(v−b)/(scale+0.01)². It is right on average, and may be negative.
pub(super) fn error_products(image: &[[f32; 3]], halves: [&[[f32; 3]]; 2], scale: &[[f32; 3]]) -> Vec<f64> {
    assert_eq!(image.len(), scale.len(), "images of one comparison have one size");
    let scales = scale.iter().flatten().map(|&s| f64::from(s) + EPSILON);
    let terms = triples(image, halves).zip(scales).map(|([v, a, b], s)| (v - a) * (v - b) / (s * s));
    let (mut pixels, mut sum) = (Vec::with_capacity(image.len()), 0.0);
    for (index, term) in terms.enumerate() {
        sum += term;
        if index % 3 == 2 {
            pixels.push(sum / 3.0);
            sum = 0.0;
        }
    }
    pixels
}

/// [`debiased_relmse`] relative to a picture that is independent of the reference's noise and close
/// to its expected value. Then the noise also cancels in dark pixels.
pub fn debiased_relmse_at(image: &[[f32; 3]], halves: [&[[f32; 3]]; 2], scale: &[[f32; 3]]) -> Estimate {
    Estimate::of(&error_products(image, halves, scale))
}

/// A mean over pixels with independent noise, and its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Mean of all samples.
    pub mean: f64,
    /// Standard deviation of the mean, from the scatter of the pixels. Differences between pixels
    /// for other reasons add to it, so it is rather too large.
    pub standard_error: f64,
}

impl Estimate {
    /// The mean of one value for each pixel.
    pub fn of(pixels: &[f64]) -> Self {
        let count = pixels.len().max(1) as f64;
        let mean = pixels.iter().sum::<f64>() / count;
        let squares = pixels.iter().map(|pixel| pixel * pixel).sum::<f64>();
        let variance = (squares / count - mean * mean).max(0.0) / (count - 1.0).max(1.0);
        Self { mean, standard_error: variance.sqrt() }
    }
}

/// Noise of a reference from its halves, as a relMSE: mean of ((a−b)/2)²/(r+0.01)², the variance of
/// r = (a+b)/2.
pub fn half_noise(halves: [&[[f32; 3]]; 2]) -> f64 {
    mean(halves[0], halves[1], |a, b| {
        let r = 0.5 * (a + b);
        (0.5 * (a - b) / (r + EPSILON)).powi(2)
    })
}

/// Noise of an image as a relMSE from the variance of its pixels: mean of variance/(r+0.01)².
pub fn variance_noise(reference: &[[f32; 3]], variance: &[[f32; 3]]) -> f64 {
    mean(reference, variance, |r, variance| variance / (r + EPSILON).powi(2))
}

/// Difference of two noisy images, in units of their stated noise.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct ZTest {
    /// Mean of z; 0 if neither image is biased.
    pub mean: f64,
    /// Root of the mean of z²; 1 if both state their noise correctly and have the
    /// same expected value.
    pub rms: f64,
    /// Fraction of |z| > 3; 0.0027 for a normal distribution.
    pub fraction_above_3: f64,
    /// Number of values tested.
    pub count: u64,
    /// Values that differ although neither image states noise; excluded from the figures above.
    pub differ_without_noise: u64,
}

/// z = (v−r)/√(var v + var r) over pixels and channels. Equal values without noise (black
/// ones) are excluded.
pub fn z_test(image: &[[f32; 3]], reference: &[[f32; 3]], variances: [&[[f32; 3]]; 2]) -> ZTest {
    assert_eq!(image.len(), reference.len(), "images of one comparison have one size");
    let differences =
        image.iter().flatten().zip(reference.iter().flatten()).map(|(&v, &r)| f64::from(v) - f64::from(r));
    assert_eq!(variances[0].len(), image.len(), "a variance for each pixel");
    assert_eq!(variances[1].len(), image.len(), "a variance for each pixel");
    let variances = variances[0].iter().flatten().zip(variances[1].iter().flatten());
    let (mut sum, mut squares, mut above, mut count, mut differ) = (0.0, 0.0, 0u64, 0u64, 0u64);
    for (difference, (&a, &b)) in differences.zip(variances) {
        let variance = f64::from(a) + f64::from(b);
        if variance <= 0.0 {
            differ += u64::from(difference != 0.0);
            continue;
        }
        let z = difference / variance.sqrt();
        sum += z;
        squares += z * z;
        above += u64::from(z.abs() > 3.0);
        count += 1;
    }
    let count_or_one = count.max(1) as f64;
    ZTest {
        mean: sum / count_or_one,
        rms: (squares / count_or_one).sqrt(),
        fraction_above_3: above as f64 / count_or_one,
        count,
        differ_without_noise: differ,
    }
}

/// Value and the two halves, channel by channel.
fn triples<'a>(
    image: &'a [[f32; 3]],
    halves: [&'a [[f32; 3]]; 2],
) -> impl Iterator<Item = [f64; 3]> + use<'a> {
    let [a, b] = halves;
    assert!(image.len() == a.len() && a.len() == b.len(), "images of one comparison have one size");
    let values = image.iter().flatten().zip(a.iter().flatten().zip(b.iter().flatten()));
    values.map(|(&v, (&a, &b))| [v, a, b].map(f64::from))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::metrics::relmse;

    /// Normal deviates by Box and Muller from a 64-bit linear congruential generator.
    pub(in crate::metrics) struct Normal(pub(in crate::metrics) u64);

    impl Normal {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        }

        pub(in crate::metrics) fn next(&mut self) -> f64 {
            (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
        }

        /// Around `value` with that standard deviation.
        fn image(&mut self, value: f64, sigma: f64, pixels: usize) -> Vec<[f32; 3]> {
            (0..pixels).map(|_| std::array::from_fn(|_| (value + sigma * self.next()) as f32)).collect()
        }
    }

    const PIXELS: usize = 20_000;

    #[test]
    fn the_noise_of_the_reference_is_stated_and_subtracted() {
        let mut normal = Normal(1);
        let [a, b] = [0, 1].map(|_| normal.image(0.99, 0.02, PIXELS));
        let halves = [a.as_slice(), b.as_slice()];
        let mean: Vec<[f32; 3]> =
            a.iter().zip(&b).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c]))).collect();
        // The mean of two halves of σ = 0.02 has the variance 0.0002; r+0.01 is 1 except for that
        // noise, which adds little.
        let near =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 0.04, "{found}, {expected}");
        near(half_noise(halves), 0.000_2);
        let image = vec![[1.01f32; 3]; PIXELS];
        near(relmse(&image, &mean), 0.000_6);
        near(debiased_relmse(&image, halves), 0.000_4);
        let exact = debiased_relmse(&vec![[0.99f32; 3]; PIXELS], halves);
        assert!(exact.abs() < 8e-6, "of an exact image: {exact}");
    }

    #[test]
    fn noise_as_large_as_the_reference_cancels_where_the_scale_does_not_know_it() {
        let mut normal = Normal(3);
        let [a, b] = [0, 1].map(|_| normal.image(0.03, 0.015, PIXELS));
        let halves = [a.as_slice(), b.as_slice()];
        // A tenth of 0.03 + 0.01 off: 0.01. The noise of a half is 0.14; its scatter over all
        // values is below 0.001.
        let (image, scale) = (vec![[0.034f32; 3]; PIXELS], vec![[0.03f32; 3]; PIXELS]);
        let [at, of_mean] =
            [debiased_relmse_at(&image, halves, &scale).mean, debiased_relmse(&image, halves)];
        assert!((at - 0.01).abs() < 0.002 && of_mean > 0.03, "{at} {of_mean}");
    }

    #[test]
    fn a_black_picture_is_judged_by_the_reference() {
        let half = vec![[0.4f32; 3]; 2];
        let image = [[0.0; 3], [0.4; 3]];
        let scale = error_scale(&image, [&half, &half]);
        assert_eq!(scale, [[0.1; 3], [0.4; 3]]);
        // (0 − 0.4)²/(0.1 + 0.01)², and no error.
        let errors = error_products(&image, [&half, &half], &scale);
        assert!((errors[0] / (0.4f64 / 0.11).powi(2) - 1.0).abs() < 1e-6 && errors[1] == 0.0, "{errors:?}");
    }

    #[test]
    fn the_standard_error_is_that_of_the_products_of_the_noise() {
        // An exact image of 0.03 + 0.01: products of two deviates of σ = 0.375, in three channels
        // of each pixel.
        let expected = 0.375 * 0.375 / (3.0 * PIXELS as f64).sqrt();
        let image = vec![[0.03f32; 3]; PIXELS];
        let mut squares = 0.0;
        for seed in 0..40 {
            let mut normal = Normal(seed);
            let [a, b] = [0, 1].map(|_| normal.image(0.03, 0.015, PIXELS));
            let found = debiased_relmse_at(&image, [&a, &b], &image);
            assert!((found.standard_error / expected - 1.0).abs() < 0.05, "{found:?}, expected {expected}");
            squares += found.mean * found.mean;
        }
        // Forty figures determine their scatter to a ninth.
        let scatter = (squares / 40.0).sqrt();
        assert!((scatter / expected - 1.0).abs() < 0.35, "{scatter}, expected {expected}");
    }

    #[test]
    fn channels_that_err_alike_are_one() {
        let mut normal = Normal(5);
        let grey = |image: Vec<[f32; 3]>| image.into_iter().map(|[r, _, _]| [r; 3]).collect::<Vec<_>>();
        let [a, b] = [0, 1].map(|_| grey(normal.image(0.03, 0.015, PIXELS)));
        let image = vec![[0.03f32; 3]; PIXELS];
        let found = debiased_relmse_at(&image, [&a, &b], &image).standard_error;
        let expected = 0.375 * 0.375 / (PIXELS as f64).sqrt();
        assert!((found / expected - 1.0).abs() < 0.05, "{found}, expected {expected}");
    }

    #[test]
    fn z_is_calibrated_and_sees_bias_and_understated_noise() {
        let mut normal = Normal(2);
        let (a, b) = (normal.image(1.0, 0.03, PIXELS), normal.image(1.0, 0.04, PIXELS));
        let [va, vb] = [0.03f32, 0.04].map(|sigma| vec![[sigma * sigma; 3]; PIXELS]);
        let fair = z_test(&a, &b, [&va, &vb]);
        assert!(fair.mean.abs() < 0.02 && (fair.rms - 1.0).abs() < 0.02, "{fair:?}");
        assert!(fair.fraction_above_3 > 0.001 && fair.fraction_above_3 < 0.0045, "{fair:?}");
        assert_eq!((fair.count, fair.differ_without_noise), (3 * PIXELS as u64, 0));
        let brighter: Vec<[f32; 3]> = a.iter().map(|pixel| pixel.map(|value| value + 0.025)).collect();
        assert!((z_test(&brighter, &b, [&va, &vb]).mean - 0.5).abs() < 0.03);
        assert!((z_test(&a, &b, [&va, &va]).rms - 0.05 / (0.03 * 2f64.sqrt())).abs() < 0.03);
        assert!((variance_noise(&vec![[0.99; 3]; PIXELS], &va) - 0.0009).abs() < 1e-6);
    }

    #[test]
    fn values_without_noise_are_counted_apart() {
        let none = [[0.0f32; 3]];
        let test = z_test(&[[0.0, 1.0, 2.0]], &[[0.0, 1.0, 3.0]], [&none, &none]);
        assert_eq!((test.count, test.differ_without_noise, test.rms), (0, 1, 0.0));
    }
}
