//! Bright clusters reflect so much more light than the mean that few gather rays meet them, such as
//! the surface beside a lamp. Records sample them by shadow rays of their own. [Veach §9;
//! numerics: bright clusters] In: flux of clusters (W). Out: added to records.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT};
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::SceneBuffers;
use crate::passes::bright_tables::BrightTables;
use crate::passes::frame::hvds::Pyramid;
use crate::passes::frame::needed_records::RecordList;
use crate::passes::frame::prefix_sum::PrefixSum;
use crate::passes::precompute::gather_rays::Hemisphere;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    pub struct BrightSumsPush {
        pub watched_count: u32,
        /// Invocations of all workgroups.
        pub stride: u32,
    }
}

gpu_struct! {
    pub struct BrightTotalPush {
        /// Workgroups of the first step.
        pub sum_count: u32,
        /// Words of all sizes.
        pub size_count: u32,
        /// Least mean radiant exitance of light, over that of area.
        pub contrast: f32,
    }
}

gpu_struct! {
    /// Sums over the watched clusters, and what follows from them.
    pub struct BrightState {
        /// Direct light that they reflect, W.
        pub light: f32,
        /// Their area, m².
        pub area: f32,
        /// Sum of light² / area.
        pub square: f32,
        /// 1: some clusters may be bright.
        pub is_on: u32,
    }
}

gpu_struct! {
    pub struct BrightWeightsPush {
        pub watched_count: u32,
        /// Least radiant exitance of a bright cluster, over the mean.
        pub contrast: f32,
    }
}

gpu_struct! {
    pub struct BrightLevelPush {
        /// Index of the level in the list.
        pub first_listed: u32,
        pub cluster_count: u32,
        /// Clusters of the base.
        pub base_count: u32,
    }
}

gpu_struct! {
    pub struct BrightGroupsPush {
        /// Number of records, listed or not.
        pub record_count: u32,
        pub watched_count: u32,
        /// Rays of a record.
        pub rays: u32,
    }
}

