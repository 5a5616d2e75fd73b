//! Light paths from all entry points. [Yue §1]
//! In: entry points. Out: steps in path order and deposits in cluster order.

use super::{Chunks, Progress};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::path_scan::{FROM_ENTRY, HEAD, PathStep};
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::scene::Material;
use crate::types::{Deposit, Grid, NO_CLUSTER, PathVertex, Surface};
use glam::Vec3;
use std::ops::Range;
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
        /// Unit direction of travel when it arrived; zero at an entry point.
        pub incoming: Vec3,
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

/// What roulette takes editable materials to reflect: were it what they reflect at load, the paths that matter after an edit
/// upwards would have ended early; were it all, paths among editable materials would never end.
pub const EDITABLE_ALBEDO: f32 = 0.9;

/// Where on its path a vertex was found, and what becomes of it.
#[derive(Clone, Copy)]
struct Vertex {
    path: u32,
    side: u32,
    weight: f32,
    cluster: u32,
    incoming: Vec3,
    lobe: f32,
}

impl Vertex {
    fn new(path: u32, vertex: &PathVertex) -> Self {
        let PathVertex { side, weight, cluster, incoming, lobe, .. } = *vertex;
        Self { path, side, weight, cluster, incoming, lobe }
    }
}

/// What is known of the vertices where a material may shine.
#[derive(Default)]
pub struct Arrivals {
    /// Of each step: 1 − cosα off the mirror direction at the vertex before.
    pub lobes: Vec<f32>,
    /// Of each deposit: unit direction of travel when the path arrived; zero at entry points.
    pub incoming: Vec<Vec3>,
    /// Of each deposit: 2·triangle + (1 if the back side).
    pub sides: Vec<u32>,
    /// Of each path: unit direction in which it left its entry point; zero if it ended there.
    pub departures: Vec<Vec3>,
}

/// Paths that stand together because the same editable materials reflect them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathGroup {
    /// A bit for each editable material, by [`editable_bits`].
    pub materials: u32,
    /// Their steps.
    pub steps: Range<u32>,
}

/// The bit of each material that is editable, in order; the last bit stands for all that find no other. Zero for the others.
pub fn editable_bits(materials: &[Material]) -> Vec<u32> {
    let mut editable = 0;
    let bit = |material: &Material| {
        if !material.editable {
            return 0;
        }
        editable += 1;
        1 << (editable - 1).min(31)
    };
    materials.iter().map(bit).collect()
}

/// All light paths, in the two orders that a frame needs.
pub struct LightPaths {
    /// Every vertex in path order: how its energy follows from the vertex before.
    pub steps: Vec<PathStep>,
    /// Every vertex in the order of base clusters; throughputs are the scan's to fill in. One more, which nobody reads,
    /// takes vertices that no cluster holds.
    pub deposits: Vec<Deposit>,
    /// First deposit of each base cluster by an entry point, then its first by another vertex, and the end.
    pub first_deposits: Vec<u32>,
    /// Where some materials are editable: the paths by which of them reflect them, entry points aside.
    pub groups: Vec<PathGroup>,
    /// Empty where nothing shines.
    pub arrivals: Arrivals,
    /// Vertices that no cluster holds: zero unless the binning is broken.
    pub lost: u64,
}

/// Traces all paths. Where some materials are editable, entry points and their paths are put in an order in which those that the same
/// of them reflect stand together. `surfaces` in BVH order, `materials` as on the device; `base_clusters` counts the clusters of the base level.
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
    materials: &[Material],
    base_clusters: u32,
    entry_points: &mut [PathVertex],
    seed: u32,
    progress: &mut dyn Progress,
) -> Result<LightPaths> {
    let mut vertices: Vec<Vertex> = Vec::with_capacity(entry_points.len() * 5);
    let mut live: Vec<PathState> = Vec::with_capacity(entry_points.len());
    for (path, entry) in entry_points.iter().enumerate() {
        let path = path as u32;
        vertices.push(Vertex::new(path, entry));
        live.push(PathState {
            position: entry.position,
            side: entry.side,
            // A path that carries little ends early.
            throughput: Vec3::splat(entry.weight),
            incoming: Vec3::ZERO,
            path,
            depth: 0,
            is_alive: 1,
        });
    }

    let may_shine: Vec<bool> = materials.iter().map(Material::may_shine).collect();
    let shines = may_shine.contains(&true);
    let walk = Walk::new(context, clusters, entry_points.len() as u32, shines, seed)?;
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
    let bits = editable_bits(materials);
    let mut masks = Vec::new();
    if bits.iter().any(|&bit| bit != 0) {
        masks =
            group(&mut vertices, entry_points, |side| bits[surfaces[side as usize / 2].material as usize]);
    }
    let mut paths =
        LightPaths::from_vertices(vertices, surfaces, &may_shine, entry_points.len(), base_clusters);
    paths.group_steps(&masks);
    if !shines {
        paths.arrivals = Arrivals::default();
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
    grid: Grid,
    seed: u32,
}

impl Walk {
    fn new(
        context: &Arc<Context>,
        clusters: &ClusterBuffers,
        paths: u32,
        shines: bool,
        seed: u32,
    ) -> Result<Self> {
        let limit = u64::from(paths.clamp(1, LIMIT));
        let constants = [
            ("STEPS", STEPS),
            ("ROULETTE_THRESHOLD", ROULETTE_THRESHOLD.to_bits()),
            ("EDITABLE_ALBEDO", EDITABLE_ALBEDO.to_bits()),
            ("SHINES", u32::from(shines)),
        ];
        let vertex_bytes = limit * u64::from(STEPS) * size_of::<PathVertex>() as u64;
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &constants)?,
            paths: Buffer::storage(context, "path states", limit * size_of::<PathState>() as u64)?,
            vertices: Buffer::storage(context, "path vertices", vertex_bytes)?,
            counts: Buffer::storage(context, "vertex counts", limit * 4)?,
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
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("Materials", &scene.materials),
                    ("CellFirst", &clusters.cell_first),
                    ("CellClusters", &clusters.cell_clusters),
                    ("Paths", &self.paths),
                    ("Vertices", &self.vertices),
                    ("VertexCounts", &self.counts),
                ],
            );
        })?;
        let counts: Vec<u32> = self.counts.read_range(0, states.len())?;
        let vertices: Vec<PathVertex> = self.vertices.read_range(0, states.len() * STEPS as usize)?;
        for ((state, &count), row) in states.iter().zip(&counts).zip(vertices.chunks_exact(STEPS as usize)) {
            found.extend(row[..count as usize].iter().map(|vertex| Vertex::new(state.path, vertex)));
        }
        let after: Vec<PathState> = self.paths.read_range(0, states.len())?;
        survivors.extend(after.into_iter().filter(|state| state.is_alive == 1));
        Ok(timings[0].ms)
    }
}

