//! The renderer's lights: the device's table, and the cached contributions of each light, free
//! of its colour. [`Dirty`](super::dirty::Dirty) stores which of them are stale.

use super::light_cache::{GlossCapacity, LightCache, cluster_light, gloss_light};
use super::plan::{FramePlan, LightResults};
use crate::cpu::lights::Intensities;
use crate::error::Result;
use crate::gpu::{Buffer, BufferName, Context, Recorder};
use crate::passes::GrowsWith;
use crate::passes::frame::antialias::Antialias;
use crate::passes::frame::gloss::GlossLight;
use crate::passes::frame::hvds::ClusterLight;
use crate::passes::frame::near_lights::{NearInputs, NearLights};
use crate::passes::frame::silhouettes::Silhouettes;
use crate::passes::{LightRows, LightTable, OneLight};
use crate::scene::emission::Sky;
use crate::scene::{Emission, Light};
use crate::types::{CHANNEL_SHIFT, LightSource};
use glam::Vec3;
use std::sync::Arc;

/// Word of a light's counters: number of pixels at the edges of its shadows.
const SHADOW_EDGES: u32 = 0;
/// Words of a light's counters: number of fragments that it may illuminate in part, and of the
/// samples that average them.
const MIXED_FRAGMENTS: u32 = 2;
/// Word of a light's counters: distance of the nearest surface, metres, bits of a float.
const NEAREST: u32 = 1;
/// Maximum number of lights with maps of silhouettes, 6 MB each, or 1.6 MB for each sample.
const MAPS: usize = 8;

/// All lights, in the order of the scene.
pub(super) struct Lights {
    context: Arc<Context>,
    /// The device's copy of `rows`.
    table: Buffer,
    /// Parts of the lights, radiances of skies, measured intensities. Kernels work per unit of
    /// emission: the colour reaches them in the sums over lights.
    rows: LightTable,
    /// Radiance of the sky by direction, W/m²/sr; three floats a cell of its table. `None` if there
    /// is no sky.
    sky_radiance: Option<Buffer>,
    /// First part of each light, with the light's emission, which is black if the light is off.
    sources: Vec<LightSource>,
    /// Lights of one channel each that represent a light of the scene: 3 if panes have colours,
    /// because results have none. Otherwise 1.
    channels: usize,
    /// The lights of the scene.
    lights: Vec<Light>,
    emission: Arc<Emission>,
    /// The factor of all light in a frame. A single active light has unit emission in the
    /// table, and its emission stands here. A new colour of that light then changes only the
    /// picture's last step.
    pub(super) emission_scale: Vec3,
    caches: Vec<LightCache>,
    factor_count: u32,
    point_count: u32,
    cluster_count: u32,
    gloss: Option<GlossCapacity>,
    /// The scene has edges for maps of silhouettes.
    has_silhouettes: bool,
    /// Lights that are off and points that face away from a light are traced, too, without effect.
    pub(super) traces_all: bool,
}

/// Consequences of edited lights.
pub(super) struct Edited {
    /// Emissions in the table have changed.
    pub(super) emission: bool,
    /// The emission scale has changed.
    pub(super) composition: bool,
    /// Lights with new buffers of beams: their form factors, clusters and hits are stale.
    pub(super) new_beams: Vec<usize>,
}

/// Buffers of all lights for a picture of another size.
pub(super) struct NewIrradiances {
    point_count: u32,
    sample_count: Option<u32>,
    /// Irradiance buffer of each light, with its hits and highlights.
    of_lights: Vec<(Buffer, Option<[Buffer; 2]>)>,
}

/// A light with all of its parts.
pub(super) fn one_light<'a>(
    table: &'a Buffer,
    rows: &LightTable,
    (index, channel): (usize, Option<u32>),
    source: &LightSource,
) -> OneLight<'a> {
    let LightRows { parts, sky } = &rows.lights[index];
    OneLight {
        row: parts.start,
        part_count: parts.len() as u32,
        sky: *sky,
        channel,
        ..OneLight::new(table, index as u32, source)
    }
}

/// Whether shadow rays go to the light. A sky without bright spots lights through records alone.
pub(super) fn has_parts(light: &OneLight<'_>) -> bool {
    light.part_count > 0
}

