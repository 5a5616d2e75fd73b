//! Error metrics of pictures against a reference. Pixels are linear Rec.709 triples, W/m²/sr,
//! unless a function states otherwise. All sums are in f64. Panics if the images of a comparison
//! differ in their number of pixels.

mod flip;
mod local;
mod noise;

pub use flip::{Flip, PIXELS_PER_DEGREE, flip_map};
pub use local::NoisyError;
pub use noise::{
    Estimate, ZTest, debiased_relmse, debiased_relmse_at, error_scale, half_noise, variance_noise, z_test,
};

/// Offset that keeps the relative error of a dark pixel finite, in the unit of the pixels.
pub const EPSILON: f64 = 0.01;

/// The five figures by which two images are compared.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Comparison {
    /// Error as of [`relmse`].
    pub relmse: f64,
    /// Error as of [`rmse`].
    pub rmse: f64,
    /// Error as of [`smape`].
    pub smape: f64,
    /// Mean of the [`flip_map`].
    pub flip: f64,
    /// Ratio as of [`energy_ratio`].
    pub energy_ratio: f64,
}

/// The first pixel with a component that is not finite.
pub fn first_non_finite(pixels: &[[f32; 3]]) -> Option<usize> {
    pixels.iter().position(|pixel| pixel.iter().any(|value| !value.is_finite()))
}

/// Mean over pixels and channels of (v−r)²/(r+0.01)².
pub fn relmse(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(image, reference, |v, r| ((v - r) / (r + EPSILON)).powi(2))
}

/// Root of the mean over pixels and channels of (v−r)².
pub fn rmse(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(image, reference, |v, r| (v - r).powi(2)).sqrt()
}

/// Symmetric mean absolute percentage error as a fraction, 0..=2: mean over pixels and channels of
/// |v−r| / ((|v|+|r|)/2), which is 0 where both are 0.
pub fn smape(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    mean(image, reference, |v, r| if v == r { 0.0 } else { 2.0 * (v - r).abs() / (v.abs() + r.abs()) })
}

/// Σv / Σr over pixels and channels; 1 where both sums are 0.
pub fn energy_ratio(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    let sum = |pixels: &[[f32; 3]]| pixels.iter().flatten().map(|&value| f64::from(value)).sum::<f64>();
    let (image, reference) = (sum(image), sum(reference));
    if image == reference { 1.0 } else { image / reference }
}

/// The relative error of each pixel: the root of the mean over channels of (v−r)²/(r+0.01)².
pub fn relative_error_map(image: &[[f32; 3]], reference: &[[f32; 3]]) -> Vec<f64> {
    image.iter().zip(reference).map(|(v, r)| relmse(&[*v], &[*r]).sqrt()).collect()
}

/// Mean over pixels and channels of a function of value and reference; 0 of no pixels.
fn mean(image: &[[f32; 3]], reference: &[[f32; 3]], of: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(image.len(), reference.len(), "images of one comparison have one size");
    let pairs = image.iter().flatten().zip(reference.iter().flatten());
    let sum: f64 = pairs.map(|(&v, &r)| of(f64::from(v), f64::from(r))).sum();
    sum / (3 * image.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-6 * expected.abs().max(1e-9), "{found}, expected {expected}");
    }

    #[test]
    fn identical_images_have_no_error() {
        let image: Vec<[f32; 3]> = (0..100).map(|i| [i as f32, 0.0, 1e-3 * i as f32]).collect();
        assert_eq!([relmse, rmse, smape].map(|of| of(&image, &image)), [0.0; 3]);
        assert_eq!(energy_ratio(&image, &image), 1.0);
        assert_eq!(energy_ratio(&[[0.0; 3]], &[[0.0; 3]]), 1.0);
    }

    #[test]
    fn a_constant_offset_gives_the_closed_forms() {
        let (reference, image) = ([[0.49f32; 3]; 7], [[0.74f32; 3]; 7]);
        close(relmse(&image, &reference), 0.25);
        close(rmse(&image, &reference), 0.25);
        close(smape(&image, &reference), 0.25 / 0.615);
        close(energy_ratio(&image, &reference), 0.74 / 0.49);
        assert!(relative_error_map(&image, &reference).iter().all(|error| (error - 0.5).abs() < 1e-6));
    }

    #[test]
    fn channels_and_pixels_weigh_alike() {
        let reference = [[0.0f32, 0.0, 0.0], [1.0, 1.0, 1.0]];
        let image = [[0.02f32, 0.0, 0.0], [1.0, 1.0, 3.02]];
        close(relmse(&image, &reference), (4.0 + 4.0) / 6.0);
        close(rmse(&image, &reference), ((0.02f64.powi(2) + 2.02f64.powi(2)) / 6.0).sqrt());
        // One value against 0 counts 2, the most there is.
        close(smape(&image, &reference), (2.0 + 2.02 / 2.01) / 6.0);
    }

    #[test]
    fn sums_do_not_lose_small_terms() {
        let reference = vec![[0.99f32; 3]; 1 << 20];
        let mut image = vec![[0.99f32 + 1e-3; 3]; 1 << 20];
        image[0] = [1e4; 3];
        let small = f64::from(0.99f32 + 1e-3) - f64::from(0.99f32);
        let rest = (small / (f64::from(0.99f32) + 0.01)).powi(2) * f64::from((1 << 20) - 1);
        let first = ((1e4 - f64::from(0.99f32)) / (f64::from(0.99f32) + 0.01)).powi(2);
        let found = relmse(&image, &reference) * f64::from(1 << 20) - first;
        assert!((found / rest - 1.0).abs() < 0.02, "beside a term of 10⁸: {found}, expected {rest}");
    }

    #[test]
    fn what_is_not_finite_is_found() {
        assert_eq!(first_non_finite(&[[0.0; 3], [f32::MAX; 3]]), None);
        for odd in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(first_non_finite(&[[0.0; 3], [0.0, odd, 0.0]]), Some(1));
        }
    }
}
