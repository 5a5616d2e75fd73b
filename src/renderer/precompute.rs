//! The precomputation, in the paper's order. [Yue §1, §2]

use super::Statistics;
use super::enclosures::{Enclosures, lost_lights};
use super::quality_warnings::{
    blurred, outgoing_directions, typical_clearance, uncovered, undersampled, wide_cells,
};
use super::statistics::{self, Watch};
use crate::cpu::math::clear_distance;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context};
use crate::passes::frame::near_field::NearCluster;
use crate::passes::precompute::cache_points::{self, Geometry, Placed, SizeField};
use crate::passes::precompute::cluster_proxies::{self, ProxyTables};
use crate::passes::precompute::entry_points::{self, Strata};
use crate::passes::precompute::gather_rays::{self, GatherTargetPacking, Hemisphere, MIN_ENTRY_POINTS};
use crate::passes::precompute::gloss::{self, GlossTables};
use crate::passes::precompute::neighbours::Neighbourhoods;
use crate::passes::precompute::path_orders::LightPaths;
use crate::passes::precompute::{
    Progress, accessibility, exposed_fractions, inconsistent, light_paths,
    merged_rays::MergedRays,
    narrow_cavities,
    near_clusters::{self, Extent},
    near_hits::{self, NearHits},
    rays::Rays,
    sides,
};
use crate::passes::{ClusterBuffers, ClusterTables, SceneBuffers};
use crate::scene::directions::Directions;
use crate::scene::{
    Scene, Triangle, bvh::Bvh, grid, host_bvh::HostBvh, hvds::Hvds, solids::Solids, surfaces,
    unweighted::NEARBY,
};
use crate::types::{CachePoint, PathVertex, Surface};
use std::borrow::Cow;
use std::sync::Arc;

/// Factor of the resolution of the finest level over the requested one. Where surfaces are nearer
/// than a requested cell, clusters are smaller than that cell.
const REFINED: u32 = 2;
/// Maximum number of finest cells along an axis: the table of cells is dense.
pub(super) const FINEST: u32 = 256;

/// A cache point sees near-field patches if its clearance is below this many base cells.
const SEES_NEAR: f32 = 2.0;

/// A cache point stands in a narrow cavity, where light is reflected to and fro, if its clearance
/// is below this many base cells.
const TIGHT: f32 = 0.5;

/// A cluster is too coarse for a cache point if its centre is within this many base cells.
const NEAR_HITS: f32 = 1.5;

/// Entry points that each cluster at a split plane must hold before a gather ray reads it. The
/// coarser cluster around it also holds the other side of the plane.
const MIN_APART: f32 = 3.0;

/// Results of the precomputation, from which frames are rendered.
pub(super) struct Precomputed {
    pub(super) buffers: SceneBuffers,
    pub(super) surfaces: Vec<Surface>,
    pub(super) hvds: Hvds,
    pub(super) entry_points: Vec<PathVertex>,
    /// Area that each entry point stands for, m².
    pub(super) area_m2: f32,
    pub(super) all_area_m2: f64,
    pub(super) paths: LightPaths,
    pub(super) point_count: u32,
    pub(super) cache_points: Buffer,
    /// The cache points cover the scene's curved surfaces.
    pub(super) is_covering: bool,
    /// Median clearance of the surface, metres.
    pub(super) clearance: f64,
    pub(super) neighbourhoods: Neighbourhoods,
    pub(super) merged_rays: MergedRays,
    /// `None` if no cluster that is read is partly hidden.
    pub(super) proxies: Option<ProxyTables>,
    /// `None` if no material may be glossy.
    pub(super) gloss: Option<GlossTables>,
    pub(super) hemisphere: Hemisphere,
    pub(super) packing: GatherTargetPacking,
    pub(super) cluster_tables: ClusterTables,
    /// `None` if no material may be glossy: no ray queries clusters after the precomputation.
    pub(super) clusters: Option<ClusterBuffers>,
    pub(super) enclosures: Enclosures,
    pub(super) near_clusters: Vec<NearCluster>,
    /// Near-field patches of single cache points.
    pub(super) near_patches: Vec<NearCluster>,
    /// Number of cache points in narrow cavities. They come first.
    pub(super) narrow_count: u32,
    /// Number of near-field patches that these cache points see. They come first.
    pub(super) narrow_patches: u32,
    pub(super) statistics: Statistics,
}

