//! What stands so close to a cache point that its cluster is too coarse: light varies within the cluster, and the point sees a part
//! of it. All rays of a point that meet one such cluster get an entry of their own, whose indirect light is that of the record
//! beside the place that they meet.
//! In: gather rays, clusters, cache points. Out: entries; gather rays that read one point to it.

use super::coverage::Placed;
use super::gather_rays::{GatherCode, Hemisphere, RayTable};
use super::near_clusters::{Patch, fits};
use crate::cpu::hemisphere::{Strata, frame};
use crate::error::Result;
use crate::passes::frame::near_field::NearCluster;
use crate::scene::Material;
use crate::types::{GatherRay, NO_TARGET};
use glam::{IVec3, Vec3};
use std::collections::HashMap;

/// Cells that records are looked up in, in units of the smallest validity radius.
const CELL: f32 = 2.0;

/// What entries are made from.
#[derive(Clone, Copy)]
pub struct Sources<'a> {
    /// Where the clusters of the finest levels are, and how they face.
    pub patches: &'a [Patch],
    /// As at load.
    pub materials: &'a [Material],
    /// Cache points; the first `near_count` of them see what is near.
    pub points: &'a [Placed],
    /// See `points`.
    pub near_count: u32,
    /// Lower clamp of their radii, metres.
    pub least_radius: f32,
    /// How far from a cache point clusters are near, metres.
    pub reach: f32,
    /// How gather rays are stratified, and the seed that they were traced with.
    pub hemisphere: Hemisphere,
    /// See `hemisphere`.
    pub seed: u32,
}

/// A ray that reads an entry.
#[derive(Clone, Copy)]
struct Reader {
    ray: u32,
    entry: u32,
    material: u32,
}

/// The entries.
#[derive(Default)]
pub struct NearHits {
    /// Cluster, record and place of each; its target counts from the first entry.
    pub entries: Vec<NearCluster>,
    readers: Vec<Reader>,
}

impl NearHits {
    /// Finds them, and takes their rays out of the table until [`Self::redirect`].
    ///
    /// # Errors
    /// The device failed.
    pub fn find(sources: Sources<'_>, table: &RayTable, code: GatherCode) -> Result<Self> {
        let mut found = Self::default();
        if sources.near_count == 0 || sources.least_radius <= 0.0 {
            return Ok(found);
        }
        let mut rows = table.read()?;
        let records = Records::new(sources.points, CELL * sources.least_radius);
        let strata = Strata { rings: sources.hemisphere.rings, sectors: sources.hemisphere.sectors };
        let per_point = strata.rays() as usize;
        for (index, row) in (0..sources.near_count).zip(rows.chunks_exact_mut(per_point)) {
            found.add(&sources, &records, strata, index, row, code);
        }
        if !found.readers.is_empty() {
            table.write(&rows)?;
        }
        Ok(found)
    }

    /// The entries of a cache point.
    fn add(
        &mut self,
        sources: &Sources<'_>,
        records: &Records<'_>,
        strata: Strata,
        index: u32,
        row: &mut [GatherRay],
        code: GatherCode,
    ) {
        let point = &sources.points[index as usize].point;
        let (frame, mask) = (frame(point.normal), (1 << code.cluster_bits) - 1);
        let mut hits: Vec<(u32, u32, Vec3)> = Vec::new();
        for (ray, found) in (0..).zip(row.iter()).filter(|(_, found)| found.target != NO_TARGET) {
            let cluster = found.target & mask;
            let Some(patch) = sources.patches.get(cluster as usize) else { continue };
            let is_near = point.position.distance(patch.middle) < sources.reach;
            if !is_near || sources.materials[(found.target >> code.cluster_bits) as usize].may_shine() {
                continue;
            }
            // Where the ray meets the cluster's plane, not outside its cell.
            let direction = (frame * strata.direction(ray, index, sources.seed)).as_vec3();
            let facing = direction.dot(patch.normal).min(-1e-3);
            let distance = (patch.middle - point.position).dot(patch.normal) / facing;
            let place = point.position + distance.clamp(0.0, 2.0 * sources.reach) * direction;
            hits.push((cluster, ray, place.clamp(patch.low, patch.high)));
        }
        hits.sort_by_key(|hit| (hit.0, hit.1));
        for run in hits.chunk_by(|a, b| a.0 == b.0) {
            let cluster = run[0].0;
            let middle = run.iter().map(|hit| hit.2).sum::<Vec3>() / run.len() as f32;
            let Some(record) = records.nearest(middle, &sources.patches[cluster as usize]) else { continue };
            let entry = self.entries.len() as u32;
            let offset = middle - sources.points[record as usize].point.position;
            self.entries.push(NearCluster { cluster, record, offset, target: entry });
            for &(_, ray, _) in run {
                let target = &mut row[ray as usize].target;
                let reader = Reader {
                    ray: index * strata.rays() + ray,
                    entry,
                    material: *target >> code.cluster_bits,
                };
                self.readers.push(reader);
                *target = NO_TARGET;
            }
        }
    }

