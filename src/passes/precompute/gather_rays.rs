//! Gather rays of all cache points: the cluster that each reads, and its weight in the gradient.
//! [Yue §3, Figure 2] In: cache points, clusters. Out: gather rays, a row a cache point.

use super::kept::hits::{KeptHits, NO_ROW};
use super::{Chunks, Progress, advance, begin_stage};
use crate::cpu::hemisphere::{Strata, frame};
use crate::error::{Error, Result};
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::gather_targets::{GatherTarget, GatherTargetPacking};
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::scene::unweighted::NEARBY;
use crate::types::{CachePoint, GatherRay, Grid};
use glam::{DVec3, Vec3};
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    pub struct GatherRaysPush {
        pub grid: Grid,
        /// First cache point of the dispatch.
        pub first_point: u32,
        /// Its row in the bound buffer of the table.
        pub first_row: u32,
        /// Cache points in the dispatch.
        pub point_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
        /// Width of the number in `GatherRay::target`.
        pub cluster_bits: u32,
        /// Number of the target of the sky's first cell.
        pub first_sky: u32,
        /// Minimum sample count of a cluster.
        pub min_entry_points: f32,
        /// Bound of distances in gradients, and their unit, metres.
        pub min_distance: f32,
        /// What [`far_cells`] returns.
        pub far_cells: f32,
        /// Low corner of the models that can move, metres.
        pub movable_low: Vec3,
        /// Their high corner.
        pub movable_high: Vec3,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[GatherRaysPush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "gather_rays";

/// Minimum expected number of entry points of a cluster that a gather ray reads:
/// fewer cause fireflies.
pub const MIN_ENTRY_POINTS: f32 = 8.0;

/// Distance beyond which bright clusters are sampled apart: a stratum of the hemisphere is there
/// that many base cells wide.
const FAR: f32 = 2.0;
/// Distance beyond which bright clusters are sampled apart, in base cells at the hit. Less than
/// one gather ray meets such a cell. Nearer than [`NEARBY`], rays read unweighted clusters.
pub fn far_cells(hemisphere: Hemisphere) -> f32 {
    (FAR * (hemisphere.rays() as f32 / std::f32::consts::PI).sqrt()).max(NEARBY)
}

/// Maximum number of rays of an invocation, if the device allows workgroups that large. A ray needs
/// some hundreds of loop iterations ([`crate::gpu::MAX_LOOP_ITERATIONS`]).
const RAYS_OF_INVOCATION: u32 = 32;

/// Maximum number of rays that the host reads at a time, unless a row has more.
const CHUNK_RAYS: usize = 1 << 20;

/// The stratification of a gather hemisphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Hemisphere {
    /// Rings of equal cosine-weighted solid angle.
    pub rings: u32,
    /// Sectors of each ring.
    pub sectors: u32,
}

impl Hemisphere {
    /// The strata of `rays` = 4·k² rays: k rings of 4k sectors, about as long as they are wide.
    pub fn new(rays: u32) -> Self {
        let rings = (rays / 4).isqrt();
        Self { rings, sectors: 4 * rings }
    }

    /// Total number of rays.
    pub fn rays(&self) -> u32 {
        self.rings * self.sectors
    }

    /// The specialisation constants of shaders that use the strata.
    pub fn constants(&self) -> [(&'static str, u32); 2] {
        [("RINGS", self.rings), ("SECTORS", self.sectors)]
    }
}

/// Unit directions of the rays of a table.
#[derive(Clone, Copy)]
pub struct RayDirections<'a> {
    points: &'a [CachePoint],
    strata: Strata,
    seed: u32,
}

impl<'a> RayDirections<'a> {
    /// Directions of the rays that start at these points and were traced with that seed.
    pub fn new(points: &'a [CachePoint], hemisphere: Hemisphere, seed: u32) -> Self {
        Self { points, strata: Strata { rings: hemisphere.rings, sectors: hemisphere.sectors }, seed }
    }

    /// The direction back along a ray.
    pub fn back(&self, ray: usize) -> DVec3 {
        let (point, ray) = (ray as u32 / self.strata.rays(), ray as u32 % self.strata.rays());
        let CachePoint { normal, stream, .. } = self.points[point as usize];
        -(frame(normal) * self.strata.direction(ray, stream, self.seed))
    }
}

/// `GatherRay`s, a row a cache point, in as many buffers as the device's bindings need.
pub struct RayTable {
    /// Rows of each buffer; the last may have fewer.
    pub rows_per_buffer: u32,
    /// Buffers of the table, in order.
    pub buffers: Vec<Buffer>,
    /// For each buffer, the packed colours of images at the hits; one unused word in
    /// scenes without images.
    pub colours: Vec<Buffer>,
    /// Whether there are images.
    pub has_colours: bool,
}

impl RayTable {
    fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        point_count: u32,
        hemisphere: Hemisphere,
    ) -> Result<Self> {
        let row_bytes = u64::from(hemisphere.rays()) * size_of::<GatherRay>() as u64;
        let limit = (context.limits().storage_range_bytes / row_bytes).max(1);
        let rows_per_buffer = limit.min(u64::from(point_count.max(1))) as u32;
        let rows = Self::split(rows_per_buffer, point_count);
        let buffers = rows.map(|(_, rows)| {
            Buffer::storage(context, GrowsWith::GatherRays.named("gather rays"), u64::from(rows) * row_bytes)
        });
        let rays_of = |rows: u32| u64::from(rows) * u64::from(hemisphere.rays());
        let colours = Self::split(rows_per_buffer, point_count).map(|(_, rows)| {
            scene.textures.colours(context, GrowsWith::GatherRays.named("ray colours"), rays_of(rows))
        });
        Ok(Self {
            rows_per_buffer,
            buffers: buffers.collect::<Result<_>>()?,
            colours: colours.collect::<Result<_>>()?,
            has_colours: scene.textures.are_used,
        })
    }

    /// First row and number of rows of each buffer.
    fn split(rows_per_buffer: u32, point_count: u32) -> impl Iterator<Item = (u32, u32)> {
        let starts = (0..point_count).step_by(rows_per_buffer as usize);
        starts.map(move |first| (first, rows_per_buffer.min(point_count - first)))
    }

    /// First point, number of points, rays and colours of each buffer of the table.
    pub fn buffers(&self, point_count: u32) -> impl Iterator<Item = (u32, u32, [&Buffer; 2])> {
        Self::split(self.rows_per_buffer, point_count)
            .zip(self.buffers.iter().zip(&self.colours))
            .map(|((first, rows), (rays, colours))| (first, rows, [rays, colours]))
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        self.buffers.iter().chain(&self.colours).map(Buffer::bytes).sum()
    }

    /// Calls `look` for the first `count` rays in order, with the index of the first, a few rows of
    /// `row` rays at a time: the whole table may be large.
    ///
    /// # Errors
    /// The device failed.
    pub fn scan(&self, count: usize, row: u32, mut look: impl FnMut(usize, &[GatherRay])) -> Result<()> {
        let chunk = (CHUNK_RAYS / row as usize).max(1) * row as usize;
        let mut before = 0;
        for buffer in &self.buffers {
            let held = buffer.bytes() as usize / size_of::<GatherRay>();
            let wanted = held.min(count.saturating_sub(before));
            for place in (0..wanted).step_by(chunk) {
                let rays: Vec<GatherRay> = buffer.read_range(place, chunk.min(wanted - place))?;
                look(before + place, &rays);
            }
            before += held;
        }
        Ok(())
    }

    /// Reads all rows.
    ///
    /// # Errors
    /// The device failed.
    pub fn read(&self) -> Result<Vec<GatherRay>> {
        Ok(self.buffers.iter().map(Buffer::read).collect::<Result<Vec<_>>>()?.concat())
    }
}

