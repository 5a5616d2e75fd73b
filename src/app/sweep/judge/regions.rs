//! Which stage errs where. In: a picture, pictures with one stage exact, two references. Out: the
//! squared error of each block of pixels, and the stage that causes most of it.

use crate::metrics::EPSILON;

/// Side of a block, pixels.
pub(super) const SIDE: u32 = 8;

/// Relative error of a block, as a root mean square, below which no stage is sought.
pub(super) const SMALL: f64 = 0.005;

/// Part of a block's squared error that a stage must cause to be named.
const LEAST_PART: f64 = 0.25;

/// Standard deviations of the references' noise below which an error is not told from noise.
const SIGMAS: f64 = 3.0;

/// Linear radiance, W/m²/sr, row by row.
pub(super) type Pixels = Vec<[f32; 3]>;

/// Two pictures with the same mean and independent noise; one picture twice has no noise.
#[derive(Clone, Copy)]
pub(super) struct Pair<'a>(pub(super) [&'a [[f32; 3]]; 2]);

/// What causes most of a block's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    DirectLight,
    Records,
    Clusters,
    GatherRays,
    /// No stage alone: light paths, gloss, or several stages.
    Rest,
    /// The error is small, or not told from the references' noise.
    Small,
}

impl Cause {
    pub(super) const ALL: [Self; 6] =
        [Self::DirectLight, Self::Records, Self::Clusters, Self::GatherRays, Self::Rest, Self::Small];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::DirectLight => "direct light",
            Self::Records => "records",
            Self::Clusters => "clusters",
            Self::GatherRays => "gather rays",
            Self::Rest => "the rest",
            Self::Small => "small",
        }
    }
}

/// Blocks of a picture.
#[derive(Clone, Copy)]
pub(super) struct Blocks {
    size: [u32; 2],
}

impl Blocks {
    pub(super) fn new(size: [u32; 2]) -> Self {
        Self { size }
    }

    fn columns(self) -> u32 {
        self.size[0].div_ceil(SIDE)
    }

    pub(super) fn count(self) -> usize {
        (self.columns() * self.size[1].div_ceil(SIDE)) as usize
    }

    /// The block of a pixel.
    pub(super) fn of_pixel(self, pixel: usize) -> usize {
        let (x, y) = (pixel as u32 % self.size[0], pixel as u32 / self.size[0]);
        (y / SIDE * self.columns() + x / SIDE) as usize
    }

    /// The first pixel of a block, x and y.
    pub(super) fn corner(self, block: usize) -> [u32; 2] {
        [block as u32 % self.columns() * SIDE, block as u32 / self.columns() * SIDE]
    }

    /// Number of pixels of each block.
    pub(super) fn pixels(self) -> Vec<f64> {
        let mut counts = vec![0.0; self.count()];
        for pixel in 0..self.size[0] as usize * self.size[1] as usize {
            counts[self.of_pixel(pixel)] += 1.0;
        }
        counts
    }

    /// Mean over the pixels and channels of each block.
    fn means(self, values: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut sums = vec![0.0; self.count()];
        for (index, value) in values.enumerate() {
            sums[self.of_pixel(index / 3)] += value;
        }
        sums.iter().zip(self.pixels()).map(|(sum, pixels)| sum / (3.0 * pixels)).collect()
    }

    /// Squared relative error of each block, without the noise of either pair: the mean of
    /// (a−r)(b−s)/(scale+0.01)². Noise of `picture` and `reference` cancels on average, so that an
    /// error may be negative.
    pub(super) fn errors(self, picture: Pair<'_>, reference: Pair<'_>, scale: &[[f32; 3]]) -> Vec<f64> {
        let product = |[a, b, r, s]: [f64; 4]| 0.5 * ((a - r) * (b - s) + (a - s) * (b - r));
        let values = fours(picture, reference).map(product);
        self.means(values.zip(scales(scale)).map(|(value, scale)| value / (scale * scale)))
    }

