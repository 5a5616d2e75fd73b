//! The order of the precomputation. [Yue §1, §2]

use super::cache_points::Points;
use super::hierarchy::{Cells, Hierarchy};
use super::surfaces::Reachable;
use super::targets::{Sources, Targets};
use super::{Precomputed, Steps};
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::precompute::cache_points::SizeField;
use crate::passes::precompute::visibility::accessibility;
use crate::passes::precompute::{Progress, entry_points, gather_rays, light_paths};
use crate::renderer::statistics::Watch;
use crate::scene::Scene;
use std::sync::Arc;

/// Traces everything that does not depend on lights. Reorders the scene's triangles to BVH order.
#[rustfmt::skip] // A step a line.
pub(in crate::renderer) fn precompute(
    context: &Arc<Context>,
    scene: &mut Scene,
    progress: &mut dyn Progress,
) -> Result<Precomputed> {
    let mut watch = Watch::start();
    let seed = scene.quality.seed;

    // The acceleration structure, and the sides of triangles that light can reach.
    let reachable = Reachable::new(context, scene, progress, &mut watch)?;
    let (buffers, surfaces, materials) = (&reachable.buffers, &reachable.surfaces, &scene.materials);

    // Surface in cells, and the distance from each surface to the next.
    let Cells { requested, finest, gaps } = Cells::new(scene, &reachable, progress)?;
    watch.lap("cells");
    let geometry = reachable.geometry(scene, &requested);
    let size_field = SizeField::new(context, buffers, &geometry, seed, progress)?;
    let sizes = (&size_field, &geometry);
    watch.lap("clearances");

    // The hierarchy, and entry points on the surface, denser where surfaces are close. [Yue §1]
    progress.stage("entry points", 1);
    let (mut hierarchy, mut warnings) = Hierarchy::new(context, scene, &reachable, (finest, &gaps), sizes)?;
    let Hierarchy { hvds, clusters, strata, hemisphere, .. } = &mut hierarchy;
    let mut entry_points = entry_points::place(context, buffers, clusters, strata, seed)?;
    watch.lap("entry points");

    // Light paths from the entry points; each vertex contributes to its cluster. [Yue §1, §2]
    let measure = |vertices: &mut [_]| accessibility::measure(context, buffers, hvds, vertices, seed);
    let paths = light_paths::trace(
        context, buffers, clusters, surfaces, materials, &mut entry_points, seed, progress, measure,
    )?;
    watch.lap("light paths");

    // Cache points, and the rays that gather irradiance there. [Yue §1, §3]
    let hemisphere = *hemisphere;
    let points = Points::place(context, scene, &reachable, sizes, &hierarchy, progress)?;
    watch.lap("cache points");
    let (clusters, count, packing) = (&hierarchy.clusters, points.count(), points.packing);
    let rays = gather_rays::trace(
        context, buffers, clusters, &points.buffer, count, hemisphere, packing, seed, progress,
    )?;

    // What each ray reads: a cluster, a patch or proxy of it, or one of its outgoing directions.
    let entries = &entry_points[..];
    let sources = Sources { reachable: &reachable, hierarchy: &hierarchy, points: &points, paths: &paths, entry_points: entries };
    let targets = Targets::resolve(context, scene, sources, rays, &mut watch, progress)?;
    progress.finish();

    warnings.extend(points.warning(scene).into_iter().chain(targets.warnings(scene, &points)));
    scene.warnings.extend(warnings);
    Ok(Steps { reachable, hierarchy, entry_points, paths, points, targets }.finish(scene, watch))
}
