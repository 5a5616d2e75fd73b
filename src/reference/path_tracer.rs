//! The path tracer: unbiased and progressive, with an estimate of its own noise. [Kajiya 1986]

use super::{Picture, Progressive, TracedScene};
use crate::cpu::sampling::hash_pair;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context};
use crate::metrics::half_noise;
use crate::passes::precompute::{Chunks, Progress};
use crate::passes::reference::path_trace::{
    Accumulators, Job, PathTrace, RadianceSum, SampleMoments, TILE_LIMIT, TracedPath,
};
use crate::scene::Scene;
use glam::{DVec3, Vec3};
use std::sync::Arc;
use std::time::Instant;

/// Weight of the prior in the scale of the variance, in pixels: it keeps the scale of
/// small images stable.
const SCALE_PRIOR: f64 = 16.0;
/// Estimates the light of every pixel from random paths; box-filtered over the pixel. Samples go
/// alternately to two halves with independent sequences.
pub struct PathTracer {
    scene: TracedScene,
    pass: PathTrace,
    halves: [Half; 2],
    chunks: Chunks,
    device_ms: f64,
    deadline: Option<Instant>,
}

/// One sequence of samples.
struct Half {
    sums: Accumulators,
    seed: u32,
    /// Samples of each pixel; after a cut, the minimum of all pixels.
    samples: u32,
    cut: Option<Cut>,
}

/// State of a half at its deadline.
struct Cut {
    /// Samples of each pixel, the unfinished ones included.
    samples: Vec<u32>,
    /// Pixels whose only sample is unfinished, and the light that its path has found:
    /// direct and indirect.
    unfinished: Vec<(u32, [DVec3; 2])>,
}

/// Sums of radiance and numbers of samples of a half, pixel by pixel, read back.
struct Sums {
    direct: Vec<DVec3>,
    indirect: Vec<DVec3>,
    samples: Vec<f64>,
}

impl PathTracer {
    /// Prepares the scene for its first camera.
    ///
    /// # Errors
    /// [`Error::Usage`] for a scene without triangles; the device lacks memory or failed.
    pub fn new(context: &Arc<Context>, scene: Scene, progress: &mut dyn Progress) -> Result<Self> {
        progress.stage("acceleration structure", 1);
        let scene = TracedScene::new(context, scene)?;
        let half = |number| {
            let sums = Accumulators::new(context, scene.pixel_count())?;
            let seed = hash_pair(scene.scene.quality.seed, number);
            Ok(Half { sums, seed, samples: 0, cut: None })
        };
        Ok(Self {
            pass: PathTrace::new(context, &scene.buffers, &scene.view)?,
            halves: [half(0)?, half(1)?],
            chunks: Chunks::new(4, TILE_LIMIT),
            device_ms: 0.0,
            deadline: None,
            scene,
        })
    }

    /// Mean radiance of all light, for each half: two independent estimates of one picture.
    ///
    /// # Errors
    /// The device failed.
    pub fn halves(&self) -> Result<[Vec<[f32; 3]>; 2]> {
        Ok(self.sums()?.map(|sums| sums.means().into_iter().map(rounded).collect()))
    }

    fn sums(&self) -> Result<[Sums; 2]> {
        Ok([self.halves[0].read()?, self.halves[1].read()?])
    }

    fn is_late(&self) -> bool {
        self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }

    /// Takes samples of a half until each pixel has `goal`. After the deadline, the half takes
    /// fewer and is cut.
    fn advance(&mut self, number: usize, goal: u32) -> Result<()> {
        let half = &mut self.halves[number];
        let (scene, from) = (&self.scene, half.samples);
        let job = Job { scene: scene.lit(), view: &scene.view, seed: half.seed, sums: &half.sums };
        let mut cut = Cut { samples: vec![goal; scene.pixel_count() as usize], unfinished: Vec::new() };
        let mut is_truncated = false;
        self.chunks.run(PathTrace::tiles(&scene.view), |first, count| {
            let tiles = first..first + count;
            let is_late = self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
            is_truncated |= is_late;
            // Every pixel gets at least one sample.
            let goal = if is_late { goal.min(from.max(1)) } else { goal };
            let ran = self.pass.run(job, tiles.clone(), from..goal, self.deadline)?;
            self.device_ms += ran.ms;
            if is_late || !ran.is_complete {
                PathTrace::pixels(&scene.view, tiles.clone())
                    .flatten()
                    .for_each(|pixel| cut.samples[pixel as usize] = goal);
            }
            if !ran.is_complete {
                is_truncated = true;
                self.pass.standing(&scene.view, tiles)?.iter().for_each(|standing| cut.stop(standing));
            }
            Ok(ran.longest_ms)
        })?;
        half.samples = goal;
        if is_truncated {
            half.samples = cut.samples.iter().copied().min().unwrap_or(goal);
            half.cut = Some(cut);
        }
        Ok(())
    }
}

impl Cut {
    /// Ends an unfinished path. If it is the pixel's only path, it counts as it is: the light that
    /// later vertices would add is missing.
    fn stop(&mut self, (pixel, path): &(u32, TracedPath)) {
        let samples = &mut self.samples[*pixel as usize];
        if path.sample_index == 0 && *samples > 0 {
            let found = [path.direct, path.indirect].map(Vec3::as_dvec3);
            self.unfinished.push((*pixel, if path.depth > 0 { found } else { [DVec3::ZERO; 2] }));
        }
        *samples = path.sample_index.max(1).min(*samples);
    }
}

