//! Near-field patches: clusters so close to a cache point that light varies within them, and the
//! point sees only a part. All rays of a point that meet one such cluster share a patch, whose
//! indirect light comes from the record beside their hits. In: gather rays, clusters, cache points.
//! Out: patches; gather rays that read a patch refer to it.

use super::near_clusters::{Patch, fits, record_reach};
use crate::cpu::hemisphere::{Strata, frame};
use crate::error::Result;
use crate::passes::frame::near_field::NearCluster;
use crate::passes::precompute::coverage::Placed;
use crate::passes::precompute::gather_rays::{GatherTargetPacking, Hemisphere, RayTable};
use crate::passes::precompute::reaches::Reaches;
use crate::scene::Material;
use crate::types::{GatherRay, NO_TARGET};
use glam::Vec3;
use rayon::prelude::*;

/// Maximum distance of the record of a patch, in units of the smallest validity radius.
const FARTHEST: f32 = 2.0;

/// Cache points in one chunk of a thread.
const CHUNK: usize = 64;

/// Inputs of the patches.
#[derive(Clone, Copy)]
pub struct Sources<'a> {
    /// Positions and orientations of the clusters of the finest levels.
    pub patches: &'a [Patch],
    /// As at load.
    pub materials: &'a [Material],
    /// Cache points; only the first ones get patches.
    pub points: &'a [Placed],
    /// Number of points with patches.
    pub near_count: u32,
    /// Lower clamp of their radii, metres.
    pub min_radius: f32,
    /// Distance from a cache point within which clusters are near, metres.
    pub reach: f32,
    /// Stratification of the gather rays.
    pub hemisphere: Hemisphere,
    /// Seed of the gather rays.
    pub seed: u32,
}

/// A ray that reads a patch.
#[derive(Clone, Copy)]
struct Reader {
    ray: u32,
    entry: u32,
    material: u32,
}

/// Near-field patches that gather rays read.
#[derive(Default)]
pub struct NearHits {
    /// Cluster, record and position of each patch; its target counts from the first patch.
    pub entries: Vec<NearCluster>,
    /// In the order of the cache points.
    readers: Vec<Reader>,
    rays_per_point: u32,
}

impl NearHits {
    /// Finds the patches, and takes their rays out of the table until [`Self::redirect`].
    ///
    /// # Errors
    /// The device failed.
    pub fn find(sources: Sources<'_>, table: &RayTable, packing: GatherTargetPacking) -> Result<Self> {
        let per_point = sources.hemisphere.rays() as usize;
        let mut found = Self { rays_per_point: sources.hemisphere.rays(), ..Self::default() };
        if sources.near_count == 0 || sources.min_radius <= 0.0 {
            return Ok(found);
        }
        let records = Records::new(sources.points, FARTHEST * sources.min_radius);
        table.revise(per_point as u32, |first, rays| {
            let points = first / per_point..(first + rays.len()) / per_point;
            let points = points.start..points.end.min(sources.near_count as usize).max(points.start);
            let near_rays = rays[..points.len() * per_point].par_chunks(CHUNK * per_point).enumerate();
            let parts = near_rays.map(|(chunk, rays)| {
                let mut part = Self::default();
                for (point, row) in (points.start + chunk * CHUNK..).zip(rays.chunks_exact(per_point)) {
                    part.add(&sources, &records, point as u32, row, packing);
                }
                part
            });
            let parts: Vec<_> = parts.collect();
            for part in parts {
                part.readers.iter().for_each(|reader| rays[reader.ray as usize - first].target = NO_TARGET);
                found.append(part);
            }
        })?;
        Ok(found)
    }

    /// Appends the patches of later cache points.
    fn append(&mut self, part: Self) {
        let before = self.entries.len() as u32;
        let moved = |entry: NearCluster| NearCluster { target: before + entry.target, ..entry };
        self.entries.extend(part.entries.into_iter().map(moved));
        let moved = |reader: Reader| Reader { entry: before + reader.entry, ..reader };
        self.readers.extend(part.readers.into_iter().map(moved));
    }