/// Invocations that share a hemisphere.
///
/// # Errors
/// [`Error::OutOfMemory`] if its rays' distances exceed the shared memory.
fn group_size(context: &Context, hemisphere: Hemisphere) -> Result<u32> {
    let (rays, limits) = (hemisphere.rays(), context.limits());
    let bytes = rays * size_of::<f32>() as u32;
    if bytes > limits.shared_bytes {
        let has = limits.shared_bytes;
        return Err(Error::OutOfMemory(format!(
            "{rays} gather rays need {bytes} bytes of shared memory, the device has {has}; lower quality.gather_rays"
        )));
    }
    let wanted = rays.div_ceil(RAYS_OF_INVOCATION).next_power_of_two();
    let most = limits.workgroup_invocations.min(limits.workgroup_size[0]);
    Ok(wanted.min(most).max(context.tuning().waiting_group))
}

/// Traces the hemispheres of all cache points.
///
/// # Errors
/// The device lacks memory or failed, or the rays exceed the shared memory of a workgroup.
#[expect(clippy::too_many_arguments, reason = "one call, at one place")]
pub fn trace(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    clusters: &ClusterBuffers,
    cache_points: &Buffer,
    point_count: u32,
    hemisphere: Hemisphere,
    packing: GatherTargetPacking,
    seed: u32,
    progress: &mut dyn Progress,
) -> Result<RayTable> {
    let tracer = GatherTracer { context, scene, clusters, hemisphere, packing, seed };
    Ok(tracer.trace((cache_points, &Rows::none(point_count)), progress)?.0)
}

/// Rows of the hits of cache points on surface that cannot move.
pub struct Rows<'a> {
    hits: Option<&'a Buffer>,
    of_points: Vec<u32>,
}

impl<'a> Rows<'a> {
    /// No hits are kept.
    pub fn none(point_count: u32) -> Self {
        Self { hits: None, of_points: vec![NO_ROW; point_count as usize] }
    }

    /// The rows of points that [`KeptHits::assign`] returned.
    pub fn new(hits: &'a KeptHits, of_points: Vec<u32>) -> Self {
        Self { hits: Some(&hits.buffer), of_points }
    }
}

/// Rays that were traced for gather rays.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
pub struct TracedRays {
    /// Among surface that cannot move.
    pub fixed: u32,
    /// Among models that can move.
    pub movable: u32,
}