impl Half {
    fn read(&self) -> Result<Sums> {
        let values = |sums: &Buffer| -> Result<Vec<DVec3>> {
            Ok(sums.read::<RadianceSum>()?.iter().map(RadianceSum::value).collect())
        };
        let (mut direct, mut indirect) = (values(&self.sums.direct)?, values(&self.sums.indirect)?);
        let Some(cut) = &self.cut else {
            let samples = vec![f64::from(self.samples); direct.len()];
            return Ok(Sums { direct, indirect, samples });
        };
        for &(pixel, found) in &cut.unfinished {
            direct[pixel as usize] += found[0];
            indirect[pixel as usize] += found[1];
        }
        Ok(Sums { direct, indirect, samples: cut.samples.iter().copied().map(f64::from).collect() })
    }
}

impl Sums {
    fn means(&self) -> Vec<DVec3> {
        let both = self.direct.iter().zip(&self.indirect).zip(&self.samples);
        both.map(|((direct, indirect), samples)| (direct + indirect) / samples.max(1.0)).collect()
    }
}

fn rounded(value: DVec3) -> [f32; 3] {
    value.as_vec3().to_array()
}

impl Progressive for PathTracer {
    /// Alternates between the two halves.
    fn add_samples(&mut self, per_pixel: u32) -> Result<()> {
        let total = self.samples() + per_pixel;
        for (number, goal) in [(0, total.div_ceil(2)), (1, total / 2)] {
            let is_first = number == 0 && self.halves[number].samples == 0;
            // After a cut, the halves have different numbers of samples.
            if self.halves.iter().any(|half| half.cut.is_some()) || (self.is_late() && !is_first) {
                break;
            }
            self.advance(number, goal)?;
        }
        Ok(())
    }

    fn set_deadline(&mut self, deadline: Option<Instant>) {
        self.deadline = deadline;
    }

    fn samples(&self) -> u32 {
        self.halves[0].samples + self.halves[1].samples
    }

    fn device_ms(&self) -> f64 {
        self.device_ms
    }

    fn rays(&self) -> Result<Option<u64>> {
        let mut rays = 0;
        for half in &self.halves {
            let moments: Vec<SampleMoments> = half.sums.moments.read()?;
            rays += moments.iter().map(|pixel| u64::from(pixel.rays)).sum::<u64>();
        }
        Ok(Some(rays))
    }

    fn traced_scene(&self) -> &TracedScene {
        &self.scene
    }

    fn picture(&self) -> Result<Picture> {
        let [a, b] = self.sums()?;
        let totals = a.samples.iter().zip(&b.samples).map(|(a, b)| (a + b).max(1.0));
        let totals: Vec<f64> = totals.collect();
        let mean = |of: fn(&Sums) -> &[DVec3]| -> Vec<DVec3> {
            of(&a).iter().zip(of(&b)).zip(&totals).map(|((a, b), total)| (a + b) / total).collect()
        };
        let (direct, indirect) = (mean(|sums| &sums.direct), mean(|sums| &sums.indirect));
        let beauty = direct.iter().zip(&indirect).map(|(direct, indirect)| rounded(direct + indirect));
        Ok(Picture {
            size: self.scene.size(),
            beauty: beauty.collect(),
            direct: direct.into_iter().map(rounded).collect(),
            indirect: indirect.into_iter().map(rounded).collect(),
        })
    }

    /// The spread of the samples in each half gives the distribution of the variance over the
    /// image. A factor for each channel scales its level, so that it predicts the mean squared
    /// difference of the halves. Samples of a low-discrepancy sequence complement each other, so
    /// their spread alone is too large.
    fn variance(&self) -> Result<Vec<[f32; 3]>> {
        if self.halves[1].samples < 2 {
            return Err(Error::Usage("the variance needs at least four samples of each pixel".into()));
        }
        let sums = self.sums()?;
        let [a, b] = [sums[0].means(), sums[1].means()];
        let mut spread = vec![DVec3::ZERO; a.len()];
        for (half, sums) in self.halves.iter().zip(&sums) {
            let moments: Vec<SampleMoments> = half.sums.moments.read()?;
            for ((spread, pixel), samples) in spread.iter_mut().zip(&moments).zip(&sums.samples) {
                // The factor 1/4: the mean of two halves, whose numbers of samples differ by
                // at most one.
                *spread += 0.25 * pixel.squares.as_dvec3() / (samples * (samples - 1.0));
            }
        }
        let (mut squares, mut count) = (DVec3::splat(SCALE_PRIOR), DVec3::splat(SCALE_PRIOR));
        for ((a, b), spread) in a.iter().zip(&b).zip(&spread) {
            let is_lit = spread.cmpgt(DVec3::ZERO);
            squares += DVec3::select(is_lit, 0.25 * (a - b) * (a - b) / spread, DVec3::ZERO);
            count += DVec3::select(is_lit, DVec3::ONE, DVec3::ZERO);
        }
        Ok(spread.into_iter().map(|spread| rounded(spread * squares / count)).collect())
    }

    fn noise(&self) -> Result<Option<f64>> {
        let is_known = self.halves[1].samples > 0;
        let noise = |[a, b]: [Vec<[f32; 3]>; 2]| half_noise([&a, &b]);
        is_known.then(|| self.halves().map(noise)).transpose()
    }
}
