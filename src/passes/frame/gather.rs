//! Final gathering at the cache points. [Yue §3, Tfg; Krivanek] In: merged rays, cluster
//! irradiance (W/m²), reflectances. Out: records: irradiance (W/m²) and its gradients.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT};
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::passes::frame::bright::Bright;
use crate::passes::frame::gloss::Gloss;
use crate::passes::frame::hvds::Pyramid;
use crate::passes::frame::needed_records::RecordList;
use crate::passes::gather_targets::{GatherTarget, GatherTargetPacking};
use crate::passes::has_textures;
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::precompute::merged_rays::MergedRays;
use crate::types::Record;
use bytemuck::Zeroable;
use std::sync::Arc;

gpu_struct! {
    /// Push constants of the first step.
    pub struct GatherRadiancePush {
        pub target_count: u32,
        /// Width of the number in `GatherRay::target`.
        pub cluster_bits: u32,
        /// Clusters and near-field patches; targets beyond are gloss bins.
        pub cluster_count: u32,
        /// Number of records, listed or not; 0: bright clusters are not sampled apart.
        pub record_count: u32,
        /// Number of the target of the sky's first cell.
        pub first_sky: u32,
        /// 0: the sky is black.
        pub has_sky: u32,
    }
}

gpu_struct! {
    /// Push constants of the second step.
    pub struct GatherPush {
        /// First cache point of the bound buffer of the merged rays.
        pub first_point: u32,
        pub end_point: u32,
        /// Width of the gather target field in a `MergedRay`.
        pub target_bits: u32,
        /// Unit of gradients under movement, metres.
        pub min_distance: f32,
        /// Unit of the packed rotational gradient of a merged ray.
        pub rotation_unit: f32,
        /// π over the rays of a hemisphere.
        pub stratum: f32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[GatherRadiancePush::LAYOUT, GatherPush::LAYOUT];

/// Inputs of the radiance at the ends of gather rays.
#[derive(Clone, Copy)]
pub struct GatherSources<'a> {
    /// `Reflectance` of each material.
    pub materials: &'a Buffer,
    /// Irradiance of each cluster, then of each near-field patch, W/m².
    pub irradiance: &'a Buffer,
    /// 1/area of each cluster, 1/m².
    pub inverse_areas: &'a Buffer,
    /// Outgoing flux of glossy clusters by direction. `None` if rays read no gloss bins.
    pub gloss: Option<&'a Gloss>,
    /// Radiance of the sky's cells, W/m²/sr; three floats. `None` if the sky is black.
    pub sky: Option<&'a Buffer>,
    /// `None`: gather rays bring the light of bright clusters, too.
    pub bright: Option<BrightSources<'a>>,
}

/// Inputs of the rays to bright clusters.
#[derive(Clone, Copy)]
pub struct BrightSources<'a> {
    /// What is bright.
    pub bright: &'a Bright,
    /// The scene that the rays pass.
    pub scene: &'a SceneBuffers,
    /// Flux of each cluster.
    pub pyramid: &'a Pyramid,
}

/// The pipelines, the cache points with their rays, and the result.
pub struct Gather {
    radiance: Pipeline,
    pipeline: Pipeline,
    /// Label of its passes in timings.
    label: &'static str,
    point_count: u32,
    /// How the rays were packed.
    pub packing: GatherTargetPacking,
    /// How a hemisphere is stratified.
    pub hemisphere: Hemisphere,
    /// A `CachePoint` for each record.
    pub cache_points: Buffer,
    /// The rays of each cache point.
    pub merged_rays: MergedRays,
    /// Radiance of each gather target as gather rays bring it, W/m²/sr, in scenes with images the
    /// diffuse part without their colour; three floats of a texel.
    radiances: Buffer,
    /// The same with the light of bright clusters, in glossy scenes.
    whole_radiances: Option<Buffer>,
    /// Radiance by its lobe. Only glossy scenes with images have it.
    lobe_radiances: Buffer,
    /// `Record` of each cache point.
    pub records: Buffer,
}

impl Gather {
    /// Stem of shaders, reference and timing.
    pub const STEM: &str = "gather";