/// What gather rays are traced with.
pub struct GatherTracer<'a> {
    /// Where rays are traced.
    pub context: &'a Arc<Context>,
    /// The scene that they meet.
    pub scene: &'a SceneBuffers,
    /// The clusters of its light paths.
    pub clusters: &'a ClusterBuffers,
    /// Strata of each cache point.
    pub hemisphere: Hemisphere,
    /// How targets are packed.
    pub packing: GatherTargetPacking,
    /// Seed of all decisions.
    pub seed: u32,
}

impl GatherTracer<'_> {
    /// A table for the rays of that many cache points.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn table(&self, point_count: u32) -> Result<RayTable> {
        RayTable::new(self.context, self.scene, point_count, self.hemisphere)
    }

    /// As [`trace`], with the hits of earlier rays. Rows without hits get those of these rays.
    ///
    /// # Errors
    /// As of [`trace`].
    pub fn trace(
        &self,
        (cache_points, rows): (&Buffer, &Rows<'_>),
        progress: &mut dyn Progress,
    ) -> Result<(RayTable, TracedRays)> {
        let point_count = rows.of_points.len() as u32;
        let table = self.table(point_count)?;
        begin_stage(progress, "gather rays", u64::from(point_count))?;
        let traced = self.rows(&table, (cache_points, rows), 0..point_count, progress)?;
        Ok((table, traced))
    }

    /// Traces the hemispheres of these cache points into their rows of a table for all of them.
    ///
    /// # Errors
    /// As of [`trace`].
    pub fn rows(
        &self,
        table: &RayTable,
        (cache_points, rows): (&Buffer, &Rows<'_>),
        points: Range<u32>,
        progress: &mut dyn Progress,
    ) -> Result<TracedRays> {
        let &Self { context, scene, clusters, hemisphere, packing, seed } = self;
        let point_count = rows.of_points.len() as u32;
        let [rings, sectors] = hemisphere.constants();
        let invocations = ("local_size_x", group_size(context, hemisphere)?);
        let constants = [
            rings,
            sectors,
            invocations,
            ("SKY_SIDE", packing.sky_side()),
            ("HAS_MOVABLE", u32::from(scene.movable.is_some())),
            scene.textures.constant(),
        ];
        let pipeline = Pipeline::new(context, STEM, &constants)?;
        let [movable_low, movable_high] = scene.movable.map_or([Vec3::ZERO; 2], |movable| movable.bounds);
        let of_points = match &rows.of_points[..] {
            [] => &[NO_ROW],
            rows => rows,
        };
        let of_points = Buffer::from_slice(context, "rows of kept hits", of_points)?;
        let unused = Buffer::storage(context, "no kept hits", 4)?;
        let traced = Buffer::from_slice(context, "traced rays", &[0u32; 2])?;
        let mut chunks = Chunks::new(64, (points.end - points.start).max(1));
        for (first_point, rows_here, [rays, colours]) in table.buffers(point_count) {
            let start = points.start.max(first_point);
            let count = points.end.min(first_point + rows_here).saturating_sub(start);
            let before = start - first_point;
            chunks.run_batches(count, |first_row, parts| {
                let first_row = before + first_row;
                let push = |part: &Range<u32>| GatherRaysPush {
                    grid: *clusters.grid,
                    first_point: first_point + first_row + part.start,
                    first_row: first_row + part.start,
                    point_count: part.end - part.start,
                    seed,
                    cluster_bits: packing.cluster_bits,
                    first_sky: packing.number(GatherTarget::Sky(0)),
                    min_entry_points: MIN_ENTRY_POINTS,
                    min_distance: packing.min_distance,
                    far_cells: far_cells(hemisphere),
                    movable_low,
                    movable_high,
                };
                let ((), timings) = context.run(|rec| {
                    for part in parts {
                        rec.barrier(COMPUTE_TO_COMPUTE);
                        rec.pass(STEM).dispatch(
                            &pipeline,
                            [(part.end - part.start) * pipeline.local_size()[0], 1, 1],
                            &push(part),
                            &scene.textures.after([
                                ("Nodes", &scene.nodes),
                                ("Triangles", &scene.triangles),
                                ("Surfaces", &scene.surfaces),
                                ("Octree", &clusters.octree),
                                ("CellClusters", &clusters.cell_clusters),
                                ("ClusterLinks", &clusters.links),
                                ("UnweightedClusters", &clusters.unweighted),
                                ("CachePoints", cache_points),
                                ("GatherRays", rays),
                                ("RayColours", colours),
                                ("TruncatedLoops", &scene.truncated_loops),
                                ("HitRows", &of_points),
                                ("KeptHits", rows.hits.unwrap_or(&unused)),
                                ("TracedRays", &traced),
                            ]),
                        );
                    }
                })?;
                let count = parts.last().map_or(0, |part| part.end);
                advance(progress, u64::from(first_point + first_row + count))?;
                Ok(timings)
            })?;
        }
        scene.refuse_truncated_loops(STEM, 0)?;
        let traced: Vec<u32> = traced.read()?;
        Ok(TracedRays { fixed: traced[0], movable: traced[1] })
    }
}
