//! Entry points: stratified over the area that light can reach, denser where surfaces are close
//! together. [Yue §1] In: fragments of the active sides, their densities. Out: the first vertex of
//! every light path, in Morton order.
//!
//! Deviation: the paper's entry points are uniform. If the nearest surface is closer than a cell,
//! the light that gather rays read varies within the cell. Finer clusters are needed there, and as
//! many entry points for each.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::scene::grid::{BRICK_BITS, CellGrid};
use crate::scene::{Scene, fragment::Fragment, hvds::Hvds};
use crate::types::{Grid, PathVertex};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A triangle of a fragment, and the weight of its entry points.
    pub struct EntryPatch {
        pub p0: Vec3,
        pub p1: Vec3,
        pub p2: Vec3,
        /// 2·triangle + (1 if the back side).
        pub side: u32,
        /// Area of each of its points, over the mean of all points.
        pub weight: f32,
    }
}

gpu_struct! {
    pub struct EntryPointsPush {
        pub grid: Grid,
        /// First entry point of the dispatch.
        pub first_point: u32,
        /// Entry points in the dispatch.
        pub point_count: u32,
        pub patch_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[EntryPatch::LAYOUT, EntryPointsPush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "entry_points";

/// Maximum number of points of one dispatch: bounds the result buffer to 10 MiB.
const LIMIT: u32 = 1 << 18;

/// Maximum density of entry points, relative to exposed surface.
pub const DENSEST: f32 = 8.0;

/// Density of entry points, relative to exposed surface, if the nearest surface in front is
/// `clearance` away. It lets clusters shrink below the cell size with that distance.
pub fn density(clearance: f32, cell_size: f32) -> f32 {
    (cell_size / clearance.max(1e-30)).powi(2).clamp(1.0, DENSEST)
}

/// Patches of the surface and the entry points on them.
pub struct Strata {
    /// The patches, cluster by cluster, so that the points of every cluster of every level are one
    /// segment, and their number is accurate to one.
    pub patches: Vec<EntryPatch>,
    /// First entry point of each patch, and the total.
    pub point_offsets: Vec<u32>,
    /// Area of all patches, each over its nominal weight, m².
    pub area_m2: f64,
    /// Expected number of entry points in each cluster.
    pub in_clusters: Vec<f32>,
}

impl Strata {
    /// Distributes `count` points over the fragments in proportion to area and density, with a
    /// running sum in f64: point i goes to the patch that contains the fraction (i + ½) / count
    /// of the sum. Fragments of density zero get no point.
    /// `nominal` is the area of an entry point on a fragment over the area in the regions of
    /// small cells, without what its clearance changes: weights are relative to the latter.
    pub fn new(hvds: &Hvds, densities: &[f32], nominal: impl Fn(&Fragment) -> f64, count: u32) -> Self {
        let mut order: Vec<usize> =
            (0..hvds.fragments.len()).filter(|&fragment| densities[fragment] > 0.0).collect();
        let nominal_m2 = |fragment: &Fragment| fragment.area_m2 / nominal(fragment);
        let area_m2: f64 = order.iter().map(|&fragment| nominal_m2(&hvds.fragments[fragment])).sum();
        order.sort_by_key(|&fragment| hvds.fragments[fragment].cluster);
        let fraction =
            |(fragment, &density): (usize, &f32)| hvds.fragments[fragment].area_m2 * f64::from(density);
        let total: f64 = densities.iter().enumerate().map(fraction).sum();
        let open = |(fragment, fraction): (usize, f64)| fraction * f64::from(hvds.fragments[fragment].open);
        let mut strata =
            Self { patches: Vec::new(), point_offsets: vec![0], area_m2, in_clusters: Vec::new() };
        let mut running = 0.0;
        for index in order {
            let (fragment, density) = (&hvds.fragments[index], f64::from(densities[index]));
            for fan in fragment.corners.windows(2).skip(1) {
                let (p0, p1, p2) = (fragment.corners[0], fan[0], fan[1]);
                let area_m2 = 0.5 * (p1 - p0).as_dvec3().cross((p2 - p0).as_dvec3()).length();
                running += area_m2 * density / total;
                let end = (running * f64::from(count) + 0.5).floor() as u32;
                let weight = (total / (density * strata.area_m2)) as f32;
                strata.patches.push(EntryPatch { p0, p1, p2, side: fragment.side, weight });
                strata.point_offsets.push(end.min(count));
            }
        }
        if let Some(last) = strata.point_offsets.last_mut() {
            *last = if strata.patches.is_empty() { 0 } else { count };
        }
        let fractions = densities.iter().enumerate().map(fraction).enumerate();
        let expected = fractions.map(open).map(|fraction| fraction * f64::from(count) / total);
        strata.in_clusters = hvds.sum_up(expected);
        strata
    }
}

/// Places the points and sorts them along a Morton curve, which makes neighbours in the list
/// neighbours in space.
///
/// # Errors
/// The device lacks memory or failed.
pub fn place(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    clusters: &ClusterBuffers,
    strata: &Strata,
    seed: u32,
) -> Result<Vec<PathVertex>> {
    let point_count = strata.point_offsets.last().copied().unwrap_or(0);
    if point_count == 0 {
        return Ok(Vec::new());
    }
    let pipeline = Pipeline::new(context, STEM, &[])?;
    let bytes = u64::from(point_count.min(LIMIT)) * size_of::<PathVertex>() as u64;
    let points = Buffer::storage(context, GrowsWith::EntryPoints.named("entry points"), bytes)?;
    // In a scene of many triangles most patches hold no point.
    let ranges = strata.patches.iter().zip(strata.point_offsets.windows(2));
    let (patches, mut point_offsets): (Vec<EntryPatch>, Vec<u32>) =
        ranges.filter(|(_, ends)| ends[0] < ends[1]).map(|(patch, ends)| (*patch, ends[0])).unzip();
    point_offsets.push(point_count);
    let mut placed: Vec<PathVertex> = Vec::with_capacity(point_count as usize);
    for first_point in (0..point_count).step_by(LIMIT as usize) {
        let count = LIMIT.min(point_count - first_point);
        // Each patch holds at least one point, so that a chunk's patches fit any binding.
        let first_patch = point_offsets.partition_point(|&first| first <= first_point) - 1;
        let end_patch = point_offsets.partition_point(|&first| first < first_point + count);
        let patch_count = (end_patch - first_patch) as u32;
        let own_patches = Buffer::from_slice(
            context,
            GrowsWith::EntryPoints.named("entry patches"),
            &patches[first_patch..end_patch],
        )?;
        let own_firsts =
            Buffer::from_slice(context, "point offsets", &point_offsets[first_patch..end_patch])?;
        let push =
            EntryPointsPush { grid: *clusters.grid, first_point, point_count: count, patch_count, seed };
        context.run(|rec| {
            rec.pass(STEM).dispatch(
                &pipeline,
                [count, 1, 1],
                &push,
                &[
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("EntryPatches", &own_patches),
                    ("PointOffsets", &own_firsts),
                    ("Octree", &clusters.octree),
                    ("CellClusters", &clusters.cell_clusters),
                    ("EntryPoints", &points),
                ],
            );
        })?;
        placed.extend(points.read_range::<PathVertex>(0, count as usize)?);
    }
    sort_along_curve(&mut placed, &clusters.grid, |vertex| vertex.position);
    Ok(placed)
}

/// The entry points outside of holes. Each stands for the same area as before.
pub fn without_holes(mut entry_points: Vec<PathVertex>, scene: &Scene) -> Vec<PathVertex> {
    let Scene { triangles, opacity, .. } = scene;
    let is_hole =
        |point: &PathVertex| opacity.is_hole_at(triangles, point.side / 2, point.position.as_dvec3());
    entry_points.retain(|point| !is_hole(point));
    entry_points
}

/// Sorts items by the Morton index of their position, stably. 1024 steps along the grid's longest
/// axis, or more in an octree with smaller cells.
pub fn sort_along_curve<T>(items: &mut [T], grid: &CellGrid, position: impl Fn(&T) -> Vec3) {
    let bits = (10 + grid.shift - BRICK_BITS).min(21);
    let steps = ((1u32 << bits) - 1) as f32;
    let scale = steps * grid.inverse_cell / grid.cells.max_element() as f32;
    let first = grid.first.as_vec3() * (steps / grid.cells.max_element() as f32);
    items.sort_by_cached_key(|item| {
        let cell = ((position(item) - grid.low) * scale + first).max(Vec3::ZERO).as_uvec3();
        let spread = |v: u32| (0..bits).fold(0u64, |m, bit| m | u64::from(v >> bit & 1) << (3 * bit));
        spread(cell.z) << 2 | spread(cell.y) << 1 | spread(cell.x)
    });
}
