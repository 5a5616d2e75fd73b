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
use crate::types::{GatherRay, MOVEMENT_EXPONENT, MergedRay, NO_TARGET};
use glam::{DVec2, DVec3, Vec2, Vec2Swizzles};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;
use std::sync::Arc;

/// Maximum number of rays that the host reads at a time, unless a row has more.
const CHUNK_RAYS: usize = 1 << 20;

/// Rays in one chunk of the search for distinct targets.
const CHUNK: usize = 2048;

/// Common packing of all merged rays of a table.
pub struct MergedRayPacking {
    /// Distinct targets of gather rays, in ascending order.
    pub targets: Vec<u32>,
    /// Bits of a gather target's index in a merged ray.
    pub target_bits: u32,
    /// Maximum number of rays of a merged ray.
    max_rays: usize,
    rotations: Vec<Vec2>,
    /// Unit of packed rotational gradients.
    pub rotation_unit: f32,
}

impl MergedRayPacking {
    /// The packing for rays of that hemisphere with these targets, in any order
    /// and with repetitions.
    pub fn new(mut targets: Vec<u32>, hemisphere: Hemisphere) -> Self {
        targets.par_sort_unstable();
        targets.dedup();
        let target_bits = u32::BITS - (targets.len() as u32).saturating_sub(1).leading_zeros();
        let max_rays = 1_u64 << (u32::BITS - target_bits);
        let rotations = rotations(hemisphere);
        // The largest rotational gradient: one merged ray of all rays of half a hemisphere.
        let most: f32 = rotations.iter().map(|rotation| rotation.x.max(0.0)).sum();
        let rotation_unit = most / ROTATION.largest() as f32;
        Self { targets, target_bits, max_rays: max_rays as usize, rotations, rotation_unit }
    }

    /// The merged rays of one cache point, ordered by gather target; `colours` of the rays, or
    /// empty; `direction` of a ray, if directions are kept.
    pub fn merged_rays(
        &self,
        rays: &[GatherRay],
        colours: &[u32],
        direction: Option<&dyn Fn(usize) -> DVec3>,
    ) -> Vec<Merged> {
        let colour = |ray: u32| colours.get(ray as usize).copied().unwrap_or(0);
        let met = (0_u32..).zip(rays).filter(|(_, ray)| ray.target != NO_TARGET);
        let mut order: Vec<(u32, u32, u32)> =
            met.map(|(index, ray)| (ray.target, colour(index), index)).collect();
        order.sort_unstable();
        let alike = order.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
        let merged = |run: &[(u32, u32, u32)]| {
            let (target, colour, _) = run[0];
            let target_index = self.targets.partition_point(|&other| other < target) as u32;
            let sum = |fraction: &dyn Fn(usize) -> DVec2| {
                run.iter().map(|ray| fraction(ray.2 as usize)).sum::<DVec2>()
            };
            let count = (run.len() - 1) as u32;
            let movement = |ray: usize| unpack(rays[ray].gradient) * power_of_two(-MOVEMENT_EXPONENT);
            let rotation = |ray: usize| self.rotations[ray].as_dvec2() / f64::from(self.rotation_unit);
            let ray = MergedRay {
                target_index: target_index | count.checked_shl(self.target_bits).unwrap_or(0),
                change: MOVEMENT.pack(sum(&movement)) | ROTATION.pack(sum(&rotation)) << MOVEMENT.bits(),
            };
            let mean = |direction: &dyn Fn(usize) -> DVec3| {
                pack_direction(run.iter().map(|ray| direction(ray.2 as usize)).sum())
            };
            Merged { ray, colour, direction: direction.map_or(0, mean) }
        };
        alike.flat_map(|run| run.chunks(self.max_rays)).map(merged).collect()
    }
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

/// Number of cache points of a buffer, such that it fits a binding even if no rays merge.
pub fn records_per_chunk(context: &Context, table: &RayTable, hemisphere: Hemisphere) -> u32 {
    table.rows_per_buffer.min(max_rows(context, hemisphere))
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
            rotation_unit: packing.rotation_unit,
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

    /// Merges the rays of a packed table by target, and frees the table buffer by buffer. Keeps
    /// `directions`, if there are any.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(
        context: &Arc<Context>,
        table: RayTable,
        hemisphere: Hemisphere,
        directions: Option<&RayDirections<'_>>,
    ) -> Result<Self> {
        let records_per_chunk = records_per_chunk(context, &table, hemisphere);
        let (per_row, has_colours) = (hemisphere.rays() as usize, table.has_colours);
        let mut targets = Vec::new();
        table.scan(hemisphere.rays(), |_, rays| targets.extend(distinct(rays)))?;
        let packing = MergedRayPacking::new(targets, hemisphere);
        let mut found =
            Self::empty(context, &packing, records_per_chunk, [has_colours, directions.is_some()])?;
        let chunk = (CHUNK_RAYS / per_row).max(1) * per_row;
        let mut rows: Vec<Vec<Merged>> = Vec::new();
        let mut first_ray = 0;
        for (rays, colours) in table.buffers.into_iter().zip(table.colours) {
            let count = rays.bytes() as usize / size_of::<GatherRay>();
            for place in (0..count).step_by(chunk) {
                let length = chunk.min(count - place);
                let read: Vec<GatherRay> = rays.read_range(place, length)?;
                let image_colours: Vec<u32> =
                    if has_colours { colours.read_range(place, length)? } else { Vec::new() };
                let merged_rays = |row: usize| {
                    let own = row * per_row..(row + 1) * per_row;
                    let colours = image_colours.get(own.clone()).unwrap_or(&[]);
                    let direction = directions.map(|directions| {
                        move |ray: usize| -directions.back(first_ray + place + row * per_row + ray)
                    });
                    let direction = direction.as_ref().map(|direction| direction as &dyn Fn(usize) -> DVec3);
                    packing.merged_rays(&read[own], colours, direction)
                };
                rows.par_extend((0..length / per_row).into_par_iter().map(merged_rays));
                while rows.len() >= records_per_chunk as usize {
                    let rest = rows.split_off(records_per_chunk as usize);
                    found.add_rows(context, &std::mem::replace(&mut rows, rest))?;
                }
            }
            first_ray += count;
        }
        if !rows.is_empty() {
            found.add_rows(context, &rows)?;
        }
        Ok(found)
    }

    /// Uploads the next buffer from rows.
    fn add_rows(&mut self, context: &Arc<Context>, rows: &[Vec<Merged>]) -> Result<()> {
        let counts: Vec<u32> = rows.iter().map(|row| row.len() as u32).collect();
        let merged_rays: Vec<MergedRay> = rows.iter().flatten().map(|merged| merged.ray).collect();
        let words = |is_kept: bool, word: fn(&Merged) -> u32| -> Vec<u32> {
            rows.iter().filter(|_| is_kept).flatten().map(word).collect()
        };
        let kept = [
            words(self.has_colours, |merged| merged.colour),
            words(self.has_directions, |merged| merged.direction),
        ];
        self.add(context, &counts, &merged_rays, kept)
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

/// The targets of some rays, each once or a few times.
fn distinct(rays: &[GatherRay]) -> Vec<u32> {
    let distinct = rays.par_chunks(CHUNK).flat_map_iter(|rays| {
        let mut targets: Vec<u32> = rays.iter().map(|ray| ray.target).collect();
        targets.retain(|&target| target != NO_TARGET);
        targets.sort_unstable();
        targets.dedup();
        targets
    });
    distinct.collect()
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
