//! Gather rays as frames read them. Rays of one cache point that meet the same cluster and material
//! bring the same light: they become one *merged ray* with the sum of their weights. A cluster with
//! a material is a *gather target*; its radiance is computed once for all merged rays that read it.
//! If surfaces may be glossy, a merged ray keeps its mean direction. In: gather rays. Out: merged
//! rays, a list a cache point; targets.

use super::gather_rays::{Hemisphere, RayDirections, RayTable};
use super::gradient_packing::{MOVEMENT, ROTATION};
use crate::cpu::gather::{power_of_two, unpack};
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::passes::gather_targets::{GatherTargetPacking, GatherTargets};
use crate::types::{GatherRay, MOVEMENT_EXPONENT, MergedRay, NO_TARGET};
use glam::{DVec2, DVec3, Vec2, Vec2Swizzles};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

/// Maximum number of rays that the host reads at a time, unless a row has more.
const CHUNK_RAYS: usize = 1 << 20;

/// Rays that one task merges, unless a row has more.
const BLOCK_RAYS: usize = 1 << 11;

/// Rays of a cache point that meet the same target and colour, with the sums of their weights.
struct Run {
    /// Packed gather target.
    target: u32,
    /// Number of rays.
    rays: u32,
    /// Packed gradients of both kinds.
    change: u32,
    colour: u32,
    direction: u32,
}

/// Weights of the rays of a hemisphere.
struct Weights {
    /// Rotational gradients, in the unit.
    rotations: Vec<DVec2>,
    /// Unit of packed rotational gradients.
    rotation_unit: f32,
}

impl Weights {
    fn new(hemisphere: Hemisphere) -> Self {
        let rotations = rotations(hemisphere);
        // The largest rotational gradient: one merged ray of all rays of half a hemisphere.
        let most: f32 = rotations.iter().map(|rotation| rotation.x.max(0.0)).sum();
        let rotation_unit = most / ROTATION.largest() as f32;
        let in_units = |rotation: &Vec2| rotation.as_dvec2() / f64::from(rotation_unit);
        Self { rotations: rotations.iter().map(in_units).collect(), rotation_unit }
    }

    /// Adds the runs of one cache point to `found`, of `most` rays at most, ordered by target.
    /// `colours` of the rays, or empty; `direction` of a ray, if directions are kept.
    fn add_runs(
        &self,
        rays: &[GatherRay],
        colours: &[u32],
        direction: Option<&dyn Fn(usize) -> DVec3>,
        most: usize,
        found: &mut Vec<Run>,
    ) {
        let colour = |ray: u32| colours.get(ray as usize).copied().unwrap_or(0);
        let met = (0_u32..).zip(rays).filter(|(_, ray)| ray.target != NO_TARGET);
        let mut order: Vec<(u32, u32, u32)> =
            met.map(|(index, ray)| (ray.target, colour(index), index)).collect();
        order.sort_unstable();
        let movement_unit = power_of_two(-MOVEMENT_EXPONENT);
        let alike = order.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        found.extend(alike.flat_map(|run| run.chunks(most)).map(|run| {
            let (target, colour, _) = run[0];
            let indices = run.iter().map(|ray| ray.2 as usize);
            let movement: DVec2 = indices.clone().map(|ray| unpack(rays[ray].gradient) * movement_unit).sum();
            let rotation: DVec2 = indices.map(|ray| self.rotations[ray]).sum();
            let mean = |direction: &dyn Fn(usize) -> DVec3| {
                pack_direction(run.iter().map(|ray| direction(ray.2 as usize)).sum())
            };
            Run {
                target,
                rays: run.len() as u32,
                change: MOVEMENT.pack(movement) | ROTATION.pack(rotation) << MOVEMENT.bits(),
                colour,
                direction: direction.map_or(0, mean),
            }
        }));
    }
}

/// Common packing of all merged rays of a table.
pub struct MergedRayPacking {
    /// Distinct targets of gather rays, in ascending order.
    pub targets: Vec<u32>,
    /// Bits of a gather target's index in a merged ray.
    pub target_bits: u32,
    weights: Weights,
}

