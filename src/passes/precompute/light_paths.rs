//! Light paths from all entry points. [Yue §1]
//! In: entry points. Out: steps in path order and deposits in cluster order.

use super::{Chunks, Progress};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::path_scan::{HEAD, PathStep};
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::types::{Deposit, Grid, NO_CLUSTER, PathVertex, Surface};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// Where a path stands between two dispatches.
    pub struct PathState {
        /// Its last vertex.
        pub position: Vec3,
        /// Of the last vertex: 2·triangle + (1 if the back side).
        pub side: u32,
        /// Product of f·cosθ/pdf so far, roulette included.
        pub throughput: Vec3,
        /// Path index: names its random numbers.
        pub path: u32,
        /// Vertices so far.
        pub depth: u32,
        /// One while it goes on.
        pub is_alive: u32,
    }
}

gpu_struct! {
    /// Push constants.
    pub struct LightPathsPush {
        /// Base grid.
        pub grid: Grid,
        /// Paths in this dispatch.
        pub path_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[PathState::LAYOUT, LightPathsPush::LAYOUT];

/// The name that shader, twin and timing share.
pub const STEM: &str = "light_paths";

/// Vertices that a dispatch adds to a path at most; a path that is not at its end then goes on in the next round.
const STEPS: u32 = 8;
/// Paths of one dispatch at most: bounds the vertex buffer to 18 MiB.
const LIMIT: u32 = 1 << 16;
/// Throughput below which Russian roulette may end a path. Lower values trade vertices for less noise.
pub const ROULETTE_THRESHOLD: f32 = 0.5;

/// A packed colour that changes nothing.
const WHITE: u32 = u32::MAX;

/// Where on its path a vertex was found, and what becomes of it.
#[derive(Clone, Copy)]
struct Vertex {
    path: u32,
    side: u32,
    weight: f32,
    cluster: u32,
    /// Packed colour of the image at the vertex before.
    colour: u32,
}

/// All light paths, in the two orders that a frame needs.
pub struct LightPaths {
    /// Every vertex in path order: how its energy follows from the vertex before.
    pub steps: Vec<PathStep>,
    /// Packed colour of the image at the vertex before each; none at all in scenes without images.
    pub colours: Vec<u32>,
    /// Every vertex in the order of base clusters; throughputs are the scan's to fill in. One more, which nobody reads,
    /// takes vertices that no cluster holds.
    pub deposits: Vec<Deposit>,
    /// First deposit of each base cluster by an entry point, then its first by another vertex, and the end.
    pub first_deposits: Vec<u32>,
    /// Vertices that no cluster holds: zero unless the binning is broken.
    pub lost: u64,
}

/// Traces all paths. `surfaces` in BVH order; `base_clusters` counts the clusters of the base level.
///
/// # Errors
/// [`Error::OutOfMemory`] if the device cannot bind so many vertices, as where nothing is absorbed and no path ends; the device
/// lacks memory or failed.
#[expect(clippy::too_many_arguments, reason = "one call, at one place")]
pub fn trace(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    clusters: &ClusterBuffers,
    surfaces: &[Surface],
    base_clusters: u32,
    entry_points: &[PathVertex],
    seed: u32,
    progress: &mut dyn Progress,
) -> Result<LightPaths> {
    let mut vertices: Vec<Vertex> = Vec::with_capacity(entry_points.len() * 5);
    let mut live: Vec<PathState> = Vec::with_capacity(entry_points.len());
    for (path, entry) in entry_points.iter().enumerate() {
        let path = path as u32;
        let PathVertex { side, weight, cluster, .. } = *entry;
        vertices.push(Vertex { path, side, weight, cluster, colour: WHITE });
        live.push(PathState {
            position: entry.position,
            side: entry.side,
            // A path that carries little ends early.
            throughput: Vec3::splat(entry.weight),
            path,
            depth: 0,
            is_alive: 1,
        });
    }

    let walk = Walk::new(context, scene, clusters, entry_points.len() as u32, seed)?;
    let mut chunks = Chunks::new(1 << 12, LIMIT);
    progress.stage("light paths", live.len() as u64);
    let total = live.len() as u64;
    let most = context.limits().storage_range_bytes / size_of::<Deposit>() as u64;
    while !live.is_empty() {
        if vertices.len() as u64 >= most {
            return Err(Error::OutOfMemory(format!(
                "{total} light paths have more than the {most} vertices that the device can bind; lower quality.entry_points, or an albedo close to 1"
            )));
        }
        let mut survivors = Vec::new();
        chunks.run(live.len() as u32, |first, count| {
            let states = &live[first as usize..(first + count) as usize];
            let ms = walk.round(scene, clusters, states, &mut vertices, &mut survivors)?;
            progress.advance(total - (live.len() as u64 - u64::from(first + count)) - survivors.len() as u64);
            Ok(ms)
        })?;
        live = survivors;
    }
    let mut paths = LightPaths::from_vertices(vertices, surfaces, entry_points.len(), base_clusters);
    if !scene.textures.are_used {
        paths.colours = Vec::new();
    }
    Ok(paths)
}

/// Device side of the walk.
struct Walk {
    context: Arc<Context>,
    pipeline: Pipeline,
    paths: Buffer,
    vertices: Buffer,
    counts: Buffer,
    colours: Buffer,
    grid: Grid,
    seed: u32,
}

impl Walk {
    fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        clusters: &ClusterBuffers,
        paths: u32,
        seed: u32,
    ) -> Result<Self> {
        let limit = u64::from(paths.clamp(1, LIMIT));
        let textures = scene.textures.constant();
        let constants = [("STEPS", STEPS), ("ROULETTE_THRESHOLD", ROULETTE_THRESHOLD.to_bits()), textures];
        let vertex_bytes = limit * u64::from(STEPS) * size_of::<PathVertex>() as u64;
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &constants)?,
            paths: Buffer::storage(context, "path states", limit * size_of::<PathState>() as u64)?,
            vertices: Buffer::storage(context, "path vertices", vertex_bytes)?,
            counts: Buffer::storage(context, "vertex counts", limit * 4)?,
            colours: scene.textures.colours(context, "vertex colours", limit * u64::from(STEPS))?,
            grid: clusters.grid,
            seed,
        })
    }

    /// Extends some paths; appends what they found, and those that go on. Returns device milliseconds.
    fn round(
        &self,
        scene: &SceneBuffers,
        clusters: &ClusterBuffers,
        states: &[PathState],
        found: &mut Vec<Vertex>,
        survivors: &mut Vec<PathState>,
    ) -> Result<f64> {
        self.paths.write(states)?;
        let push = LightPathsPush { grid: self.grid, path_count: states.len() as u32, seed: self.seed };
        let ((), timings) = self.context.run(|rec| {
            rec.pass(STEM).dispatch(
                &self.pipeline,
                [push.path_count, 1, 1],
                &push,
                &scene.textures.after([
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("Materials", &scene.materials),
                    ("CellFirst", &clusters.cell_first),
                    ("CellClusters", &clusters.cell_clusters),
                    ("Paths", &self.paths),
                    ("Vertices", &self.vertices),
                    ("VertexCounts", &self.counts),
                    ("VertexColours", &self.colours),
                ]),
            );
        })?;
        let counts: Vec<u32> = self.counts.read_range(0, states.len())?;
        let vertices: Vec<PathVertex> = self.vertices.read_range(0, states.len() * STEPS as usize)?;
        let colours: Vec<u32> = match scene.textures.are_used {
            true => self.colours.read_range(0, vertices.len())?,
            false => vec![WHITE; vertices.len()],
        };
        let rows = vertices.chunks_exact(STEPS as usize).zip(colours.chunks_exact(STEPS as usize));
        for ((state, &count), (row, colours)) in states.iter().zip(&counts).zip(rows) {
            found.extend(row[..count as usize].iter().zip(colours).map(|(vertex, &colour)| Vertex {
                path: state.path,
                side: vertex.side,
                weight: vertex.weight,
                cluster: vertex.cluster,
                colour,
            }));
        }
        let after: Vec<PathState> = self.paths.read_range(0, states.len())?;
        survivors.extend(after.into_iter().filter(|state| state.is_alive == 1));
        Ok(timings[0].ms)
    }
}

