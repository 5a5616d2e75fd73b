//! What is known of the surface while cache points are placed: the clearances around a candidate, the records that cover it.

use crate::cpu::records::record_weight;
use crate::types::{CachePoint, Grid};
use glam::{UVec3, Vec3};

/// An accepted cache point.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// The point and its validity radius.
    pub point: CachePoint,
    /// Distance to the nearest surface that it or its neighbourhood sees, metres; the radius comes of it.
    pub clearance: f32,
}

/// Clearances measured all over the surface: no record may claim more than its surroundings, growing with distance.
pub(super) struct Neighbourhood<'a> {
    grid: &'a Grid,
    samples: &'a [CachePoint],
    clearances: &'a [f32],
    cells: Vec<Vec<u32>>,
}

impl<'a> Neighbourhood<'a> {
    pub(super) fn new(grid: &'a Grid, samples: &'a [CachePoint], clearances: &'a [f32]) -> Self {
        let mut cells = vec![Vec::new(); grid.cell_count()];
        for (index, sample) in samples.iter().enumerate() {
            cells[grid.index_of(grid.cell_of(sample.position, sample.normal))].push(index as u32);
        }
        Self { grid, samples, clearances, cells }
    }

    /// Lowers a clearance to what nearby samples that face alike allow. [Krivanek]
    pub(super) fn clamp(&self, candidate: &CachePoint, clearance: f32) -> f32 {
        let grid = self.grid;
        let centre = grid.cell_of(candidate.position, candidate.normal);
        let (low, high) = (centre.saturating_sub(UVec3::ONE), (centre + 1).min(grid.cells - 1));
        let mut clamped = clearance;
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    for &i in &self.cells[grid.index_of(UVec3::new(x, y, z))] {
                        let sample = &self.samples[i as usize];
                        if sample.normal.dot(candidate.normal) > 0.5 {
                            let distance = sample.position.distance(candidate.position);
                            clamped = clamped.min(self.clearances[i as usize] + distance);
                        }
                    }
                }
            }
        }
        clamped
    }
}

/// Accepted records, found by position.
pub(super) struct Records {
    /// In order of acceptance.
    pub(super) points: Vec<Placed>,
    low: Vec3,
    inverse_cell: f32,
    cells: UVec3,
    lists: Vec<Vec<u32>>,
}

impl Records {
    /// Cells as wide as the largest radius, so that a point's records stand in the cells around it.
    pub(super) fn new(grid: &Grid, largest_radius: f64) -> Self {
        let extent = grid.cells.as_vec3() / grid.inverse_cell;
        let cell = (largest_radius as f32).max(extent.max_element() / 128.0);
        let cells = (extent / cell).ceil().as_uvec3().max(UVec3::ONE);
        let count = cells.as_usizevec3().element_product();
        Self {
            points: Vec::new(),
            low: grid.low,
            inverse_cell: 1.0 / cell,
            cells,
            lists: vec![Vec::new(); count],
        }
    }

    fn cell(&self, position: Vec3) -> UVec3 {
        ((position - self.low) * self.inverse_cell).max(Vec3::ZERO).as_uvec3().min(self.cells - 1)
    }

    fn index(&self, cell: UVec3) -> usize {
        let [x, y, z] = cell.as_usizevec3().to_array();
        (z * self.cells.y as usize + y) * self.cells.x as usize + x
    }

    pub(super) fn insert(&mut self, placed: Placed) {
        let cell = self.index(self.cell(placed.point.position));
        self.lists[cell].push(self.points.len() as u32);
        self.points.push(placed);
    }

    /// The candidates, in order, where no record has more than this weight.
    pub(super) fn uncovered(&self, candidates: &[CachePoint], weight: f32) -> Vec<CachePoint> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let share = candidates.len().div_ceil(threads).max(1);
        let open = |share: &[CachePoint]| -> Vec<CachePoint> {
            share.iter().filter(|candidate| !self.cover(candidate, weight)).copied().collect()
        };
        std::thread::scope(|scope| {
            let workers: Vec<_> =
                candidates.chunks(share).map(|share| scope.spawn(move || open(share))).collect();
            workers.into_iter().flat_map(|worker| worker.join().expect("the search does not panic")).collect()
        })
    }

    /// Whether some record has more than this weight at the point.
    pub(super) fn cover(&self, point: &CachePoint, weight: f32) -> bool {
        let centre = self.cell(point.position);
        let (low, high) = (centre.saturating_sub(UVec3::ONE), (centre + 1).min(self.cells - 1));
        (low.z..=high.z).any(|z| {
            (low.y..=high.y).any(|y| {
                (low.x..=high.x).any(|x| {
                    self.lists[self.index(UVec3::new(x, y, z))].iter().any(|&record| {
                        record_weight(
                            point.position,
                            point.normal,
                            point.facet,
                            &self.points[record as usize].point,
                        ) > weight
                    })
                })
            })
        })
    }
}