    /// Takes over the merged rays; `is_glossy` if some read gloss bins.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        cache_points: Buffer,
        point_count: u32,
        merged_rays: MergedRays,
        hemisphere: Hemisphere,
        packing: GatherTargetPacking,
        is_glossy: bool,
    ) -> Result<Self> {
        let constants = [("IS_GLOSSY", u32::from(is_glossy)), has_textures(merged_rays.has_colours)];
        let allocate = |count: u32, bytes: u64| {
            Buffer::storage(
                context,
                GrowsWith::GatherRays.named("reflected radiance"),
                bytes * u64::from(count.max(1)),
            )
        };
        Ok(Self {
            radiance: Pipeline::new(context, "gather_radiance", &constants)?,
            pipeline: Pipeline::new(context, Self::STEM, &constants)?,
            label: Self::STEM,
            point_count,
            packing,
            hemisphere,
            cache_points,
            radiances: allocate(merged_rays.target_count, 16)?,
            whole_radiances: is_glossy.then(|| allocate(merged_rays.target_count, 16)).transpose()?,
            lobe_radiances: allocate(
                if is_glossy && merged_rays.has_colours { merged_rays.target_count } else { 1 },
                12,
            )?,
            merged_rays,
            // Records that no view has needed yet are never written.
            records: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("records"),
                &vec![Record::zeroed(); point_count as usize],
            )?,
        })
    }

    /// The same gather, with another label of its passes in timings.
    #[must_use]
    pub fn labelled(self, label: &'static str) -> Self {
        Self { label, ..self }
    }

    /// Number of cache points.
    pub fn point_count(&self) -> u32 {
        self.point_count
    }

    /// Radiance of each gather target at the last gather, W/m²/sr: in scenes with images diffuse
    /// radiance without their colour, else all of it, three floats of a texel; and in glossy scenes
    /// with images radiance by its lobe, three floats (else one element).
    pub fn radiances(&self) -> [&Buffer; 2] {
        [self.whole_radiances.as_ref().unwrap_or(&self.radiances), &self.lobe_radiances]
    }

    /// Computes the radiance of all gather targets, as [`Self::record`] begins. `list`: the records
    /// whose rays to bright clusters follow.
    pub fn record_radiances(&self, pass: &mut PassScope<'_>, sources: GatherSources<'_>, list: &RecordList) {
        let GatherSources { materials, irradiance, inverse_areas, gloss, sky, bright } = sources;
        // Unused bindings if no ray reads a gloss bin.
        let (bins, fluxes) = gloss.map_or((irradiance, irradiance), |gloss| (&gloss.bins, &gloss.fluxes));
        // Unused bindings if bright clusters are not sampled apart.
        let (record_count, [cluster_flux, ranges, ranks, bright_clusters, state, ray_groups]) = match bright {
            Some(BrightSources { bright, pyramid, .. }) => {
                let Bright { watched_ranges, ranks, clusters, state, ray_groups, .. } = bright;
                (list.record_count(), [&pyramid.flux, watched_ranges, ranks, clusters, state, ray_groups])
            }
            None => (0, [irradiance, irradiance, irradiance, irradiance, irradiance, &self.lobe_radiances]),
        };
        let target_count = self.merged_rays.target_count;
        pass.dispatch(
            &self.radiance,
            [target_count, 1, 1],
            &GatherRadiancePush {
                target_count,
                cluster_bits: self.packing.cluster_bits,
                cluster_count: (irradiance.bytes() / 12) as u32,
                record_count,
                first_sky: self.packing.number(GatherTarget::Sky(0)),
                has_sky: u32::from(sky.is_some()),
            },
            &[
                ("Targets", &self.merged_rays.targets),
                ("Materials", materials),
                ("Irradiance", irradiance),
                ("InverseAreas", inverse_areas),
                ("GlossBins", bins),
                ("GlossFluxes", fluxes),
                ("Radiances", self.radiances()[0]),
                ("LobeRadiances", &self.lobe_radiances),
                ("SkyRadiance", sky.unwrap_or(irradiance)),
                ("ClusterFluxes", cluster_flux),
                ("WatchedRanges", ranges),
                ("BrightRanks", ranks),
                ("BrightClusters", bright_clusters),
                ("BrightStates", state),
                ("RecordOffsets", &list.offsets),
                ("BrightGroups", ray_groups),
                ("GatheredRadiances", &self.radiances),
            ],
        );
    }

    /// Gathers at the cache points of a list.
    pub fn record(&self, rec: &mut Recorder, sources: GatherSources<'_>, list: &RecordList) {
        let mut pass = rec.pass(self.label);
        self.record_radiances(&mut pass, sources, list);
        for (chunk, merged_rays) in (0..).zip(&self.merged_rays.chunks) {
            // After the first step. The dispatches write disjoint records, but the hazard check
            // works by buffer.
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch_indirect(
                &self.pipeline,
                (&list.groups, 12 * chunk),
                &GatherPush {
                    first_point: merged_rays.points.start,
                    end_point: merged_rays.points.end,
                    target_bits: self.merged_rays.target_bits,
                    min_distance: self.packing.min_distance,
                    rotation_unit: self.merged_rays.rotation_unit,
                    stratum: std::f32::consts::PI / self.hemisphere.rays() as f32,
                },
                &[
                    ("CachePoints", &self.cache_points),
                    ("MergedRayOffsets", &merged_rays.merged_ray_offsets),
                    ("MergedRays", &merged_rays.merged_rays),
                    ("MergedRayColours", &merged_rays.colours),
                    ("Radiances", &self.radiances),
                    ("LobeRadiances", &self.lobe_radiances),
                    ("Records", &self.records),
                    ("RecordOffsets", &list.offsets),
                    ("ListedRecords", &list.records),
                ],
            );
        }
        if let Some(BrightSources { bright, scene, pyramid }) = sources.bright {
            // They add to the records.
            pass.barrier(COMPUTE_TO_INDIRECT);
            let points = (&self.cache_points, &self.records);
            bright.record_rays(&mut pass, (scene, pyramid), points, list);
        }
    }
}
