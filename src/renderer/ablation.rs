//! Ablation: one stage of a frame is replaced by its exact reference, to find the stage that errs.
//! Slow; not part of any frame.

use super::{Layer, Renderer};
use crate::cpu::sampling::hash_pair;
use crate::error::Result;
use crate::gpu::Buffer;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::passes::LitScene;
use crate::passes::frame::{needed_records::RecordList, splat::SeenSurfaces};
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::reference::irradiance_probe;
use crate::types::{CachePoint, NO_SIDE, PixelSurface, Record};
use glam::Vec3;

/// Maximum number of strata of a cache point's hemisphere for new directions. The jitter makes any
/// number right on average.
const STRATA: u32 = 36;

/// Pixels that are gathered in one batch: their rays are the largest buffer.
const PIXELS_AT_A_TIME: usize = 1 << 14;

/// A stage that an exact reference replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Gathers at every pixel instead of splatting records.
    Splat,
    /// Path tracing instead of clusters gives the radiance at the hits of the gather rays.
    Clusters,
    /// Gathers at the cache points along many new directions, with path-traced radiance. Gather
    /// rays and clusters are exact; gradients stay.
    Gather,
}

/// The reference of a stage, and its sampling.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    /// Stage that the reference replaces.
    pub stage: Stage,
    /// Paths in each stratum of a cache point's hemisphere. Unused by [`Stage::Splat`], whose
    /// reference takes no samples.
    pub samples: u32,
    /// Selects the random sequence. Different sequences give independent noise.
    pub sequence: u32,
}

/// Points where paths probe indirect irradiance, and how.
struct Probes<'a> {
    cache_points: &'a Buffer,
    point_count: u32,
    hemisphere: Hemisphere,
    is_along_gather_rays: bool,
    samples: u32,
    sequence: u32,
}

