//! The error of a picture, and of each pixel, against a noisy reference in two halves.

use super::noise::{error_products, error_scale};

/// The squared relative errors of a picture's pixels, with the noise of a reference.
pub struct NoisyError {
    /// Right on average, for each pixel; may be negative.
    of_pixels: Vec<f64>,
    /// Standard deviation of their mean from the noise of the reference.
    uncertainty: f64,
}

impl NoisyError {
    /// Compares a picture with the halves of a reference, whose noise is independent.
    pub fn new(picture: &[[f32; 3]], halves: [&[[f32; 3]]; 2]) -> Self {
        let scale = error_scale(picture, halves);
        let of_pixels = error_products(picture, halves, &scale);
        // (a−b)²: twice the variance σ² of a half. Of normal noise, its square is 12 σ⁴ on average.
        let squares = error_products(halves[0], [halves[1]; 2], &scale);
        // The variance of (e+m)(e+n) with noise m, n: 2 e² σ² + σ⁴.
        let variance = |(error, square): (&f64, &f64)| error.max(0.0) * square + square * square / 12.0;
        let sum: f64 = of_pixels.iter().zip(&squares).map(variance).sum();
        let uncertainty = sum.sqrt() / of_pixels.len().max(1) as f64;
        Self { of_pixels, uncertainty }
    }

    /// The mean over the picture.
    pub fn relmse(&self) -> f64 {
        self.of_pixels.iter().sum::<f64>() / self.of_pixels.len().max(1) as f64
    }

    /// Standard deviation of [`Self::relmse`] from the noise of the reference.
    pub fn uncertainty(&self) -> f64 {
        self.uncertainty
    }

    /// The same for the mean over a block of that many pixels.
    pub fn uncertainty_of(&self, pixels: f64) -> f64 {
        self.uncertainty * (self.of_pixels.len() as f64 / pixels).max(1.0).sqrt()
    }

    /// The relative error of each pixel: a root mean square over its surroundings, which are as
    /// wide as the noise asks. 0 where the error is not told from none.
    pub fn map(&self, size: [u32; 2]) -> Vec<f64> {
        smoothed(&self.of_pixels, size).into_iter().map(|error| error.max(0.0).sqrt()).collect()
    }
}

/// Block means at one scale, and the noise of each.
struct Level {
    columns: usize,
    sums: Vec<f64>,
    squares: Vec<f64>,
    counts: Vec<f64>,
}

impl Level {
    fn of_pixels(values: &[f64], columns: usize) -> Self {
        let squares = values.iter().map(|value| value * value).collect();
        Self { columns, sums: values.to_vec(), squares, counts: vec![1.0; values.len()] }
    }

    fn rows(&self) -> usize {
        self.sums.len() / self.columns
    }

    /// The block of the next level that holds a block of this one.
    fn parent(&self, block: usize) -> usize {
        block / self.columns / 2 * self.columns.div_ceil(2) + block % self.columns / 2
    }

    /// Blocks of twice the side.
    fn coarser(&self) -> Self {
        let (columns, rows) = (self.columns.div_ceil(2), self.rows().div_ceil(2));
        let zeros = || vec![0.0; columns * rows];
        let mut coarser = Self { columns, sums: zeros(), squares: zeros(), counts: zeros() };
        for block in 0..self.sums.len() {
            let parent = self.parent(block);
            coarser.sums[parent] += self.sums[block];
            coarser.squares[parent] += self.squares[block];
            coarser.counts[parent] += self.counts[block];
        }
        coarser
    }

    fn mean(&self, block: usize) -> f64 {
        self.sums[block] / self.counts[block]
    }

    /// Estimates of the blocks from those of their parents. A block differs from its parent by
    /// signal and noise: the part of signal in all squared differences of the level is the weight
    /// of each difference (Wiener's filter). The mean over the picture stays.
    fn refined(&self, parents: &[f64]) -> Vec<f64> {
        let blocks = 0..self.sums.len();
        let difference = |block: usize| self.mean(block) - parents[self.parent(block)];
        let all: f64 = blocks.clone().map(|block| self.counts[block] * difference(block).powi(2)).sum();
        // A value's square stands for its variance: most of it is noise.
        let noise: f64 = blocks.clone().map(|block| self.squares[block] / self.counts[block]).sum();
        let weight = if all > noise { 1.0 - noise / all } else { 0.0 };
        blocks.map(|block| parents[self.parent(block)] + weight * difference(block)).collect()
    }
}

