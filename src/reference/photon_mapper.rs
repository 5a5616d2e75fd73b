//! Photon mapping with final gathering, progressive. [Jensen 1996]
//!
//! Each photon map serves a few samples of every pixel; the picture is the mean over all maps. The
//! radius of the density estimate shrinks with the number of maps, and its bias with it. [Knaus
//! and Zwicker 2011]

use super::irradiance_points::{IrradiancePoints, Reachable, bounding_sphere};
use super::{Picture, Progressive, TracedScene};
use crate::cpu::brdf::luminance;
use crate::cpu::emission::light_power;
use crate::cpu::sampling::hash_pair;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::metrics::half_noise;
use crate::passes::precompute::Progress;
use crate::passes::reference::photon_gather::{GatherSums, PhotonGather, Sequence};
use crate::passes::reference::photon_irradiance::PhotonIrradiance;
use crate::passes::reference::photon_map::PhotonMap;
use crate::passes::reference::photon_trace::{self, BoundingSphere, PhotonTrace};
use crate::scene::Scene;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Instant;

/// Photon paths of a map; fewer if their photons do not fit.
const PATHS: u32 = 1 << 17;
/// Slots of a photon map, empty ones included: this bounds its buffers to 36 MiB.
const SLOTS: u32 = 1 << 20;
/// Number of paths that would meet the first map's kernel if light were spread evenly
/// and not reflected.
const PATHS_IN_KERNEL: f64 = 32.0;
/// Gather rays that one map serves. Small images reach [`MAX_SAMPLES_A_MAP`] first.
const RAYS_A_MAP: u32 = 1 << 19;
const MAX_SAMPLES_A_MAP: u32 = 32;
/// Samples of a pixel in one dispatch: lavapipe ends all loops of an invocation once they have run
/// 65 535 times.
const SAMPLES_A_DISPATCH: u32 = 2;
/// Maximum number of times that the radius shrinks, once for each doubling of the number of maps:
/// to 35 % of the first radius.
const MAX_SHRINKS: u32 = 9;

/// Renders by photon mapping; box-filtered over the pixel. Samples and photons depend on the
/// scene's seed alone.
///
/// Every sample adds the direct light at the hit of a camera ray, and sends one ray from there by
/// the BRDF. At the hit of that ray, the photon map gives the irradiance, which is multiplied with
/// the diffuse albedo; a Phong lobe there continues the path. If the ray is shorter than the radius
/// of the density estimate, the path also continues, until a ray is longer.
pub struct PhotonMapper {
    scene: TracedScene,
    /// Power of each light, W.
    powers: Vec<f64>,
    reachable: Reachable,
    trace: PhotonTrace,
    estimate: PhotonIrradiance,
    gather: PhotonGather,
    photons: PhotonMap,
    points: Option<IrradiancePoints>,
    /// Paths of a map.
    paths: u32,
    /// Maps go alternately to the two halves.
    halves: [Half; 2],
    /// Radius of the first map's density estimate, metres.
    first_radius: f64,
    maps: u32,
    /// Slots in use of the last map.
    slots: u32,
    samples: u32,
    device_ms: f64,
    deadline: Option<Instant>,
}

/// One sequence of photons and samples.
struct Half {
    gather: Sequence,
    photon_seed: u32,
    /// Rays that each light has sent so far.
    first_rays: Vec<u32>,
    samples: u32,
}

