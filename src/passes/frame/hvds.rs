//! The volumetric hierarchy of a frame: base level and pyramid. [Yue §2, Thvds] In: form factors
//! of each light, its outgoing flux after the first bounce; contributions. Out: irradiance (W/m²)
//! of every cluster.
//!
//! The flux of the base level is linear in the lights and kept for each light: a change of colour
//! visits no path.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, MAX_LOOP_ITERATIONS, Pipeline, Recorder, SplitBuffer};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::light_sum::LightSum;
use crate::scene::hvds::Hvds;
use crate::types::{ContributionRange, NO_CLUSTER};
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// Push constants of the base level's flux from each light.
    pub struct HvdsLightPush {
        /// Index of the base level in the list.
        pub first_listed: u32,
        /// Its listed clusters.
        pub cluster_count: u32,
        /// First contribution of the dispatch.
        pub first_contribution: u32,
        /// One past the last contribution of the dispatch.
        pub end_contribution: u32,
        /// First index of the bound buffer of the contributions.
        pub first_bound: u32,
    }
}

gpu_struct! {
    /// Push constants of a coarser level.
    pub struct HvdsLevelPush {
        /// Index of the level in the list.
        pub first_listed: u32,
        /// Its listed clusters.
        pub cluster_count: u32,
        /// Clusters of the base.
        pub base_count: u32,
    }
}

gpu_struct! {
    /// Push constants of the last step.
    pub struct HvdsResolvePush {
        /// Listed clusters of all levels.
        pub cluster_count: u32,
    }
}

gpu_struct! {
    /// Flux that a cluster has received, W.
    pub struct ClusterFlux {
        /// At entry points: straight from the lights.
        pub direct: Vec3,
        /// At all other vertices: from surfaces.
        pub indirect: Vec3,
    }
}

gpu_struct! {
    /// Flux that a base cluster receives from one light, per unit of its emission and of the mean
    /// area of an entry point.
    pub struct LightFlux {
        /// At entry points, in every channel.
        pub direct: f32,
        /// At all other vertices.
        pub indirect: Vec3,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    HvdsLightPush::LAYOUT,
    HvdsLevelPush::LAYOUT,
    HvdsResolvePush::LAYOUT,
    ClusterFlux::LAYOUT,
    LightFlux::LAYOUT,
];

/// A light whose irradiance buffer is stale.
#[derive(Clone, Copy)]
pub struct ClusterLight<'a> {
    /// Its form factors at entry points, 1/m² for a point light.
    pub factors: &'a Buffer,
    /// Outgoing flux after the first bounce, three floats. `None` if no material may be glossy: it
    /// then equals the form factors.
    pub first_bounce: Option<&'a Buffer>,
    /// `LightFlux` of each base cluster.
    pub flux: &'a Buffer,
}

/// Lights of one dispatch if as many are stale: it reads the contributions once for all of them.
const LIGHTS: usize = 4;

/// Minimum number of path vertices for the indirect light of a cluster. It exceeds that of entry
/// points, because vertices are random and have unequal weights, while entry points are stratified.
pub const MIN_VERTICES: u32 = 48;

/// The expected count comes from an enclosing cluster with this many times the minimum. The
/// cluster's own count is random: selecting on it keeps clusters with many vertices by chance
/// and replaces the others by the mean. That bias was 2 % too much light in an empty box at 100
/// 000 entry points.
pub const VERTICES_AROUND: u32 = 16;

/// A cluster with less than 1/`MIN_FRACTION` of the minimum is darker than its surroundings and
/// is replaced anyway.
pub const MIN_FRACTION: u32 = 4;

/// Clusters that a frame works on.
pub struct ClusterLists {
    /// Clusters whose flux is summed, in ascending order.
    summed: Buffer,
    /// Range of each level in `summed`.
    levels: Vec<Range<u32>>,
    /// Clusters whose irradiance is computed.
    read: Buffer,
    read_count: u32,
}