    /// Adds the patches of a cache point.
    fn add(
        &mut self,
        sources: &Sources<'_>,
        records: &Records<'_>,
        index: u32,
        row: &[GatherRay],
        packing: GatherTargetPacking,
    ) {
        let point = &sources.points[index as usize].point;
        let (frame, mask) = (frame(point.normal), (1 << packing.cluster_bits) - 1);
        let strata = Strata { rings: sources.hemisphere.rings, sectors: sources.hemisphere.sectors };
        let mut hits: Vec<(u32, u32, Vec3)> = Vec::new();
        for (ray, found) in (0..).zip(row.iter()).filter(|(_, found)| found.target != NO_TARGET) {
            let cluster = found.target & mask;
            let Some(patch) = sources.patches.get(cluster as usize) else { continue };
            let is_near = point.position.distance(patch.middle) < sources.reach;
            if !is_near || sources.materials[(found.target >> packing.cluster_bits) as usize].may_be_glossy()
            {
                continue;
            }
            // The hit of the ray on the cluster's plane, clamped to its box.
            let direction = (frame * strata.direction(ray, index, sources.seed)).as_vec3();
            let facing = direction.dot(patch.normal).min(-1e-3);
            let distance = (patch.middle - point.position).dot(patch.normal) / facing;
            let place = point.position + distance.clamp(0.0, 2.0 * sources.reach) * direction;
            hits.push((cluster, ray, place.clamp(patch.low, patch.high)));
        }
        hits.sort_unstable_by_key(|hit| (hit.0, hit.1));
        for range in hits.chunk_by(|a, b| a.0 == b.0) {
            let cluster = range[0].0;
            let middle = range.iter().map(|hit| hit.2).sum::<Vec3>() / range.len() as f32;
            let Some(record) = records.nearest(middle, &sources.patches[cluster as usize]) else { continue };
            let entry = self.entries.len() as u32;
            let offset = middle - sources.points[record as usize].point.position;
            self.entries.push(NearCluster { cluster, record, offset, target: entry });
            self.readers.extend(range.iter().map(|&(_, ray, _)| Reader {
                ray: index * strata.rays() + ray,
                entry,
                material: row[ray as usize].target >> packing.cluster_bits,
            }));
        }
    }

    /// Number of patches read by the rays before `ray` of the table. Call it before
    /// [`Self::redirect`], which clears the readers.
    pub fn count_before(&self, ray: u32) -> u32 {
        let end = self.readers.partition_point(|reader| reader.ray < ray);
        self.readers[..end].iter().map(|reader| reader.entry + 1).max().unwrap_or(0)
    }

    /// Number of gather rays that read patches.
    pub fn reader_count(&self) -> u64 {
        self.readers.len() as u64
    }

    /// Repacks the rays and redirects the removed rays to their patches, whose targets
    /// start at `taken`.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if all do not fit the word of a gather ray; the device failed.
    pub fn redirect(
        &mut self,
        table: &RayTable,
        packing: GatherTargetPacking,
        taken: u32,
        materials: usize,
    ) -> Result<GatherTargetPacking> {
        if self.entries.is_empty() {
            return Ok(packing);
        }
        let packed =
            GatherTargetPacking::new(taken + self.entries.len() as u32, materials, packing.min_distance)?;
        let mask = (1 << packing.cluster_bits) - 1;
        let mut readers = self.readers.as_slice();
        table.revise(self.rays_per_point, |first, rays| {
            for ray in rays.iter_mut().filter(|ray| ray.target != NO_TARGET) {
                ray.target = ray.target & mask | ray.target >> packing.cluster_bits << packed.cluster_bits;
            }
            // Readers are in the order of points, and chunks of the table end with points.
            let of_chunk = readers.partition_point(|reader| (reader.ray as usize) < first + rays.len());
            let (here, others) = readers.split_at(of_chunk);
            for reader in here {
                rays[reader.ray as usize - first].target =
                    (taken + reader.entry) | reader.material << packed.cluster_bits;
            }
            readers = others;
        })?;
        self.entries.iter_mut().for_each(|entry| entry.target += taken);
        self.readers = Vec::new();
        Ok(packed)
    }
}

/// Cache points by position.
struct Records<'a> {
    points: &'a [Placed],
    farthest: f32,
    map: Reaches,
}

impl<'a> Records<'a> {
    /// The records are used within `farthest` metres.
    fn new(points: &'a [Placed], farthest: f32) -> Self {
        let reach = |placed: &Placed| (placed.point.position, record_reach(&placed.point).min(farthest));
        let map = Reaches::from_points(&points.iter().map(reach).collect::<Vec<_>>());
        Self { points, farthest, map }
    }

    /// Returns the nearest record that may be used at that position on a cluster.
    fn nearest(&self, place: Vec3, patch: &Patch) -> Option<u32> {
        let mut best = (self.farthest, 0);
        self.map.any(place, |index| {
            let placed = &self.points[index as usize];
            let found = (placed.point.position.distance(place), index);
            if found < best && fits(placed, place, patch) {
                best = found;
            }
            false
        });
        (best.0 < self.farthest).then_some(best.1)
    }
}
