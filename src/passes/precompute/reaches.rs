//! Lookup of points by the positions within their reach.

use glam::{UVec3, Vec3};
use std::collections::HashMap;

/// Levels of a map with reaches of one order: the reaches in a level differ by at most a factor of
/// two; the last level takes all smaller ones.
const LEVELS: u32 = 4;

/// Maximum number of cells of a level along an axis, if all cells have a list.
const MAX_CELLS: f32 = 128.0;

/// The same, in all, for each point that is known from the start.
const CELLS_PER_POINT: f32 = 8.0;

/// Cells that are wider than the reach by this factor hold too many points: such a level has lists
/// of cells with points alone.
const WIDE: f32 = 8.0;

/// Factor by which a search exceeds the reach, because positions are rounded.
const SLACK: f32 = 1.001;

/// One grid for points of similar reach, so that a cell as wide as the reach holds few points.
pub(super) struct Reaches {
    levels: Vec<Level>,
}

struct Level {
    /// The largest reach, metres.
    most: f32,
    low: Vec3,
    inverse_cell: f32,
    cells: UVec3,
    lists: Lists,
}

/// Points by cell.
enum Lists {
    Dense(Vec<Vec<Point>>),
    Sparse(HashMap<UVec3, Vec<Point>>),
}

#[derive(Clone, Copy)]
struct Point {
    position: Vec3,
    /// Square of its reach, m², slightly enlarged.
    reach2: f32,
    index: u32,
}

impl Reaches {
    /// An empty map of the box from `low` to `high`, for reaches up to `most`, all in metres. Many
    /// reaches may be smaller than that by a factor of `orders`.
    pub(super) fn new(low: Vec3, high: Vec3, most: f32, orders: f32) -> Self {
        Self::with_cells(low, high, most, orders, MAX_CELLS)
    }

    /// As [`Self::new`]; `max_cells` is the maximum number of cells of a level along an axis.
    fn with_cells(low: Vec3, high: Vec3, most: f32, orders: f32, max_cells: f32) -> Self {
        let most = most.max(f32::MIN_POSITIVE);
        let levels = LEVELS + orders.max(1.0).log2().ceil() as u32;
        let level = |halvings: u32| Level::new(low, high, most * (-(halvings as f32)).exp2(), max_cells);
        Self { levels: (0..levels).map(level).collect() }
    }

    /// A map of points with their reaches, metres; the index of a point is its index in the list.
    pub(super) fn from_points(points: &[(Vec3, f32)]) -> Self {
        let least = points.iter().fold(Vec3::INFINITY, |low, point| low.min(point.0));
        let high = points.iter().fold(Vec3::NEG_INFINITY, |high, point| high.max(point.0));
        let most = points.iter().fold(0.0f32, |most, point| most.max(point.1));
        let mut reaches: Vec<f32> = points.iter().map(|point| point.1).collect();
        reaches.sort_by(f32::total_cmp);
        let typical = reaches.get(reaches.len() / 4).map_or(most, |&reach| reach.max(1e-6 * most));
        let orders = most / (2.0 * typical).max(f32::MIN_POSITIVE);
        let max_cells = (CELLS_PER_POINT * points.len() as f32).cbrt().clamp(1.0, MAX_CELLS);
        let mut map = Self::with_cells(least.min(high), high, most, orders, max_cells);
        for (index, &(position, reach)) in (0..).zip(points) {
            map.insert(position, reach, index);
        }
        map
    }

    /// Adds a point. Panics if its reach exceeds that of the map.
    pub(super) fn insert(&mut self, position: Vec3, reach: f32, index: u32) {
        let level = self.levels.iter_mut().rev().find(|level| reach <= level.most);
        let level = level.expect("the first level takes every point");
        let (cell, point) = (level.cell(position), Point { position, reach2: SLACK * reach * reach, index });
        match &mut level.lists {
            Lists::Dense(lists) => lists[place(cell, level.cells)].push(point),
            Lists::Sparse(lists) => lists.entry(cell).or_default().push(point),
        }
    }

    /// Returns whether `wanted` accepts any point whose reach includes `place`; stops at the first
    /// one. A closure that always returns false visits them all, in arbitrary order.
    pub(super) fn any(&self, place: Vec3, mut wanted: impl FnMut(u32) -> bool) -> bool {
        self.levels.iter().any(|level| level.any(place, &mut wanted))
    }

    /// As [`Self::any`]; returns the accepted point.
    pub(super) fn find(&self, place: Vec3, mut wanted: impl FnMut(u32) -> bool) -> Option<u32> {
        let mut found = None;
        self.any(place, |index| {
            found = wanted(index).then_some(index);
            found.is_some()
        });
        found
    }
}

/// Index of a cell in a list of all.
fn place(cell: UVec3, cells: UVec3) -> usize {
    let [x, y, z] = cell.as_usizevec3().to_array();
    (z * cells.y as usize + y) * cells.x as usize + x
}