impl ClusterLists {
    /// Lists all clusters of a hierarchy.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn all(context: &Arc<Context>, levels: &[Range<u32>]) -> Result<Self> {
        let all = vec![true; levels.last().map_or(0, |level| level.end) as usize];
        Self::new(context, levels, &all, &all)
    }

    /// Lists the marked clusters; `levels` are those of the hierarchy.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(
        context: &Arc<Context>,
        levels: &[Range<u32>],
        is_summed: &[bool],
        is_read: &[bool],
    ) -> Result<Self> {
        let list = |is_listed: &[bool]| -> Vec<u32> {
            (0..).zip(is_listed).filter(|(_, is_listed)| **is_listed).map(|(cluster, _)| cluster).collect()
        };
        let (summed, read) = (list(is_summed), list(is_read));
        let place = |cluster: u32| summed.partition_point(|&other| other < cluster) as u32;
        Ok(Self {
            levels: levels.iter().map(|level| place(level.start)..place(level.end)).collect(),
            summed: Buffer::from_slice(context, GrowsWith::Cells.named("summed clusters"), &summed)?,
            read: Buffer::from_slice(context, GrowsWith::Cells.named("read clusters"), &read)?,
            read_count: read.len() as u32,
        })
    }
}

/// The pipelines, the hierarchy and its flux.
pub struct Pyramid {
    lights: [Pipeline; 2],
    sum: LightSum,
    level: Pipeline,
    resolve: Pipeline,
    /// Clusters of the base level.
    base_count: u32,
    /// Maximum number of contributions of one dispatch.
    max_contributions: u32,
    /// Mean area of an entry point.
    entry_area_m2: f32,
    /// `ContributionRange` of each base cluster.
    pub contribution_ranges: Buffer,
    /// First child, in `children`, of each cluster above the base, and the end.
    pub child_offsets: Buffer,
    /// Children of all clusters, in order of their parents.
    pub children: Buffer,
    /// 1/area of each cluster, 1/m².
    pub inverse_areas: Buffer,
    /// The cluster from which each takes its indirect light.
    pub indirect_sources: Buffer,
    /// `ClusterFlux` of each cluster, W.
    pub flux: Buffer,
    /// Irradiance of each cluster, W/m²; three floats. Near-field patches may follow.
    pub irradiance: Buffer,
}

impl Pyramid {
    /// Stem of shaders, reference and timing.
    pub const STEM: &str = "hvds";
    /// Timing name of the per-light irradiance buffers.
    pub const LIGHTS_STEM: &str = "hvds_light";

