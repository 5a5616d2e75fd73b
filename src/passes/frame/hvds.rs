//! The volumetric hierarchy of a frame: base level and pyramid. [Yue §2, Thvds]
//! In: path flux (W), deposits. Out: irradiance (W/m²) of every cluster.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// Push constants of the base level.
    pub struct HvdsBasePush {
        /// First cluster of the level.
        pub first_cluster: u32,
        /// Its clusters.
        pub cluster_count: u32,
    }
}

gpu_struct! {
    /// Push constants of a coarser level.
    pub struct HvdsLevelPush {
        /// First cluster of the level.
        pub first_cluster: u32,
        /// Its clusters.
        pub cluster_count: u32,
    }
}

/// What this pass shares with its shaders.
pub const LAYOUTS: &[Layout] = &[HvdsBasePush::LAYOUT, HvdsLevelPush::LAYOUT];

/// The pipelines, the nesting of the clusters and their energy.
pub struct Pyramid {
    base: Pipeline,
    level: Pipeline,
    levels: Vec<Range<u32>>,
    first_deposits: Buffer,
    first_children: Buffer,
    inverse_areas: Buffer,
    /// Flux of each cluster, W; three floats.
    pub flux: Buffer,
    /// Irradiance of each cluster, W/m²; three floats.
    pub irradiance: Buffer,
}

impl Pyramid {
    /// The name that shaders, twin and timing share.
    pub const STEM: &str = "hvds";

    /// Uploads the nesting. No cluster is divided by an area below `least_area_m2`, the area of one entry point: what
    /// is smaller cannot be resolved, and only roots so small are ever read.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        hvds: &crate::scene::hvds::Hvds,
        first_deposits: &[u32],
        least_area_m2: f32,
    ) -> Result<Self> {
        let inverse_areas: Vec<f32> =
            hvds.areas_m2.iter().map(|area| 1.0 / area.max(least_area_m2)).collect();
        let bytes = u64::from(hvds.cluster_count()) * 12;
        Ok(Self {
            base: Pipeline::new(context, "hvds_base", &[])?,
            level: Pipeline::new(context, "hvds_level", &[])?,
            levels: hvds.levels.clone(),
            first_deposits: Buffer::from_slice(context, "first deposits", first_deposits)?,
            first_children: Buffer::from_slice(context, "first children", &hvds.first_children)?,
            inverse_areas: Buffer::from_slice(context, "inverse areas", &inverse_areas)?,
            flux: Buffer::storage(context, "cluster flux", bytes)?,
            irradiance: Buffer::storage(context, "cluster irradiance", bytes)?,
        })
    }

    /// Sums the base level, then each coarser one from the level below it.
    pub fn record(&self, rec: &mut Recorder, path_flux: &Buffer, deposits: &Buffer) {
        let mut pass = rec.pass(Self::STEM);
        let base = &self.levels[0];
        pass.dispatch(
            &self.base,
            [base.len() as u32, 1, 1],
            &HvdsBasePush { first_cluster: base.start, cluster_count: base.len() as u32 },
            &[
                ("PathFlux", path_flux),
                ("FirstDeposits", &self.first_deposits),
                ("Deposits", deposits),
                ("InverseAreas", &self.inverse_areas),
                ("ClusterFlux", &self.flux),
                ("Irradiance", &self.irradiance),
            ],
        );
        for level in &self.levels[1..] {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.level,
                [level.len() as u32, 1, 1],
                &HvdsLevelPush { first_cluster: level.start, cluster_count: level.len() as u32 },
                &[
                    ("FirstChildren", &self.first_children),
                    ("InverseAreas", &self.inverse_areas),
                    ("ClusterFlux", &self.flux),
                    ("Irradiance", &self.irradiance),
                ],
            );
        }
    }
}