impl MergedRayPacking {
    /// The packing for rays of that hemisphere with these targets, in any order
    /// and with repetitions.
    pub fn new(mut targets: Vec<u32>, hemisphere: Hemisphere) -> Self {
        targets.par_sort_unstable();
        targets.dedup();
        let target_bits = target_bits(targets.len() as u64);
        Self { targets, target_bits, weights: Weights::new(hemisphere) }
    }

    /// Unit of packed rotational gradients.
    pub fn rotation_unit(&self) -> f32 {
        self.weights.rotation_unit
    }

    /// The merged rays of one cache point, ordered by gather target; `colours` of the rays, or
    /// empty; `direction` of a ray, if directions are kept.
    pub fn merged_rays(
        &self,
        rays: &[GatherRay],
        colours: &[u32],
        direction: Option<&dyn Fn(usize) -> DVec3>,
    ) -> Vec<Merged> {
        let mut runs = Vec::new();
        self.weights.add_runs(rays, colours, direction, max_rays(self.target_bits), &mut runs);
        let merged =
            |run: &Run| Merged { ray: self.merged_ray(run), colour: run.colour, direction: run.direction };
        runs.iter().map(merged).collect()
    }

    fn merged_ray(&self, run: &Run) -> MergedRay {
        let target_index = self.targets.partition_point(|&other| other < run.target) as u32;
        let count = (run.rays - 1).checked_shl(self.target_bits).unwrap_or(0);
        MergedRay { target_index: target_index | count, change: run.change }
    }
}

/// Bits of the index of one of `count` targets.
fn target_bits(count: u64) -> u32 {
    u64::BITS - count.saturating_sub(1).leading_zeros()
}

/// Maximum number of rays of a merged ray.
fn max_rays(target_bits: u32) -> usize {
    1 << u32::BITS.saturating_sub(target_bits)
}

/// A merged ray, with what only some scenes keep of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Merged {
    /// Target, number of rays, and gradients.
    pub ray: MergedRay,
    /// Packed colour of the image that its rays met.
    pub colour: u32,
    /// Packed mean direction of its rays.
    pub direction: u32,
}