impl PhotonMapper {
    /// Prepares the scene for its first camera.
    ///
    /// # Errors
    /// [`Error::Usage`] for a scene without triangles; the device lacks memory or failed.
    pub fn new(context: &Arc<Context>, scene: Scene, progress: &mut dyn Progress) -> Result<Self> {
        progress.stage("acceleration structure", 1);
        let scene = TracedScene::new(context, scene)?;
        let (centre, radius) = bounding_sphere(&scene.scene);
        let lights = &scene.light_sources;
        let table = (&lights.rows[..], lights.intensities());
        let power = |light| luminance(light_power(light, table, f64::from(radius)).as_vec3());
        let half = |number| {
            let [photon_seed, gather_seed] =
                [2_u32, 4].map(|purpose| hash_pair(scene.scene.quality.seed, purpose + number));
            let gather = Sequence::new(context, scene.pixel_count(), gather_seed)?;
            Ok(Half { gather, photon_seed, first_rays: vec![0; scene.scene.lights.len()], samples: 0 })
        };
        let sphere = BoundingSphere { centre, radius };
        Ok(Self {
            powers: lights.rows[..scene.scene.lights.len()].iter().map(power).collect(),
            reachable: Reachable::new(context, &scene)?,
            trace: PhotonTrace::new(context, &scene.buffers, PATHS + scene.light_count(), sphere)?,
            estimate: PhotonIrradiance::new(context)?,
            gather: PhotonGather::new(context, &scene.buffers)?,
            photons: PhotonMap::new(context, SLOTS)?,
            points: None,
            paths: PATHS,
            halves: [half(0)?, half(1)?],
            first_radius: 0.0,
            maps: 0,
            slots: 0,
            samples: 0,
            device_ms: 0.0,
            deadline: None,
            scene,
        })
    }

    /// Samples of each pixel that one photon map serves.
    pub fn samples_a_map(&self) -> u32 {
        (RAYS_A_MAP / self.scene.pixel_count().max(1)).clamp(1, MAX_SAMPLES_A_MAP)
    }

    /// Traces photons and estimates their irradiance.
    fn next_map(&mut self) -> Result<()> {
        let (context, buffers) = (self.scene.context.clone(), &self.scene.buffers);
        let ms = &mut self.device_ms;
        let half = &mut self.halves[self.maps as usize % 2];
        let (slots, rays) = loop {
            let rays = photon_trace::deal(&self.powers, self.paths);
            let paths = photon_trace::start(&rays, &half.first_rays);
            if let Some(slots) =
                self.trace.trace(self.scene.lit(), paths, half.photon_seed, &self.photons, ms)?
            {
                break (slots, rays);
            }
            self.paths /= 2;
            if self.paths < 1 << 10 {
                return Err(Error::OutOfMemory(format!(
                    "the photons of {} paths do not fit a map of {SLOTS}; lower an albedo close to 1",
                    2 * self.paths
                )));
            }
        };
        for (first, rays) in half.first_rays.iter_mut().zip(rays) {
            *first = first.wrapping_add(rays);
        }

        let shrinks = (self.maps + 1).ilog2().min(MAX_SHRINKS);
        if self.maps == 0 {
            let area = self.reachable.area_m2.max(f64::MIN_POSITIVE);
            self.first_radius = (PATHS_IN_KERNEL * area / (PI * f64::from(self.paths))).sqrt().max(1e-30);
        }
        // Variance falls as the number of maps to the power of 2/3, bias to the power of 1/3.
        let radius = (self.first_radius * (-f64::from(shrinks) / 6.0).exp2()) as f32;
        let points = match self.points.take().filter(|points| points.radius() == radius) {
            Some(points) => points,
            None => {
                let reachable = &self.reachable;
                IrradiancePoints::new(&context, &self.scene, reachable, radius, &mut self.estimate, ms)?
            }
        };
        points.estimate(&context, buffers, &self.photons, slots, &mut self.estimate, ms)?;
        self.points = Some(points);
        self.slots = slots;
        self.maps += 1;
        Ok(())
    }

    /// Photon maps so far.
    pub fn maps(&self) -> u32 {
        self.maps
    }

    /// Photon paths of the last map.
    pub fn paths_a_map(&self) -> u32 {
        self.paths
    }

    /// Radius of the last map's density estimate, metres.
    pub fn radius(&self) -> f32 {
        self.points.as_ref().map_or(0.0, IrradiancePoints::radius)
    }

