//! Cached contributions of one light, free of its colour.

use crate::error::Result;
use crate::gpu::{Buffer, BufferName, Context, HostBlock};
use crate::passes::frame::antialias::Antialias;
use crate::passes::frame::gloss::GlossLight;
use crate::passes::frame::hvds::ClusterLight;
use crate::passes::frame::near_lights::NearInputs;
use crate::passes::{GrowsWith, OneLight};
use std::sync::Arc;

/// Cached contributions of one light.
pub(super) struct LightCache {
    /// Its form factor at each entry point.
    pub(super) factors: Buffer,
    /// Inputs of the near-light correction. `None` if no surface is near the light.
    pub(super) near: Option<NearInputs>,
    /// `NearState` of the light.
    pub(super) near_state: Buffer,
    /// What the host wants of the last frame that traced the light: see `lights.rs`.
    pub(super) counters: HostBlock,
    /// Irradiance by the light at each pixel and each fragment.
    pub(super) irradiance: Buffer,
    /// Numbers of pixels at the edges of the light's shadows and of mixed fragments.
    pub(super) shadow_groups: Buffer,
    /// Maps of silhouettes around the light. `None` if frames use none.
    pub(super) silhouettes: Option<Buffer>,
    /// Irradiance buffer of the light at base clusters.
    pub(super) clusters: Buffer,
    /// Beams at glossy entry points. `None` if no material is glossy.
    pub(super) beams: Option<Buffer>,
    /// Outgoing flux of entry points after the first bounce. `None` if no material is glossy.
    pub(super) first_bounce: Option<Buffer>,
    /// Flux that gloss bins (outgoing directions of clusters) emit. `None` if no
    /// material is glossy.
    pub(super) bins: Option<Buffer>,
    /// Radiance that the rays of glossy pixels see on glossy surfaces. `None` if no
    /// material is glossy.
    pub(super) hits: Option<Buffer>,
    /// Highlight of the light at each sample of glossy pixels. `None` if no material is glossy.
    pub(super) highlights: Option<Buffer>,
}

/// Sizes of a light's buffers for glossy materials.
#[derive(Clone, Copy)]
pub(super) struct GlossCapacity {
    /// Bytes of a beam of the light at all entry points.
    pub(super) beam_bytes: u64,
    /// Gloss bins that are not sums of other gloss bins.
    pub(super) bin_count: u32,
    /// Samples of glossy pixels.
    pub(super) sample_count: u32,
}

impl LightCache {
    /// Allocates the buffers of a light: `factor_count` form factors, `point_count` points that the
    /// camera sees, `cluster_count` base clusters.
    ///
    /// # Errors
    /// The device lacks memory.
    pub(super) fn new(
        context: &Arc<Context>,
        [factor_count, point_count, cluster_count]: [u32; 3],
        gloss: Option<GlossCapacity>,
    ) -> Result<Self> {
        let buffer =
            |name: BufferName<'static>, count: u32| Buffer::storage(context, name, 4 * u64::from(count));
        Ok(Self {
            factors: buffer(GrowsWith::EntryPoints.named("form factors"), factor_count)?,
            near: None,
            near_state: buffer("near state".into(), 2)?,
            counters: HostBlock::new(context, "light counters", 4)?,
            irradiance: buffer(GrowsWith::Pixels.named("light irradiance"), point_count)?,
            shadow_groups: Antialias::groups(context)?,
            silhouettes: None,
            // Four words each: `LightFlux`. The first frame of the light clears it.
            clusters: buffer(GrowsWith::Cells.named("light flux"), 4 * cluster_count)?,
            beams: None,
            first_bounce: gloss
                .map(|_| buffer(GrowsWith::EntryPoints.named("first bounce flux"), 3 * factor_count))
                .transpose()?,
            bins: gloss
                .map(|gloss| buffer(GrowsWith::Cells.named("light gloss bins"), 3 * gloss.bin_count))
                .transpose()?,
            hits: gloss
                .map(|gloss| buffer(GrowsWith::Pixels.named("light hits"), 3 * gloss.sample_count))
                .transpose()?,
            highlights: gloss
                .map(|gloss| buffer(GrowsWith::Pixels.named("light highlights"), gloss.sample_count))
                .transpose()?,
        })
    }
}

pub(super) fn cluster_light(cache: &LightCache) -> ClusterLight<'_> {
    ClusterLight { factors: &cache.factors, first_bounce: cache.first_bounce.as_ref(), flux: &cache.clusters }
}

/// A light as the passes of glossy surfaces read it. `None` if no material is glossy.
pub(super) fn gloss_light<'a>(light: OneLight<'_>, cache: &'a LightCache) -> Option<GlossLight<'a>> {
    Some(GlossLight {
        beam_count: light.beam_count(),
        beams: cache.beams.as_ref()?,
        first_bounce: cache.first_bounce.as_ref()?,
        bins: cache.bins.as_ref()?,
        hits: cache.hits.as_ref()?,
    })
}
