//! The baselines at our time and at our error.

use std::sync::Arc;
use std::time::Instant;

use super::measure::{Judged, judge};
use super::reference::Reference;
use super::results::{Baseline, Occasion, Setting};
use crate::app::args::DeviceArgs;
use crate::error::Result;
use crate::gpu::Context;
use crate::reference::{PathTracer, PhotonMapper, Progressive};
use crate::renderer::Silent;
use crate::scene::Scene;

/// Creates a method's renderer.
type Open = fn(&Arc<Context>, Scene) -> Result<Box<dyn Progressive>>;

/// A baseline method.
pub(super) struct Method {
    pub(super) name: &'static str,
    open: Open,
}

/// All baselines, in the order of the tables.
pub(super) const METHODS: [Method; 2] = [
    Method {
        name: "photon mapping",
        open: |context, scene| Ok(Box::new(PhotonMapper::new(context, scene, &mut Silent)?)),
    },
    Method {
        name: "path tracing",
        open: |context, scene| Ok(Box::new(PathTracer::new(context, scene, &mut Silent)?)),
    },
];

/// Time limit for a method to reach our error, seconds. Beyond it, the number of
/// samples is extrapolated.
const EQUAL_ERROR_S: f64 = 5.0;
/// Sample limit of that, as a multiple of the reference's samples. Beyond it, the reference's noise
/// dominates the error.
const MAX_OF_REFERENCE: f64 = 4.0;
/// Most renderings until the errors are equal.
const MAX_ATTEMPTS: u32 = 6;
/// Fewest samples for the estimate of a method's speed, after a round that contains compilation.
const TIMED: u32 = 2;

/// The result of a baseline.
pub(super) struct Outcome {
    pub(super) baselines: Vec<Baseline>,
    /// The picture at the time of precomputation and first frame.
    pub(super) picture: Judged,
    /// Samples of each of its pixels.
    pub(super) spp: u32,
    /// Wall-clock time of these samples.
    pub(super) seconds: f64,
}

/// Runs a method for the time of ours, then until it has our error.
pub(super) fn compare(
    method: &Method,
    scene: &Scene,
    ours: &Setting,
    reference: &Reference,
    (context, device_args): (&Arc<Context>, &DeviceArgs),
) -> Result<Outcome> {
    // Independent of the reference's samples.
    let mut scene = scene.clone();
    scene.quality.seed = scene.quality.seed.wrapping_add(0x9e37_79b9);
    let renderer = (method.open)(context, scene.clone())?;
    let round = renderer.round();
    let open = method.open;
    let mut run =
        Run { open, context: context.clone(), scene, renderer, sample_s: f64::INFINITY, round, reference };
    // The smallest amount of work; often one of our frames leaves no time for more.
    let least = run.take(round)?;
    let count = TIMED.next_multiple_of(round);
    let start = Instant::now();
    run.renderer.add_samples(count)?;
    run.sample_s = start.elapsed().as_secs_f64() / f64::from(count);

    let mut baselines = Vec::new();
    let mut curve = Vec::new();
    let mut told = |run: &Run<'_>, at, spp: u32, picture: &Judged, ours_s: f64| {
        let seconds = run.sample_s * f64::from(spp);
        baselines.push(Baseline {
            method: method.name,
            at,
            spp,
            seconds,
            times_ours: seconds / ours_s,
            error: Some(picture.error),
            is_extrapolated: false,
        });
        curve.push((f64::from(spp), picture.error.relmse_debiased));
    };
    let (relit_s, first_s) = (ours.relit_s(), ours.first_picture_s());
    if run.samples_in(relit_s) == round {
        told(&run, Occasion::RelitFrameTime, round, &least, relit_s);
    } else {
        let picture = run.spend(relit_s)?;
        told(&run, Occasion::RelitFrameTime, run.renderer.samples(), &picture, relit_s);
    }
    let picture = run.spend(first_s)?;
    let (spp, seconds) = (run.renderer.samples(), run.seconds());
    told(&run, Occasion::FirstPictureTime, spp, &picture, first_s);
    baselines.push(equal_error(method, run, curve, ours)?);
    device_args.report_validation(context);
    Ok(Outcome { baselines, picture, spp, seconds })
}