    /// Uploads the hierarchy. `shown_m2`: area of each cluster that distant readers see.
    /// `contribution_offsets` holds, for each base cluster, its first
    /// contribution of an entry point and its first one of another vertex; then the end. The area
    /// of a root is at least `entry_area_m2`, the mean area of an entry point: smaller roots cannot
    /// be resolved. No ray reads other clusters that are that small. `is_glossy`: lights have an
    /// outgoing flux after the first bounce.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        (hvds, shown_m2): (&Hvds, &[f32]),
        contribution_offsets: &[u32],
        entry_area_m2: f32,
        is_glossy: bool,
    ) -> Result<Self> {
        let roots = hvds.levels.last().map_or(0, |roots| roots.start) as usize;
        let inverse_areas: Vec<f32> = (0..)
            .zip(shown_m2)
            .map(|(cluster, &area)| match cluster < roots {
                true if area > 0.0 => 1.0 / area,
                true => 0.0,
                false => 1.0 / area.max(entry_area_m2),
            })
            .collect();
        let ranges = contribution_ranges(hvds, contribution_offsets);
        // No pass writes the clusters without readers.
        let dark = vec![Vec3::ZERO; hvds.cluster_count() as usize];
        let lights = |lights| {
            let constants = [("LIGHTS", lights as u32), ("IS_GLOSSY", u32::from(is_glossy))];
            Pipeline::new(context, Self::LIGHTS_STEM, &constants)
        };
        Ok(Self {
            lights: [lights(1)?, lights(LIGHTS)?],
            sum: LightSum::of_clusters(context)?,
            level: Pipeline::new(context, "hvds_level", &[])?,
            resolve: Pipeline::new(context, "hvds_resolve", &[])?,
            base_count: hvds.levels[0].len() as u32,
            max_contributions: contributions_at_once(&ranges),
            entry_area_m2,
            contribution_ranges: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("contribution ranges"),
                &ranges,
            )?,
            child_offsets: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("child offsets"),
                &hvds.child_offsets,
            )?,
            children: Buffer::from_slice(context, GrowsWith::Cells.named("children"), &hvds.children)?,
            inverse_areas: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("inverse areas"),
                &inverse_areas,
            )?,
            indirect_sources: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("indirect sources"),
                &indirect_sources(hvds, &ranges, MIN_VERTICES),
            )?,
            flux: Buffer::from_slice(
                context,
                GrowsWith::Cells.named("cluster flux"),
                &[&dark[..], &dark].concat(),
            )?,
            irradiance: Buffer::from_slice(context, GrowsWith::Cells.named("cluster irradiance"), &dark)?,
        })
    }

    /// Allocates `patch_count` near-field patches behind the irradiance of clusters.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn reserve_patches(&mut self, context: &Arc<Context>, patch_count: u32) -> Result<()> {
        if patch_count > 0 {
            let bytes = self.irradiance.bytes() + 12 * u64::from(patch_count);
            self.irradiance = Buffer::storage(context, GrowsWith::Cells.named("cluster irradiance"), bytes)?;
        }
        Ok(())
    }

    /// Allocates a per-light irradiance buffer, initially dark: no pass writes the
    /// clusters without readers.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn new_light_flux(context: &Arc<Context>, base_count: u32) -> Result<Buffer> {
        let dark = LightFlux { direct: 0.0, indirect: Vec3::ZERO };
        Buffer::from_slice(context, GrowsWith::Cells.named("light flux"), &vec![dark; base_count as usize])
    }

    /// Number of base clusters: the length of a light's [`LightFlux`] buffer.
    pub fn base_count(&self) -> u32 {
        self.base_count
    }

    /// Sums the base level for each stale light.
    pub fn record_lights(
        &self,
        rec: &mut Recorder,
        due: &[ClusterLight<'_>],
        contributions: &SplitBuffer,
        lists: &ClusterLists,
    ) {
        let mut pass = rec.pass(Self::LIGHTS_STEM);
        let base = &lists.levels[0];
        let [one, four] = &self.lights;
        let groups = due.chunks_exact(LIGHTS);
        let single = groups.remainder().chunks(1).map(|light| (one, light));
        for (pipeline, lights) in groups.map(|lights| (four, lights)).chain(single) {
            let light = |place: usize| lights.get(place).unwrap_or(&lights[0]);
            // If nothing is glossy, no pass reads it.
            let first_bounce = |place: usize| light(place).first_bounce.unwrap_or(light(place).factors);
            for (chunk, items) in contributions.spans(self.max_contributions) {
                let push = HvdsLightPush {
                    first_listed: base.start,
                    cluster_count: base.len() as u32,
                    first_contribution: items.start,
                    end_contribution: items.end,
                    first_bound: chunk.items.start,
                };
                if items.start > 0 {
                    pass.barrier(COMPUTE_TO_COMPUTE);
                }
                pass.dispatch(
                    pipeline,
                    [base.len() as u32, 1, 1],
                    &push,
                    &[
                        ("Factors0", light(0).factors),
                        ("Factors1", light(1).factors),
                        ("Factors2", light(2).factors),
                        ("Factors3", light(3).factors),
                        ("FirstBounce0", first_bounce(0)),
                        ("FirstBounce1", first_bounce(1)),
                        ("FirstBounce2", first_bounce(2)),
                        ("FirstBounce3", first_bounce(3)),
                        ("ContributionRanges", &self.contribution_ranges),
                        ("Contributions", &chunk.buffer),
                        ("SummedClusters", &lists.summed),
                        ("LightFlux0", light(0).flux),
                        ("LightFlux1", light(1).flux),
                        ("LightFlux2", light(2).flux),
                        ("LightFlux3", light(3).flux),
                    ],
                );
            }
        }
    }

    /// Sums the base level's flux over the lights, weighted by the emissions, in
    /// order. Then sums the coarser levels and divides by area.
    pub fn record_sum(&self, rec: &mut Recorder, of_lights: &[(Vec3, &Buffer)], lists: &ClusterLists) {
        let mut pass = rec.pass(Self::STEM);
        self.sum.record(&mut pass, of_lights, self.base_count, self.entry_area_m2, &self.flux);
        for level in lists.levels[1..].iter().filter(|level| !level.is_empty()) {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.level,
                [level.len() as u32, 1, 1],
                &HvdsLevelPush {
                    first_listed: level.start,
                    cluster_count: level.len() as u32,
                    base_count: self.base_count,
                },
                &[
                    ("ChildOffsets", &self.child_offsets),
                    ("Children", &self.children),
                    ("ClusterFluxes", &self.flux),
                    ("SummedClusters", &lists.summed),
                ],
            );
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.resolve,
            [lists.read_count, 1, 1],
            &HvdsResolvePush { cluster_count: lists.read_count },
            &[
                ("InverseAreas", &self.inverse_areas),
                ("IndirectSources", &self.indirect_sources),
                ("ClusterFluxes", &self.flux),
                ("Irradiance", &self.irradiance),
                ("ReadClusters", &lists.read),
            ],
        );
    }
}