/// Whether a light is part of the sums over lights. A light that is off has a black emission
/// in the table.
fn is_active(source: &LightSource) -> bool {
    source.emission != Vec3::ZERO
}

impl Lights {
    /// Allocates buffers for each light: `factor_count` form factors, `point_count` points that the
    /// camera sees, `cluster_count` base clusters.
    pub(super) fn new(
        context: &Arc<Context>,
        (lights, emission, channels): (&[Light], &Arc<Emission>, u32),
        [factor_count, point_count, cluster_count]: [u32; 3],
        gloss: Option<GlossCapacity>,
        has_silhouettes: bool,
    ) -> Result<Self> {
        let sky_radiance = |sky: &Sky| {
            let black = vec![Vec3::ZERO; (sky.side * sky.side) as usize];
            Buffer::from_slice(context, "sky radiance", &black)
        };
        let mut made = Self {
            context: context.clone(),
            table: Buffer::storage(context, "lights", 0)?,
            sky_radiance: emission.sky.as_ref().map(sky_radiance).transpose()?,
            rows: LightTable::default(),
            sources: Vec::new(),
            channels: channels as usize,
            lights: Vec::new(),
            emission: emission.clone(),
            emission_scale: Vec3::ONE,
            caches: Vec::new(),
            factor_count,
            point_count,
            cluster_count,
            gloss,
            has_silhouettes,
            traces_all: false,
        };
        for _ in lights {
            made.add()?;
        }
        made.edit(lights)?;
        Ok(made)
    }

    /// Allocates the buffers of one more light of the scene, the last.
    pub(super) fn add(&mut self) -> Result<()> {
        (0..self.channels).try_for_each(|_| self.add_channel())
    }

    fn add_channel(&mut self) -> Result<()> {
        let counts = [self.factor_count, self.point_count, self.cluster_count];
        self.caches.push(LightCache::new(&self.context, counts, self.gloss)?);
        Ok(())
    }

    /// Removes the buffers of a light of the scene. Its last channels may have none.
    pub(super) fn remove(&mut self, light: usize) {
        let own = light * self.channels..self.caches.len().min((light + 1) * self.channels);
        self.caches.drain(own);
    }

    /// The light of the scene whose channel this is.
    pub(super) fn of_scene(&self, light: OneLight<'_>) -> usize {
        light.index as usize / self.channels
    }

