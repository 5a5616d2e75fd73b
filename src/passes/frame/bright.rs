//! Bright clusters reflect so much more light than the mean that few gather rays meet them, such as
//! the surface beside a lamp. Records sample them by shadow rays of their own. [Veach §9;
//! numerics: bright clusters] In: flux of clusters (W). Out: added to records.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::passes::bright_tables::{BrightTables, Watched};
use crate::passes::frame::hvds::Pyramid;
use crate::passes::frame::needed_records::RecordList;
use crate::passes::precompute::gather_rays::Hemisphere;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    pub struct BrightSumsPush {
        pub watched_count: u32,
        /// Invocations of all workgroups.
        pub stride: u32,
    }
}

gpu_struct! {
    pub struct BrightSelectPush {
        pub watched_count: u32,
        /// Workgroups of the first step.
        pub sum_count: u32,
        /// Least mean radiant exitance of light, over that of area.
        pub contrast: f32,
        /// Least radiant exitance of a bright cluster, over the mean.
        pub bright: f32,
    }
}

gpu_struct! {
    /// Sums over some watched clusters.
    pub struct BrightSum {
        /// Direct light that they reflect, W.
        pub light: f32,
        /// Their area, m².
        pub area: f32,
        /// Sum of light² / area.
        pub square: f32,
    }
}

gpu_struct! {
    /// A bright cluster. Rays select it in proportion to its weight.
    pub struct BrightCluster {
        pub cluster: u32,
        /// Sum of the weights up to its own.
        pub end: u32,
    }
}

gpu_struct! {
    /// What the select step has found.
    pub struct BrightState {
        /// Bright clusters; 0: gather rays bring all light.
        pub count: u32,
        /// Sum of their weights.
        pub weight: u32,
    }
}