/// Packs a direction of any length: octahedral, two signed 16-bit integers. `unpack_direction` of
/// `glsl/include/gloss_rays.glsl` reads it.
fn pack_direction(direction: DVec3) -> u32 {
    let d = direction / direction.abs().element_sum().max(f64::MIN_POSITIVE);
    let flat = d.truncate();
    let place = if d.z >= 0.0 { flat } else { (1.0 - flat.yx().abs()).copysign(flat) };
    let number = |value: f64| u32::from((value.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16);
    number(place.x) | number(place.y) << 16
}

/// Merged rays of consecutive cache points, in one binding each.
pub struct MergedRayChunk {
    /// The cache points.
    pub points: Range<u32>,
    /// CSR offsets of the merged rays of each point.
    pub merged_ray_offsets: Buffer,
    /// The [`MergedRay`]s of these points.
    pub merged_rays: Buffer,
    /// For each, the packed colour of the image that its rays met; one unused word in
    /// scenes without images.
    pub colours: Buffer,
    /// For each, its packed mean direction; one unused word if nothing may be glossy.
    pub directions: Buffer,
}

/// The merged rays of all cache points, in as many buffers as the device's bindings need.
pub struct MergedRays {
    /// Cache points of each buffer; the last may have fewer.
    pub records_per_chunk: u32,
    /// The buffers, in order.
    pub chunks: Vec<MergedRayChunk>,
    /// Cluster and material of each gather target, packed as in gather rays.
    pub targets: Buffer,
    /// Number of gather targets.
    pub target_count: u32,
    /// Bits of a gather target's index in a merged ray.
    pub target_bits: u32,
    /// Unit of packed rotational gradients.
    pub rotation_unit: f32,
    /// Whether there are images.
    pub has_colours: bool,
    /// Whether surfaces may be glossy, so that directions are kept.
    pub has_directions: bool,
    /// Total number of rays in all merged rays.
    pub ray_count: u64,
    /// Total number of merged rays.
    pub merged_ray_count: u64,
}

/// Maximum number of cache points of a binding if no rays merge.
fn max_rows(context: &Context, hemisphere: Hemisphere) -> u32 {
    let row_bytes = u64::from(hemisphere.rays()) * size_of::<MergedRay>() as u64;
    let limit = (context.limits().storage_range_bytes / row_bytes).max(1);
    limit.min(u64::from(u32::MAX)) as u32
}

/// Merged rays of all cache points as plain lists.
#[derive(Debug, Default, PartialEq)]
pub struct MergedRayLists {
    /// Distinct targets of gather rays, in ascending order.
    pub targets: Vec<u32>,
    /// Merged rays of each cache point.
    pub counts: Vec<u32>,
    /// [`MergedRay`]s of one cache point after the other.
    pub merged_rays: Vec<MergedRay>,
    /// For each, the packed colour of the image that its rays met; empty in scenes without images.
    pub colours: Vec<u32>,
    /// For each, its packed mean direction; empty if nothing may be glossy.
    pub directions: Vec<u32>,
}

impl MergedRays {
    fn empty(
        context: &Arc<Context>,
        packing: &MergedRayPacking,
        records_per_chunk: u32,
        [has_colours, has_directions]: [bool; 2],
    ) -> Result<Self> {
        Ok(Self {
            records_per_chunk,
            chunks: Vec::new(),
            targets: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("gather targets"),
                &packing.targets,
            )?,
            target_count: packing.targets.len() as u32,
            target_bits: packing.target_bits,
            rotation_unit: packing.rotation_unit(),
            has_colours,
            has_directions,
            ray_count: 0,
            merged_ray_count: 0,
        })
    }

    /// Uploads merged rays of [`Self::lists`], whose targets ascend.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn of_lists(context: &Arc<Context>, lists: &MergedRayLists, hemisphere: Hemisphere) -> Result<Self> {
        let MergedRayLists { targets, counts, merged_rays, colours, directions } = lists;
        let records_per_chunk = (counts.len().max(1) as u32).min(max_rows(context, hemisphere));
        let packing = MergedRayPacking::new(targets.clone(), hemisphere);
        let kept = [colours, directions].map(|list| !list.is_empty());
        let mut found = Self::empty(context, &packing, records_per_chunk, kept)?;
        let mut start = 0;
        for counts in counts.chunks(records_per_chunk as usize) {
            let end = start + counts.iter().map(|&count| count as usize).sum::<usize>();
            let part = |list: &'_ Vec<u32>| list.get(start..end).unwrap_or_default().to_vec();
            found.add(context, counts, &merged_rays[start..end], [part(colours), part(directions)])?;
            start = end;
        }
        Ok(found)
    }

    /// Reads all lists back, for the precompute cache.
    ///
    /// # Errors
    /// The device failed.
    pub fn lists(&self) -> Result<MergedRayLists> {
        let mut lists = MergedRayLists { targets: self.targets.read()?, ..MergedRayLists::default() };
        for chunk in &self.chunks {
            let first: Vec<u32> = chunk.merged_ray_offsets.read()?;
            lists.counts.extend(first.windows(2).map(|ends| ends[1] - ends[0]));
            lists.merged_rays.extend(chunk.merged_rays.read::<MergedRay>()?);
            if self.has_colours {
                lists.colours.extend(chunk.colours.read::<u32>()?);
            }
            if self.has_directions {
                lists.directions.extend(chunk.directions.read::<u32>()?);
            }
        }
        Ok(lists)
    }

    /// Merges the rays of a table by target, and frees the table buffer by buffer. Keeps
    /// `directions`, if there are any. Each ray is read once.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(
        context: &Arc<Context>,
        table: RayTable,
        (targets, packing): (&GatherTargets, &GatherTargetPacking),
        hemisphere: Hemisphere,
        directions: Option<&RayDirections<'_>>,
    ) -> Result<Self> {
        // A merged ray takes as many bytes as a gather ray.
        const { assert!(size_of::<MergedRay>() <= size_of::<GatherRay>()) };
        let records_per_chunk = table.rows_per_buffer;
        let (per_row, has_colours) = (hemisphere.rays() as usize, table.has_colours);
        let weights = Weights::new(hemisphere);
        // Which targets occur is known when all rays are read.
        let most = max_rays(target_bits(packing.max_targets()));
        let block_rays = (BLOCK_RAYS / per_row).max(1) * per_row;
        let chunk = (CHUNK_RAYS / block_rays).max(1) * block_rays;
        let mut chunks: Vec<Vec<Block>> = Vec::new();
        let mut first_ray = 0;
        for (rays, colours) in table.buffers.into_iter().zip(table.colours) {
            let count = rays.bytes() as usize / size_of::<GatherRay>();
            let mut blocks: Vec<Block> = Vec::new();
            for place in (0..count).step_by(chunk) {
                let length = chunk.min(count - place);
                let read: Vec<GatherRay> = rays.read_range(place, length)?;
                let image_colours: Vec<u32> =
                    if has_colours { colours.read_range(place, length)? } else { Vec::new() };
                let block = |(index, rays): (usize, &[GatherRay])| {
                    let start = index * block_rays;
                    let first_ray = first_ray + place + start;
                    let rays = targets.packed(packing, first_ray, rays);
                    let mut block = Block::default();
                    for (row, rays) in rays.chunks(per_row).enumerate() {
                        let colours = image_colours.get(start + row * per_row..).unwrap_or(&[]);
                        let direction = directions.map(|directions| {
                            move |ray: usize| -directions.back(first_ray + row * per_row + ray)
                        });
                        let direction =
                            direction.as_ref().map(|direction| direction as &dyn Fn(usize) -> DVec3);
                        block.add(|found| weights.add_runs(rays, colours, direction, most, found));
                    }
                    block.finish()
                };
                blocks.par_extend(read.par_chunks(block_rays).enumerate().map(block));
            }
            chunks.push(blocks);
            first_ray += count;
        }
        let occurring = chunks.iter().flatten().flat_map(|block| block.targets.iter().copied()).collect();
        let packing = MergedRayPacking::new(occurring, hemisphere);
        let kept = [has_colours, directions.is_some()];
        let mut found = Self::empty(context, &packing, records_per_chunk, kept)?;
        for blocks in chunks {
            found.add_blocks(context, &packing, &blocks)?;
        }
        Ok(found)
    }

    /// Uploads the next buffer from the runs of its points.
    fn add_blocks(
        &mut self,
        context: &Arc<Context>,
        packing: &MergedRayPacking,
        blocks: &[Block],
    ) -> Result<()> {
        let counts: Vec<u32> = blocks.iter().flat_map(|block| block.counts.iter().copied()).collect();
        let merged_ray = |block: &'_ Block| block.runs.iter().map(|run| packing.merged_ray(run)).collect();
        let merged_rays: Vec<Vec<MergedRay>> = blocks.par_iter().map(merged_ray).collect();
        let runs = || blocks.iter().flat_map(|block| &block.runs);
        let words = |is_kept: bool, word: fn(&Run) -> u32| -> Vec<u32> {
            runs().filter(|_| is_kept).map(word).collect()
        };
        let kept =
            [words(self.has_colours, |run| run.colour), words(self.has_directions, |run| run.direction)];
        self.add(context, &counts, &merged_rays.concat(), kept)
    }

    /// Uploads the next buffer: the number of merged rays of each point; the merged rays, with
    /// their colours and directions.
    fn add(
        &mut self,
        context: &Arc<Context>,
        counts: &[u32],
        merged_rays: &[MergedRay],
        [colours, directions]: [Vec<u32>; 2],
    ) -> Result<()> {
        let first_point = self.chunks.last().map_or(0, |chunk| chunk.points.end);
        let mut merged_ray_offsets = vec![0_u32];
        for count in counts {
            merged_ray_offsets.push(merged_ray_offsets[merged_ray_offsets.len() - 1] + count);
        }
        self.merged_ray_count += merged_rays.len() as u64;
        let rays = |merged_ray: &MergedRay| {
            u64::from(merged_ray.target_index.checked_shr(self.target_bits).unwrap_or(0)) + 1
        };
        self.ray_count += merged_rays.iter().map(rays).sum::<u64>();
        self.chunks.push(MergedRayChunk {
            points: first_point..first_point + counts.len() as u32,
            merged_ray_offsets: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("merged ray offsets"),
                &merged_ray_offsets,
            )?,
            merged_rays: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("merged rays"),
                merged_rays,
            )?,
            colours: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("merged ray colours"),
                if self.has_colours { &colours } else { &[0] },
            )?,
            directions: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("merged ray directions"),
                if self.has_directions { &directions } else { &[0] },
            )?,
        });
        Ok(())
    }

    /// Reads the merged rays of a cache point. Empty if there is no such point.
    ///
    /// # Errors
    /// The device failed.
    pub fn of_point(&self, point: u32) -> Result<Vec<MergedRay>> {
        let Some(chunk) = self.chunks.iter().find(|chunk| chunk.points.contains(&point)) else {
            return Ok(Vec::new());
        };
        let first = (point - chunk.points.start) as usize;
        let ends: Vec<u32> = chunk.merged_ray_offsets.read_range(first, 2)?;
        chunk.merged_rays.read_range(ends[0] as usize, (ends[1] - ends[0]) as usize)
    }

    /// The gather target that a merged ray reads.
    pub fn target_index_of(&self, merged_ray: &MergedRay) -> u32 {
        merged_ray.target_index & 1_u32.checked_shl(self.target_bits).map_or(u32::MAX, |end| end - 1)
    }

    /// Bytes of all buffers.
    pub fn bytes(&self) -> u64 {
        let of_chunk = |chunk: &MergedRayChunk| {
            let MergedRayChunk { merged_ray_offsets, merged_rays, colours, directions, .. } = chunk;
            [merged_ray_offsets, merged_rays, colours, directions].map(Buffer::bytes).iter().sum::<u64>()
        };
        self.chunks.iter().map(of_chunk).sum()
    }
}

