//! The order of the precomputation. [Yue §1, §2]

use super::cache_points::Points;
use super::hierarchy::{Cells, Hierarchy};
use super::surfaces::Reachable;
use super::targets::{Sources, Targets};
use super::{KeptCounts, Precomputed, Steps};
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::precompute::cache_points::SizeField;
use crate::passes::precompute::gather_rays::{GatherTracer, RayTable, Rows};
use crate::passes::precompute::kept::Kept;
use crate::passes::precompute::path_orders::LightPaths;
use crate::passes::precompute::visibility::accessibility::{self, Accessibility};
use crate::passes::precompute::{Progress, begin_stage, entry_points, light_paths};
use crate::renderer::statistics::Watch;
use crate::scene::Scene;
use glam::Vec3;
use std::sync::Arc;

/// Traces everything that does not depend on lights. Reorders the scene's triangles to BVH order.
/// `kept`: what the precomputation before leaves to this one, and this one to the next.
#[rustfmt::skip] // A step a line.
pub(in crate::renderer) fn precompute(
    context: &Arc<Context>,
    scene: &mut Scene,
    mut kept: Option<&mut Kept>,
    progress: &mut dyn Progress,
) -> Result<Precomputed> {
    let mut watch = Watch::start();
    let seed = scene.quality.seed;

    // The acceleration structure, and the sides of triangles that light can reach.
    let reachable = Reachable::new(context, scene, progress, &mut watch)?;
    let (buffers, surfaces, materials) = (&reachable.buffers, &reachable.surfaces, &scene.materials);
    if let Some(kept) = &mut kept {
        kept.note_sides(surfaces, &reachable.bvh.order);
    }
    let near = kept.as_deref();

    // Surface in cells, and the distance from each surface to the next.
    let Cells { requested, finest, gaps } = Cells::new(scene, &reachable, near, progress)?;
    watch.lap("cells");
    let geometry = reachable.geometry(scene, &requested);
    let size_field = SizeField::new(context, buffers, &geometry, (seed, near), progress)?;
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
        accessibility::measure(context, buffers, hvds, vertices, (seed, naming), near.zip(Some(&surfaces[..])))?;
    let (base_count, has_images) = (clusters.base_count, buffers.textures.are_used);
    let (entry_points, paths) =
        LightPaths::new(vertices, (entry_points, streams), surfaces, materials, base_count, has_images);
    watch.lap("light paths");

    // Cache points, and the rays that gather irradiance there. [Yue §1, §3]
    let points = Points::place(context, scene, &reachable, sizes, &hierarchy, progress)?;
    watch.lap("cache points");
    drop(size_field);
    let (rays, kept) = gather(context, scene, (&reachable, &hierarchy, &points), kept, progress)?;

    begin_stage(progress, "merged rays", 1)?;
    // What each ray reads: a cluster, a patch of it, or one of its outgoing directions.
    let sources = Sources { reachable: &reachable, hierarchy: &hierarchy, points: &points, paths: &paths, entry_points: &entry_points };
    let targets = Targets::resolve(context, scene, sources, rays, &mut watch)?;

    warnings.extend(points.warning(scene).into_iter().chain(targets.warnings(scene, &points)));
    scene.warnings.extend(warnings);
    Ok(Steps { reachable, hierarchy, entry_points, shown_m2, paths, points, targets, kept }.finish(scene, watch))
}

/// Traces the gather rays of all cache points. With `kept`, also returns how many results were kept
/// and how many rays were traced.
fn gather(
    context: &Arc<Context>,
    scene: &Scene,
    (reachable, hierarchy, points): (&Reachable, &Hierarchy, &Points),
    kept: Option<&mut Kept>,
    progress: &mut dyn Progress,
) -> Result<(RayTable, Option<KeptCounts>)> {
    let Hierarchy { clusters, hemisphere, .. } = hierarchy;
    let tracer = GatherTracer {
        context,
        scene: &reachable.buffers,
        clusters,
        hemisphere: *hemisphere,
        packing: points.hits,
        seed: scene.quality.seed,
    };
    let trace = |rows: Rows<'_>, progress: &mut dyn Progress| tracer.trace((&points.buffer, &rows), progress);
    let Some(kept) = kept else { return Ok((trace(Rows::none(points.count()), progress)?.0, None)) };
    let results = kept.counts();
    // One tree of all surface: any move changes it, and no hit can be kept.
    if reachable.buffers.movable.is_none() {
        let (rays, _) = trace(Rows::none(points.count()), progress)?;
        kept.end();
        return Ok((rays, Some(KeptCounts { results, rays: None })));
    }
    let most = scene.quality.cache_points + scene.measuring_points().iter().product::<usize>() as u32;
    let hits = kept.hits(context, hemisphere.rays(), most)?;
    let assigned = hits.assign(&points.points);
    let (rays, traced) = trace(Rows::new(hits, assigned.rows.clone()), progress)?;
    hits.fill(assigned);
    kept.end();
    let all = points.count() * hemisphere.rays();
    Ok((rays, Some(KeptCounts { results, rays: Some((traced, all)) })))
}
