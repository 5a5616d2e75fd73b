//! Light paths from all entry points. [Yue §1] In: entry points. Out: path vertices.

use super::path_orders::{Vertex, WHITE};
use super::{Chunks, Progress, advance, begin_stage, each_part};
use crate::error::{Error, Result};
use crate::gpu::barrier::{COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, HostBlock, HostUpload, PassTiming, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::path_scan::PathStep;
use crate::passes::{ClusterBuffers, SceneBuffers, loop_limit};
use crate::scene::{CellSizes, Material};
use crate::types::{Contribution, Grid, LOOP_TRUNCATED, MAY_BE_GLOSSY, PathVertex, Reflectance};
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// State of a path between two dispatches.
    pub struct PathState {
        /// Its last vertex.
        pub position: Vec3,
        /// Of the last vertex: 2·triangle + (1 if the back side).
        pub side: u32,
        /// Product of f·cosθ/pdf so far, roulette included.
        pub throughput: Vec3,
        /// Unit direction of travel when it arrived; zero at an entry point.
        pub incoming: Vec3,
        /// Index of the path.
        pub path: u32,
        /// Its random stream index.
        pub stream: u32,
        /// Vertices so far.
        pub depth: u32,
        /// One while the path continues.
        pub is_alive: u32,
    }
}

impl PathState {
    /// The path with these indices at its entry point. Roulette ends a path of low weight early.
    pub fn at([path, stream]: [u32; 2], position: Vec3, side: u32, weight: f32) -> Self {
        let (throughput, incoming) = (Vec3::splat(weight), Vec3::ZERO);
        Self { position, side, throughput, incoming, path, stream, depth: 0, is_alive: 1 }
    }
}