/// Continues until the error is ours or a limit is reached. Restarts if the error
/// is already smaller.
fn equal_error(
    method: &Method,
    mut run: Run,
    mut curve: Vec<(f64, f64)>,
    ours: &Setting,
) -> Result<Baseline> {
    let goal = ours.error.told();
    let most =
        (EQUAL_ERROR_S / run.sample_s).min(MAX_OF_REFERENCE * f64::from(run.reference.facts.spp)).max(1.0);
    let mut rendered = None;
    let mut needed = samples_for(&curve, goal);
    if needed < 0.9 * f64::from(run.renderer.samples()) {
        run.restart()?;
    }
    for _ in 0..MAX_ATTEMPTS {
        let taken = run.renderer.samples();
        // At most four times as many samples at once, because the first estimates are rough.
        let rash = if taken == 0 { f64::INFINITY } else { 4.0 * f64::from(taken) };
        let next = needed.min(most).min(rash) as u32;
        let next = next.next_multiple_of(run.round).max(run.round);
        if next <= taken + taken / 20 {
            break;
        }
        let picture = run.take(next)?;
        curve.push((f64::from(next), picture.error.relmse_debiased));
        rendered = Some((next, picture.error));
        needed = samples_for(&curve, goal);
    }
    // A rendered picture counts if its error is about as small.
    let measured = rendered.filter(|(_, error)| error.relmse_debiased <= 1.2 * goal);
    let spp = measured.map_or(needed, |(spp, _)| f64::from(spp));
    let seconds = spp * run.sample_s;
    Ok(Baseline {
        method: method.name,
        at: Occasion::Error,
        spp: spp.min(f64::from(u32::MAX)) as u32,
        seconds,
        times_ours: seconds / ours.relit_s(),
        error: measured.map(|(_, error)| error),
        is_extrapolated: measured.is_none(),
    })
}

/// Samples at which the error reaches `goal`, extrapolated as 1/samples from measurements (at least
/// one). A biased method needs more.
fn samples_for(curve: &[(f64, f64)], goal: f64) -> f64 {
    let distance = |(_, error): &(f64, f64)| (error.max(1e-12) / goal).ln().abs();
    let nearest = curve.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
    nearest.map_or(1.0, |(samples, error)| samples * error / goal).max(1.0)
}

/// A method while it renders.
struct Run<'a> {
    open: Open,
    context: Arc<Context>,
    scene: Scene,
    renderer: Box<dyn Progressive>,
    /// Wall-clock time of one sample of every pixel.
    sample_s: f64,
    /// Samples of a round, which share a cost.
    round: u32,
    reference: &'a Reference,
}

/// Rounds from which on a new time measurement replaces the old one.
const TRUSTED_ROUNDS: u32 = 4;
/// Times that the sample count is corrected by the measured time.
const CORRECTIONS: u32 = 4;

impl Run<'_> {
    fn restart(&mut self) -> Result<()> {
        self.renderer = (self.open)(&self.context, self.scene.clone())?;
        Ok(())
    }

    /// Samples that fit the time, in whole rounds, at least one.
    fn samples_in(&self, seconds: f64) -> u32 {
        ((seconds / self.sample_s) as u32 / self.round * self.round).max(self.round)
    }

    /// Continues to the samples that fit the time. Restarts if there are more already.
    fn spend(&mut self, seconds: f64) -> Result<Judged> {
        if self.renderer.samples() > self.samples_in(seconds) {
            self.restart()?;
        }
        for _ in 0..CORRECTIONS {
            let goal = self.samples_in(seconds);
            let taken = self.renderer.samples();
            if goal <= taken + taken / 20 {
                break;
            }
            self.advance(goal)?;
        }
        self.judge()
    }

    /// Continues to `samples` samples in total.
    fn take(&mut self, samples: u32) -> Result<Judged> {
        self.advance(samples)?;
        self.judge()
    }

    /// Adds samples, and updates the speed estimate: first rounds can cost more than later ones.
    fn advance(&mut self, samples: u32) -> Result<()> {
        let taken = self.renderer.samples();
        let start = Instant::now();
        self.renderer.add_samples(samples - taken)?;
        if taken > 0 && samples - taken >= TRUSTED_ROUNDS * self.round {
            self.sample_s = start.elapsed().as_secs_f64() / f64::from(samples - taken);
        }
        Ok(())
    }

    fn judge(&self) -> Result<Judged> {
        let picture = self.renderer.picture()?;
        judge(picture.beauty, Some(&picture.indirect), self.reference)
    }

    /// Time of the samples so far, without compilation.
    fn seconds(&self) -> f64 {
        self.sample_s * f64::from(self.renderer.samples())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_extrapolated_by_the_fall_of_the_error() {
        let curve = [(2.0, 0.5), (8.0, 0.125)];
        let close = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found}");
        close(samples_for(&curve, 0.01), 100.0);
        close(samples_for(&curve, 0.25), 4.0);
        close(samples_for(&curve, 10.0), 1.0);
        // The nearest point decides.
        close(samples_for(&[(2.0, 0.5), (8.0, 0.2)], 0.1), 16.0);
        close(samples_for(&[(2.0, 0.5), (8.0, -1e-3)], 0.4), 2.5);
    }
}