/// Traces everything that does not depend on lights. Reorders the scene's triangles to BVH order.
pub(super) fn precompute(
    context: &Arc<Context>,
    scene: &mut Scene,
    progress: &mut dyn Progress,
) -> Result<Precomputed> {
    let mut watch = Watch::start();
    let quality = scene.quality.clone();

    progress.stage("acceleration structure", 1);
    let bvh = Bvh::build(&scene.triangles)?;
    scene.reorder(&bvh.order);
    watch.lap("acceleration structure");

    progress.stage("surfaces", 1);
    let solids = Solids::new(&scene.triangles, &scene.viewpoints());
    scene.warnings.extend(lost_lights(&solids, &scene.lights));
    let tracer = Rays::new(context)?;
    let (buffers, surfaces, closed) = reachable_surfaces(context, scene, &solids, &tracer, &bvh)?;
    watch.lap("surfaces");

    progress.stage("cells", 1);
    let (low, high) = scene.bounds();
    let lengths = [(high - low).length(), clear_distance(&bvh.nodes[0])];
    let seed = quality.seed;
    let has_gaps = quality.gap_rounds > 0;
    // Only direct light is rendered: no pass reads clusters, and clusters take most of the time.
    let is_direct = quality.entry_points == 0 && quality.cache_points == 0;
    let clustered =
        if is_direct { surfaces::one_side(&surfaces).into() } else { Cow::Borrowed(&surfaces[..]) };
    let build = |cells| {
        let build = if has_gaps { Hvds::build_split } else { Hvds::build };
        let mut hvds = build(&scene.triangles, &clustered, grid::grid(low, high, cells), cells);
        if is_direct {
            return Ok(hvds);
        }
        let geometry = geometry(&scene.triangles, &surfaces, &solids, &hvds, lengths);
        let open = exposed_fractions::exposed_fractions(&geometry, (&tracer, &buffers), seed)?;
        hvds.leave_out_interior(&open);
        Ok::<_, Error>(hvds)
    };
    let cells = build(quality.cells)?;
    let mut hvds = build(finest_cells(quality.cells))?;
    let gaps = narrow_cavities::find(&tracer, &buffers, &scene.lights)?;
    watch.lap("cells");

    let geometry = geometry(&scene.triangles, &surfaces, &solids, &cells, lengths);
    let size_field = SizeField::new(context, &buffers, &geometry, seed, progress)?;
    watch.lap("clearances");

    progress.stage("entry points", 1);
    let cell_size = cells.grid.cell_size() as f32;
    let clearances = size_field.clearances_of(&geometry, &hvds);
    let mut has_unweighted = vec![false; hvds.levels[0].len()];
    for (fragment, &clearance) in hvds.fragments.iter().zip(&clearances) {
        has_unweighted[fragment.cluster as usize] |= clearance < NEARBY * hvds.grid.cell_size() as f32;
    }
    hvds.add_unweighted(&has_unweighted);
    let densities: Vec<f32> = clearances.iter().map(|&c| entry_points::density(c, cell_size)).collect();
    let strata = Strata::new(&hvds, &densities, quality.entry_points);
    let mut effective_entry_points = strata.in_clusters.clone();
    for cluster in hvds.split_clusters() {
        let entry_points = &mut effective_entry_points[cluster as usize];
        if *entry_points >= MIN_APART {
            *entry_points = entry_points.max(MIN_ENTRY_POINTS);
        }
    }
    let normal = |side: u32| surfaces[side as usize / 2].normal_of(side % 2 == 1);
    let extent = if quality.gap_rounds > 1 { Extent::SHADOWS } else { Extent::CONTACTS };
    let patches = near_clusters::patches(&hvds, &clearances, normal, 1 + inconsistent::LEVELS);
    let hemisphere = Hemisphere::new(quality.gather_rays);
    let [resolved, parted] =
        narrow_cavities::resolved((high - low).length(), hvds.grid.cell_size() as f32, hemisphere);
    let told: Vec<String> = undersampled(scene, &gaps, resolved, strata.area_m2, cell_size).collect();
    let clearance = typical_clearance(&hvds.fragments, &clearances);
    let told = told.into_iter().chain(wide_cells(clearance, &hvds.grid, quality.cells));
    scene.warnings.extend(told.filter(|_| !is_direct));
    if quality.occlusion {
        let (rays, in_clusters) = ((&tracer, &buffers), &strata.in_clusters);
        let mut inconsistent =
            narrow_cavities::inconsistent(rays, &hvds, &patches, &surfaces, in_clusters, parted, lengths[1])?;
        let by_rays = inconsistent::inconsistent(rays, &hvds, &patches, in_clusters)?;
        inconsistent.resize(inconsistent.len().max(by_rays.len()), false);
        inconsistent.iter_mut().zip(by_rays).for_each(|(any, by_rays)| *any |= by_rays);
        hvds.inconsistent = inconsistent;
    }
    let cluster_tables = ClusterTables::new(&hvds, &effective_entry_points);
    let clusters = cluster_tables.upload(context)?;
    let area_m2 = (strata.area_m2 / f64::from(quality.entry_points.max(1))) as f32;
    let mut entry_points = entry_points::place(context, &buffers, &clusters, &strata, seed)?;
    watch.lap("entry points");

    let paths = light_paths::trace(
        context,
        &buffers,
        &clusters,
        &surfaces,
        &scene.materials,
        &mut entry_points,
        seed,
        progress,
        |vertices| accessibility::measure(context, &buffers, &mut hvds, vertices, seed),
    )?;
    watch.lap("light paths");

    let mut placement =
        cache_points::place(&size_field, &buffers, &geometry, quality.cache_points, seed, progress)?;
    entry_points::sort_along_curve(&mut placement.points, &hvds.grid, |placed| placed.point.position);
    // Cache points that see near clusters come first, and among these the points
    // in narrow cavities.
    let within = |cells: f32| move |placed: &Placed| placed.clearance < cells * cell_size;
    let [is_narrow, is_near] = [TIGHT, SEES_NEAR].map(|cells| within(if has_gaps { cells } else { 0.0 }));
    placement.points.sort_by_key(|placed| (!is_near(placed), !is_narrow(placed)));
    let narrow_count = placement.points.partition_point(is_narrow) as u32;
    let near_count = placement.points.partition_point(is_near) as u32;
    let points: Vec<CachePoint> = placement.points.iter().map(|placed| placed.point).collect();
    let cache_points = Buffer::from_slice(context, "cache points", &points)?;
    let neighbourhoods = Neighbourhoods::new(&placement.points);
    if !placement.is_covering {
        scene.warnings.push(uncovered(quality.cache_points));
    }
    watch.lap("cache points");

    let near_clusters =
        near_clusters::find(&patches[..extent.end(&hvds)], extent, cell_size, &placement.points);
    let packing =
        GatherTargetPacking::new(hvds.cluster_count(), scene.materials.len(), placement.min_radius)?;
    let point_count = placement.points.len() as u32;
    let rays = gather_rays::trace(
        context,
        &buffers,
        &clusters,
        &cache_points,
        point_count,
        hemisphere,
        packing,
        seed,
        progress,
    )?;
    let near = near_hits::Sources {
        patches: &patches[..Extent::CONTACTS.end(&hvds)],
        materials: &scene.materials,
        points: &placement.points,
        near_count,
        min_radius: placement.min_radius,
        reach: NEAR_HITS * cell_size,
        hemisphere,
        seed,
    };
    let mut near_hits = NearHits::find(near, &rays, packing)?;
    watch.lap("gather rays");
    let directions = Directions::new(quality.directions);
    let outgoing = outgoing_directions(&scene.materials, directions);
    if point_count > 0 {
        scene.warnings.extend(blurred(&scene.materials, outgoing));
    }
    let mut proxies = None;
    let mut packing = packing;
    if quality.occlusion {
        let sources = cluster_proxies::Sources {
            hvds: &hvds,
            in_clusters: &strata.in_clusters,
            surfaces: &surfaces,
            materials: &scene.materials,
            cache_points: &points,
            hemisphere,
            seed,
            directions,
            clear_distance: clear_distance(&bvh.nodes[0]),
        };
        let (tables, packed) = cluster_proxies::build(
            (&Rays::of_segments(context)?, &buffers),
            sources,
            &rays,
            packing,
            progress,
        )?;
        (proxies, packing) = (Some(tables), packed);
        watch.lap("occlusion");
    }
    let proxy_count = proxies.as_ref().map_or(0, ProxyTables::count);
    let near_readers = near_hits.reader_count();
    let patch_count = near_hits.entries.len() as u32;
    let narrow_patches = near_hits.count_before(narrow_count * hemisphere.rays());
    let packing =
        near_hits.redirect(&rays, packing, hvds.cluster_count() + proxy_count, scene.materials.len())?;
    let (gloss, packing) = gloss::build(
        gloss::Sources {
            hvds: &hvds,
            proxy_count: proxy_count + patch_count,
            surfaces: &surfaces,
            materials: &scene.materials,
            paths: &paths,
            entry_points: &entry_points,
            cache_points: &points,
            hemisphere,
            seed,
            directions: outgoing,
        },
        &rays,
        packing,
    )?
    .map_or((None, packing), |(tables, packing)| (Some(tables), packing));
    watch.lap("outgoing directions");
    let merged_rays = MergedRays::new(context, rays, hemisphere)?;
    watch.lap("merged rays");
    progress.finish();

    let mut statistics = Statistics {
        precompute_s: watch.start.elapsed().as_secs_f64(),
        precompute_stages: watch.stages,
        ..Statistics::default()
    };
    statistics::note(&mut statistics, scene, &surfaces, &hvds, &paths, &placement, hemisphere);
    statistics.counts.insert("cache points in narrow cavities".into(), u64::from(narrow_count));
    statistics.counts.insert("cache points that see near clusters".into(), u64::from(near_count));
    statistics.counts.insert("near clusters".into(), near_clusters.len() as u64);
    statistics.counts.insert("near-field patches".into(), u64::from(patch_count));
    statistics.counts.insert("gather rays that read near patches".into(), near_readers);
    if !hvds.inconsistent.is_empty() {
        let inconsistent = hvds.inconsistent.iter().filter(|inconsistent| **inconsistent).count() as u64;
        statistics.counts.insert("clusters of inconsistent visibility".into(), inconsistent);
    }
    if let Some(proxies) = &proxies {
        statistics.counts.extend(proxies.counts());
    }
    if let Some(gloss) = &gloss {
        statistics.counts.insert("directions of the sphere".into(), u64::from(outgoing.count()));
        statistics.counts.extend(gloss.counts());
    }
    let is_glossy = gloss.is_some();
    Ok(Precomputed {
        buffers,
        surfaces,
        hvds,
        entry_points,
        area_m2,
        all_area_m2: strata.area_m2,
        paths,
        point_count,
        cache_points,
        is_covering: placement.is_covering,
        clearance,
        neighbourhoods,
        merged_rays,
        proxies: proxies.filter(|proxies| !proxies.is_empty()),
        gloss,
        hemisphere,
        packing,
        cluster_tables,
        clusters: is_glossy.then_some(clusters),
        enclosures: Enclosures {
            tree: (!closed.is_empty()).then(|| HostBvh::new(&bvh, &scene.triangles)),
            solids,
            groups: closed,
            rays: tracer,
            order: bvh.order,
            is_due: false,
            holds_both: false,
        },
        near_clusters,
        near_patches: near_hits.entries,
        narrow_count,
        narrow_patches,
        statistics,
    })
}