    /// Standard deviation of [`Self::errors`] from the references' noise alone.
    pub(super) fn noise(self, reference: Pair<'_>, scale: &[[f32; 3]]) -> Vec<f64> {
        let variances = fours(reference, reference).map(|[r, s, ..]| 0.5 * (r - s) * (r - s));
        let variances =
            self.means(variances.zip(scales(scale)).map(|(value, scale)| value / (scale * scale)));
        variances
            .iter()
            .zip(self.pixels())
            .map(|(variance, pixels)| variance / (3.0 * pixels).sqrt())
            .collect()
    }
}

/// The channels of both pairs, one after another.
fn fours<'a>(picture: Pair<'a>, reference: Pair<'a>) -> impl Iterator<Item = [f64; 4]> {
    let channels = |pixels: &'a [[f32; 3]]| pixels.as_flattened().iter().map(|&value| f64::from(value));
    let (Pair([a, b]), Pair([r, s])) = (picture, reference);
    let pairs = channels(a).zip(channels(b)).zip(channels(r).zip(channels(s)));
    pairs.map(|((a, b), (r, s))| [a, b, r, s])
}

fn scales(scale: &[[f32; 3]]) -> impl Iterator<Item = f64> {
    scale.as_flattened().iter().map(|&value| f64::from(value) + EPSILON)
}

/// Squared error of each block: of the picture, and with stages exact.
pub(super) struct Errors {
    pub(super) whole: Vec<f64>,
    pub(super) direct_exact: Vec<f64>,
    pub(super) records_exact: Vec<f64>,
    pub(super) clusters_exact: Vec<f64>,
    /// Gather rays and clusters exact.
    pub(super) gather_exact: Vec<f64>,
    /// Standard deviation of `whole` from the references' noise.
    pub(super) noise: Vec<f64>,
}

impl Errors {
    /// What each stage causes in a block: the squared error that goes if the stage alone is exact.
    /// That of gather rays is the difference of two such errors.
    fn caused(&self, block: usize) -> [(Cause, f64); 4] {
        let [whole, direct, records, clusters, gather] =
            [&self.whole, &self.direct_exact, &self.records_exact, &self.clusters_exact, &self.gather_exact]
                .map(|errors| errors[block]);
        [
            (Cause::DirectLight, whole - direct),
            (Cause::Records, whole - records),
            (Cause::Clusters, whole - clusters),
            (Cause::GatherRays, clusters - gather),
        ]
    }

    /// The main cause of each block's error.
    pub(super) fn causes(&self) -> Vec<Cause> {
        let cause = |block: usize| {
            let whole = self.whole[block];
            if whole <= (SMALL * SMALL).max(SIGMAS * self.noise[block]) {
                return Cause::Small;
            }
            let largest = self.caused(block).into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
            largest
                .filter(|(_, caused)| *caused >= LEAST_PART * whole)
                .map_or(Cause::Rest, |(cause, _)| cause)
        };
        (0..self.whole.len()).map(cause).collect()
    }

    /// Mean squared error of the picture that a stage causes.
    pub(super) fn caused_by(&self, cause: Cause, pixels: &[f64]) -> Option<f64> {
        let of_block = |block: usize| self.caused(block).into_iter().find(|(of, _)| *of == cause);
        let caused: Option<Vec<f64>> =
            (0..self.whole.len()).map(|block| of_block(block).map(|(_, caused)| caused)).collect();
        caused.map(|caused| mean(&caused, pixels))
    }
}