    /// Slots that the photons of the last map used.
    pub fn slots(&self) -> u32 {
        self.slots
    }

    /// The last photon map.
    pub fn photons(&self) -> &PhotonMap {
        &self.photons
    }

    /// Mean radiance of all light, for each half: estimates from independent photons and gather
    /// rays, with the same bias.
    ///
    /// # Errors
    /// The device failed.
    pub fn halves(&self) -> Result<[Vec<[f32; 3]>; 2]> {
        let mean = |half: &Half| -> Result<Vec<[f32; 3]>> {
            let scale = 1.0 / f64::from(half.samples.max(1));
            let sums: Vec<GatherSums> = half.gather.sums.read()?;
            let value = |sums: &GatherSums| sums.values().into_iter().sum::<DVec3>();
            Ok(sums.iter().map(|sums| rounded(scale * value(sums))).collect())
        };
        Ok([mean(&self.halves[0])?, mean(&self.halves[1])?])
    }
}

fn rounded(value: DVec3) -> [f32; 3] {
    value.as_vec3().to_array()
}

impl Progressive for PhotonMapper {
    /// Starts a new photon map if the last one has served its samples. [`Error::OutOfMemory`] if
    /// photons do not fit, for example because no surface absorbs.
    fn add_samples(&mut self, per_pixel: u32) -> Result<()> {
        let goal = self.samples + per_pixel;
        let samples_a_map = self.samples_a_map();
        while self.samples < goal {
            let is_late = self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
            if is_late && self.samples > 0 {
                break;
            }
            if self.samples == self.maps * samples_a_map {
                self.next_map()?;
            }
            let Some(points) = &self.points else { break };
            let half = &mut self.halves[(self.maps - 1) as usize % 2];
            let most = if is_late { 1 } else { SAMPLES_A_DISPATCH };
            let count = (goal.min(self.maps * samples_a_map) - self.samples).min(most);
            let samples = half.samples..half.samples + count;
            let (scene, view) = (self.scene.lit(), &self.scene.view);
            let ms = &mut self.device_ms;
            self.gather.gather(scene, view, points.irradiance(), &half.gather, samples, ms)?;
            half.samples += count;
            self.samples += count;
        }
        Ok(())
    }

    fn set_deadline(&mut self, deadline: Option<Instant>) {
        self.deadline = deadline;
    }

    fn samples(&self) -> u32 {
        self.samples
    }

    fn device_ms(&self) -> f64 {
        self.device_ms
    }

    fn traced_scene(&self) -> &TracedScene {
        &self.scene
    }

    fn picture(&self) -> Result<Picture> {
        let [a, b] = [self.halves[0].gather.sums.read::<GatherSums>()?, self.halves[1].gather.sums.read()?];
        let scale = 1.0 / f64::from(self.samples.max(1));
        let layer = |of: fn([DVec3; 2]) -> DVec3| {
            let both = a.iter().zip(&b);
            both.map(|(a, b)| rounded(scale * (of(a.values()) + of(b.values())))).collect()
        };
        Ok(Picture {
            size: self.scene.size(),
            beauty: layer(|[direct, indirect]| direct + indirect),
            direct: layer(|[direct, _]| direct),
            indirect: layer(|[_, indirect]| indirect),
        })
    }

    fn round(&self) -> u32 {
        self.samples_a_map()
    }

    /// Unknown, because samples of one map share its photons.
    fn variance(&self) -> Result<Vec<[f32; 3]>> {
        Err(Error::Usage("photon mapping does not know the variance of a pixel; --method path does".into()))
    }

    /// Computed from the difference of the halves, if both have samples. The bias of the density
    /// estimate is not included.
    fn noise(&self) -> Result<Option<f64>> {
        if self.halves[1].samples == 0 {
            return Ok(None);
        }
        let [a, b] = self.halves()?;
        Ok(Some(half_noise([&a, &b])))
    }

    fn rays(&self) -> Result<Option<u64>> {
        Ok(None)
    }
}
