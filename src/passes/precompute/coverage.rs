//! State of the placement of cache points: clearances around a candidate, and the records
//! that cover it.

use super::budget::COVERED;
use super::reaches::Reaches;
use crate::cpu::records::{Tolerance, cover_weight};
use crate::scene::grid::CellGrid;
use crate::scene::hvds::Hvds;
use crate::types::CachePoint;
use glam::{UVec3, Vec3};
use rayon::prelude::*;
use std::sync::atomic::{AtomicU32, Ordering::Relaxed};

/// An accepted cache point.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The point and its validity radius.
    pub point: CachePoint,
    /// Distance to the nearest surface that it or its neighbourhood sees, metres; it
    /// determines the radius.
    pub clearance: f32,
    /// Factor of the spacing of points around it.
    pub spacing: f32,
}

/// Condition under which a record covers a position.
#[derive(Clone, Copy)]
pub(super) struct Cover {
    within: Tolerance,
    /// Weight that the record must exceed there.
    above: f32,
}

impl Cover {
    /// Some record is valid there.
    pub(super) const ANY: Self = Self { within: Tolerance::VALID, above: 0.0 };
    /// Records overlap enough to blend.
    pub(super) const DENSE: Self = Self { within: Tolerance::VALID, above: COVERED };
    /// Some record is near and faces alike.
    pub(super) const SPARSE: Self = Self { within: Tolerance::SPARSE, above: 0.0 };

    /// Whether a record covers a point.
    pub(super) fn holds(self, point: &CachePoint, record: &CachePoint) -> bool {
        cover_weight(point.position, point.normal, point.facet, record, self.within) > self.above
    }
}

/// Clearances measured all over the surface. A record's clearance is at most that of a sample plus
/// the distance to it.
pub(super) struct Neighbourhood<'a> {
    hvds: &'a Hvds,
    /// Samples by cell, those of a cell by clearance: it bounds what later ones can tell.
    samples: Vec<Sample>,
    /// First sample of each cell, and the end.
    first: Vec<u32>,
}

/// A position with a measured clearance.
#[derive(Clone, Copy)]
struct Sample {
    position: Vec3,
    normal: Vec3,
    clearance: f32,
}

impl<'a> Neighbourhood<'a> {
    pub(super) fn new(hvds: &'a Hvds, points: &[CachePoint], clearances: &[f32]) -> Self {
        let cell = |point: &CachePoint| hvds.cell_at(point.position, point.normal).word;
        let cells: Vec<usize> = points.iter().map(cell).collect();
        let mut first = vec![0; hvds.octree.words.len() + 1];
        for &cell in &cells {
            first[cell + 1] += 1;
        }
        for cell in 1..first.len() {
            first[cell] += first[cell - 1];
        }
        let none = Sample { position: Vec3::ZERO, normal: Vec3::ZERO, clearance: 0.0 };
        let (mut samples, mut next) = (vec![none; points.len()], first.clone());
        for ((point, &clearance), cell) in points.iter().zip(clearances).zip(cells) {
            samples[next[cell] as usize] =
                Sample { position: point.position, normal: point.normal, clearance };
            next[cell] += 1;
        }
        let cells = first.windows(2).filter(|ends| ends[1] - ends[0] > 1);
        for ends in cells {
            let of_cell = &mut samples[ends[0] as usize..ends[1] as usize];
            of_cell.sort_unstable_by(|a, b| a.clearance.total_cmp(&b.clearance));
        }
        Self { hvds, samples, first }
    }

    /// Lowers a clearance to the bound of nearby samples that face alike. [Krivanek]
    pub(super) fn clamp(&self, candidate: &CachePoint, clearance: f32) -> f32 {
        let Hvds { grid, octree, .. } = self.hvds;
        let centre = grid.cell_of(candidate.position, candidate.normal);
        let own = octree.cell_at(grid, centre);
        let level = own.level;
        let width = 1 << level;
        let around = [centre.saturating_sub(UVec3::splat(width)), (centre + width).min(grid.cells - 1)];
        let mut clamped = clearance;
        let mut look = |cell: usize| {
            for sample in &self.samples[self.first[cell] as usize..self.first[cell + 1] as usize] {
                if sample.clearance >= clamped {
                    break;
                }
                if sample.normal.dot(candidate.normal) > 0.5 {
                    let distance = sample.position.distance(candidate.position);
                    clamped = clamped.min(sample.clearance + distance);
                }
            }
        };
        // The nearest samples bound the clearance most.
        look(own.word);
        octree.visit(grid, around, level, look);
        clamped
    }
}