/// Runs of consecutive cache points.
#[derive(Default)]
struct Block {
    runs: Vec<Run>,
    /// Number of runs of each point.
    counts: Vec<u32>,
    /// Distinct targets of the runs.
    targets: Vec<u32>,
}

impl Block {
    /// Adds the runs of the next cache point, which `add` appends.
    fn add(&mut self, add: impl FnOnce(&mut Vec<Run>)) {
        let before = self.runs.len();
        add(&mut self.runs);
        self.counts.push((self.runs.len() - before) as u32);
    }

    fn finish(mut self) -> Self {
        self.targets = self.runs.iter().map(|run| run.target).collect();
        self.targets.sort_unstable();
        self.targets.dedup();
        self
    }
}

/// Weight of each stratum's radiance in the rotational gradient, along tangent and bitangent:
/// turning the normal by dω changes a ray's cosine by dω·(n×ω), which is tanθ across its azimuth,
/// at the stratum's middle. [Krivanek]
fn rotations(hemisphere: Hemisphere) -> Vec<Vec2> {
    let rotation = |ray: u32| {
        let (ring, sector) = (ray / hemisphere.sectors, ray % hemisphere.sectors);
        let sin2 = (f64::from(ring) + 0.5) / f64::from(hemisphere.rings);
        let azimuth = TAU * (f64::from(sector) + 0.5) / f64::from(hemisphere.sectors);
        ((sin2 / (1.0 - sin2)).sqrt() * DVec2::new(-azimuth.sin(), azimuth.cos())).as_vec2()
    };
    (0..hemisphere.rays()).map(rotation).collect()
}