/// Reorders entry points and numbers the paths anew, so that those that the same editable materials reflect stand together;
/// returns for each path which these are. Entry points do not count: their reflection is part of the path's flux.
fn group(vertices: &mut [Vertex], entry_points: &mut [PathVertex], bit: impl Fn(u32) -> u32) -> Vec<u32> {
    let mut masks = vec![0; entry_points.len()];
    let mut pending: Vec<Option<u32>> = vec![None; entry_points.len()];
    for vertex in &*vertices {
        // A vertex reflects what reaches the next one, if there is one.
        let path = vertex.path as usize;
        if let Some(reflector) = pending[path] {
            masks[path] |= reflector;
        }
        let is_entry = vertex.incoming == Vec3::ZERO;
        pending[path] = Some(if is_entry { 0 } else { bit(vertex.side) });
    }
    let mut order: Vec<u32> = (0..entry_points.len() as u32).collect();
    order.sort_by_key(|&path| masks[path as usize]);
    let mut places = vec![0; order.len()];
    for (place, &path) in (0..).zip(&order) {
        places[path as usize] = place;
    }
    vertices.iter_mut().for_each(|vertex| vertex.path = places[vertex.path as usize]);
    let sorted: Vec<PathVertex> = order.iter().map(|&path| entry_points[path as usize]).collect();
    entry_points.copy_from_slice(&sorted);
    order.iter().map(|&path| masks[path as usize]).collect()
}

impl LightPaths {
    /// Notes where the paths of each mask stand; `masks` in path order, or none.
    fn group_steps(&mut self, masks: &[u32]) {
        let mut path = 0;
        for (index, step) in (0..).zip(&self.steps) {
            if step.material == HEAD {
                path += 1;
            }
            let Some(&materials) = masks.get(path - 1) else { return };
            match self.groups.last_mut() {
                Some(group) if group.materials == materials => group.steps.end = index + 1,
                _ => self.groups.push(PathGroup { materials, steps: index..index + 1 }),
            }
        }
    }

    /// Orders vertices by path, and by cluster. Vertices of one path come in the order of the walk.
    fn from_vertices(
        mut vertices: Vec<Vertex>,
        surfaces: &[Surface],
        may_shine: &[bool],
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
        let mut arrivals = Arrivals {
            lobes: Vec::with_capacity(ordered.len()),
            incoming: vec![Vec3::ZERO; deposits.len()],
            sides: vec![0; deposits.len()],
            departures: vec![Vec3::ZERO; paths],
        };
        let mut before: Option<(Vertex, bool)> = None;
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
            arrivals.lobes.push(vertex.lobe);
            arrivals.incoming[slot as usize] = vertex.incoming;
            arrivals.sides[slot as usize] = vertex.side;
            let mut material = HEAD;
            if let Some((reflector, is_entry)) = before.filter(|(before, _)| before.path == vertex.path) {
                material = surfaces[reflector.side as usize / 2].material;
                if is_entry {
                    arrivals.departures[vertex.path as usize] = vertex.incoming;
                    material = if may_shine[material as usize] { FROM_ENTRY } else { material };
                }
            }
            steps.push(PathStep { material, weight: vertex.weight, slot });
            before = Some((vertex, is_head));
        }
        Self { steps, deposits, first_deposits, groups: Vec::new(), arrivals, lost }
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