gpu_struct! {
    pub struct LightPathsPush {
        pub grid: Grid,
        /// Paths in this dispatch.
        pub path_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[PathState::LAYOUT, LightPathsPush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "light_paths";

/// Maximum number of vertices that a dispatch adds to a path; longer paths continue in
/// the next dispatch.
const STEPS: u32 = 8;
/// Maximum number of paths of one dispatch: bounds the vertex buffer to 18 MiB.
const LIMIT: u32 = 1 << 16;
/// Maximum number of vertices of all paths: 16 GB of host memory.
const MAX_VERTICES: u64 = 1 << 28;
/// Throughput below which Russian roulette may end a path. Lower values trade vertices
/// for less noise.
pub const ROULETTE_THRESHOLD: f32 = 0.5;

/// Albedo of editable materials in the roulette. With the albedo at load, paths that matter after
/// an edit upwards would have ended early; with 1, paths among editable materials would never end.
pub const EDITABLE_ALBEDO: f32 = 0.9;

/// Maximum number of vertices of all paths: the device stores a contribution and a step for each,
/// and the host holds at most [`MAX_VERTICES`].
fn max_vertices(device_memory_bytes: u64) -> u64 {
    let on_device = device_memory_bytes / (size_of::<Contribution>() + size_of::<PathStep>()) as u64;
    on_device.min(MAX_VERTICES)
}

/// Traces the path of each entry point and returns the vertices of all paths: those of one path in
/// the order of the walk, the entry point first. Each entry point comes with its random stream
/// index; `materials` as on the device.
///
/// # Errors
/// [`Error::OutOfMemory`] if there are too many vertices, for example if nothing is absorbed and no
/// path ends; the device lacks memory or failed.
pub fn trace(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    clusters: &ClusterBuffers,
    (materials, cell_sizes): (&[Material], &CellSizes),
    (entry_points, streams): (&[PathVertex], &[u32]),
    seed: u32,
    progress: &mut dyn Progress,
) -> Result<Vec<Vertex>> {
    let mut vertices: Vec<Vertex> = Vec::with_capacity(entry_points.len() * 5);
    let mut live: Vec<PathState> = Vec::with_capacity(entry_points.len());
    for ((path, entry), &stream) in (0..).zip(entry_points).zip(streams) {
        vertices.push(Vertex::new(path, entry, WHITE));
        live.push(PathState::at([path, stream], entry.position, entry.side, entry.weight));
    }

    let is_glossy = materials.iter().any(Material::may_be_glossy);
    let walk = Walk::new(context, scene, clusters, entry_points.len() as u32, is_glossy, (cell_sizes, seed))?;
    let mut chunks = Chunks::new(1 << 12, LIMIT);
    begin_stage(progress, "light paths", live.len() as u64)?;
    let total = live.len() as u64;
    let most = max_vertices(context.limits().device_memory_bytes);
    while !live.is_empty() {
        if vertices.len() as u64 >= most {
            return Err(Error::OutOfMemory(format!(
                "{total} light paths have more than the {most} vertices that fit; lower quality.entry_points, or an albedo close to 1"
            )));
        }
        let mut survivors = Vec::new();
        chunks.run_batches(live.len() as u32, |first, parts| {
            let count = parts.last().map_or(0, |part| part.end);
            let states = &live[first as usize..(first + count) as usize];
            let timings = walk.round(scene, clusters, (states, parts), &mut vertices, &mut survivors)?;
            advance(
                progress,
                total - (live.len() as u64 - u64::from(first + count)) - survivors.len() as u64,
            )?;
            Ok(timings)
        })?;
        live = survivors;
    }
    Ok(vertices)
}

/// Traces one path again and returns its positions and sides, the entry point first. `materials` as
/// at the first trace, `state` before its first step. The bits equal those of the first trace.
///
/// # Errors
/// The device lacks memory or failed.
pub fn retrace(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    (clusters, cell_sizes): (&ClusterBuffers, &CellSizes),
    materials: &[Reflectance],
    state: PathState,
    seed: u32,
) -> Result<Vec<(Vec3, u32)>> {
    let is_glossy = materials.iter().any(|material| material.flags & MAY_BE_GLOSSY != 0);
    let mut walk = Walk::new(context, scene, clusters, 1, is_glossy, (cell_sizes, seed))?;
    walk.materials =
        Buffer::from_slice(context, GrowsWith::EntryPoints.named("materials of paths"), materials)?;
    let (mut found, mut live) = (Vec::new(), vec![state]);
    while !live.is_empty() {
        let mut survivors = Vec::new();
        walk.round(scene, clusters, (&live, std::slice::from_ref(&(0..1))), &mut found, &mut survivors)?;
        live = survivors;
    }
    let later = found.iter().map(|vertex| (vertex.position, vertex.side));
    Ok(std::iter::once((state.position, state.side)).chain(later).collect())
}

/// Device side of the walk.
struct Walk {
    context: Arc<Context>,
    pipeline: Pipeline,
    materials: Buffer,
    paths: Buffer,
    vertices: Buffer,
    counts: Buffer,
    colours: Buffer,
    states_from_host: HostUpload,
    states_to_host: HostBlock,
    vertices_to_host: HostBlock,
    counts_to_host: HostBlock,
    colours_to_host: HostBlock,
    grid: Grid,
    guides: Buffer,
    seed: u32,
}

impl Walk {
    fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        clusters: &ClusterBuffers,
        paths: u32,
        is_glossy: bool,
        (cell_sizes, seed): (&CellSizes, u32),
    ) -> Result<Self> {
        let limit = u64::from(paths.clamp(1, LIMIT));
        let constants = [
            ("STEPS", STEPS),
            ("ROULETTE_THRESHOLD", ROULETTE_THRESHOLD.to_bits()),
            ("EDITABLE_ALBEDO", EDITABLE_ALBEDO.to_bits()),
            ("IS_GLOSSY", u32::from(is_glossy)),
            scene.textures.constant(),
        ];
        let vertex_bytes = limit * u64::from(STEPS) * size_of::<PathVertex>() as u64;
        let paths = Buffer::storage(
            context,
            GrowsWith::EntryPoints.named("path states"),
            limit * size_of::<PathState>() as u64,
        )?;
        let vertices = Buffer::storage(context, GrowsWith::EntryPoints.named("path vertices"), vertex_bytes)?;
        let counts = Buffer::storage(context, GrowsWith::EntryPoints.named("vertex counts"), limit * 4)?;
        let colours = scene.textures.colours(
            context,
            GrowsWith::EntryPoints.named("vertex colours"),
            limit * u64::from(STEPS),
        )?;
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &constants)?,
            materials: scene.materials.followed(),
            states_from_host: HostUpload::of(context, "new path states on the host", &paths)?,
            states_to_host: HostBlock::of(context, "path states on the host", &paths)?,
            vertices_to_host: HostBlock::of(context, "path vertices on the host", &vertices)?,
            counts_to_host: HostBlock::of(context, "vertex counts on the host", &counts)?,
            colours_to_host: HostBlock::of(context, "vertex colours on the host", &colours)?,
            paths,
            vertices,
            counts,
            colours,
            grid: *clusters.grid,
            guides: Buffer::from_slice(context, "guides", &cell_sizes.guides())?,
            seed,
        })
    }

    /// Extends some paths with a dispatch for each of `parts`; appends their vertices to `found`,
    /// and the paths that continue to `survivors`. Returns the timings.
    fn round(
        &self,
        scene: &SceneBuffers,
        clusters: &ClusterBuffers,
        (states, parts): (&[PathState], &[Range<u32>]),
        found: &mut Vec<Vertex>,
        survivors: &mut Vec<PathState>,
    ) -> Result<Vec<PassTiming>> {
        self.states_from_host.write(states);
        let (count, vertex_count) = (states.len(), states.len() * STEPS as usize);
        let ((), timings) = self.context.run(|rec| {
            each_part(rec, parts, |rec, part| {
                let path_count = part.end - part.start;
                rec.copy_from_host::<PathState>(&self.states_from_host, part.clone(), &self.paths);
                rec.barrier(TRANSFER_TO_COMPUTE);
                rec.pass(STEM).dispatch(
                    &self.pipeline,
                    [path_count, 1, 1],
                    &LightPathsPush { grid: self.grid, path_count, seed: self.seed },
                    &scene.textures.after([
                        ("Nodes", &scene.nodes),
                        ("Triangles", &scene.triangles),
                        ("Surfaces", &scene.surfaces),
                        ("Materials", &self.materials),
                        ("Octree", &clusters.octree),
                        ("CellClusters", &clusters.cell_clusters),
                        ("Guides", &self.guides),
                        ("Paths", &self.paths),
                        ("Vertices", &self.vertices),
                        ("VertexCounts", &self.counts),
                        ("VertexColours", &self.colours),
                    ]),
                );
                rec.barrier(COMPUTE_TO_TRANSFER);
                let steps = STEPS * part.start..STEPS * part.end;
                rec.copy_elements_to_host::<PathState>(&self.paths, &self.states_to_host, part.clone());
                rec.copy_elements_to_host::<PathVertex>(
                    &self.vertices,
                    &self.vertices_to_host,
                    steps.clone(),
                );
                rec.copy_elements_to_host::<u32>(&self.counts, &self.counts_to_host, part);
                if scene.textures.are_used {
                    rec.copy_elements_to_host::<u32>(&self.colours, &self.colours_to_host, steps);
                }
            });
        })?;
        let counts: Vec<u32> = self.counts_to_host.read(count);
        loop_limit::refuse(counts.contains(&LOOP_TRUNCATED), STEM, 0)?;
        let vertices: Vec<PathVertex> = self.vertices_to_host.read(vertex_count);
        let colours: Vec<u32> = match scene.textures.are_used {
            true => self.colours_to_host.read(vertex_count),
            false => vec![WHITE; vertex_count],
        };
        let rows = vertices.chunks_exact(STEPS as usize).zip(colours.chunks_exact(STEPS as usize));
        for ((state, &count), (row, colours)) in states.iter().zip(&counts).zip(rows) {
            let row = row[..count as usize].iter().zip(colours);
            found.extend(row.map(|(vertex, &colour)| Vertex::new(state.path, vertex, colour)));
        }
        let after: Vec<PathState> = self.states_to_host.read(count);
        survivors.extend(after.into_iter().filter(|state| state.is_alive == 1));
        Ok(timings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_fit_the_device_and_the_host() {
        // Contributions and steps of one vertex; the host's 2^28.
        let each = (size_of::<Contribution>() + size_of::<PathStep>()) as u64;
        assert_eq!(max_vertices(1000 * each + each - 1), 1000);
        assert_eq!(max_vertices(u64::MAX), 1 << 28);
    }
}
