//! The error of a picture, without a reference picture: a few path-traced samples a pixel, in two
//! halves. Their noise cancels in the mean of (v−a)(v−b), so they need no more of them than tell
//! the error from the noise. Unlike the scatter over seeds, this sees systematic errors.

use std::sync::Arc;
use std::time::Instant;

use super::sampled::{Budget, spend};
use crate::app::args::DeviceArgs;
use crate::app::picture::refuse_non_finite;
use crate::cpu::sampling::hash_pair;
use crate::error::Result;
use crate::gpu::Context;
use crate::metrics::NoisyError;
use crate::reference::{PathTracer, Progressive};
use crate::scene::Scene;

/// Samples of a pixel at first; they double until the noise is small.
const FIRST_SPP: u32 = 16;
/// Most samples of a pixel, unless the user asks for more.
const MAX_SPP: u32 = 1024;
/// Pixels of a block in which a map states the error.
const BLOCK_PIXELS: f64 = 32.0 * 32.0;
/// Uncertainty of a block's error, relative to the picture's error.
const MAX_BLOCK_NOISE: f64 = 0.15;
/// Uncertainty of the picture's error, relative to the error asked for.
const MAX_NOISE: f64 = 0.1;

/// How exactly the error must be known.
#[derive(Clone, Copy, Debug)]
pub(super) enum Wanted {
    /// In each block of the picture.
    Map,
    /// For the whole picture, against this relMSE.
    Picture(f64),
}

/// The error of a picture, as `--stats` states it.
#[derive(Clone, Debug, serde::Serialize)]
pub(super) struct StatedError {
    /// Mean squared relative error.
    pub(super) relmse: f64,
    /// Its standard deviation from the noise of the paths.
    pub(super) uncertainty: f64,
    /// Path-traced samples of a pixel, and their time.
    pub(super) spp: u32,
    pub(super) seconds: f64,
    /// Relative error of each pixel, as a root mean square over its surroundings.
    #[serde(skip)]
    pub(super) map: Vec<f64>,
}

impl StatedError {
    pub(super) fn words(&self) -> String {
        format!("relMSE {:.1e} ± {:.0e}", self.relmse, self.uncertainty)
    }
}

/// Path tracing in two halves, which judges pictures of one scene.
pub(super) struct PathJudge<'a> {
    tracer: PathTracer,
    budget: Budget,
    device_args: &'a DeviceArgs,
    seconds: f64,
}

impl<'a> PathJudge<'a> {
    /// `budget`: samples and time that the user asks for; with neither, as many as the error needs.
    pub(super) fn new(
        context: &Arc<Context>,
        mut scene: Scene,
        budget: Budget,
        device_args: &'a DeviceArgs,
    ) -> Result<Self> {
        // Noise that the picture's own seed does not know.
        scene.quality.seed = hash_pair(scene.quality.seed, 1);
        let tracer = PathTracer::new(context, scene, device_args.progress().as_mut())?;
        Ok(Self { tracer, budget, device_args, seconds: 0.0 })
    }

    /// The error of a picture of the scene. Adds samples until it is known well enough.
    pub(super) fn judge(&mut self, picture: &[[f32; 3]], wanted: Wanted) -> Result<StatedError> {
        let is_free = self.budget.spp.is_none() && self.budget.seconds.is_none();
        let mut budget = self.budget;
        let mut goal = FIRST_SPP.max(self.tracer.samples());
        loop {
            if is_free {
                budget.spp = Some(goal);
            }
            if self.tracer.samples() == 0 || is_free {
                let start = Instant::now();
                spend(&mut self.tracer, budget, self.device_args.progress().as_mut())?;
                self.seconds += start.elapsed().as_secs_f64();
            }
            let [a, b] = self.tracer.halves()?;
            let size = self.tracer.traced_scene().size();
            [&a, &b].into_iter().try_for_each(|half| refuse_non_finite(size, half))?;
            let error = NoisyError::new(picture, [&a, &b]);
            if !is_free || goal >= MAX_SPP || is_known(&error, wanted) {
                return Ok(StatedError {
                    relmse: error.relmse(),
                    uncertainty: error.uncertainty(),
                    spp: self.tracer.samples(),
                    seconds: self.seconds,
                    map: if matches!(wanted, Wanted::Map) { error.map(size) } else { Vec::new() },
                });
            }
            goal *= 2;
        }
    }
}

fn is_known(error: &NoisyError, wanted: Wanted) -> bool {
    match wanted {
        Wanted::Map => error.uncertainty_of(BLOCK_PIXELS) <= MAX_BLOCK_NOISE * error.relmse(),
        Wanted::Picture(asked) => error.uncertainty() <= MAX_NOISE * asked,
    }
}
