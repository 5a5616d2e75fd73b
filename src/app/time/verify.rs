//! Check of the timed picture: its energy against the path tracer's.

use crate::app::args::DeviceArgs;
use crate::error::Result;
use crate::metrics;
use crate::reference::{PathTracer, Progressive};
use crate::renderer::Silent;
use crate::scene::Scene;

/// Samples of each pixel in a round, two for each half.
const ROUND: u32 = 4;
/// Relative standard deviation of the energy at which the path tracer is exact enough.
const EXACT: f64 = 0.002;
/// Largest number of samples of all pixels.
const MAX_SAMPLES: u64 = 1 << 24;
/// Relative deviation that is allowed because any such method has it.
const ALLOWED: f64 = 0.01;
/// Deviation that counts as noise, in the path tracer's standard deviations.
const SIGMAS: f64 = 3.0;

/// The picture's energy relative to the path tracer's.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub(super) struct Energy {
    /// Energy of the picture over that of the path tracer.
    pub(super) ratio: f64,
    /// Standard deviation of the ratio, from the path tracer's noise.
    pub(super) noise: f64,
    /// Samples of each of its pixels.
    pub(super) spp: u32,
}

impl Energy {
    /// Compares a picture with two independent estimates of it.
    fn from_picture(picture: &[[f32; 3]], halves: [&[[f32; 3]]; 2], spp: u32) -> Self {
        let sum = |pixel: &[f32; 3]| pixel.iter().map(|&value| f64::from(value)).sum::<f64>();
        let pairs = || halves[0].iter().zip(halves[1]).map(|(a, b)| [sum(a), sum(b)]);
        let total: f64 = pairs().map(|[a, b]| 0.5 * (a + b)).sum();
        // Half the difference of two estimates has the deviation of their mean.
        let variance: f64 = pairs().map(|[a, b]| 0.25 * (a - b).powi(2)).sum();
        let ours: f64 = picture.iter().map(sum).sum();
        match total > 0.0 {
            true => Self { ratio: ours / total, noise: variance.sqrt() / total, spp },
            false => Self { ratio: if ours == total { 1.0 } else { f64::INFINITY }, noise: 0.0, spp },
        }
    }

    /// Whether the energies agree within the allowed deviation and the noise.
    pub(super) fn agrees(&self) -> bool {
        (self.ratio - 1.0).abs() <= ALLOWED + SIGMAS * self.noise
    }

    /// The result as text.
    pub(super) fn say(&self) -> String {
        let Self { ratio, noise, spp } = self;
        let ratio = 100.0 * (ratio - 1.0);
        format!("{ratio:+.2} % off the path tracer's (± {:.2} %, {spp} samples a pixel)", 100.0 * noise)
    }
}

/// Path traces until the energy is exact enough. The scene's first camera is the picture's.
pub(super) fn energy(scene: Scene, picture: &[[f32; 3]], device_args: &DeviceArgs) -> Result<Energy> {
    if metrics::first_non_finite(picture).is_some() {
        return Ok(Energy { ratio: f64::NAN, noise: 0.0, spp: 0 });
    }
    let context = device_args.open()?;
    let mut tracer = PathTracer::new(&context, scene, &mut Silent)?;
    loop {
        tracer.add_samples(ROUND)?;
        let [a, b] = tracer.halves()?;
        let energy = Energy::from_picture(picture, [&a, &b], tracer.samples());
        let samples = u64::from(tracer.samples()) * picture.len() as u64;
        // An estimate from few pixels may underestimate its noise.
        let is_exact = energy.noise <= EXACT && tracer.samples() > ROUND;
        if is_exact || samples >= MAX_SAMPLES {
            device_args.report_validation(&context);
            return Ok(energy);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energies_agree_within_one_per_cent_and_the_noise() {
        let picture = |value: f32| vec![[value, 2.0 * value, 0.0]; 10_000];
        let noisy = |sign: f32| -> Vec<[f32; 3]> {
            let value = |index: usize| 1.0 + 0.4 * sign * if index.is_multiple_of(2) { 1.0 } else { -1.0 };
            (0..10_000).map(|index| [value(index), 2.0 * value(index), 0.0]).collect()
        };
        let (a, b) = (noisy(1.0), noisy(-1.0));
        let of = |value: f32| Energy::from_picture(&picture(value), [&a, &b], 4);
        // Each pixel's mean deviates by 0.4; the sum of ten thousand deviates by a
        // hundredth of that.
        assert!((of(1.0).noise - 0.004).abs() < 1e-6 && (of(1.0).ratio - 1.0).abs() < 1e-6);
        assert!(of(1.02).agrees() && of(0.98).agrees());
        assert!(!of(1.025).agrees() && !of(0.975).agrees());
        let exact = Energy::from_picture(&picture(1.0), [&picture(1.0), &picture(1.0)], 4);
        assert_eq!((exact.ratio, exact.noise), (1.0, 0.0));
        assert!(!Energy { ratio: f64::NAN, noise: 0.0, spp: 0 }.agrees());
        let black = picture(0.0);
        assert!(Energy::from_picture(&black, [&black, &black], 4).agrees());
        assert!(!Energy::from_picture(&picture(1.0), [&black, &black], 4).agrees());
    }
}
