//! The other methods at our time and at our error.

use std::sync::Arc;
use std::time::Instant;

use super::measure::{Judged, judge};
use super::reference::Reference;
use super::results::{Occasion, Rival, Setting};
use crate::app::args::DeviceArgs;
use crate::error::Result;
use crate::gpu::Context;
use crate::reference::{PathTracer, Progressive};
use crate::renderer::Silent;
use crate::scene::Scene;

/// A method to compare with.
pub(super) struct Method {
    pub(super) name: &'static str,
    open: fn(&Arc<Context>, Scene) -> Result<Box<dyn Progressive>>,
    /// Its error falls to nothing, not to a bias.
    is_unbiased: bool,
}

/// All of them, in the order of the tables.
pub(super) const METHODS: [Method; 1] = [Method {
    name: "path tracing",
    open: |context, scene| Ok(Box::new(PathTracer::new(context, scene, &mut Silent)?)),
    is_unbiased: true,
}];

/// Longest that a method is given to reach our error, seconds; beyond, the number of samples is extrapolated.
const EQUAL_ERROR_S: f64 = 12.0;
/// Samples by which a method's speed is told: the first ones contain compilation.
const WARM_UP: u32 = 4;
const TIMED: u32 = 4;

/// What a method did.
pub(super) struct Outcome {
    pub(super) rivals: Vec<Rival>,
    /// The picture at the time of precomputation and first frame.
    pub(super) picture: Judged,
    /// Samples of each of its pixels.
    pub(super) spp: u32,
    /// Wall-clock time of these.
    pub(super) seconds: f64,
}

/// Runs a method for as long as ours takes, then until it is as accurate.
pub(super) fn compare(
    method: &Method,
    scene: &Scene,
    ours: &Setting,
    reference: &Reference,
    device_args: &DeviceArgs,
) -> Result<Outcome> {
    let context = device_args.open()?;
    // Independent of the reference's own samples.
    let mut scene = scene.clone();
    scene.quality.seed = scene.quality.seed.wrapping_add(0x9e37_79b9);
    let sample_s = {
        let mut scratch = (method.open)(&context, scene.clone())?;
        scratch.add_samples(WARM_UP)?;
        let start = Instant::now();
        scratch.add_samples(TIMED)?;
        start.elapsed().as_secs_f64() / f64::from(TIMED)
    };
    let mut run = Run { renderer: (method.open)(&context, scene)?, sample_s, reference };
    let samples_in = |seconds: f64| ((seconds / sample_s) as u32).max(1);

    let mut rivals = Vec::new();
    let mut curve = Vec::new();
    let mut pictures = Vec::new();
    for (at, seconds) in
        [(Occasion::EqualTimeRelit, ours.relit_s()), (Occasion::EqualTimeFirst, ours.first_picture_s())]
    {
        let picture = run.take(samples_in(seconds).max(run.renderer.samples()))?;
        let spp = run.renderer.samples();
        rivals.push(Rival {
            method: method.name,
            at,
            spp: Some(spp),
            seconds: Some(run.seconds()),
            times_ours: Some(run.seconds() / seconds),
            error: Some(picture.error),
            is_extrapolated: false,
            bias_relmse: None,
        });
        curve.push((f64::from(spp), picture.error.relmse_debiased));
        pictures.push((picture, spp, run.seconds()));
    }
    rivals.push(equal_error(method, &mut run, curve, ours)?);
    device_args.report_validation(&context);
    let (picture, spp, seconds) = pictures.pop().expect("there are two");
    Ok(Outcome { rivals, picture, spp, seconds })
}

/// Goes on until the error is ours or time is up.
fn equal_error(method: &Method, run: &mut Run, mut curve: Vec<(f64, f64)>, ours: &Setting) -> Result<Rival> {
    let goal = ours.error.told(&run.reference.facts);
    let most = (EQUAL_ERROR_S / run.sample_s) as u32;
    let mut rendered = None;
    let (needed, bias) = loop {
        let (needed, bias) = samples_for(&curve, goal, method.is_unbiased);
        let taken = run.renderer.samples();
        let is_reached = curve.last().is_some_and(|(_, error)| *error <= goal);
        let next =
            needed.map_or(most, |needed| needed.min(f64::from(most)) as u32).min(taken.saturating_mul(4));
        if is_reached || next <= taken + taken / 20 {
            break (needed, bias);
        }
        let picture = run.take(next)?;
        curve.push((f64::from(next), picture.error.relmse_debiased));
        rendered = Some(picture.error);
    };
    let is_extrapolated = needed.is_some_and(|needed| needed > 1.1 * f64::from(run.renderer.samples()));
    let spp = if is_extrapolated { needed } else { needed.map(|_| f64::from(run.renderer.samples())) };
    let seconds = spp.map(|spp| spp * run.sample_s);
    Ok(Rival {
        method: method.name,
        at: Occasion::EqualError,
        spp: spp.map(|spp| spp.min(f64::from(u32::MAX)) as u32),
        seconds,
        times_ours: seconds.map(|seconds| seconds / ours.relit_s()),
        error: rendered.filter(|_| !is_extrapolated),
        is_extrapolated,
        bias_relmse: bias.filter(|_| needed.is_none()),
    })
}

/// Samples at which the error, bias + c/samples, comes down to `goal`, from what was measured at numbers of samples; none where the
/// bias alone is larger. Also the bias, which an unbiased method has not.
fn samples_for(curve: &[(f64, f64)], goal: f64, is_unbiased: bool) -> (Option<f64>, Option<f64>) {
    let Some(&(samples, error)) = curve.last() else { return (None, None) };
    // The two that are farthest apart tell the bias best.
    let (first_samples, first_error) = curve[0];
    let bias = if is_unbiased || samples <= first_samples {
        0.0
    } else {
        ((samples * error - first_samples * first_error) / (samples - first_samples)).max(0.0)
    };
    if error <= goal {
        return (Some(samples), Some(bias));
    }
    let needed = (bias < goal).then(|| samples * (error - bias) / (goal - bias));
    (needed, Some(bias))
}

/// A method at work.
struct Run<'a> {
    renderer: Box<dyn Progressive>,
    /// Wall-clock time of one sample of every pixel.
    sample_s: f64,
    reference: &'a Reference,
}

impl Run<'_> {
    /// Goes on to so many samples in all.
    fn take(&mut self, samples: u32) -> Result<Judged> {
        self.renderer.add_samples(samples - self.renderer.samples())?;
        let picture = self.renderer.picture()?;
        judge(picture.beauty, Some(&picture.indirect), self.reference)
    }

    /// What its samples so far have taken, without compilation.
    fn seconds(&self) -> f64 {
        self.sample_s * f64::from(self.renderer.samples())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_extrapolated_by_the_fall_of_the_error() {
        let curve = |bias: f64| [(2.0, bias + 0.5), (8.0, bias + 0.125)];
        assert_eq!(samples_for(&curve(0.0), 0.01, true), (Some(100.0), Some(0.0)));
        let (needed, bias) = samples_for(&curve(0.01), 0.02, false);
        assert!((needed.unwrap() - 100.0).abs() < 1e-9 && (bias.unwrap() - 0.01).abs() < 1e-12);
        let (needed, bias) = samples_for(&curve(0.01), 0.01, false);
        assert!(needed.is_none() && (bias.unwrap() - 0.01).abs() < 1e-12);
        assert_eq!(samples_for(&curve(0.0), 0.2, true), (Some(8.0), Some(0.0)), "reached already");
    }
}