/// The expected value at each pixel, given values with independent noise that is as large as what
/// is sought: blocks of 1, 2, 4 … pixels count as far as they differ by more than their noise. The
/// mean is that of the values. `size`: columns and rows. An estimate may be negative.
fn smoothed(values: &[f64], size: [u32; 2]) -> Vec<f64> {
    assert_eq!(values.len(), size[0] as usize * size[1] as usize, "one value for each pixel");
    if values.is_empty() {
        return Vec::new();
    }
    let mut levels = vec![Level::of_pixels(values, size[0] as usize)];
    while let Some(last) = levels.last().filter(|last| last.sums.len() > 1) {
        let coarser = last.coarser();
        levels.push(coarser);
    }
    let whole = vec![values.iter().sum::<f64>() / values.len() as f64];
    levels.iter().rev().skip(1).fold(whole, |parents, level| level.refined(&parents))
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::Normal;
    use super::*;

    const SIZE: [u32; 2] = [90, 70];

    /// Products of two deviates of σ = 1 around errors: what two noisy references give.
    fn products(error: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut normal = Normal(7);
        let pixels = (SIZE[0] * SIZE[1]) as usize;
        (0..pixels).map(|pixel| (error(pixel) + normal.next()) * (error(pixel) + normal.next())).collect()
    }

    fn mean(values: &[f64]) -> f64 {
        values.iter().sum::<f64>() / values.len() as f64
    }

    /// Halves with normal noise around 1, the same in all channels.
    fn halves(sigma: f64, seed: u64, pixels: usize) -> [Vec<[f32; 3]>; 2] {
        let mut normal = Normal(seed);
        [0, 1].map(|_| (0..pixels).map(|_| [(1.0 + sigma * normal.next()) as f32; 3]).collect())
    }

    #[test]
    fn the_uncertainty_is_the_scatter_of_the_error() {
        for picture in [1.0f32, 1.1] {
            let found: Vec<NoisyError> = (0..200)
                .map(|seed| {
                    let [a, b] = halves(0.1, seed, 1000);
                    NoisyError::new(&vec![[picture; 3]; 1000], [&a, &b])
                })
                .collect();
            let error = f64::from((picture - 1.0) / (picture + 0.01)).powi(2);
            let of = |value: &dyn Fn(&NoisyError) -> f64| found.iter().map(value).sum::<f64>() / 200.0;
            let scatter = of(&|found| (found.relmse() - error).powi(2)).sqrt();
            let stated = of(&|found| found.uncertainty().powi(2)).sqrt();
            // Two hundred seeds determine a scatter to a twentieth. Products below 0 count as
            // errors of 0, which raises the statement.
            assert!((0.9..1.4).contains(&(stated / scatter)), "{stated} {scatter}");
            assert!((of(&|found| found.relmse()) - error).abs() < 4.0 * stated / 200f64.sqrt());
            assert!((found[0].uncertainty_of(250.0) / found[0].uncertainty() - 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_map_shows_the_error_of_each_region() {
        let pixels = (SIZE[0] * SIZE[1]) as usize;
        let [a, b] = halves(0.1, 3, pixels);
        let value = |pixel: usize| if pixel % 90 < 45 { [1.3; 3] } else { [1.0; 3] };
        let picture: Vec<[f32; 3]> = (0..pixels).map(value).collect();
        let map = NoisyError::new(&picture, [&a, &b]).map(SIZE);
        let of = |column: usize| mean(&map.iter().skip(column).step_by(90).copied().collect::<Vec<_>>());
        assert!((of(10) / (0.3 / 1.31) - 1.0).abs() < 0.1 && of(80) < 0.04, "{} {}", of(10), of(80));
    }

    #[test]
    fn the_mean_stays() {
        let values = products(|pixel| (pixel % 90) as f64 / 30.0);
        assert!((mean(&smoothed(&values, SIZE)) - mean(&values)).abs() < 1e-9);
        assert_eq!(smoothed(&[3.0], [1, 1]), [3.0]);
        assert!(smoothed(&[], [0, 4]).is_empty());
    }

    #[test]
    fn noise_alone_is_smoothed_away() {
        let values = products(|_| 0.0);
        let found = smoothed(&values, SIZE);
        let scatter = |of: &[f64]| of.iter().map(|value| value * value).sum::<f64>() / of.len() as f64;
        assert!(scatter(&values) > 0.8, "the noise of a product is 1");
        assert!(scatter(&found) < 0.02, "{}", scatter(&found));
    }

    #[test]
    fn regions_keep_their_errors() {
        // A third of the picture errs by two standard deviations, the rest by a tenth.
        let errs = |pixel: usize| pixel % 90 < 30;
        let values = products(|pixel| if errs(pixel) { 2.0 } else { 0.1 });
        let found = smoothed(&values, SIZE);
        let of = |wanted: bool| {
            let pixels = (0..values.len()).filter(|&pixel| errs(pixel) == wanted);
            mean(&pixels.map(|pixel| found[pixel]).collect::<Vec<_>>())
        };
        // Blocks across the border take a tenth of the error to the other side, which is twice as
        // large.
        assert!((of(true) / 4.0 - 1.0).abs() < 0.1 && of(false).abs() < 0.2, "{} {}", of(true), of(false));
        // Away from the border, single pixels follow their region.
        let far = |pixel: usize| pixel % 90 < 24 || pixel % 90 > 40;
        let right = (0..values.len()).filter(|&pixel| far(pixel));
        let right = right.map(|pixel| f64::from(u8::from((found[pixel] > 1.5) == errs(pixel))));
        assert!(mean(&right.collect::<Vec<_>>()) > 0.95);
    }

    #[test]
    fn a_lone_outlier_counts_as_noise() {
        let mut values = vec![0.0; (SIZE[0] * SIZE[1]) as usize];
        values[3000] = 9.0;
        // Its square says that it may be noise, so that the whole picture takes it on.
        assert!(smoothed(&values, SIZE).iter().all(|&value| (value * 6300.0 - 9.0).abs() < 1e-6));
    }
}