/// CSR ranges of the contributions of each base cluster. `contribution_offsets` holds, for each
/// cluster, its first contribution of an entry point and its first one of another vertex; then the
/// end. An unweighted cluster has the range of its cluster.
pub fn contribution_ranges(hvds: &Hvds, contribution_offsets: &[u32]) -> Vec<ContributionRange> {
    let range = |first: &[u32]| ContributionRange {
        first: first[0],
        first_other: first[1],
        end: first[2],
        is_unweighted: 0,
    };
    let mut ranges: Vec<ContributionRange> = contribution_offsets.windows(3).step_by(2).map(range).collect();
    for (cluster, &unweighted) in
        hvds.unweighted.iter().enumerate().filter(|(_, unweighted)| **unweighted != NO_CLUSTER)
    {
        ranges[unweighted as usize] = ContributionRange { is_unweighted: 1, ..ranges[cluster] };
    }
    ranges
}

/// Maximum number of contributions of one dispatch: all, unless some cluster has too many for
/// one invocation. In a scene that fills a small part of its box, few clusters hold nearly all.
fn contributions_at_once(ranges: &[ContributionRange]) -> u32 {
    const MAX: u32 = 1 << 15;
    const { assert!(MAX < MAX_LOOP_ITERATIONS) };
    if ranges.iter().any(|range| range.end - range.first > MAX) { MAX } else { u32::MAX }
}

/// For each cluster, the smallest enclosing one with at least `least` expected path vertices that
/// are no entry points.
pub fn indirect_sources(hvds: &Hvds, ranges: &[ContributionRange], least: u32) -> Vec<u32> {
    let mut counts = vec![0; hvds.cluster_count() as usize];
    for (count, range) in counts.iter_mut().zip(ranges) {
        *count = range.end - range.first_other;
    }
    for cluster in 0..counts.len() {
        if hvds.parents[cluster] != NO_CLUSTER {
            counts[hvds.parents[cluster] as usize] += counts[cluster];
        }
    }
    // From the root down, because a child may take the source of its parent.
    let mut sources: Vec<u32> = (0..hvds.cluster_count()).collect();
    for cluster in (0..counts.len()).rev() {
        let parent = hvds.coarser(cluster as u32);
        if parent == NO_CLUSTER {
            continue;
        }
        let mut around = cluster;
        while counts[around] < VERTICES_AROUND * least && hvds.parents[around] != NO_CLUSTER {
            around = hvds.parents[around] as usize;
        }
        // The expected count: the enclosing cluster's count times the area fraction.
        let [area_m2, area_around_m2] = [cluster, around].map(|cluster| f64::from(hvds.areas_m2[cluster]));
        let is_expected = f64::from(counts[around]) * area_m2 >= f64::from(least) * area_around_m2;
        if !is_expected || MIN_FRACTION * counts[cluster] < least {
            sources[cluster] = sources[parent as usize];
        }
    }
    sources
}
