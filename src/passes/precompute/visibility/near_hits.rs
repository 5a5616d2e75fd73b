//! Near-field patches: clusters so close to a cache point that light varies within them, and the
//! point sees only a part. All rays of a point that meet one such cluster share a patch, whose
//! indirect light comes from the record beside their hits. In: gather rays, clusters, cache points.
//! Out: patches, and the gather rays that read each.

use super::near_clusters::{Patch, fits, record_reach};
use crate::cpu::hemisphere::{Strata, frame};
use crate::error::Result;
use crate::passes::frame::near_field::NearCluster;
use crate::passes::gather_targets::{GatherTarget, GatherTargetPacking, GatherTargets, Met, Reader};
use crate::passes::precompute::coverage::Placed;
use crate::passes::precompute::gather_rays::{Hemisphere, RayTable};
use crate::passes::precompute::reaches::Reaches;
use crate::scene::Material;
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
    /// Lower clamp of their radii where points are closest, metres.
    pub min_radius: f32,
    /// Distance from a cache point within which clusters are near, over its spacing, metres.
    pub reach: f32,
    /// Stratification of the gather rays.
    pub hemisphere: Hemisphere,
    /// Seed of the gather rays.
    pub seed: u32,
}

/// A near-field patch.
#[derive(Clone, Copy, Debug)]
pub struct NearPatch {
    /// Cluster that the patch belongs to.
    pub cluster: u32,
    /// Record beside it.
    pub record: u32,
    /// From the record to the middle of the patch, metres.
    pub offset: Vec3,
}

/// Near-field patches that gather rays read.
#[derive(Default)]
pub struct NearHits {
    /// The patches, in the order of the cache points that see them.
    pub patches: Vec<NearPatch>,
    /// The rays that read them, by ray.
    pub readers: Vec<Reader>,
}

impl NearHits {
    /// Finds the patches.
    ///
    /// # Errors
    /// The device failed.
    pub fn find(sources: Sources<'_>, table: &RayTable, targets: &GatherTargets) -> Result<Self> {
        let per_point = sources.hemisphere.rays() as usize;
        let mut found = Self::default();
        if sources.near_count == 0 || sources.min_radius <= 0.0 {
            return Ok(found);
        }
        let records = Records::new(sources.points, FARTHEST * sources.min_radius);
        table.scan(sources.near_count as usize * per_point, per_point as u32, |first, rays| {
            let parts = rays.par_chunks(CHUNK * per_point).enumerate().map(|(chunk, rays)| {
                let mut part = Self::default();
                let first_point = first / per_point + chunk * CHUNK;
                for (point, row) in (first_point..).zip(rays.chunks_exact(per_point)) {
                    let targets = targets.of_rays(point * per_point, row);
                    part.add(&sources, &records, point as u32, &targets);
                }
                part
            });
            let parts: Vec<_> = parts.collect();
            parts.into_iter().for_each(|part| found.append(part));
        })?;
        Ok(found)
    }

    /// Appends the patches of later cache points.
    fn append(&mut self, part: Self) {
        let before = self.patches.len() as u32;
        self.patches.extend(part.patches);
        let moved = |reader: Reader| Reader { index: before + reader.index, ..reader };
        self.readers.extend(part.readers.into_iter().map(moved));
    }

    /// Adds the patches of a cache point.
    fn add(
        &mut self,
        sources: &Sources<'_>,
        records: &Records<'_>,
        index: u32,
        row: &[Option<(GatherTarget, Met)>],
    ) {
        let Placed { point, spacing, .. } = &sources.points[index as usize];
        let reach = sources.reach * spacing;
        let frame = frame(point.normal);
        let strata = Strata { rings: sources.hemisphere.rings, sectors: sources.hemisphere.sectors };
        let mut hits: Vec<(u32, u32, Vec3)> = Vec::new();
        for (ray, target) in (0..).zip(row) {
            let &Some((GatherTarget::Cluster(cluster), met)) = target else { continue };
            let Some(patch) = sources.patches.get(cluster as usize) else { continue };
            let is_near = point.position.distance(patch.middle) < reach && !met.is_far;
            if !is_near || sources.materials[met.material as usize].may_be_glossy() {
                continue;
            }
            // The hit of the ray on the cluster's plane, clamped to its box.
            let direction = (frame * strata.direction(ray, point.stream, sources.seed)).as_vec3();
            let facing = direction.dot(patch.normal).min(-1e-3);
            let distance = (patch.middle - point.position).dot(patch.normal) / facing;
            let place = point.position + distance.clamp(0.0, 2.0 * reach) * direction;
            hits.push((cluster, ray, place.clamp(patch.low, patch.high)));
        }
        hits.sort_unstable_by_key(|hit| (hit.0, hit.1));
        for range in hits.chunk_by(|a, b| a.0 == b.0) {
            let cluster = range[0].0;
            let middle = range.iter().map(|hit| hit.2).sum::<Vec3>() / range.len() as f32;
            let Some(record) = records.nearest(middle, &sources.patches[cluster as usize]) else { continue };
            let patch = self.patches.len() as u32;
            let offset = middle - sources.points[record as usize].point.position;
            self.patches.push(NearPatch { cluster, record, offset });
            let reader =
                |&(_, ray, _): &(u32, u32, Vec3)| Reader { ray: index * strata.rays() + ray, index: patch };
            self.readers.extend(range.iter().map(reader));
        }
        let own = self.readers.partition_point(|reader| reader.ray < index * strata.rays());
        self.readers[own..].sort_unstable();
    }

    /// Number of patches that the first `points` cache points see.
    pub fn patches_of(&self, points: u32, hemisphere: Hemisphere) -> u32 {
        let end = self.readers.partition_point(|reader| reader.ray < points * hemisphere.rays());
        self.readers[..end].iter().map(|reader| reader.index + 1).max().unwrap_or(0)
    }
}

/// The patches as frames read them.
pub fn near_clusters(patches: &[NearPatch], packing: &GatherTargetPacking) -> Vec<NearCluster> {
    let near = |(patch, &NearPatch { cluster, record, offset }): (u32, &NearPatch)| NearCluster {
        cluster,
        record,
        offset,
        target: packing.number(GatherTarget::Patch(patch)),
    };
    (0..).zip(patches).map(near).collect()
}

/// Cache points by position.
struct Records<'a> {
    points: &'a [Placed],
    farthest: f32,
    map: Reaches,
}

impl<'a> Records<'a> {
    /// The records are used within `farthest` metres, over the spacing of points.
    fn new(points: &'a [Placed], farthest: f32) -> Self {
        let reach = |placed: &Placed| {
            (placed.point.position, record_reach(&placed.point).min(farthest * placed.spacing))
        };
        let map = Reaches::from_points(&points.iter().map(reach).collect::<Vec<_>>());
        Self { points, farthest, map }
    }

    /// Returns the nearest record that may be used at that position on a cluster.
    fn nearest(&self, place: Vec3, patch: &Patch) -> Option<u32> {
        let farthest = self.farthest * patch.scale;
        let mut best = (farthest, 0);
        self.map.any(place, |index| {
            let placed = &self.points[index as usize];
            let found = (placed.point.position.distance(place), index);
            if found < best && fits(placed, place, patch) {
                best = found;
            }
            false
        });
        (best.0 < farthest).then_some(best.1)
    }
}
