//! Small clusters at surfaces that are close together, and the cache point beside each.

use crate::passes::frame::near_field::NearCluster;
use crate::passes::precompute::coverage::Placed;
use crate::passes::precompute::reaches::Reaches;
use crate::scene::hvds::Hvds;
use crate::types::CachePoint;
use glam::Vec3;
use rayon::prelude::*;

/// Selection of the clusters that take their light from the records beside them.
#[derive(Clone, Copy, Debug)]
pub struct Extent {
    /// Levels of the hierarchy, from the finest, whose clusters are small enough.
    pub levels: usize,
    /// Clearance up to which surfaces count as close, in base cells.
    pub close: f32,
}

impl Extent {
    /// Regions where light varies below the resolution of path vertices.
    pub const CONTACTS: Self = Self { levels: 2, close: 3.0 };
    /// Also regions in shadow, where a few path vertices provide all the light.
    pub const SHADOWS: Self = Self { levels: 4, close: 12.0 };

    /// One past the last cluster of its levels.
    pub fn end(self, hvds: &Hvds) -> usize {
        end_of_levels(hvds, self.levels)
    }
}

/// One past the last cluster of the finest `levels` levels.
fn end_of_levels(hvds: &Hvds, levels: usize) -> usize {
    hvds.levels[levels.min(hvds.levels.len()) - 1].end as usize
}

/// Maximum distance of a record, in its validity radii.
const REACH: f32 = 1.5;
/// Height above or below the record, in clearances, from which a position counts as another
/// surface, if the slope to it is at least `SLOPE`.
const LEVEL_CLEARANCES: f32 = 0.5;
const SLOPE: f32 = 0.1;
/// Minimum cosine between its normal and the cluster's.
const LEAN: f32 = 0.8;

/// Position and orientation of a cluster of the finest levels.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// Mean position, metres.
    pub middle: Vec3,
    /// Mean normal, unit length.
    pub normal: Vec3,
    /// Lowest corner of the box around it, metres.
    pub low: Vec3,
    /// Highest corner of the box, metres.
    pub high: Vec3,
    /// Mean distance to the nearest surface that it sees, metres.
    pub clearance: f32,
    /// Whether it holds back sides.
    pub is_back: bool,
    /// Width of its base cells over the smallest ones'.
    pub scale: f32,
}

impl Patch {
    /// A patch without area; its box is empty.
    const EMPTY: Self = Self {
        middle: Vec3::ZERO,
        normal: Vec3::ZERO,
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
        clearance: f32::INFINITY,
        is_back: false,
        scale: 1.0,
    };
}

/// The clusters of the finest `levels` levels, in order; an unweighted cluster has the patch of its
/// cluster. `clearances` of the fragments, metres; `normal` of a side.
pub fn patches(hvds: &Hvds, clearances: &[f32], normal: impl Fn(u32) -> Vec3, levels: usize) -> Vec<Patch> {
    let end = end_of_levels(hvds, levels);
    let mut patches = vec![Patch { clearance: 0.0, ..Patch::EMPTY }; end];
    let mut areas = vec![0.0; end];
    for (fragment, &clearance) in hvds.fragments.iter().zip(clearances) {
        let (middle, scale) = (fragment.middle(), hvds.scale_of(fragment.cluster));
        let [low, high] = [Vec3::min, Vec3::max]
            .map(|bound| fragment.corners[1..].iter().fold(fragment.corners[0], |a, &b| bound(a, b)));
        let area = fragment.open_area_m2() as f32;
        for base in [fragment.cluster, hvds.unweighted[fragment.cluster as usize]] {
            let mut cluster = base as usize;
            while cluster < end {
                let patch = &mut patches[cluster];
                areas[cluster] += fragment.open_area_m2();
                patch.clearance += area * clearance;
                patch.middle += area * middle;
                patch.normal += area * normal(fragment.side);
                (patch.low, patch.high) = (patch.low.min(low), patch.high.max(high));
                patch.is_back = fragment.side % 2 == 1;
                patch.scale = patch.scale.max(scale);
                cluster = hvds.parents[cluster] as usize;
            }
        }
    }
    let mean = |(patch, area): (Patch, f64)| match area > 0.0 {
        true => Patch {
            middle: patch.middle / area as f32,
            normal: patch.normal.normalize_or_zero(),
            clearance: patch.clearance / area as f32,
            ..patch
        },
        false => Patch::EMPTY,
    };
    patches.into_iter().zip(areas).map(mean).collect()
}

/// Distance within which a record is used, metres.
pub(super) fn record_reach(point: &CachePoint) -> f32 {
    REACH * point.radius
}

/// Whether a record may be used at a position on a cluster: not if either lies behind the surface
/// that the other sees.
pub(super) fn fits(placed: &Placed, place: Vec3, patch: &Patch) -> bool {
    let point = &placed.point;
    let apart = place - point.position;
    let height = apart.dot(point.normal);
    let clearance = if height > 0.0 { placed.clearance } else { patch.clearance };
    if height.abs() > LEVEL_CLEARANCES * clearance && height.abs() > SLOPE * apart.length() {
        return false;
    }
    (point.side % 2 == 1) == patch.is_back
        && apart.length() <= record_reach(point)
        && point.normal.dot(patch.normal) >= LEAN
        && apart.dot(point.occluder) <= 1.0
}

/// Finds the near clusters of the extent's levels. `cell_size`: width of the
/// smallest cells, metres.
pub fn find(patches: &[Patch], extent: Extent, cell_size: f32, points: &[Placed]) -> Vec<NearCluster> {
    if points.is_empty() {
        return Vec::new();
    }
    let places: Vec<(Vec3, f32)> =
        points.iter().map(|placed| (placed.point.position, record_reach(&placed.point))).collect();
    let map = Reaches::from_points(&places);
    let beside = |cluster: usize| {
        let patch = &patches[cluster];
        if patch.clearance > extent.close * cell_size * patch.scale {
            return None;
        }
        let mut best = (f32::INFINITY, 0);
        map.any(patch.middle, |index| {
            let placed = &points[index as usize];
            let found = (placed.point.position.distance(patch.middle), index);
            if found < best && fits(placed, patch.middle, patch) {
                best = found;
            }
            false
        });
        let offset = patch.middle - points[best.1 as usize].point.position;
        let cluster = cluster as u32;
        best.0.is_finite().then_some(NearCluster { cluster, record: best.1, offset, target: cluster })
    };
    (0..patches.len()).into_par_iter().filter_map(beside).collect()
}
