//! Entry points: stratified over the area that light can reach, denser where surfaces are close
//! together. [Yue §1] In: fragments of the active sides, their densities. Out: the first vertex of
//! every light path, in Morton order.
//!
//! Deviation: the paper's entry points are uniform. If the nearest surface is closer than a cell,
//! the light that gather rays read varies within the cell. Finer clusters are needed there, and as
//! many entry points for each.

use super::geometry::Geometry;
use crate::cpu::sampling::hash;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::scene::grid::{BRICK_BITS, CellGrid};
use crate::scene::{Naming, Quality, Scene, fragment::Fragment, hvds::Hvds};
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
        /// Random stream index of its first point; the others' follow.
        pub stream: u32,
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

/// Level of clusters that have running sums of their own if decisions are named by place: what
/// happens in one changes no entry point in another. Larger blocks are stratified better.
const BLOCK_LEVEL: usize = 3;

/// The first of the stream indices that a name stands for. Neighbours in space have consecutive
/// indices, and 256 indices that start at a multiple of 256 are stratified among themselves.
/// Starts at multiples of 65 536 would all have about the same first coordinates.
fn first_stream(name: u32) -> u32 {
    name & 0xffff_ff00
}

/// Patches of the surface and the entry points on them.
pub struct Strata {
    /// The patches, cluster by cluster, so that the points of every cluster of every level are one
    /// segment, and their number is accurate to one. Named by place, that holds up to cells of
    /// eight smallest cells' width.
    pub patches: Vec<EntryPatch>,
    /// First entry point of each patch, and the total.
    pub point_offsets: Vec<u32>,
    /// Area of all patches, each over its nominal weight, m², by [`Naming::rounded`].
    pub area_m2: f64,
    /// Expected number of entry points in each cluster.
    pub in_clusters: Vec<f32>,
}

impl Strata {
    /// Distributes `count` points over the fragments in proportion to area and density, with a
    /// running sum in f64: point i goes to the patch that contains the fraction (i + ½) / count
    /// of the sum. Fragments of density zero get no point.
    /// Named by place, each block of clusters has a running sum of its own, which starts at random;
    /// there are up to a 64th more or fewer points.
    /// `nominal` is the area of an entry point on a fragment over the area in the regions of
    /// small cells, without what its clearance changes: weights are relative to the latter.
    pub fn new(
        hvds: &Hvds,
        densities: &[f32],
        nominal: impl Fn(&Fragment) -> f64,
        count: u32,
        (seed, naming): (u32, Naming),
    ) -> Self {
        let names = Geometry::names_of(hvds, naming);
        let mut order: Vec<usize> =
            (0..hvds.fragments.len()).filter(|&fragment| densities[fragment] > 0.0).collect();
        let nominal_m2 = |fragment: &Fragment| fragment.area_m2 / nominal(fragment);
        let area_m2 = order.iter().map(|&fragment| nominal_m2(&hvds.fragments[fragment])).sum();
        let area_m2 = naming.rounded(area_m2);
        // By name, because the order of triangles in the tree changes when one moves.
        order.sort_by_key(|&fragment| (hvds.fragments[fragment].cluster, names[fragment]));
        let fraction =
            |(fragment, &density): (usize, &f32)| hvds.fragments[fragment].area_m2 * f64::from(density);
        let total = naming.rounded(densities.iter().enumerate().map(fraction).sum());
        let open = |(fragment, fraction): (usize, f64)| fraction * f64::from(hvds.fragments[fragment].open);
        let mut strata =
            Self { patches: Vec::new(), point_offsets: vec![0], area_m2, in_clusters: Vec::new() };
        let block =
            |&fragment: &usize| naming.pick(0, || hvds.above(hvds.fragments[fragment].cluster, BLOCK_LEVEL));
        let limit = naming.pick(count, || u32::MAX);
        let mut first_point = 0;
        for fragments in order.chunk_by(|a, b| block(a) == block(b)) {
            let name = hash(names[fragments[0]] ^ hash(!seed));
            let (stream, start) = match naming {
                Naming::Number => (0, 0.5),
                Naming::Place => (first_stream(name), f64::from(hash(name)) / 2f64.powi(32)),
            };
            let (mut points, mut running) = (0, 0.0);
            for &index in fragments {
                let (fragment, density) = (&hvds.fragments[index], f64::from(densities[index]));
                let weight = (total / (density * strata.area_m2)) as f32;
                for fan in fragment.corners.windows(2).skip(1) {
                    let (p0, p1, p2) = (fragment.corners[0], fan[0], fan[1]);
                    let side = fragment.side;
                    let stream = stream.wrapping_add(points);
                    strata.patches.push(EntryPatch { p0, p1, p2, side, weight, stream });
                    let area_m2 = 0.5 * (p1 - p0).as_dvec3().cross((p2 - p0).as_dvec3()).length();
                    running += area_m2 * density / total;
                    points = ((running * f64::from(count) + start) as u32).min(limit);
                    strata.point_offsets.push(first_point + points);
                }
            }
            first_point += points;
        }
        if let (Some(last), Naming::Number) = (strata.point_offsets.last_mut(), naming) {
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

/// Sorts items by the Morton index of their position, stably.
pub fn sort_along_curve<T>(items: &mut [T], grid: &CellGrid, position: impl Fn(&T) -> Vec3) {
    let bits = curve_bits(grid);
    items.sort_by_cached_key(|item| morton_index(grid, bits, position(item)));
}

/// A random stream index for each of these positions along the curve: they are consecutive. Named
/// by place, they are so within a cube of space, and those of a cube depend on nothing outside.
pub fn streams_along_curve(
    positions: &[Vec3],
    grid: &CellGrid,
    (quality, naming): (&Quality, Naming),
) -> Vec<u32> {
    if naming == Naming::Number {
        return (0..positions.len() as u32).collect();
    }
    let below = 3 * (curve_bits(grid) - cube_bits(quality.cache_points));
    let block = |&position: &Vec3| morton_index(grid, curve_bits(grid), position) >> below;
    let mut streams = Vec::with_capacity(positions.len());
    for positions in positions.chunk_by(|a, b| block(a) == block(b)) {
        let first = first_stream(hash(block(&positions[0]) as u32 ^ hash(quality.seed)));
        streams.extend((0..positions.len() as u32).map(|place| first.wrapping_add(place)));
    }
    streams
}

/// Levels of halving from the scene to the cubes of [`streams_along_curve`]: a room with that
/// budget of cache points has some 25 in each. Points of different cubes are not stratified.
fn cube_bits(cache_points: u32) -> u32 {
    (cache_points / 128).max(1).ilog2() / 2
}

/// Bits of the steps along the longest axis: ten, or more in an octree with smaller cells.
fn curve_bits(grid: &CellGrid) -> u32 {
    (10 + grid.shift - BRICK_BITS).min(21)
}

/// Morton index of a position.
fn morton_index(grid: &CellGrid, bits: u32, position: Vec3) -> u64 {
    let steps = ((1u32 << bits) - 1) as f32;
    let scale = steps * grid.inverse_cell / grid.cells.max_element() as f32;
    let first = grid.first.as_vec3() * (steps / grid.cells.max_element() as f32);
    let cell = ((position - grid.low) * scale + first).max(Vec3::ZERO).as_uvec3();
    let spread = |v: u32| (0..bits).fold(0u64, |m, bit| m | u64::from(v >> bit & 1) << (3 * bit));
    spread(cell.z) << 2 | spread(cell.y) << 1 | spread(cell.x)
}