gpu_struct! {
    pub struct BrightRaysPush {
        /// Number of records, listed or not.
        pub record_count: u32,
        /// Clusters of the base.
        pub base_count: u32,
        /// Rays of a record.
        pub rays: u32,
        /// Seed of all decisions.
        pub seed: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    BrightSumsPush::LAYOUT,
    BrightSelectPush::LAYOUT,
    BrightSum::LAYOUT,
    BrightCluster::LAYOUT,
    BrightState::LAYOUT,
    BrightRaysPush::LAYOUT,
];

/// Invocations that cast the rays of one record, as many each; mirrors `glsl/include/bright.glsl`.
const LANES: u32 = 4;

/// Gather rays for each ray to bright clusters.
const GATHER_RAYS: u32 = 32;

/// Least radiant exitance of a bright cluster, over the mean: at most a sixteenth of the area.
pub const BRIGHT: f32 = 16.0;

/// Mean radiant exitance of light, over that of area, from which on clusters may be bright. Below,
/// gather rays sample all light well enough.
pub const CONTRAST: f32 = 12.0;

/// Workgroups of the first step, and invocations of all of them.
const SUM_GROUPS: u32 = 64;
const STRIDE: u32 = SUM_GROUPS * 64;

/// Rays of a record to bright clusters.
pub fn rays_of(hemisphere: Hemisphere) -> u32 {
    (hemisphere.rays() / GATHER_RAYS).div_ceil(LANES).max(1) * LANES
}

/// The pipelines, the tables, and which clusters are bright.
pub struct Bright {
    sums: Pipeline,
    select: Pipeline,
    rays: Pipeline,
    base_count: u32,
    /// Rays of a record.
    ray_count: u32,
    seed: u32,
    /// `BrightSite` of each base cluster.
    sites: Buffer,
    /// The `Watched` clusters, in order.
    watched: Buffer,
    watched_count: u32,
    /// Range of the watched clusters in each cluster, or the one around it.
    pub watched_ranges: Buffer,
    /// `BrightSum` of each workgroup.
    sums_of_groups: Buffer,
    /// The `BrightState` of the frame.
    pub state: Buffer,
    /// Number of bright clusters before each watched one, and of all.
    pub ranks: Buffer,
    /// The `BrightCluster`s, in order.
    pub clusters: Buffer,
    /// Workgroups of the rays.
    pub ray_groups: Buffer,
}

impl Bright {
    /// Stem of shaders, reference and timing.
    pub const STEM: &str = "bright";

    /// Uploads the tables.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        tables: &BrightTables,
        hemisphere: Hemisphere,
        seed: u32,
    ) -> Result<Self> {
        let watched_count = tables.watched.len() as u32;
        let name = |name| GrowsWith::Cells.named(name);
        let allocate = |label, bytes: u64| Buffer::storage(context, name(label), bytes);
        Ok(Self {
            sums: Pipeline::new(context, "bright_sums", &[])?,
            select: Pipeline::new(context, "bright_select", &[])?,
            rays: Pipeline::new(context, "bright_rays", &[scene.textures.constant()])?,
            base_count: tables.sites.len() as u32,
            ray_count: rays_of(hemisphere),
            seed,
            sites: Buffer::from_slice(context, name("bright sites"), &tables.sites)?,
            watched: Buffer::from_slice(context, name("watched clusters"), &tables.watched)?,
            watched_count,
            watched_ranges: Buffer::from_slice(context, name("watched ranges"), &tables.ranges)?,
            sums_of_groups: allocate("bright sums", size_of::<BrightSum>() as u64 * u64::from(SUM_GROUPS))?,
            state: allocate("bright state", size_of::<BrightState>() as u64)?,
            ranks: allocate("bright ranks", 4 * (u64::from(watched_count) + 1))?,
            clusters: allocate(
                "bright clusters",
                size_of::<BrightCluster>() as u64 * u64::from(watched_count),
            )?,
            // No gather writes it in a scene without records or targets.
            ray_groups: Buffer::from_slice(context, name("bright groups"), &[0_u32; 3])?,
        })
    }

    /// Rays of a record.
    pub fn ray_count(&self) -> u32 {
        self.ray_count
    }

    /// Bytes that [`Self::record`] reads at least: clusters with flux, reflectance and area.
    pub fn watched_bytes(&self) -> u64 {
        u64::from(self.watched_count) * (size_of::<Watched>() + 2 * size_of::<Vec3>() + 4) as u64
    }

    /// Selects the bright clusters.
    pub fn record(&self, rec: &mut Recorder, materials: &Buffer, pyramid: &Pyramid) {
        let mut pass = rec.pass(Self::STEM);
        let (flux, inverse_areas) = (&pyramid.flux, &pyramid.inverse_areas);
        let watched_count = self.watched_count;
        pass.dispatch(
            &self.sums,
            [STRIDE, 1, 1],
            &BrightSumsPush { watched_count, stride: STRIDE },
            &[
                ("WatchedClusters", &self.watched),
                ("Materials", materials),
                ("ClusterFluxes", flux),
                ("InverseAreas", inverse_areas),
                ("BrightSums", &self.sums_of_groups),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.select,
            [1, 1, 1],
            &BrightSelectPush { watched_count, sum_count: SUM_GROUPS, contrast: CONTRAST, bright: BRIGHT },
            &[
                ("WatchedClusters", &self.watched),
                ("Materials", materials),
                ("ClusterFluxes", flux),
                ("InverseAreas", inverse_areas),
                ("BrightSums", &self.sums_of_groups),
                ("BrightRanks", &self.ranks),
                ("BrightClusters", &self.clusters),
                ("BrightStates", &self.state),
            ],
        );
    }

    /// Adds the light of bright clusters to the listed records of `cache_points`. The first step of
    /// a gather has written the size of the dispatch.
    pub fn record_rays(
        &self,
        pass: &mut PassScope<'_>,
        (scene, pyramid): (&SceneBuffers, &Pyramid),
        (cache_points, records): (&Buffer, &Buffer),
        list: &RecordList,
    ) {
        pass.dispatch_indirect(
            &self.rays,
            (&self.ray_groups, 0),
            &BrightRaysPush {
                record_count: list.record_count(),
                base_count: self.base_count,
                rays: self.ray_count,
                seed: self.seed,
            },
            &scene.textures.after([
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("CachePoints", cache_points),
                ("ClusterFluxes", &pyramid.flux),
                ("ChildOffsets", &pyramid.child_offsets),
                ("Children", &pyramid.children),
                ("BrightClusters", &self.clusters),
                ("BrightSites", &self.sites),
                ("BrightStates", &self.state),
                ("RecordOffsets", &list.offsets),
                ("ListedRecords", &list.records),
                ("Records", records),
                ("TruncatedLoops", &scene.truncated_loops),
            ]),
        );
    }
}
