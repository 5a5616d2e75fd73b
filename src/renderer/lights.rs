//! The renderer's lights: the device's table, and the cached contributions of each light, free
//! of its colour.

use super::near_lights::NearFactors;
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::frame::antialias::Antialias;
use crate::passes::frame::gloss::GlossLight;
use crate::passes::frame::hvds::{ClusterLight, Pyramid};
use crate::passes::{OneLight, light_sources};
use crate::scene::Light;
use crate::types::LightSource;
use glam::Vec3;
use std::sync::Arc;

/// Cached contributions of one light.
struct LightCache {
    /// Its form factor at each entry point.
    factors: Buffer,
    /// The light's near-light correction. `None` if no surface is near the light.
    near: Option<NearFactors>,
    /// Irradiance by the light at each pixel and each edge sample.
    irradiance: Buffer,
    /// Number of pixels at the edges of the light's shadows.
    shadow_groups: Buffer,
    /// Irradiance buffer of the light at base clusters.
    clusters: Buffer,
    /// Beams at glossy entry points. `None` if no material is glossy.
    beams: Option<Buffer>,
    /// Outgoing flux of entry points after the first bounce. `None` if no material is glossy.
    first_bounce: Option<Buffer>,
    /// Flux that gloss bins (outgoing directions of clusters) emit. `None` if no
    /// material is glossy.
    bins: Option<Buffer>,
    /// Radiance that the rays of glossy pixels see on glossy surfaces. `None` if no
    /// material is glossy.
    hits: Option<Buffer>,
    /// Highlight of the light at each sample of glossy pixels. `None` if no material is glossy.
    highlights: Option<Buffer>,
    /// `factors` and `beams` are current for the light.
    has_factors: bool,
    /// `irradiance` is current for the light and the camera.
    has_irradiance: bool,
    /// `first_bounce`, `clusters` and `bins` are current for the light and the materials.
    has_clusters: bool,
    /// `hits` are current for the light, the camera and the materials.
    has_hits: bool,
    /// `highlights` are current for the light, the camera and the materials.
    has_highlights: bool,
}

/// All lights, in the order of the scene.
pub(super) struct Lights {
    context: Arc<Context>,
    /// A `LightSource` for each light. A light that is off has a black emission. Kernels of frames
    /// work per unit of emission: the colour reaches them in the sums over lights.
    pub(super) table: Buffer,
    sources: Vec<LightSource>,
    /// The factor of all light in a frame. A single active light has unit emission in the
    /// table, and its emission stands here. A new colour of that light then changes only the
    /// picture's last step.
    pub(super) emission_scale: Vec3,
    caches: Vec<LightCache>,
    factor_count: u32,
    point_count: u32,
    cluster_count: u32,
    gloss: Option<GlossCapacity>,
    /// The pixel tiles are current for the camera.
    pub(super) has_batches: bool,
    /// Lights that are off and points that face away from a light are traced, too, without effect.
    pub(super) traces_all: bool,
}

/// Sizes of a light's buffers for glossy materials.
#[derive(Clone, Copy)]
pub(super) struct GlossCapacity {
    /// Bytes of beams for each point sample of the light.
    pub(super) beam_bytes: u64,
    /// Gloss bins that are not sums of other gloss bins.
    pub(super) bin_count: u32,
    /// Samples of glossy pixels.
    pub(super) sample_count: u32,
}

/// Buffers of all lights for a picture of another size.
pub(super) struct NewIrradiances {
    point_count: u32,
    sample_count: Option<u32>,
    /// Irradiance buffer of each light, with its hits and highlights.
    of_lights: Vec<(Buffer, Option<[Buffer; 2]>)>,
}

fn cluster_light(cache: &LightCache) -> ClusterLight<'_> {
    ClusterLight { factors: &cache.factors, first_bounce: cache.first_bounce.as_ref(), flux: &cache.clusters }
}

