//! Small clusters where surfaces stand close together, and the cache point beside each.

use super::coverage::Placed;
use super::reaches::Reaches;
use super::shares;
use crate::passes::frame::near_field::NearCluster;
use crate::scene::hvds::Hvds;
use crate::types::NO_CLUSTER;
use glam::Vec3;

/// Levels of the hierarchy, from the finest, whose clusters are small enough.
const LEVELS: usize = 2;
/// Clearance up to which surfaces count as close, in base cells.
const CLOSE: f32 = 3.0;
/// How far a record may be, in its validity radii.
const REACH: f32 = 1.5;
/// Cosine of how far its normal may lean from the cluster's.
const LEAN: f32 = 0.8;

/// Middle and mean normal of a cluster, summed by area.
#[derive(Clone, Copy, Default)]
struct Sums {
    area: f64,
    clearance: f32,
    middle: Vec3,
    normal: Vec3,
    is_back: bool,
}

/// Finds them. `clearances` of the pieces, metres; `cell_size` of the base cells; `normal` of a side.
pub fn find(
    hvds: &Hvds,
    clearances: &[f32],
    cell_size: f32,
    normal: impl Fn(u32) -> Vec3,
    points: &[Placed],
) -> Vec<NearCluster> {
    if points.is_empty() {
        return Vec::new();
    }
    let end = hvds.levels[LEVELS.min(hvds.levels.len()) - 1].end as usize;
    let mut sums = vec![Sums::default(); end];
    for (piece, &clearance) in hvds.pieces.iter().zip(clearances) {
        let middle = piece.corners.iter().sum::<Vec3>() / piece.corners.len() as f32;
        let mut cluster = piece.cluster as usize;
        while cluster < end {
            let sum = &mut sums[cluster];
            let area = piece.area_m2 as f32;
            sum.area += piece.area_m2;
            sum.clearance += area * clearance;
            sum.middle += area * middle;
            sum.normal += area * normal(piece.side);
            sum.is_back = piece.side % 2 == 1;
            cluster = hvds.parents[cluster] as usize;
            if cluster == NO_CLUSTER as usize {
                break;
            }
        }
    }
    let places: Vec<(Vec3, f32)> =
        points.iter().map(|placed| (placed.point.position, REACH * placed.point.radius)).collect();
    let map = Reaches::of(&places);
    let beside = |cluster: usize| {
        let sum = &sums[cluster];
        if sum.area <= 0.0 || sum.clearance > CLOSE * cell_size * sum.area as f32 {
            return None;
        }
        let (middle, normal) = (sum.middle / sum.area as f32, sum.normal.normalize_or_zero());
        let mut best = (f32::INFINITY, 0);
        map.any(middle, |index| {
            let point = &points[index as usize].point;
            let distance = point.position.distance(middle);
            let fits = (point.side % 2 == 1) == sum.is_back
                && distance <= REACH * point.radius
                && point.normal.dot(normal) >= LEAN
                && (middle - point.position).dot(point.wall) <= 1.0;
            if fits && (distance, index) < best {
                best = (distance, index);
            }
            false
        });
        let offset = middle - points[best.1 as usize].point.position;
        best.0.is_finite().then_some(NearCluster { cluster: cluster as u32, record: best.1, offset })
    };
    shares::in_shares(end, |share| share.filter_map(beside).collect())
}
