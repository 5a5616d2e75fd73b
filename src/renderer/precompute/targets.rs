//! Last step: what each gather ray reads. A ray meets a cluster; it reads the cluster itself, a
//! near-field patch of it, or a gloss bin.

use super::cache_points::Points;
use super::hierarchy::Hierarchy;
use super::surfaces::Reachable;
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::frame::near_field::NearCluster;
use crate::passes::gather_targets::{GatherTarget, GatherTargetPacking, GatherTargets, Reader, TargetCounts};
use crate::passes::gloss_tables::GlossTables;
use crate::passes::precompute::gather_rays::{RayDirections, RayTable};
use crate::passes::precompute::gloss;
use crate::passes::precompute::merged_rays::MergedRays;
use crate::passes::precompute::path_orders::LightPaths;
use crate::passes::precompute::visibility::near_clusters::Extent;
use crate::passes::precompute::visibility::near_hits::{self, NearHits};
use crate::renderer::quality_warnings::{blurred, outgoing_directions};
use crate::renderer::statistics::Watch;
use crate::scene::{Measure, Scene, directions::Directions};
use crate::types::PathVertex;
use std::sync::Arc;

/// A cluster is too coarse for a cache point if its centre is within this many base cells.
const NEAR_HITS: f32 = 1.5;

/// The results of the steps before.
#[derive(Clone, Copy)]
pub(super) struct Sources<'a> {
    pub(super) reachable: &'a Reachable,
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) points: &'a Points,
    pub(super) paths: &'a LightPaths,
    pub(super) entry_points: &'a [PathVertex],
}

/// Targets of all gather rays, which are merged by target.
pub(super) struct Targets {
    pub(super) merged_rays: MergedRays,
    /// `None` if no material may be glossy.
    pub(super) gloss: Option<GlossTables>,
    /// Near-field patches of single cache points.
    pub(super) near_patches: Vec<NearCluster>,
    /// Number of patches that points in narrow cavities see. They come first.
    pub(super) narrow_patches: u32,
    /// Number of rays that read patches.
    pub(super) patch_readers: u64,
    pub(super) packing: GatherTargetPacking,
    /// Direction bins of glossy clusters.
    pub(super) outgoing: Directions,
}

impl Targets {
    /// Finds the rays that read patches, then the readers of gloss bins among the others. Numbers
    /// all targets and merges the rays.
    pub(super) fn resolve(
        context: &Arc<Context>,
        scene: &Scene,
        sources: Sources<'_>,
        rays: RayTable,
        watch: &mut Watch,
    ) -> Result<Self> {
        let Sources { hierarchy, points, .. } = sources;
        let outgoing = outgoing_directions(&scene.materials, Directions::new(scene.quality.directions));
        let targets = GatherTargets::of_hits(points.hits);
        let near = near_hits(scene, sources, &rays, &targets)?;
        let patch_readers = near.readers.len() as u64;
        let narrow_patches = near.patches_of(points.narrow_count, hierarchy.hemisphere);
        let targets = targets.with(GatherTarget::Patch, near.readers);
        watch.lap("gather rays");
        let (gloss, targets) = match gloss_tables(scene, sources, (&rays, &targets), outgoing)? {
            Some((tables, readers)) => (Some(tables), targets.with(GatherTarget::GlossBin, readers)),
            None => (None, targets),
        };
        watch.lap("outgoing directions");
        let counts = TargetCounts {
            clusters: hierarchy.hvds.cluster_count(),
            patches: near.patches.len() as u32,
            gloss_bins: gloss.as_ref().map_or(0, |gloss| gloss.bins.len() as u32),
            sky_side: points.hits.sky_side(),
        };
        let packing =
            GatherTargetPacking::of_counts(counts, scene.materials.len(), points.hits.min_distance)?;
        let directions = RayDirections::new(&points.points, hierarchy.hemisphere, scene.quality.seed);
        let kept = gloss.is_some().then_some(&directions);
        let merged_rays = MergedRays::new(context, rays, (&targets, &packing), hierarchy.hemisphere, kept)?;
        watch.lap("merged rays");
        Ok(Self {
            merged_rays,
            gloss,
            near_patches: near_hits::near_clusters(&near.patches, &packing),
            narrow_patches,
            patch_readers,
            packing,
            outgoing,
        })
    }

    /// Warnings about lobes that the directions do not resolve.
    pub(super) fn warnings(&self, scene: &Scene, points: &Points) -> Vec<String> {
        let has_rays = points.count() > 0;
        blurred(&scene.materials, self.outgoing).filter(|_| has_rays).collect()
    }
}

/// Near-field patches: pieces of near clusters that single cache points see.
fn near_hits(
    scene: &Scene,
    sources: Sources<'_>,
    rays: &RayTable,
    targets: &GatherTargets,
) -> Result<NearHits> {
    let Sources { hierarchy, points, .. } = sources;
    let near = near_hits::Sources {
        patches: &hierarchy.patches[..Extent::CONTACTS.end(&hierarchy.hvds)],
        materials: &scene.materials,
        points: &points.placement.points,
        near_count: if scene.quality.takes(Measure::NearFieldPatches) { points.near_count } else { 0 },
        min_radius: points.placement.min_radius,
        reach: NEAR_HITS * hierarchy.cell_size,
        hemisphere: hierarchy.hemisphere,
        seed: scene.quality.seed,
    };
    NearHits::find(near, rays, targets)
}

/// Gloss bins: the outgoing directions of glossy clusters that some ray reads.
fn gloss_tables(
    scene: &Scene,
    sources: Sources<'_>,
    (rays, targets): (&RayTable, &GatherTargets),
    directions: Directions,
) -> Result<Option<(GlossTables, Vec<Reader>)>> {
    let Sources { reachable, hierarchy, points, paths, entry_points } = sources;
    let gloss = gloss::Sources {
        hvds: &hierarchy.hvds,
        surfaces: &reachable.surfaces,
        materials: &scene.materials,
        paths,
        entry_points,
        cache_points: &points.points,
        hemisphere: hierarchy.hemisphere,
        seed: scene.quality.seed,
        directions,
    };
    gloss::build(gloss, rays, targets)
}