/// A light as the passes of glossy surfaces read it. `None` if no material is glossy.
fn gloss_light<'a>(light: OneLight<'_>, cache: &'a LightCache) -> Option<GlossLight<'a>> {
    Some(GlossLight {
        samples: light.samples,
        beams: cache.beams.as_ref()?,
        first_bounce: cache.first_bounce.as_ref()?,
        bins: cache.bins.as_ref()?,
        hits: cache.hits.as_ref()?,
    })
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
        lights: &[Light],
        [factor_count, point_count, cluster_count]: [u32; 3],
        gloss: Option<GlossCapacity>,
    ) -> Result<Self> {
        let mut made = Self {
            context: context.clone(),
            table: Buffer::from_slice::<LightSource>(context, "lights", &[])?,
            sources: Vec::new(),
            emission_scale: Vec3::ONE,
            caches: Vec::new(),
            factor_count,
            point_count,
            cluster_count,
            gloss,
            has_batches: false,
            traces_all: false,
        };
        for _ in lights {
            made.add()?;
        }
        made.upload(lights)?;
        Ok(made)
    }

    /// Allocates the buffers of one more light, the last.
    pub(super) fn add(&mut self) -> Result<()> {
        let buffer = |name, count: u32| Buffer::storage(&self.context, name, 4 * u64::from(count));
        let cache = LightCache {
            factors: buffer("form factors", self.factor_count)?,
            near: None,
            irradiance: buffer("light irradiance", self.point_count)?,
            shadow_groups: Antialias::groups(&self.context)?,
            clusters: Pyramid::new_light_flux(&self.context, self.cluster_count)?,
            beams: None,
            first_bounce: self
                .gloss
                .map(|_| buffer("first bounce flux", 3 * self.factor_count))
                .transpose()?,
            bins: self.gloss.map(|gloss| buffer("light gloss bins", 3 * gloss.bin_count)).transpose()?,
            hits: self.gloss.map(|gloss| buffer("light hits", 3 * gloss.sample_count)).transpose()?,
            highlights: self.gloss.map(|gloss| buffer("light highlights", gloss.sample_count)).transpose()?,
            has_factors: false,
            has_irradiance: false,
            has_clusters: false,
            has_hits: false,
            has_highlights: false,
        };
        self.caches.push(cache);
        Ok(())
    }

    /// Removes the buffers of a light.
    pub(super) fn remove(&mut self, light: usize) {
        self.caches.remove(light);
    }

    /// Marks all cached contributions of a light stale.
    pub(super) fn moved(&mut self, light: usize) {
        let cache = &mut self.caches[light];
        (cache.has_factors, cache.has_irradiance, cache.has_clusters) = (false, false, false);
        (cache.has_hits, cache.has_highlights) = (false, false);
    }

    /// Marks results stale that depend on the points that the camera sees.
    pub(super) fn view_changed(&mut self) {
        self.caches.iter_mut().for_each(|cache| cache.has_irradiance = false);
        self.has_batches = false;
        self.lobes_changed();
    }

    /// Marks hits and highlights stale: lobes or the camera have changed.
    pub(super) fn lobes_changed(&mut self) {
        self.caches.iter_mut().for_each(|cache| (cache.has_hits, cache.has_highlights) = (false, false));
    }

    /// Marks results stale that depend on the flux of light paths and on the reflectance
    /// at their vertices.
    pub(super) fn paths_changed(&mut self) {
        self.caches.iter_mut().for_each(|cache| (cache.has_clusters, cache.has_hits) = (false, false));
    }

    /// Allocates buffers for `point_count` points that the camera sees and `sample_count` samples
    /// of glossy pixels. If `sample_count` is `None`, hits and highlights keep their buffers.
    pub(super) fn new_irradiances(
        &self,
        point_count: u32,
        sample_count: Option<u32>,
    ) -> Result<NewIrradiances> {
        let buffer = |name, count: u32| Buffer::storage(&self.context, name, 4 * u64::from(count));
        let of_gloss =
            |count: u32| Ok([buffer("light hits", 3 * count)?, buffer("light highlights", count)?]);
        let of_light =
            |_| Ok((buffer("light irradiance", point_count)?, sample_count.map(of_gloss).transpose()?));
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

    /// Marks clean: the last frame traced all stale results.
    pub(super) fn settle(&mut self) {
        for (cache, source) in self.caches.iter_mut().zip(&self.sources) {
            if self.traces_all || is_active(source) {
                (cache.has_factors, cache.has_irradiance, cache.has_clusters) = (true, true, true);
                (cache.has_hits, cache.has_highlights) = (true, true);
                self.has_batches = true;
            }
        }
    }

    /// Writes the device's table. Returns whether the emissions in the table have changed, and
    /// whether the emission scale has. If it fails, the emissions of the previous call stay in use.
    pub(super) fn upload(&mut self, lights: &[Light]) -> Result<[bool; 2]> {
        let emissions =
            |sources: &[LightSource]| sources.iter().map(|source| source.emission).collect::<Vec<_>>();
        let mut sources = light_sources(lights);
        for (source, light) in sources.iter_mut().zip(lights) {
            source.emission = if light.is_on { source.emission } else { Vec3::ZERO };
        }
        let mut active = sources.iter_mut().filter(|source| source.emission != Vec3::ZERO);
        let emission_scale = match (active.next(), active.next()) {
            (Some(only), None) => std::mem::replace(&mut only.emission, Vec3::ONE),
            _ => Vec3::ONE,
        };
        if let Some(gloss) = self.gloss {
            for (source, cache) in sources.iter().zip(&mut self.caches) {
                let bytes = u64::from(source.samples) * gloss.beam_bytes;
                if cache.beams.as_ref().is_none_or(|beams| beams.bytes() < bytes) {
                    cache.beams = Some(Buffer::storage(&self.context, "gloss beams", bytes)?);
                    (cache.has_factors, cache.has_clusters, cache.has_hits) = (false, false, false);
                }
            }
        }
        if size_of_val(&*sources) as u64 > self.table.bytes() {
            self.table = Buffer::from_slice(&self.context, "lights", &sources)?;
        } else {
            self.table.write(&sources)?;
        }
        let changed =
            [emissions(&self.sources) != emissions(&sources), self.emission_scale != emission_scale];
        (self.sources, self.emission_scale) = (sources, emission_scale);
        Ok(changed)
    }

    /// Number of lights, on or off.
    pub(super) fn count(&self) -> u32 {
        self.caches.len() as u32
    }

    /// Active lights with stale form factors, each with its near-light correction.
    pub(super) fn near_due(&mut self) -> impl Iterator<Item = (&LightSource, &mut Option<NearFactors>)> {
        let all = self.traces_all;
        let due = self.sources.iter().zip(&mut self.caches).filter(|(_, cache)| !cache.has_factors);
        due.filter(move |(source, _)| all || is_active(source))
            .map(|(source, cache)| (source, &mut cache.near))
    }

    /// Active lights with stale form factors, each with the buffer for them.
    pub(super) fn stale_factors(&self) -> Vec<(OneLight<'_>, &Buffer)> {
        self.active()
            .filter(|(_, cache)| !cache.has_factors)
            .map(|(light, cache)| (light, &cache.factors))
            .collect()
    }

    /// The near-light correction of a light. `None` if no surface is near the light.
    pub(super) fn near(&self, light: u32) -> Option<&NearFactors> {
        self.caches[light as usize].near.as_ref()
    }

    /// Active lights with a stale irradiance buffer, each with that buffer.
    pub(super) fn stale_irradiance(&self) -> Vec<(OneLight<'_>, &Buffer)> {
        self.active()
            .filter(|(_, cache)| !cache.has_irradiance)
            .map(|(light, cache)| (light, &cache.irradiance))
            .collect()
    }

    /// The counter of pixels at the edges of a light's shadows.
    pub(super) fn shadow_groups(&self, light: OneLight<'_>) -> &Buffer {
        &self.caches[light.index as usize].shadow_groups
    }

    /// Number of pixels at shadow edges, summed over active lights.
    pub(super) fn shadow_edge_count(&self) -> Result<u64> {
        let counts = self.active().map(|(_, cache)| Antialias::counted(&cache.shadow_groups).map(u64::from));
        counts.sum()
    }

    /// Emission and form factors of each active light.
    pub(super) fn factors(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| Some(&cache.factors))
    }

    /// Active lights, as the passes of the hierarchy read them.
    pub(super) fn cluster_lights(&self) -> Vec<ClusterLight<'_>> {
        self.active().map(|(_, cache)| cluster_light(cache)).collect()
    }

    /// Active lights with a stale irradiance buffer of base clusters.
    pub(super) fn stale_clusters(&self) -> Vec<ClusterLight<'_>> {
        let due = self.active().filter(|(_, cache)| !cache.has_clusters);
        due.map(|(_, cache)| cluster_light(cache)).collect()
    }

    /// Emission and irradiance buffer of base clusters of each active light.
    pub(super) fn clusters(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| Some(&cache.clusters))
    }

    /// Emission and irradiance buffer of pixels of each active light.
    pub(super) fn irradiances(&self) -> Vec<(Vec3, &Buffer)> {
        self.emitting(|cache| Some(&cache.irradiance))
    }

    /// Fraction of active lights with current form factors, and fraction with a current irradiance
    /// buffer of pixels. Both are 1 if no light is active.
    pub(super) fn unchanged(&self) -> [f64; 2] {
        let active = self.active().count().max(1) as f64;
        [self.stale_factors().len(), self.stale_irradiance().len()].map(|due| 1.0 - due as f64 / active)
    }

    /// Device form of the active lights.
    pub(super) fn active_sources(&self) -> impl Iterator<Item = &LightSource> {
        self.sources.iter().filter(|source| is_active(source))
    }

    /// Active lights with current form factors and a current irradiance buffer of pixels: both
    /// buffers, and the index of the light.
    pub(super) fn traced(&self) -> impl Iterator<Item = (&LightSource, [&Buffer; 2], u32)> {
        let traced = self.active().filter(|(_, cache)| cache.has_factors && cache.has_irradiance);
        traced.map(|(light, cache)| {
            (&self.sources[light.index as usize], [&cache.factors, &cache.irradiance], light.index)
        })
    }

    /// Active lights with stale beams: form factors, and the buffers of glossy surfaces. Empty if
    /// no material is glossy.
    pub(super) fn stale_beams(&self) -> Vec<(OneLight<'_>, &Buffer, GlossLight<'_>)> {
        let due = self.active().filter(|(_, cache)| !cache.has_factors);
        due.filter_map(|(light, cache)| Some((light, &cache.factors, gloss_light(light, cache)?))).collect()
    }

    /// Active lights whose cached highlights are stale, each with its highlight buffer. Empty if no
    /// material is glossy.
    pub(super) fn stale_highlights(&self) -> Vec<(OneLight<'_>, &Buffer)> {
        let due = self.active().filter(|(_, cache)| !cache.has_highlights);
        due.filter_map(|(light, cache)| Some((light, cache.highlights.as_ref()?))).collect()
    }

    /// Active lights with stale gloss bins. Empty if no material is glossy.
    pub(super) fn stale_bins(&self) -> Vec<GlossLight<'_>> {
        let due = self.active().filter(|(_, cache)| !cache.has_clusters);
        due.filter_map(|(light, cache)| gloss_light(light, cache)).collect()
    }

    /// Active lights with stale hits. Empty if no material is glossy.
    pub(super) fn stale_hits(&self) -> Vec<GlossLight<'_>> {
        let due = self.active().filter(|(_, cache)| !cache.has_hits);
        due.filter_map(|(light, cache)| gloss_light(light, cache)).collect()
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
            let light = OneLight::new(&self.table, index, source);
            (OneLight { traces_all: self.traces_all, ..light }, cache)
        })
    }
}
