//! The precomputation: everything that depends neither on lights nor on the camera. [Yue §1, §2]
//! `recipe.rs` is the paper's order of steps; the other files are these steps.

mod cache_points;
mod hierarchy;
mod meters;
mod recipe;
mod surfaces;
mod targets;

pub(super) use recipe::precompute;

use super::Statistics;
use super::enclosures::Enclosures;
use super::statistics::{self, Watch};
use crate::gpu::Buffer;
use crate::passes::frame::near_field::NearCluster;
use crate::passes::gather_targets::GatherTargetPacking;
use crate::passes::gloss_tables::GlossTables;
use crate::passes::precompute::gather_rays::{Hemisphere, TracedRays};
use crate::passes::precompute::kept::KeptCount;
use crate::passes::precompute::merged_rays::MergedRays;
use crate::passes::precompute::neighbours::Neighbourhoods;
use crate::passes::precompute::path_orders::LightPaths;
use crate::passes::{ClusterBuffers, ClusterTables, SceneBuffers};
use crate::scene::Scene;
use crate::scene::hvds::Hvds;
use crate::types::{PathVertex, Surface};
use cache_points::Points;
use hierarchy::Hierarchy;
use std::collections::BTreeMap;
use surfaces::Reachable;
use targets::Targets;

/// Results of the precomputation, from which frames are rendered.
pub(in crate::renderer) struct Precomputed {
    pub(in crate::renderer) buffers: SceneBuffers,
    pub(in crate::renderer) surfaces: Vec<Surface>,
    pub(in crate::renderer) hvds: Hvds,
    /// Area of each cluster that distant readers see, m².
    pub(in crate::renderer) shown_m2: Vec<f32>,
    pub(in crate::renderer) entry_points: Vec<PathVertex>,
    /// Area that each entry point stands for, m².
    pub(in crate::renderer) area_m2: f32,
    pub(in crate::renderer) all_area_m2: f64,
    pub(in crate::renderer) paths: LightPaths,
    pub(in crate::renderer) point_count: u32,
    pub(in crate::renderer) cache_points: Buffer,
    /// The cache points cover the scene's curved surfaces.
    pub(in crate::renderer) is_covering: bool,
    /// Median clearance of the surface, metres.
    pub(in crate::renderer) clearance: f64,
    pub(in crate::renderer) neighbourhoods: Neighbourhoods,
    pub(in crate::renderer) merged_rays: MergedRays,
    /// `None` if no material may be glossy.
    pub(in crate::renderer) gloss: Option<GlossTables>,
    pub(in crate::renderer) hemisphere: Hemisphere,
    pub(in crate::renderer) packing: GatherTargetPacking,
    pub(in crate::renderer) cluster_tables: ClusterTables,
    /// `None` if no material may be glossy: no ray queries clusters after the precomputation.
    pub(in crate::renderer) clusters: Option<ClusterBuffers>,
    pub(in crate::renderer) enclosures: Enclosures,
    pub(in crate::renderer) near_clusters: Vec<NearCluster>,
    /// Near-field patches of single cache points.
    pub(in crate::renderer) near_patches: Vec<NearCluster>,
    /// Number of cache points in narrow cavities. They come first.
    pub(in crate::renderer) narrow_count: u32,
    /// Number of near-field patches that these cache points see. They come first.
    pub(in crate::renderer) narrow_patches: u32,
    pub(in crate::renderer) statistics: Statistics,
}

/// The results of all steps.
struct Steps {
    reachable: Reachable,
    hierarchy: Hierarchy,
    entry_points: Vec<PathVertex>,
    shown_m2: Vec<f32>,
    paths: LightPaths,
    points: Points,
    targets: Targets,
    kept: Option<KeptCounts>,
}

/// What was kept of the precomputation before.
struct KeptCounts {
    results: Vec<(&'static str, KeptCount)>,
    /// Gather rays that were traced, and their number. `None` if all surface is in one tree.
    rays: Option<(TracedRays, u32)>,
}

impl KeptCounts {
    /// Number of kept results of each kind, and of all.
    fn by_kind(&self) -> BTreeMap<String, [u64; 2]> {
        let rays = self.rays.iter().flat_map(|(traced, all)| {
            let others = |some: u32| [all - some, *all].map(u64::from);
            [
                ("gather rays not traced among surface that stays", others(traced.fixed)),
                ("gather rays not traced among models that can move", others(traced.movable)),
            ]
        });
        let results = self.results.iter().map(|(kind, count)| (*kind, [count.kept, count.all]));
        results.chain(rays).map(|(kind, counts)| (kind.to_owned(), counts)).collect()
    }
}

impl Steps {
    /// Keeps what frames and queries read, with statistics.
    fn finish(self, scene: &Scene, watch: Watch) -> Precomputed {
        let statistics = self.statistics(scene, watch);
        let Self { reachable, hierarchy, entry_points, shown_m2, paths, points, targets, .. } = self;
        let is_glossy = targets.gloss.is_some();
        let (buffers, surfaces, enclosures) = reachable.finish(scene);
        Precomputed {
            buffers,
            surfaces,
            enclosures,
            hvds: hierarchy.hvds,
            shown_m2,
            entry_points,
            area_m2: hierarchy.area_m2,
            all_area_m2: hierarchy.strata.area_m2,
            paths,
            point_count: points.count(),
            cache_points: points.buffer,
            is_covering: points.placement.is_covering,
            clearance: hierarchy.clearance,
            neighbourhoods: points.neighbourhoods,
            merged_rays: targets.merged_rays,
            gloss: targets.gloss,
            hemisphere: hierarchy.hemisphere,
            packing: targets.packing,
            cluster_tables: hierarchy.tables,
            clusters: is_glossy.then_some(hierarchy.clusters),
            near_clusters: points.near_clusters,
            near_patches: targets.near_patches,
            narrow_count: points.narrow_count,
            narrow_patches: targets.narrow_patches,
            statistics,
        }
    }

    fn statistics(&self, scene: &Scene, watch: Watch) -> Statistics {
        let Self { reachable, hierarchy, paths, points, targets, .. } = self;
        let (hvds, hemisphere) = (&hierarchy.hvds, hierarchy.hemisphere);
        let mut statistics = Statistics {
            precompute_s: watch.start.elapsed().as_secs_f64(),
            precompute_stages: watch.stages,
            ..Statistics::default()
        };
        statistics::note(
            &mut statistics,
            scene,
            &reachable.surfaces,
            hvds,
            paths,
            &points.placement,
            hemisphere,
        );
        let inconsistent = hvds.inconsistent.iter().filter(|inconsistent| **inconsistent).count() as u64;
        let counts = [
            ("cache points in narrow cavities", u64::from(points.narrow_count)),
            ("cache points that see near clusters", u64::from(points.near_count)),
            ("near clusters", points.near_clusters.len() as u64),
            ("near-field patches", targets.near_patches.len() as u64),
            ("gather rays that read near patches", targets.patch_readers),
            ("clusters of inconsistent visibility", inconsistent),
        ];
        let counts = counts.into_iter().filter(|(name, _)| {
            !hvds.inconsistent.is_empty() || *name != "clusters of inconsistent visibility"
        });
        statistics.counts.extend(counts.map(|(name, value)| (name.to_owned(), value)));
        statistics.kept = self.kept.as_ref().map(KeptCounts::by_kind).unwrap_or_default();
        if let Some(gloss) = &targets.gloss {
            let directions = u64::from(targets.outgoing.count());
            statistics.counts.insert("directions of the sphere".into(), directions);
            statistics.counts.extend(gloss.counts());
        }
        statistics
    }
}