/// Cells of the finest level along an axis, for `cells` requested ones.
pub(super) fn finest_cells(cells: u32) -> u32 {
    (REFINED * cells).min(FINEST)
}

/// The geometry on which cache points are placed, with the scene's size and the distance at which
/// rays start off surfaces, metres.
fn geometry<'a>(
    triangles: &'a [Triangle],
    surfaces: &'a [Surface],
    solids: &'a Solids,
    hvds: &'a Hvds,
    [scene_size, clear_distance]: [f32; 2],
) -> Geometry<'a> {
    Geometry { triangles, surfaces, hvds, scene_size, solids, clear_distance }
}

/// Uploads the scene and finds the sides that take part in transport.
fn reachable_surfaces(
    context: &Arc<Context>,
    scene: &Scene,
    solids: &Solids,
    tracer: &Rays,
    bvh: &Bvh,
) -> Result<(SceneBuffers, Vec<Surface>, sides::Enclosures)> {
    let sees = surfaces::sides_that_see_something(&scene.triangles);
    let pairs = scene.triangles.iter().zip(sees);
    let mut surfaces: Vec<Surface> =
        pairs.map(|(triangle, active)| surfaces::surface(triangle, active)).collect();
    let buffers = SceneBuffers::new(
        context,
        bvh,
        &scene.triangles,
        &surfaces,
        &scene.texture_coordinates,
        &scene.materials,
    )?;
    let clear_distance = clear_distance(&bvh.nodes[0]);
    let closed =
        sides::deactivate_unreachable(tracer, &buffers, scene, solids, clear_distance, &mut surfaces)?;
    buffers.surfaces.followed().write(&surfaces)?;
    if surfaces.is_empty() {
        return Err(Error::Usage("the scene has no triangle".into()));
    }
    Ok((buffers, surfaces, closed))
}