    /// Results of the plan for each light.
    fn plans<'a>(&self, plan: &'a [LightResults]) -> impl Iterator<Item = &'a LightResults> + use<'a> {
        let channels = self.channels;
        plan.iter().flat_map(move |results| std::iter::repeat_n(results, channels))
    }

    /// The lights of one channel each that stand for these.
    fn of_channels(&self, lights: &[Light]) -> Vec<Light> {
        let masks = [Vec3::X, Vec3::Y, Vec3::Z];
        let of_light = |light: &Light| -> Vec<Light> {
            let of_channel = |mask: &Vec3| Light {
                kind: light.kind.with_emission(*mask * light.kind.emission()),
                ..light.clone()
            };
            if self.channels == 1 { vec![light.clone()] } else { masks.iter().map(of_channel).collect() }
        };
        lights.iter().flat_map(of_light).collect()
    }

    /// The channel of a light. `None` if it has all.
    pub(super) fn channel(&self, light: usize) -> Option<u32> {
        (self.channels > 1).then_some((light % self.channels) as u32)
    }

    /// Allocates buffers for `point_count` points that the camera sees and `sample_count` samples
    /// of glossy pixels. If `sample_count` is `None`, hits and highlights keep their buffers.
    pub(super) fn new_irradiances(
        &self,
        point_count: u32,
        sample_count: Option<u32>,
    ) -> Result<NewIrradiances> {
        let buffer = |name: BufferName<'static>, count: u32| {
            Buffer::storage(&self.context, name, 4 * u64::from(count))
        };
        let of_gloss = |count: u32| {
            Ok([
                buffer(GrowsWith::Pixels.named("light hits"), 3 * count)?,
                buffer(GrowsWith::Pixels.named("light highlights"), count)?,
            ])
        };
        let of_light = |_| {
            Ok((
                buffer(GrowsWith::Pixels.named("light irradiance"), point_count)?,
                sample_count.map(of_gloss).transpose()?,
            ))
        };
        let of_lights = (0..self.caches.len()).map(of_light).collect::<Result<_>>()?;
        Ok(NewIrradiances { point_count, sample_count, of_lights })
    }

    /// Replaces the buffers. The new ones are empty, so the caller also marks the view stale.
    pub(super) fn take_irradiances(&mut self, new: NewIrradiances) {
        self.point_count = new.point_count;
        if let (Some(gloss), Some(sample_count)) = (&mut self.gloss, new.sample_count) {
            gloss.sample_count = sample_count;
        }
        for (cache, (irradiance, of_gloss)) in self.caches.iter_mut().zip(new.of_lights) {
            cache.irradiance = irradiance;
            if let Some([hits, highlights]) = of_gloss {
                (cache.hits, cache.highlights) = (Some(hits), Some(highlights));
            }
        }
    }

    /// The table of these lights, and the first part of each channel of a light, with the light's
    /// emission, which is black if the light is off.
    pub(super) fn tables(&self, lights: &[Light]) -> (LightTable, Vec<LightSource>) {
        let lights = &self.of_channels(lights)[..];
        let mut rows = LightTable::new(lights, &self.emission);
        for (index, light) in rows.lights.iter().enumerate() {
            let channel = self.channel(index).map_or(0, |channel| channel + 1) << CHANNEL_SHIFT;
            rows.rows[light.rows()].iter_mut().for_each(|row| row.shape |= channel);
        }
        let first = |light: &LightRows| rows.rows[light.parts.start as usize];
        let mut sources: Vec<LightSource> = rows.lights.iter().map(first).collect();
        for (source, light) in sources.iter_mut().zip(lights) {
            source.emission = if light.is_on { source.emission } else { Vec3::ZERO };
        }
        (rows, sources)
    }

    /// Takes over edited lights. The next frame uploads them. If it fails, the emissions of the
    /// previous call stay in use.
    pub(super) fn edit(&mut self, lights: &[Light]) -> Result<Edited> {
        let emissions =
            |sources: &[LightSource]| sources.iter().map(|source| source.emission).collect::<Vec<_>>();
        let (rows, mut sources) = self.tables(lights);
        let mut active = sources.iter_mut().filter(|source| source.emission != Vec3::ZERO);
        let emission_scale = match (active.next(), active.next()) {
            (Some(only), None) => std::mem::replace(&mut only.emission, Vec3::ONE),
            _ => Vec3::ONE,
        };
        if self.has_silhouettes {
            for (index, (source, cache)) in sources.iter().zip(&mut self.caches).take(MAPS).enumerate() {
                let bytes = one_light(&self.table, &rows, (index, None), source).map_bytes();
                if cache.silhouettes.as_ref().map_or(0, Buffer::bytes) < bytes {
                    cache.silhouettes = Some(Silhouettes::maps(&self.context, bytes)?);
                }
            }
        }
        let mut new_beams = Vec::new();
        if let Some(gloss) = self.gloss {
            let channels: Vec<_> = (0..sources.len()).map(|index| self.channel(index)).collect();
            for (index, (source, cache)) in sources.iter().zip(&mut self.caches).enumerate() {
                let light = one_light(&self.table, &rows, (index, channels[index]), source);
                let bytes = u64::from(light.beam_count()) * gloss.beam_bytes;
                if cache.beams.as_ref().is_none_or(|beams| beams.bytes() < bytes) {
                    cache.beams = Some(Buffer::storage(
                        &self.context,
                        GrowsWith::EntryPoints.named("gloss beams"),
                        bytes,
                    )?);
                    new_beams.push(index / self.channels);
                }
            }
        }
        let bytes = rows.byte_count() as u64;
        if bytes > self.table.bytes() {
            self.table = Buffer::storage(&self.context, "lights", bytes)?;
        }
        let emission = emissions(&self.sources) != emissions(&sources);
        let composition = self.emission_scale != emission_scale;
        (self.sources, self.emission_scale) = (sources, emission_scale);
        (self.rows, self.lights) = (rows, lights.to_vec());
        Ok(Edited { emission, composition, new_beams })
    }

    /// The table for path tracing: the lights as frames see them, then their parts.
    pub(super) fn for_paths(&self) -> LightTable {
        let mut table = LightTable::for_paths(&self.lights, &self.emission);
        for (row, sources) in table.rows.iter_mut().zip(self.sources.chunks(self.channels)) {
            row.emission = sources.iter().map(|source| source.emission).sum();
        }
        table
    }

    /// Intensities intensities of the table.
    pub(super) fn intensities(&self) -> Intensities<'_> {
        self.rows.intensities()
    }

    /// Uploads the table. A transfer.
    pub(super) fn record_upload(&self, rec: &mut Recorder) {
        rec.upload(&self.table, &self.rows.bytes());
    }

    /// Uploads the radiance of the sky, colours included. A transfer.
    pub(super) fn record_sky_upload(&self, rec: &mut Recorder) {
        if let Some(sky_radiance) = &self.sky_radiance {
            rec.upload(sky_radiance, &self.sky_radiance());
        }
    }

    /// Finds what the near-light corrections of these lights read. Traces no ray.
    ///
    /// # Errors
    /// The device lacks memory.
    pub(super) fn prepare_near(&mut self, plan: &FramePlan, near_lights: &mut NearLights) -> Result<()> {
        let plans = self.plans(&plan.lights);
        let intensities = self.rows.intensities();
        for ((source, cache), planned) in self.sources.iter().zip(&mut self.caches).zip(plans) {
            if planned.factors {
                cache.near = near_lights.inputs(source, intensities);
                near_lights.reserve(cache.near.as_slice())?;
            }
        }
        Ok(())
    }

    /// Copies counters of the lights that the frame traces to the host. Transfers.
    pub(super) fn copy_counters(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        (antialias, near_lights): (&Antialias, &NearLights),
    ) {
        let plans = self.plans(&plan.lights);
        for ((rows, cache), planned) in self.rows.lights.iter().zip(&self.caches).zip(plans) {
            if planned.irradiance && antialias.is_on() && !rows.parts.is_empty() {
                rec.copy_to_host(&cache.shadow_groups, 12, &cache.counters, SHADOW_EDGES, 1);
                rec.copy_to_host(&cache.shadow_groups, 44, &cache.counters, MIXED_FRAGMENTS, 2);
            }
            if planned.factors && cache.near.is_some() {
                near_lights.copy_nearest(rec, &cache.near_state, &cache.counters, NEAREST);
            }
        }
    }

    /// Whether frames trace and sum each light of the scene: if it is active, or all of them.
    pub(super) fn traced(&self) -> Vec<bool> {
        let is_traced = |sources: &[LightSource]| self.traces_all || sources.iter().any(is_active);
        self.sources.chunks(self.channels).map(is_traced).collect()
    }

    /// Radiance of the sky without its bright spots. `None` without a sky.
    pub(super) fn sky(&self) -> Option<&Buffer> {
        self.sky_radiance.as_ref()
    }

    /// Contents of [`Self::sky`]. Empty without a sky.
    pub(super) fn sky_radiance(&self) -> Vec<Vec3> {
        self.rows.sky_radiance(self.sources.iter().map(|source| source.emission))
    }

    /// Side of the sky's octahedral table. `None` without a sky.
    pub(super) fn sky_side(&self) -> Option<u32> {
        self.emission.sky.as_ref().map(|sky| sky.side)
    }

    /// Number of lights of the scene, on or off.
    pub(super) fn count(&self) -> u32 {
        (self.caches.len() / self.channels) as u32
    }

    /// Lights whose results of one kind the frame computes, each with its buffers.
    fn planned<'a, 'p>(
        &'a self,
        plan: &'p FramePlan,
        result: fn(&LightResults) -> bool,
    ) -> impl Iterator<Item = (OneLight<'a>, &'a LightCache)> + use<'a, 'p> {
        self.active().filter(move |(light, _)| result(&plan.lights[self.of_scene(*light)]))
    }

    /// Lights whose form factors the frame computes, each with the buffer for them.
    pub(super) fn planned_factors(&self, plan: &FramePlan) -> Vec<(OneLight<'_>, &Buffer)> {
        let planned = self.planned(plan, |results| results.factors);
        planned.map(|(light, cache)| (light, &cache.factors)).collect()
    }

    /// Inputs and state of a light's near-light correction. `None` if no surface is near the light.
    pub(super) fn near(&self, light: u32) -> Option<(&NearInputs, &Buffer)> {
        let cache = &self.caches[light as usize];
        Some((cache.near.as_ref()?, &cache.near_state))
    }

    /// The entry points whose form factors the near-light correction has changed.
    pub(super) fn corrected_points(&self, light: u32, near_lights: &NearLights) -> impl Iterator<Item = u32> {
        let cache = &self.caches[light as usize];
        let near =
            cache.near.iter().filter(|_| near_lights.is_near(f32::from_bits(cache.counters.word(NEAREST))));
        near.flat_map(|near| near.points.iter().map(|point| point.index))
    }

    /// Lights whose irradiance at pixels the frame computes, each with the buffer for it. A light
    /// without parts has none.
    pub(super) fn planned_irradiances(&self, plan: &FramePlan) -> Vec<(OneLight<'_>, &Buffer)> {
        let planned = self.planned(plan, |results| results.irradiance).filter(|(light, _)| has_parts(light));
        planned.map(|(light, cache)| (light, &cache.irradiance)).collect()
    }

    /// The counter of pixels at the edges of a light's shadows.
    pub(super) fn shadow_groups(&self, light: OneLight<'_>) -> &Buffer {
        &self.caches[light.index as usize].shadow_groups
    }

    /// Number of pixels at the edges of a light's shadows in the last frame that traced it.
    pub(super) fn shadow_edges(&self, light: OneLight<'_>) -> u32 {
        self.caches[light.index as usize].counters.word(SHADOW_EDGES)
    }

    /// Number of samples of mixed fragments in the last frame that traced a light.
    pub(super) fn mixed_samples(&self, light: OneLight<'_>) -> u64 {
        u64::from(self.caches[light.index as usize].counters.word(MIXED_FRAGMENTS + 1))
    }

    /// Number of fragments that a light may illuminate in part, in the last frame that traced it.
    pub(super) fn mixed_fragments(&self, light: OneLight<'_>) -> u32 {
        self.caches[light.index as usize].counters.word(MIXED_FRAGMENTS)
    }

    /// Number of fragments that lights may illuminate in part, summed over active lights.
    pub(super) fn mixed_fragment_count(&self) -> u64 {
        let traced = self.active().filter(|(light, _)| has_parts(light));
        traced.map(|(light, _)| u64::from(self.mixed_fragments(light))).sum()
    }

    /// Number of pixels at shadow edges, summed over active lights.
    pub(super) fn shadow_edge_count(&self) -> u64 {
        let traced = self.active().filter(|(light, _)| has_parts(light));
        traced.map(|(light, _)| u64::from(self.shadow_edges(light))).sum()
    }

    /// Emission and form factors of each active light.
    pub(super) fn factors(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| Some(&cache.factors))
    }

    /// Active lights, as the passes of the hierarchy read them.
    pub(super) fn cluster_lights(&self) -> Vec<ClusterLight<'_>> {
        self.active().map(|(_, cache)| cluster_light(cache)).collect()
    }

    /// Lights whose flux of base clusters the frame computes.
    pub(super) fn planned_clusters(&self, plan: &FramePlan) -> Vec<ClusterLight<'_>> {
        let planned = self.planned(plan, |results| results.clusters);
        planned.map(|(_, cache)| cluster_light(cache)).collect()
    }

    /// Clears the flux of new lights. A transfer. Returns whether there are any.
    pub(super) fn record_clear(&self, rec: &mut Recorder, plan: &FramePlan) -> bool {
        let new = || self.caches.iter().zip(self.plans(&plan.lights)).filter(|(_, planned)| planned.cleared);
        new().for_each(|(cache, _)| rec.fill_zero(&cache.clusters));
        new().next().is_some()
    }

    /// Emission and irradiance buffer of base clusters of each active light.
    pub(super) fn clusters(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| Some(&cache.clusters))
    }

    /// Emission and irradiance buffer of pixels of each active light that has parts.
    pub(super) fn irradiances(&self) -> Vec<(Vec3, &Buffer)> {
        let traced = self.active().filter(|(light, _)| has_parts(light));
        traced.map(|(light, cache)| (self.emission(light), &cache.irradiance)).collect()
    }

    /// Fraction of active lights whose form factors the frame keeps, and fraction whose irradiance
    /// at pixels. Both are 1 if no light is active.
    pub(super) fn unchanged(&self, plan: &FramePlan) -> [f64; 2] {
        let active = self.active().count().max(1) as f64;
        [self.planned_factors(plan).len(), self.planned_irradiances(plan).len()]
            .map(|planned| 1.0 - planned as f64 / active)
    }

    /// Parts of each active light.
    pub(super) fn active_parts(&self) -> impl Iterator<Item = &[LightSource]> {
        let lights = self.sources.iter().zip(&self.rows.lights);
        let active = lights.filter(|(source, _)| is_active(source));
        active.map(|(_, LightRows { parts, .. })| &self.rows.rows[parts.start as usize..parts.end as usize])
    }

    /// Active lights that are not stale. Returns their parts, emission, form factors, irradiance at
    /// pixels, and index.
    pub(super) fn current<'a>(
        &'a self,
        stale: &'a [LightResults],
    ) -> impl Iterator<Item = (&'a [LightSource], Vec3, [&'a Buffer; 2], u32)> {
        let is_current = |stale: &LightResults| !stale.factors && !stale.irradiance;
        let current = self.active().filter(move |(light, _)| is_current(&stale[self.of_scene(*light)]));
        current.map(|(light, cache)| {
            let parts = light.row as usize..(light.row + light.part_count) as usize;
            (&self.rows.rows[parts], self.emission(light), [&cache.factors, &cache.irradiance], light.index)
        })
    }

    /// Lights whose beams the frame computes: form factors, and the buffers of glossy surfaces.
    /// Empty if no material is glossy.
    pub(super) fn planned_beams(&self, plan: &FramePlan) -> Vec<(OneLight<'_>, &Buffer, GlossLight<'_>)> {
        let planned = self.planned(plan, |results| results.factors);
        planned
            .filter_map(|(light, cache)| Some((light, &cache.factors, gloss_light(light, cache)?)))
            .collect()
    }

    /// Lights whose highlights the frame computes, each with the buffer for them. Empty if no
    /// material is glossy.
    pub(super) fn planned_highlights(&self, plan: &FramePlan) -> Vec<(OneLight<'_>, &Buffer)> {
        let planned = self.planned(plan, |results| results.highlights);
        planned.filter_map(|(light, cache)| Some((light, cache.highlights.as_ref()?))).collect()
    }

    /// Lights whose gloss bins the frame computes. Empty if no material is glossy.
    pub(super) fn planned_bins(&self, plan: &FramePlan) -> Vec<GlossLight<'_>> {
        let planned = self.planned(plan, |results| results.clusters);
        planned.filter_map(|(light, cache)| gloss_light(light, cache)).collect()
    }

    /// Lights whose hits the frame computes. Empty if no material is glossy.
    pub(super) fn planned_hits(&self, plan: &FramePlan) -> Vec<GlossLight<'_>> {
        let planned = self.planned(plan, |results| results.hits);
        planned.filter_map(|(light, cache)| gloss_light(light, cache)).collect()
    }

    /// Emission and gloss bins of each active light. Empty if no material is glossy.
    pub(super) fn bins(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| cache.bins.as_ref())
    }

    /// Emission and hits of each active light. Empty if no material is glossy.
    pub(super) fn hits(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| cache.hits.as_ref())
    }

    /// Emission and highlights of each active light. Empty if no material is glossy.
    pub(super) fn highlights(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| cache.highlights.as_ref())
    }

    /// Emission and one buffer of each active light that has this buffer.
    fn emitting(&self, buffer: impl Fn(&LightCache) -> Option<&Buffer>) -> Vec<(Vec3, &Buffer)> {
        self.active().filter_map(|(light, cache)| Some((self.emission(light), buffer(cache)?))).collect()
    }

    fn emission(&self, light: OneLight<'_>) -> Vec3 {
        self.sources[light.index as usize].emission
    }

    fn active(&self) -> impl Iterator<Item = (OneLight<'_>, &LightCache)> {
        let lights = self.sources.iter().zip(&self.caches);
        let active = (0..).zip(lights).filter(|(_, (source, _))| self.traces_all || is_active(source));
        active.map(|(index, (source, cache))| {
            let index = index as usize;
            let light = one_light(&self.table, &self.rows, (index, self.channel(index)), source);
            let silhouettes = cache.silhouettes.as_ref();
            (OneLight { traces_all: self.traces_all, silhouettes, ..light }, cache)
        })
    }
}