impl LightPaths {
    /// Orders vertices by path, and by cluster. Vertices of one path come in the order of the walk.
    fn from_vertices(
        mut vertices: Vec<Vertex>,
        surfaces: &[Surface],
        paths: usize,
        base_clusters: u32,
    ) -> Self {
        let first_vertices = offsets(paths, vertices.iter().map(|vertex| vertex.path));
        let mut ordered = vertices.clone();
        let mut cursor = first_vertices.clone();
        for vertex in vertices.drain(..) {
            let place = &mut cursor[vertex.path as usize];
            ordered[*place as usize] = vertex;
            *place += 1;
        }

        let mut heads = vec![false; ordered.len()];
        first_vertices[..paths].iter().for_each(|&first| heads[first as usize] = true);
        let list = |(vertex, &is_head): (&Vertex, &bool)| 2 * vertex.cluster + u32::from(!is_head);
        let held = ordered.iter().zip(&heads).filter(|(vertex, _)| vertex.cluster != NO_CLUSTER);
        let first_deposits = offsets(2 * base_clusters as usize, held.map(list));
        let total = first_deposits[2 * base_clusters as usize];
        let mut cursor = first_deposits.clone();
        let mut deposits = vec![Deposit { throughput: Vec3::ZERO, path: 0 }; total as usize + 1];
        let mut steps = Vec::with_capacity(ordered.len());
        let colours = ordered.iter().map(|vertex| vertex.colour).collect();
        let mut before: Option<Vertex> = None;
        let mut lost = 0;
        for (vertex, is_head) in ordered.into_iter().zip(heads) {
            let slot = if vertex.cluster == NO_CLUSTER {
                lost += 1;
                total
            } else {
                let place = &mut cursor[2 * vertex.cluster as usize + usize::from(!is_head)];
                *place += 1;
                *place - 1
            };
            deposits[slot as usize].path = vertex.path;
            let reflector = before.filter(|before| before.path == vertex.path);
            let material = reflector.map_or(HEAD, |before| surfaces[before.side as usize / 2].material);
            steps.push(PathStep { material, weight: vertex.weight, slot });
            before = Some(vertex);
        }
        Self { steps, colours, deposits, first_deposits, lost }
    }
}

/// Where each bin of a counting sort begins, and the end.
fn offsets(bins: usize, keys: impl Iterator<Item = u32>) -> Vec<u32> {
    let mut first = vec![0; bins + 1];
    for key in keys {
        first[key as usize + 1] += 1;
    }
    for bin in 0..bins {
        first[bin + 1] += first[bin];
    }
    first
}