/// Mean over all pixels.
pub(super) fn mean(of_blocks: &[f64], pixels: &[f64]) -> f64 {
    of_blocks.iter().zip(pixels).map(|(value, pixels)| value * pixels).sum::<f64>()
        / pixels.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::hash;
    use crate::metrics;

    const SIZE: [u32; 2] = [20, 11];

    fn pixels(value: impl Fn(u32) -> f32) -> Pixels {
        (0..SIZE[0] * SIZE[1]).map(|index| std::array::from_fn(|c| value(3 * index + c as u32))).collect()
    }

    /// From −1 to 1.
    fn noise(index: u32) -> f32 {
        2.0 * (hash(index) as f32 / u32::MAX as f32) - 1.0
    }

    #[test]
    fn blocks_cover_each_pixel_once() {
        let blocks = Blocks::new(SIZE);
        assert_eq!(blocks.count(), 6);
        assert_eq!(blocks.pixels(), [64.0, 64.0, 32.0, 24.0, 24.0, 12.0]);
        for pixel in 0..(SIZE[0] * SIZE[1]) as usize {
            let [x, y] = blocks.corner(blocks.of_pixel(pixel));
            let [px, py] = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]];
            assert!((x..x + SIDE).contains(&px) && (y..y + SIDE).contains(&py));
        }
    }

    #[test]
    fn block_errors_add_up_to_the_relative_error_of_the_picture() {
        let blocks = Blocks::new(SIZE);
        let picture = pixels(|index| 1.0 + 0.1 * noise(index));
        let halves =
            [pixels(|index| 1.0 + 0.1 * noise(!index)), pixels(|index| 1.0 + 0.1 * noise(index ^ 0x5555))];
        let reference = Pair([&halves[0], &halves[1]]);
        let errors = blocks.errors(Pair([&picture, &picture]), reference, &picture);
        let expected = metrics::debiased_relmse_at(&picture, reference.0, &picture).mean;
        assert!((mean(&errors, &blocks.pixels()) - expected).abs() < 1e-12);
    }

    #[test]
    fn noise_of_the_pictures_cancels_and_errors_stay() {
        let blocks = Blocks::new(SIZE);
        let (one, grey) = (pixels(|_| 1.0), pixels(|_| 1.1));
        let noisy = |of: f32, salt: u32| pixels(move |index| of + 0.2 * noise(index ^ salt));
        let (r, s) = (noisy(1.0, 0x1000_0000), noisy(1.0, 0x2000_0000));
        let (a, b) = (noisy(1.1, 0x3000_0000), noisy(1.1, 0x4000_0000));
        let reference = Pair([&r, &s]);
        let all = blocks.pixels();
        let found = mean(&blocks.errors(Pair([&a, &b]), reference, &one), &all);
        let exact = mean(&blocks.errors(Pair([&grey, &grey]), Pair([&one, &one]), &one), &all);
        // Variance of the noise: 0.2²/3, and of a mean of products, with 660 channels.
        let bound = 3.0 * (2.0 * 0.2_f64.powi(2) / 3.0 + 0.1 * 0.2) / 660_f64.sqrt();
        assert!((found - exact).abs() < bound && bound < exact, "{found}, {exact}, {bound}");
        // The stated noise is that of a picture without error.
        let still = blocks.errors(Pair([&one, &one]), reference, &one);
        let stated = blocks.noise(reference, &one);
        let within = still.iter().zip(&stated).filter(|(error, noise)| error.abs() < 3.0 * **noise).count();
        assert_eq!(within, still.len());
        assert!(stated.iter().all(|&noise| noise < 0.1 * 0.1), "a tenth of error is told from noise");
    }

    #[test]
    fn the_stage_that_removes_most_is_the_cause() {
        // One block each: small, noise, direct light, records, clusters, gather rays, none.
        let errors = Errors {
            whole: vec![1e-5, 1e-2, 1.0, 1.0, 1.0, 1.0, 1.0],
            direct_exact: vec![0.0, 0.0, 0.3, 1.0, 0.9, 1.2, 0.9],
            records_exact: vec![0.0, 0.0, 0.6, 0.2, 0.9, 1.0, 0.8],
            clusters_exact: vec![0.0, 0.0, 0.9, 0.9, 0.4, 1.0, 0.9],
            gather_exact: vec![0.0, 0.0, 0.9, 0.9, 0.1, 0.5, 0.9],
            noise: vec![0.0, 1e-2, 0.0, 0.0, 0.0, 0.0, 0.0],
        };
        use Cause::{Clusters, DirectLight, GatherRays, Records, Rest, Small};
        assert_eq!(errors.causes(), [Small, Small, DirectLight, Records, Clusters, GatherRays, Rest]);
        let caused = errors.caused_by(Clusters, &[1.0; 7]).unwrap();
        assert!((caused - (1e-5 + 1e-2 + 0.1 + 0.1 + 0.6 + 0.0 + 0.1) / 7.0).abs() < 1e-12);
        assert_eq!(errors.caused_by(Rest, &[1.0; 7]), None);
    }
}