#[doc(hidden)]
impl Renderer {
    /// A layer of the last frame with one stage replaced by its reference. The renderer's
    /// own frame stays.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn layer_with_exact(&self, exact: Exact, layer: Layer) -> Result<Vec<[f32; 3]>> {
        if exact.stage == Stage::Splat {
            return self.layer_gathered_at_pixels(layer);
        }
        self.complete()?;
        let gathered: Vec<Record> = self.transport.gather.records.read()?;
        let irradiance = self.exact_irradiance(exact)?;
        let exact =
            gathered.iter().zip(irradiance).map(|(&record, irradiance)| Record { irradiance, ..record });
        self.transport.gather.records.write(&exact.collect::<Vec<_>>())?;
        self.blend_and_splat()?;
        let found = self.layer(layer)?;
        self.transport.gather.records.write(&gathered)?;
        self.blend_and_splat()?;
        Ok(found)
    }

    /// Path-traced indirect irradiance at each cache point, W/m², without
    /// the factor [`super::StageBuffers::emission_scale`].
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn exact_irradiance(&self, exact: Exact) -> Result<Vec<Vec3>> {
        let gather = &self.transport.gather;
        let is_along_gather_rays = exact.stage == Stage::Clusters;
        let rays = gather.hemisphere.rays();
        self.probed(Probes {
            cache_points: &gather.cache_points,
            point_count: gather.point_count(),
            hemisphere: Hemisphere::new(if is_along_gather_rays { rays } else { rays.min(STRATA) }),
            is_along_gather_rays,
            samples: exact.samples,
            sequence: exact.sequence,
        })
    }

    /// Path-traced indirect irradiance at each of these points, W/m², without the factor
    /// [`super::StageBuffers::emission_scale`]: `samples` paths in each stratum of a hemisphere.
    pub(super) fn traced_irradiance(
        &self,
        points: &[CachePoint],
        hemisphere: Hemisphere,
        samples: u32,
    ) -> Result<Vec<Vec3>> {
        let cache_points = &Buffer::from_slice(&self.context, "probed points", points)?;
        let point_count = points.len() as u32;
        let (is_along_gather_rays, sequence) = (false, 0);
        self.probed(Probes { cache_points, point_count, hemisphere, is_along_gather_rays, samples, sequence })
    }

    fn probed(&self, probes: Probes<'_>) -> Result<Vec<Vec3>> {
        let Probes { cache_points, point_count, hemisphere, is_along_gather_rays, samples, sequence } =
            probes;
        let seed = self.world.scene.quality.seed;
        let lights = Buffer::from_slice(&self.context, "lights of paths", &self.lights.for_paths().bytes())?;
        irradiance_probe::trace(
            &self.context,
            irradiance_probe::Job {
                scene: LitScene {
                    buffers: &self.world.buffers,
                    lights: &lights,
                    light_count: self.world.scene.lights.len() as u32,
                },
                sky: self.lights.sky().zip(self.lights.sky_side()),
                cache_points,
                point_count,
                hemisphere,
                gather_seed: is_along_gather_rays.then_some(seed),
                seed: hash_pair(!seed, sequence),
                samples,
            },
        )
    }

    /// Sets the number of samples of edge pixels, from the next frame on.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn set_edge_samples(&mut self, samples: u32) -> Result<()> {
        self.world.scene.quality.edge_samples = samples;
        self.replace_image(self.image.view)
    }

    /// Computes the clusters and records that the last frame skipped because nothing reads them.
    /// The others keep their bits.
    fn complete(&self) -> Result<()> {
        self.complete_clusters()?;
        self.context.run(|rec| {
            self.transport.gather.record(
                rec,
                self.transport.all_sources(&self.world.buffers, self.lights.sky()),
                &self.transport.record_lists.all,
            );
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.transport.blend.record(
                rec,
                &self.transport.gather.cache_points,
                &self.transport.gather.records,
                None,
            );
        })?;
        Ok(())
    }

    /// Computes the clusters that the last frame skipped.
    pub(super) fn complete_clusters(&self) -> Result<()> {
        let whole = self.transport.live_sets.make_whole()?;
        self.context.run(|rec| {
            self.transport.record_flux(rec, &whole, &self.lights.cluster_lights(), &self.lights);
            self.transport.record_near_field(rec, &self.world.buffers.materials, &whole);
            self.transport.record_bright(rec, &self.world.buffers.materials);
            // The near field has overwritten these records with light gathered from unfinished
            // clusters. The next frame would take them for current, so they are gathered again from
            // the finished ones.
            self.transport.gather.record(
                rec,
                self.transport.all_sources(&self.world.buffers, self.lights.sky()),
                &whole.sources,
            );
        })?;
        Ok(())
    }

    /// Blends and splats records as a frame does, and composes the picture.
    fn blend_and_splat(&self) -> Result<()> {
        self.context.run(|rec| {
            self.transport.blend.record(
                rec,
                &self.transport.gather.cache_points,
                &self.transport.gather.records,
                None,
            );
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.record_splat(rec);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.image.record_composition(rec, &self.world.buffers, self.indirect_light(), [1.0, 1.0]);
        })?;
        Ok(())
    }

    /// A layer of the last frame without splatting: a final gather at every pixel and edge point,
    /// from the same clusters.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn layer_gathered_at_pixels(&self, layer: Layer) -> Result<Vec<[f32; 3]>> {
        self.complete()?;
        let SeenSurfaces { pixels, edge_points, point_groups } = self.image.seen();
        let points = point_groups.read_range::<u32>(3, 1)?[0] as usize;
        let both = [
            (pixels.read()?, self.splat.irradiance()),
            (edge_points.read_range(0, points)?, self.splat.edge_irradiance()),
        ];
        let mut splatted = Vec::new();
        for (seen, irradiance) in &both {
            let before: Vec<Vec3> = irradiance.read_range(0, seen.len())?;
            irradiance.write(&self.gathered_at(seen)?)?;
            splatted.push((before, *irradiance));
        }
        self.compose_with([1.0, 1.0])?;
        let layer = self.layer(layer)?;
        for (before, irradiance) in splatted {
            irradiance.write(&before)?;
        }
        self.compose_with([1.0, 1.0])?;
        Ok(layer)
    }

    /// Irradiance of a final gather at each of these surfaces, W/m².
    fn gathered_at(&self, seen: &[PixelSurface]) -> Result<Vec<Vec3>> {
        let mut irradiance = vec![Vec3::ZERO; seen.len()];
        let shown: Vec<usize> = (0..seen.len()).filter(|&index| seen[index].side != NO_SIDE).collect();
        for indices in shown.chunks(PIXELS_AT_A_TIME) {
            let point = |(stream, &index): (u32, &usize)| self.gather_point(&seen[index], stream);
            let points: Vec<CachePoint> = (0..).zip(indices).map(point).collect();
            for (&index, record) in indices.iter().zip(self.gather_at(&points)?) {
                irradiance[index] = record.irradiance;
            }
        }
        Ok(irradiance)
    }

    /// Gathers at the given points from the clusters of the last frame.
    fn gather_at(&self, points: &[CachePoint]) -> Result<Vec<Record>> {
        let gather = self.gather_at_points(points)?;
        let list =
            RecordList::all(&self.context, gather.point_count(), gather.merged_rays.records_per_chunk)?;
        self.context.run(|rec| {
            gather.record(
                rec,
                self.transport.gather_sources(&self.world.buffers.materials, self.lights.sky()),
                &list,
            );
        })?;
        gather.records.read()
    }
}
