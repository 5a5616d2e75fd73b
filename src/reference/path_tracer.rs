//! The path tracer: unbiased, progressive, its own noise stated. [Kajiya 1986]

use super::{Picture, Progressive, TracedScene};
use crate::cpu::sampling::hash_pair;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::metrics::half_noise;
use crate::passes::precompute::{Chunks, Progress};
use crate::passes::reference::path_trace::{
    Accumulators, Job, PathTrace, RadianceSum, SampleMoments, TILE_LIMIT,
};
use crate::scene::Scene;
use glam::DVec3;
use std::sync::Arc;

/// Pixels whose worth of doubt the scale of the variance starts from, so that images of few pixels do not swing it.
const SCALE_PRIOR: f64 = 16.0;
/// Estimates the light of every pixel from random paths; box-filtered over the pixel. Samples belong in turn to two halves,
/// whose sequences are independent.
pub struct PathTracer {
    scene: TracedScene,
    pass: PathTrace,
    halves: [Half; 2],
    chunks: Chunks,
    device_ms: f64,
}

/// One sequence of samples.
struct Half {
    sums: Accumulators,
    seed: u32,
    samples: u32,
}

/// What was read back of a half.
struct Sums {
    direct: Vec<RadianceSum>,
    indirect: Vec<RadianceSum>,
    samples: f64,
}

impl PathTracer {
    /// Makes ready to render the scene for its first camera.
    ///
    /// # Errors
    /// [`Error::Usage`] for a scene without triangles; the device lacks memory or failed.
    pub fn new(context: &Arc<Context>, scene: Scene, progress: &mut dyn Progress) -> Result<Self> {
        progress.stage("acceleration structure", 1);
        let scene = TracedScene::new(context, scene)?;
        let half = |number| {
            let sums = Accumulators::new(context, scene.pixel_count())?;
            Ok(Half { sums, seed: hash_pair(scene.scene.quality.seed, number), samples: 0 })
        };
        Ok(Self {
            pass: PathTrace::new(context, &scene.buffers, &scene.view)?,
            halves: [half(0)?, half(1)?],
            chunks: Chunks::new(4, TILE_LIMIT),
            device_ms: 0.0,
            scene,
        })
    }

    /// Mean radiance of all light, each half by itself: two independent estimates of one picture.
    ///
    /// # Errors
    /// The device failed.
    pub fn halves(&self) -> Result<[Vec<[f32; 3]>; 2]> {
        Ok(self.sums()?.map(|sums| sums.means().into_iter().map(rounded).collect()))
    }

    fn sums(&self) -> Result<[Sums; 2]> {
        let read = |half: &Half| {
            let (direct, indirect) = (half.sums.direct.read()?, half.sums.indirect.read()?);
            Ok(Sums { direct, indirect, samples: f64::from(half.samples) })
        };
        Ok([read(&self.halves[0])?, read(&self.halves[1])?])
    }
}

impl Sums {
    fn means(&self) -> Vec<DVec3> {
        let samples = self.samples.max(1.0);
        let both = self.direct.iter().zip(&self.indirect);
        both.map(|(direct, indirect)| (direct.value() + indirect.value()) / samples).collect()
    }
}

fn rounded(value: DVec3) -> [f32; 3] {
    value.as_vec3().to_array()
}

impl Progressive for PathTracer {
    /// In turn for the two halves.
    fn add_samples(&mut self, per_pixel: u32) -> Result<()> {
        let total = self.samples() + per_pixel;
        let (scene, tiles) = (&self.scene, PathTrace::tiles(&self.scene.view));
        for (half, goal) in self.halves.iter_mut().zip([total.div_ceil(2), total / 2]) {
            let job = Job { scene: scene.lit(), view: &scene.view, seed: half.seed, sums: &half.sums };
            self.chunks.run(tiles, |first, count| {
                let [ms, longest] = self.pass.run(job, first..first + count, half.samples..goal)?;
                self.device_ms += ms;
                Ok(longest)
            })?;
            half.samples = goal;
        }
        Ok(())
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
        let total = (a.samples + b.samples).max(1.0);
        let mean = |of: fn(&Sums) -> &[RadianceSum]| -> Vec<DVec3> {
            of(&a).iter().zip(of(&b)).map(|(a, b)| (a.value() + b.value()) / total).collect()
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

    /// The spread of the samples in each half gives its distribution over the image; for the level it is scaled, all pixels of a
    /// channel alike, so that the squared differences of the two halves are on average what it predicts: samples of a
    /// low-discrepancy sequence complement each other, and their spread alone would state too much.
    fn variance(&self) -> Result<Vec<[f32; 3]>> {
        if self.halves[1].samples < 2 {
            return Err(Error::Usage("the variance needs at least four samples of each pixel".into()));
        }
        let [a, b] = self.sums()?.map(|sums| sums.means());
        let mut spread = vec![DVec3::ZERO; a.len()];
        for half in &self.halves {
            let moments: Vec<SampleMoments> = half.sums.moments.read()?;
            let samples = f64::from(half.samples);
            for (spread, pixel) in spread.iter_mut().zip(&moments) {
                // A quarter: of the mean of two halves, which differ by one sample at most.
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