gpu_struct! {
    pub struct BrightRaysPush {
        /// Number of records, listed or not.
        pub record_count: u32,
        pub watched_count: u32,
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
    BrightTotalPush::LAYOUT,
    BrightState::LAYOUT,
    BrightWeightsPush::LAYOUT,
    BrightLevelPush::LAYOUT,
    BrightGroupsPush::LAYOUT,
    BrightRaysPush::LAYOUT,
];

/// Lanes of a record, of which each casts as many rays; mirrors `glsl/bright_rays.comp`.
const LANES: u32 = 4;

/// Gather rays for each ray to bright clusters.
const GATHER_RAYS: u32 = 32;

/// Least radiant exitance of a bright cluster, over the mean: at most a sixteenth of the area.
pub const BRIGHT: f32 = 16.0;

/// Mean radiant exitance of light, over that of area, from which on clusters may be bright. Below,
/// gather rays sample all light well enough.
pub const CONTRAST: f32 = 12.0;

/// Workgroups of the first step, and their invocations.
const SUM_GROUPS: u32 = 64;
const GROUP: u32 = 64;

/// Bytes of the size of a dispatch.
const SIZE_BYTES: u64 = 12;

/// Rays of a record to bright clusters.
pub fn rays_of(hemisphere: Hemisphere) -> u32 {
    (hemisphere.rays() / GATHER_RAYS).div_ceil(LANES).max(1) * LANES
}

/// The pipelines, the tables, and which clusters are bright.
pub struct Bright {
    sums: Pipeline,
    total: Pipeline,
    weights: Pipeline,
    prefix_sum: PrefixSum,
    level: Pipeline,
    groups: Pipeline,
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
    /// Index of the watched cluster to which each cluster belongs.
    pub watched_of: Buffer,
    /// Clusters above watched ones, level by level, and the range of each level.
    above: Buffer,
    levels: Vec<Range<u32>>,
    sums_of_groups: Buffer,
    /// The `BrightState` of the frame.
    pub state: Buffer,
    /// Prefix sum of the weights of watched clusters, and the total.
    pub offsets: Buffer,
    /// Direct flux of each cluster above the base that comes from bright clusters, W.
    pub flux: Buffer,
    /// Sizes of the conditional dispatches, in order.
    all_sizes: Buffer,
    /// The same, or zeros.
    sizes: Buffer,
    /// Workgroups of the rays.
    ray_groups: Buffer,
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
        let (base_count, watched_count) = (tables.sites.len() as u32, tables.watched.len() as u32);
        let list = |name, words: &[u32]| Buffer::from_slice(context, GrowsWith::Cells.named(name), words);
        let allocate = |name, bytes: u64| Buffer::storage(context, GrowsWith::Cells.named(name), bytes);
        let prefix_sum = PrefixSum::new(context, watched_count)?;
        let levels = tables.levels.iter().map(|level| (level.len() as u32).div_ceil(GROUP));
        let groups =
            [watched_count.div_ceil(GROUP)].into_iter().chain(prefix_sum.groups(watched_count)).chain(levels);
        let sizes: Vec<u32> = groups.flat_map(|groups| context.tuning().swizzled(groups)).collect();
        let ray_count = rays_of(hemisphere);
        let pipeline = |stem| Pipeline::new(context, stem, &[]);
        Ok(Self {
            sums: pipeline("bright_sums")?,
            total: pipeline("bright_total")?,
            weights: pipeline("bright_weights")?,
            prefix_sum,
            level: pipeline("bright_level")?,
            groups: pipeline("bright_groups")?,
            rays: Pipeline::new(context, "bright_rays", &[scene.textures.constant()])?,
            base_count,
            ray_count,
            seed,
            sites: Buffer::from_slice(context, GrowsWith::Cells.named("bright sites"), &tables.sites)?,
            watched: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("watched clusters"),
                &tables.watched,
            )?,
            watched_count,
            watched_of: list("watched cluster of each", &tables.watched_of)?,
            above: list("clusters above watched ones", &tables.above)?,
            levels: tables.levels.clone(),
            sums_of_groups: allocate("bright sums", u64::from(SUM_GROUPS) * size_of::<BrightState>() as u64)?,
            state: allocate("bright state", size_of::<BrightState>() as u64)?,
            offsets: allocate("bright offsets", 4 * (u64::from(watched_count) + 1))?,
            flux: allocate(
                "bright flux",
                12 * (tables.watched_of.len() as u64 - u64::from(base_count)).max(1),
            )?,
            sizes: allocate("bright sizes", 4 * sizes.len() as u64)?,
            all_sizes: Buffer::from_slice(context, "all bright sizes", &sizes)?,
            ray_groups: allocate("bright groups", SIZE_BYTES)?,
        })
    }

    /// Selects the bright clusters, and sums their flux over the levels.
    pub fn record(&self, rec: &mut Recorder, materials: &Buffer, pyramid: &Pyramid) {
        let mut pass = rec.pass(Self::STEM);
        let (flux, inverse_areas) = (&pyramid.flux, &pyramid.inverse_areas);
        pass.dispatch(
            &self.sums,
            [SUM_GROUPS * GROUP, 1, 1],
            &BrightSumsPush { watched_count: self.watched_count, stride: SUM_GROUPS * GROUP },
            &[
                ("WatchedClusters", &self.watched),
                ("Materials", materials),
                ("ClusterFluxes", flux),
                ("InverseAreas", inverse_areas),
                ("BrightSums", &self.sums_of_groups),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        let size_count = (self.sizes.bytes() / 4) as u32;
        pass.dispatch(
            &self.total,
            [1, 1, 1],
            &BrightTotalPush { sum_count: SUM_GROUPS, size_count, contrast: CONTRAST },
            &[
                ("BrightSums", &self.sums_of_groups),
                ("AllSizes", &self.all_sizes),
                ("BrightStates", &self.state),
                ("BrightSizes", &self.sizes),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch_indirect(
            &self.weights,
            (&self.sizes, 0),
            &BrightWeightsPush { watched_count: self.watched_count, contrast: BRIGHT },
            &[
                ("WatchedClusters", &self.watched),
                ("Materials", materials),
                ("ClusterFluxes", flux),
                ("InverseAreas", inverse_areas),
                ("BrightStates", &self.state),
                ("BrightOffsets", &self.offsets),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record_indirect(
            &mut pass,
            &self.offsets,
            self.watched_count,
            (&self.sizes, SIZE_BYTES),
        );
        let first = 1 + self.prefix_sum.groups(self.watched_count).len() as u64;
        for (number, level) in (first..).zip(&self.levels) {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch_indirect(
                &self.level,
                (&self.sizes, SIZE_BYTES * number),
                &BrightLevelPush {
                    first_listed: level.start,
                    cluster_count: level.len() as u32,
                    base_count: self.base_count,
                },
                &[
                    ("ChildOffsets", &pyramid.child_offsets),
                    ("Children", &pyramid.children),
                    ("AboveWatched", &self.above),
                    ("WatchedOf", &self.watched_of),
                    ("ClusterFluxes", flux),
                    ("BrightOffsets", &self.offsets),
                    ("BrightFlux", &self.flux),
                ],
            );
        }
    }

    /// Adds the light of bright clusters to the listed records of `cache_points`.
    pub fn record_rays(
        &self,
        pass: &mut PassScope<'_>,
        (scene, pyramid): (&SceneBuffers, &Pyramid),
        (cache_points, records): (&Buffer, &Buffer),
        list: &RecordList,
    ) {
        let (record_count, watched_count, rays) = (list.record_count(), self.watched_count, self.ray_count);
        pass.dispatch(
            &self.groups,
            [1, 1, 1],
            &BrightGroupsPush { record_count, watched_count, rays },
            &[
                ("BrightOffsets", &self.offsets),
                ("BrightStates", &self.state),
                ("RecordOffsets", &list.offsets),
                ("BrightGroups", &self.ray_groups),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch_indirect(
            &self.rays,
            (&self.ray_groups, 0),
            &BrightRaysPush {
                record_count,
                watched_count,
                base_count: self.base_count,
                rays,
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
                ("WatchedClusters", &self.watched),
                ("BrightSites", &self.sites),
                ("BrightOffsets", &self.offsets),
                ("RecordOffsets", &list.offsets),
                ("ListedRecords", &list.records),
                ("Records", records),
                ("TruncatedLoops", &scene.truncated_loops),
            ]),
        );
    }
}
