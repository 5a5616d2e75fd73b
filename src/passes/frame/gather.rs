//! Final gathering at the cache points. [Yue §3, Tfg; Krivanek] In: merged rays of gather rays,
//! cluster irradiance (W/m²), reflectances. Out: records: irradiance and its gradients.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::gloss::Gloss;
use crate::passes::frame::needed_records::RecordList;
use crate::passes::has_textures;
use crate::passes::precompute::gather_rays::{GatherTargetPacking, Hemisphere, RayTable};
use crate::passes::precompute::merged_rays::MergedRays;
use crate::types::Record;
use bytemuck::Zeroable;
use std::sync::Arc;

gpu_struct! {
    /// Push constants of the first step.
    pub struct GatherRadiancePush {
        pub target_count: u32,
        /// Width of the cluster field in `GatherRay::target`.
        pub cluster_bits: u32,
        /// Clusters, and proxies and parts of clusters; targets beyond are slots.
        pub cluster_count: u32,
    }
}

gpu_struct! {
    /// Push constants of the second step.
    pub struct GatherPush {
        /// First cache point of the bound part of the merged rays.
        pub first_point: u32,
        pub end_point: u32,
        /// Width of the gather target field in `MergedRay::gather target`.
        pub target_bits: u32,
        /// Unit of gradients under movement, metres.
        pub min_distance: f32,
        /// Unit of a merged ray's share in the gradient under rotation.
        pub rotation_unit: f32,
        /// π over the rays of a hemisphere.
        pub stratum: f32,
    }
}

/// What this pass shares with its shaders.
pub const LAYOUTS: &[Layout] = &[GatherRadiancePush::LAYOUT, GatherPush::LAYOUT];

/// Where the radiance at the ends of gather rays comes from.
#[derive(Clone, Copy)]
pub struct GatherSources<'a> {
    /// `Reflectance` of each material.
    pub materials: &'a Buffer,
    /// Irradiance of each cluster, and behind them of each view of one, W/m².
    pub irradiance: &'a Buffer,
    /// 1/area of each cluster, 1/m².
    pub inverse_areas: &'a Buffer,
    /// What glossy clusters send towards directions; none where rays read no slots.
    pub gloss: Option<&'a Gloss>,
}

/// The pipelines, the cache points with their rays, and the result.
pub struct Gather {
    radiance: Pipeline,
    pipeline: Pipeline,
    point_count: u32,
    /// How the rays were packed.
    pub packing: GatherTargetPacking,
    /// How a hemisphere is stratified.
    pub hemisphere: Hemisphere,
    /// A `CachePoint` for each record.
    pub cache_points: Buffer,
    /// The rays of each cache point.
    pub merged_rays: MergedRays,
    /// Radiance of each gather target without its lobe, W/m²/sr; three floats.
    radiances: Buffer,
    /// By its lobe; if nothing is glossy, no pass reads it.
    lobe_radiances: Buffer,
    /// `Record` of each cache point.
    pub records: Buffer,
}

impl Gather {
    /// Stem of shaders, reference and timing.
    pub const STEM: &str = "gather";

    /// Takes over what the precomputation found; `is_glossy` where some rays read slots.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        cache_points: Buffer,
        point_count: u32,
        rays: RayTable,
        hemisphere: Hemisphere,
        packing: GatherTargetPacking,
        is_glossy: bool,
    ) -> Result<Self> {
        let merged_rays = MergedRays::new(context, rays, hemisphere)?;
        Self::of_merged_rays(context, cache_points, point_count, merged_rays, hemisphere, packing, is_glossy)
    }

    /// The same, of rays that are merged.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn of_merged_rays(
        context: &Arc<Context>,
        cache_points: Buffer,
        point_count: u32,
        merged_rays: MergedRays,
        hemisphere: Hemisphere,
        packing: GatherTargetPacking,
        is_glossy: bool,
    ) -> Result<Self> {
        let glossy_constant = ("IS_GLOSSY", u32::from(is_glossy));
        let constants = [glossy_constant, has_textures(merged_rays.has_colours)];
        let room = |count: u32, bytes: u64| {
            Buffer::storage(context, "reflected radiance", bytes * u64::from(count.max(1)))
        };
        Ok(Self {
            radiance: Pipeline::new(context, "gather_radiance", &[glossy_constant])?,
            pipeline: Pipeline::new(context, Self::STEM, &constants)?,
            point_count,
            packing,
            hemisphere,
            cache_points,
            radiances: room(merged_rays.target_count, 16)?,
            lobe_radiances: room(if is_glossy { merged_rays.target_count } else { 1 }, 12)?,
            merged_rays,
            // Records that no view has needed yet are never written.
            records: Buffer::from_slice(context, "records", &vec![Record::zeroed(); point_count as usize])?,
        })
    }

    /// Number of cache points.
    pub fn point_count(&self) -> u32 {
        self.point_count
    }

    /// What each gather target sent back when something was last gathered, W/m²/sr: evenly, without
    /// the image's colour, three floats of a texel; and by its lobe, three floats, of one at most
    /// if nothing is glossy.
    pub fn radiances(&self) -> [&Buffer; 2] {
        [&self.radiances, &self.lobe_radiances]
    }

    /// Gathers at the cache points of a list.
    pub fn record(&self, rec: &mut Recorder, sources: GatherSources<'_>, list: &RecordList) {
        let GatherSources { materials, irradiance, inverse_areas, gloss } = sources;
        // Where no ray reads a slot nobody looks at what is bound for it.
        let (slots, fluxes) = gloss.map_or((irradiance, irradiance), |gloss| (&gloss.slots, &gloss.fluxes));
        let target_count = self.merged_rays.target_count;
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(
            &self.radiance,
            [target_count, 1, 1],
            &GatherRadiancePush {
                target_count,
                cluster_bits: self.packing.cluster_bits,
                cluster_count: (irradiance.bytes() / 12) as u32,
            },
            &[
                ("Targets", &self.merged_rays.targets),
                ("Materials", materials),
                ("Irradiance", irradiance),
                ("InverseAreas", inverse_areas),
                ("GlossSlots", slots),
                ("GlossFluxes", fluxes),
                ("Radiances", &self.radiances),
                ("LobeRadiances", &self.lobe_radiances),
            ],
        );
        for (part, merged_rays) in (0..).zip(&self.merged_rays.parts) {
            // Behind the first step; and the parts write different records, but the hazard check
            // counts in buffers.
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch_indirect(
                &self.pipeline,
                (&list.groups, 12 * part),
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
    }
}