/// Accepted records by position.
pub(super) struct Records {
    /// In order of acceptance.
    pub(super) points: Vec<Placed>,
    map: Reaches,
}

impl Records {
    /// No records yet; their radii will be at most `largest`, metres, and many
    /// smaller by a factor of `orders`.
    pub(super) fn new(grid: &CellGrid, largest: f64, orders: f64) -> Self {
        let (low, high) = grid.bounds();
        Self { points: Vec::new(), map: Reaches::new(low, high, largest as f32, orders as f32) }
    }

    pub(super) fn insert(&mut self, placed: Placed) {
        self.map.insert(placed.point.position, placed.point.radius, self.points.len() as u32);
        self.points.push(placed);
    }

    /// Whether some record covers the point. The record `hint` is asked first; the one that covers
    /// becomes the hint.
    pub(super) fn cover_near(&self, hint: &AtomicU32, point: &CachePoint, cover: Cover) -> bool {
        let hinted = self.points.get(hint.load(Relaxed) as usize);
        if hinted.is_some_and(|record| cover.holds(point, &record.point)) {
            return true;
        }
        let covering =
            self.map.find(point.position, |record| cover.holds(point, &self.points[record as usize].point));
        covering.inspect(|&record| hint.store(record, Relaxed)).is_some()
    }

    /// Whether some record covers the point.
    pub(super) fn cover(&self, point: &CachePoint, cover: Cover) -> bool {
        self.map.any(point.position, |record| cover.holds(point, &self.points[record as usize].point))
    }
}

/// For each of these records, which records before it cover it.
pub(super) fn earlier_covers(records: &[Placed], cover: Cover) -> Vec<Vec<u32>> {
    let reach = |placed: &Placed| (placed.point.position, placed.point.radius);
    let map = Reaches::from_points(&records.iter().map(reach).collect::<Vec<_>>());
    let covering = |index: usize| {
        let point = &records[index].point;
        let mut found = Vec::new();
        map.any(point.position, |other| {
            if (other as usize) < index && cover.holds(point, &records[other as usize].point) {
                found.push(other);
            }
            false
        });
        found
    };
    (0..records.len()).into_par_iter().map(covering).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::hash;
    use crate::scene::grid::grid;

    fn record(i: u32) -> Placed {
        let random = |k: u32| hash(hash(i) ^ k) as f32 / u32::MAX as f32;
        let normal = [Vec3::Y, Vec3::X][i as usize % 2];
        let position = Vec3::new(random(1), random(2), random(3)) * (Vec3::ONE - normal);
        let point = CachePoint {
            position,
            radius: 0.02 + 0.1 * random(4),
            normal,
            side: 0,
            occluder: Vec3::ZERO,
            facet: normal,
            inverse_reach: 0.0,
            stream: 0,
        };
        Placed { point, clearance: 1.0, spacing: 1.0 }
    }

    #[test]
    fn covers_are_those_of_all_pairs() {
        let records: Vec<Placed> = (0..600).map(record).collect();
        for cover in [Cover::ANY, Cover::DENSE, Cover::SPARSE] {
            let mut count = 0;
            for (index, mut found) in earlier_covers(&records, cover).into_iter().enumerate() {
                found.sort_unstable();
                let covers =
                    |&other: &u32| cover.holds(&records[index].point, &records[other as usize].point);
                assert_eq!(found, (0..index as u32).filter(covers).collect::<Vec<_>>());
                count += found.len();
            }
            assert!(count > 600, "{count} pairs");
        }
    }

    #[test]
    fn a_hint_changes_no_answer() {
        let mut records = Records::new(&grid(Vec3::ZERO, Vec3::ONE, 4), 0.2, 8.0);
        let hint = AtomicU32::new(u32::MAX);
        let mut covered = 0;
        for i in 0..2000 {
            let placed = record(i);
            let is_covered = records.cover(&placed.point, Cover::DENSE);
            assert_eq!(records.cover_near(&hint, &placed.point, Cover::DENSE), is_covered);
            covered += u32::from(is_covered);
            if i % 8 == 0 {
                records.insert(placed);
            }
        }
        assert!((200..1800).contains(&covered), "{covered} of 2000");
    }
}
