//! The order of the precomputation. [Yue §1, §2]

use super::cache_points::Points;
use super::hierarchy::{Cells, Hierarchy};
use super::surfaces::Reachable;
use super::targets::{Sources, Targets};
use super::{Precomputed, Steps};
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::precompute::cache_points::SizeField;
use crate::passes::precompute::path_orders::LightPaths;
use crate::passes::precompute::visibility::accessibility::{self, Accessibility};
use crate::passes::precompute::{Progress, begin_stage, entry_points, gather_rays, light_paths};
use crate::renderer::statistics::Watch;
use crate::scene::Scene;
use glam::Vec3;
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
    begin_stage(progress, "entry points", 1)?;
    let (hierarchy, mut warnings) = Hierarchy::new(context, scene, &reachable, (finest, &gaps), sizes)?;
    let Hierarchy { hvds, clusters, strata, .. } = &hierarchy;
    let entry_points = entry_points::place(context, buffers, clusters, strata, seed)?;
    let entry_points = entry_points::without_holes(entry_points, scene);
    let places: Vec<Vec3> = entry_points.iter().map(|point| point.position).collect();
    let naming = scene.naming();
    let streams = entry_points::streams_along_curve(&places, &hvds.grid, (&scene.quality, naming));
    watch.lap("entry points");

    // Light paths from the entry points; each vertex contributes to its cluster. [Yue §1, §2]
    let vertices = light_paths::trace(
        context, buffers, clusters, (materials, &scene.cell_sizes), (&entry_points, &streams), seed, progress,
    )?;
    let Accessibility { vertices, shown_m2 } =
        accessibility::measure(context, buffers, hvds, vertices, (seed, naming))?;
    let (base_count, has_images) = (clusters.base_count, buffers.textures.are_used);
    let (entry_points, paths) =
        LightPaths::new(vertices, (entry_points, streams), surfaces, materials, base_count, has_images);
    watch.lap("light paths");

    // Cache points, and the rays that gather irradiance there. [Yue §1, §3]
    let points = Points::place(context, scene, &reachable, sizes, &hierarchy, progress)?;
    watch.lap("cache points");
    let (hemisphere, count, hits) = (hierarchy.hemisphere, points.count(), points.hits);
    let rays = gather_rays::trace(
        context, buffers, clusters, &points.buffer, count, hemisphere, hits, seed, progress,
    )?;

    begin_stage(progress, "merged rays", 1)?;
    // What each ray reads: a cluster, a patch of it, or one of its outgoing directions.
    let sources = Sources { reachable: &reachable, hierarchy: &hierarchy, points: &points, paths: &paths, entry_points: &entry_points };
    let targets = Targets::resolve(context, scene, sources, rays, &mut watch)?;

    warnings.extend(points.warning(scene).into_iter().chain(targets.warnings(scene, &points)));
    scene.warnings.extend(warnings);
    Ok(Steps { reachable, hierarchy, entry_points, shown_m2, paths, points, targets }.finish(scene, watch))
}