    /// Entries that the rays before one of the table read. To be asked before [`Self::redirect`].
    pub fn count_before(&self, ray: u32) -> u32 {
        let end = self.readers.partition_point(|reader| reader.ray < ray);
        self.readers[..end].iter().map(|reader| reader.entry + 1).max().unwrap_or(0)
    }

    /// Gather rays that read entries.
    pub fn reader_count(&self) -> u64 {
        self.readers.len() as u64
    }

    /// Packs the rays anew and points those that were taken out to their entries, which stand behind `taken` targets.
    ///
    /// # Errors
    /// [`crate::Error::OutOfMemory`] if all do not fit the word of a gather ray; the device failed.
    pub fn redirect(
        &mut self,
        table: &RayTable,
        code: GatherCode,
        taken: u32,
        materials: usize,
    ) -> Result<GatherCode> {
        if self.entries.is_empty() {
            return Ok(code);
        }
        let packed = GatherCode::new(taken + self.entries.len() as u32, materials, code.least_distance)?;
        let mut rows = table.read()?;
        let mask = (1 << code.cluster_bits) - 1;
        for row in rows.iter_mut().filter(|row| row.target != NO_TARGET) {
            row.target = row.target & mask | row.target >> code.cluster_bits << packed.cluster_bits;
        }
        for reader in &self.readers {
            rows[reader.ray as usize].target =
                (taken + reader.entry) | reader.material << packed.cluster_bits;
        }
        table.write(&rows)?;
        self.entries.iter_mut().for_each(|entry| entry.target += taken);
        self.readers = Vec::new();
        Ok(packed)
    }
}

/// Cache points by position.
struct Records<'a> {
    points: &'a [Placed],
    cell: f32,
    cells: HashMap<IVec3, Vec<u32>>,
}

impl<'a> Records<'a> {
    fn new(points: &'a [Placed], cell: f32) -> Self {
        let mut records = Self { points, cell, cells: HashMap::new() };
        for (index, placed) in points.iter().enumerate() {
            let cell = records.cell_of(placed.point.position);
            records.cells.entry(cell).or_default().push(index as u32);
        }
        records
    }

    fn cell_of(&self, position: Vec3) -> IVec3 {
        (position / self.cell).floor().as_ivec3()
    }

    /// The nearest record within a cell's width that speaks for that place on a cluster.
    fn nearest(&self, place: Vec3, patch: &Patch) -> Option<u32> {
        let centre = self.cell_of(place);
        let mut best = (self.cell, None);
        for offset in 0..27 {
            let step = IVec3::new(offset % 3, offset / 3 % 3, offset / 9) - 1;
            for &index in self.cells.get(&(centre + step)).into_iter().flatten() {
                let placed = &self.points[index as usize];
                let distance = placed.point.position.distance(place);
                if distance < best.0 && fits(placed, place, patch) {
                    best = (distance, Some(index));
                }
            }
        }
        best.1
    }
}
