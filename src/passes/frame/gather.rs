//! Final gathering at the cache points. [Yue §3, Tfg; Krivanek]
//! In: gather rays, cluster irradiance (W/m²), reflectances. Out: records: irradiance and its gradients.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::gloss::Gloss;
use crate::passes::frame::needed_records::RecordList;
use crate::passes::has_textures;
use crate::passes::precompute::gather_rays::{GatherCode, Hemisphere, RayTable};
use crate::types::Record;
use bytemuck::Zeroable;
use glam::{DVec2, Vec2};
use std::sync::Arc;

gpu_struct! {
    /// Push constants.
    pub struct GatherPush {
        /// First cache point of the bound part of the table of rays.
        pub first_point: u32,
        /// Its end.
        pub end_point: u32,
        /// Width of the cluster field in `GatherRay::target`.
        pub cluster_bits: u32,
        /// Unit of `GatherRay::gradient`, metres.
        pub least_distance: f32,
        /// Clusters and views of clusters; targets beyond are slots.
        pub cluster_count: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[GatherPush::LAYOUT];

/// Where the radiance at the ends of gather rays comes from.
#[derive(Clone, Copy)]
pub struct GatherSources<'a> {
    /// `Reflectance` of each material.
    pub materials: &'a Buffer,
    /// Irradiance of each cluster, and behind them of each view of one, W/m².
    pub irradiance: &'a Buffer,
    /// 1/area of each cluster, 1/m².
    pub inverse_areas: &'a Buffer,
    /// What clusters that shine send towards directions; none where rays read no slots.
    pub gloss: Option<&'a Gloss>,
}

/// The pipeline, the cache points with their rays, and the result.
pub struct Gather {
    pipeline: Pipeline,
    point_count: u32,
    /// How the rays are packed.
    pub code: GatherCode,
    /// How a hemisphere is stratified.
    pub hemisphere: Hemisphere,
    turns: Buffer,
    /// `CachePoint`s.
    pub cache_points: Buffer,
    /// A row of rays for each cache point.
    pub rays: RayTable,
    /// `Record` of each cache point.
    pub records: Buffer,
}

impl Gather {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "gather";

    /// Takes over what the precomputation found; `shines` where some rays read slots.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        cache_points: Buffer,
        point_count: u32,
        rays: RayTable,
        hemisphere: Hemisphere,
        code: GatherCode,
        shines: bool,
    ) -> Result<Self> {
        let [rings, sectors] = hemisphere.constants();
        let shines = ("SHINES", u32::from(shines));
        let constants = [rings, sectors, shines, has_textures(rays.has_colours), context.waiting_group()];
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &constants)?,
            point_count,
            code,
            hemisphere,
            turns: Buffer::from_slice(context, "turns", &turns(hemisphere))?,
            cache_points,
            rays,
            // Records that no view has needed yet are never written.
            records: Buffer::from_slice(context, "records", &vec![Record::zeroed(); point_count as usize])?,
        })
    }

    /// Cache points.
    pub fn point_count(&self) -> u32 {
        self.point_count
    }

    /// Gathers at the cache points of a list.
    pub fn record(&self, rec: &mut Recorder, sources: GatherSources<'_>, list: &RecordList) {
        let GatherSources { materials, irradiance, inverse_areas, gloss } = sources;
        let cluster_count = (irradiance.bytes() / 12) as u32;
        // Where no ray reads a slot nobody looks at what is bound for it.
        let (slots, fluxes) = gloss.map_or((irradiance, irradiance), |gloss| (&gloss.slots, &gloss.fluxes));
        let mut pass = rec.pass(Self::STEM);
        for (part, (first_point, rows, [rays, colours])) in (0..).zip(self.rays.parts(self.point_count)) {
            let push = GatherPush {
                first_point,
                end_point: first_point + rows,
                cluster_bits: self.code.cluster_bits,
                least_distance: self.code.least_distance,
                cluster_count,
            };
            if first_point > 0 {
                // The parts write different records, but the hazard check counts in buffers.
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch_indirect(
                &self.pipeline,
                (&list.groups, 12 * part),
                &push,
                &[
                    ("CachePoints", &self.cache_points),
                    ("Turns", &self.turns),
                    ("GatherRays", rays),
                    ("Materials", materials),
                    ("Irradiance", irradiance),
                    ("InverseAreas", inverse_areas),
                    ("GlossSlots", slots),
                    ("GlossFluxes", fluxes),
                    ("Records", &self.records),
                    ("RayColours", colours),
                    ("RecordOffsets", &list.offsets),
                    ("ListedRecords", &list.records),
                ],
            );
        }
    }
}

/// What the radiance of each stratum adds to the rotational gradient, along tangent and bitangent: turning the normal by dω
/// changes a ray's cosine by dω·(n×ω), which is tanθ across its azimuth, at the stratum's middle. [Krivanek]
fn turns(hemisphere: Hemisphere) -> Vec<Vec2> {
    let turn = |ray: u32| {
        let (ring, sector) = (ray / hemisphere.sectors, ray % hemisphere.sectors);
        let sin2 = (f64::from(ring) + 0.5) / f64::from(hemisphere.rings);
        let azimuth = std::f64::consts::TAU * (f64::from(sector) + 0.5) / f64::from(hemisphere.sectors);
        ((sin2 / (1.0 - sin2)).sqrt() * DVec2::new(-azimuth.sin(), azimuth.cos())).as_vec2()
    };
    (0..hemisphere.rays()).map(turn).collect()
}