impl Level {
    fn new(low: Vec3, high: Vec3, most: f32, max_cells: f32) -> Self {
        let extent = (high - low).max(Vec3::ZERO);
        let (own, least) = (SLACK * most, extent.max_element() / max_cells);
        let is_dense = least <= WIDE * own;
        let cell = if is_dense { own.max(least) } else { own }.max(f32::MIN_POSITIVE);
        let cells = (extent / cell).ceil().as_uvec3().max(UVec3::ONE);
        let lists = match is_dense {
            true => Lists::Dense(vec![Vec::new(); cells.as_usizevec3().element_product()]),
            false => Lists::Sparse(HashMap::new()),
        };
        Self { most, low, inverse_cell: 1.0 / cell, cells, lists }
    }

    /// Points of a cell.
    fn list(&self, cell: UVec3) -> &[Point] {
        match &self.lists {
            Lists::Dense(lists) => &lists[place(cell, self.cells)],
            Lists::Sparse(lists) => lists.get(&cell).map_or(&[], |list| list),
        }
    }

    fn cell(&self, position: Vec3) -> UVec3 {
        ((position - self.low) * self.inverse_cell).max(Vec3::ZERO).as_uvec3().min(self.cells - 1)
    }

    fn any(&self, place: Vec3, wanted: &mut impl FnMut(u32) -> bool) -> bool {
        let centre = self.cell(place);
        let reach = SLACK * self.most;
        let (low, high) = (self.cell(place - reach), self.cell(place + reach));
        // The cell of `place` first: it most likely holds an accepted point.
        let along = |axis: usize| {
            let others = (low[axis]..=high[axis]).filter(move |&cell| cell != centre[axis]);
            std::iter::once(centre[axis]).chain(others)
        };
        along(2).any(|z| {
            along(1).any(|y| {
                along(0).any(|x| {
                    self.list(UVec3::new(x, y, z)).iter().any(|point| {
                        point.position.distance_squared(place) <= point.reach2 && wanted(point.index)
                    })
                })
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::sampling::hash;

    /// A misplaced point would cost time, and no image would show it.
    #[test]
    fn points_stand_in_the_cells_that_they_lie_in() {
        let random = |i: u32| hash(hash(i)) as f32 / u32::MAX as f32;
        let point = |i: u32| 7.0 * Vec3::new(random(3 * i), random(3 * i + 1), random(3 * i + 2)) - 3.0;
        let points: Vec<(Vec3, f32)> = (0..500).map(|i| (point(i), 0.5 * random(i + 9000))).collect();
        let map = Reaches::from_points(&points);
        let mut count = 0;
        for level in &map.levels {
            let place = |index: usize| {
                let [across, down] =
                    [level.cells.x, level.cells.x * level.cells.y].map(|stride| stride as usize);
                let [x, y, z] = [index % across, index % down / across, index / down];
                UVec3::new(x as u32, y as u32, z as u32)
            };
            let lists: Vec<(UVec3, &Vec<Point>)> = match &level.lists {
                Lists::Dense(lists) => {
                    lists.iter().enumerate().map(|(index, list)| (place(index), list)).collect()
                }
                Lists::Sparse(lists) => lists.iter().map(|(&cell, list)| (cell, list)).collect(),
            };
            for (cell, list) in lists {
                for point in list {
                    let within = (point.position - level.low) * level.inverse_cell - cell.as_vec3();
                    // f32 rounds a place among at most 128 cells by 1e-5 of a cell. The last cell
                    // ends at the last point.
                    assert!(within.min_element() >= -1e-4 && within.max_element() <= 1.0 + 1e-4, "{within}");
                    count += 1;
                }
            }
        }
        assert_eq!(count, points.len());
    }

    #[test]
    fn whatever_reaches_a_place_is_found_once() {
        let random = |i: u32| hash(hash(i)) as f32 / u32::MAX as f32;
        let point = |i: u32| Vec3::new(random(5 * i), random(5 * i + 1), 0.1 * random(5 * i + 2));
        // From none to a fifth of the box, with many that are small.
        let points: Vec<(Vec3, f32)> =
            (0..2000).map(|i| (point(i), 0.2 * random(5 * i + 3).powi(4))).collect();
        let map = Reaches::from_points(&points);
        for i in 2000..2300 {
            // Some places lie outside the box.
            let place = 1.2 * point(i) - 0.1;
            let mut found = Vec::new();
            map.any(place, |index| {
                found.push(index);
                false
            });
            found.sort_unstable();
            assert!(found.windows(2).all(|pair| pair[0] != pair[1]));
            for (index, (position, reach)) in (0..).zip(&points) {
                let distance = position.distance(place);
                let is_found = found.binary_search(&index).is_ok();
                assert!(is_found || distance > *reach, "{distance} of {reach}");
                assert!(!is_found || distance < 1.001 * reach, "{distance} of {reach}");
            }
            assert_eq!(map.any(place, |_| true), !found.is_empty());
        }
    }

    #[test]
    fn points_at_one_place_and_no_points() {
        assert!(!Reaches::from_points(&[]).any(Vec3::ONE, |_| true));
        let map = Reaches::from_points(&[(Vec3::ONE, 0.0), (Vec3::ONE, 0.0)]);
        assert!(map.any(Vec3::ONE, |index| index == 1));
        assert!(!map.any(Vec3::splat(1.01), |_| true));
    }
}
