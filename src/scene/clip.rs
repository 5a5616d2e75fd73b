//! Exact clipping of triangles against grid cells, in f64.

use crate::scene::grid::{BRICK_BITS, CellGrid, Cells};
use glam::{DVec3, UVec3};
use std::ops::RangeInclusive;

/// Margin around a cell for the test whether a surface exists in it, in cells. Positions on the
/// device are f32: a point that rounding moves across a boundary must still find a cluster.
const REACH: f64 = 1e-3;

/// A convex polygon; clipping a triangle by a box leaves at most nine corners.
type Polygon = Vec<DVec3>;

/// Clips a polygon by a plane of constant coordinate; keeps the side where `sign·(p[axis] -
/// bound) ≥ 0`.
fn clip(polygon: &[DVec3], axis: usize, bound: f64, sign: f64) -> Polygon {
    let mut kept = Polygon::with_capacity(polygon.len() + 1);
    for (i, &b) in polygon.iter().enumerate() {
        let a = polygon[(i + polygon.len() - 1) % polygon.len()];
        let (da, db) = (sign * (a[axis] - bound), sign * (b[axis] - bound));
        if (da < 0.0) != (db < 0.0) {
            let mut crossing = a + (b - a) * (da / (da - db));
            crossing[axis] = bound;
            kept.push(crossing);
        }
        if db >= 0.0 {
            kept.push(b);
        }
    }
    kept
}

/// Clips off the side behind a plane; `over` is a point's distance in front of it.
pub fn clip_by(polygon: &[DVec3], over: impl Fn(DVec3) -> f64) -> Vec<DVec3> {
    let mut kept = Polygon::with_capacity(polygon.len() + 1);
    for (i, &b) in polygon.iter().enumerate() {
        let a = polygon[(i + polygon.len() - 1) % polygon.len()];
        let (da, db) = (over(a), over(b));
        if (da < 0.0) != (db < 0.0) {
            kept.push(a + (b - a) * (da / (da - db)));
        }
        if db >= 0.0 {
            kept.push(b);
        }
    }
    kept
}

fn clip_between(polygon: &[DVec3], axis: usize, low: f64, high: f64) -> Polygon {
    clip(&clip(polygon, axis, low, 1.0), axis, high, -1.0)
}

/// Area of a planar convex polygon, m².
pub fn area(polygon: &[DVec3]) -> f64 {
    let fan = |i: usize| (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]);
    if polygon.len() < 3 { 0.0 } else { 0.5 * (1..polygon.len() - 1).map(fan).sum::<DVec3>().length() }
}

/// A box of cells of one level: from `low` to `high`, in cells of that level, both included.
struct Slabs<'a> {
    grid: &'a CellGrid,
    level: u32,
    low: UVec3,
    high: UVec3,
}

impl Slabs<'_> {
    /// Width of a cell in smallest cells.
    fn width(&self) -> f64 {
        f64::from(1u32 << self.level)
    }

    /// Cells along an axis that a polygon touches.
    fn range(&self, polygon: &[DVec3], axis: usize) -> RangeInclusive<u32> {
        let place = |p: &DVec3| self.grid.in_cells(*p)[axis] / self.width();
        let (min, max) = polygon
            .iter()
            .map(place)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(s), b.max(s)));
        // The first and last cell include everything outside the grid, as the device's clamp does.
        let last = self.last(axis);
        let cell = |place: f64| (place.max(0.0) as u32).min(last);
        cell(min - REACH).max(self.low[axis])..=cell(max + REACH).min(self.high[axis])
    }

    /// Last cell of the grid along an axis.
    fn last(&self, axis: usize) -> u32 {
        (self.grid.cells[axis] - 1) >> self.level
    }

    /// Bounds of a cell along an axis, metres, with a margin in cells.
    fn slab(&self, axis: usize, cell: u32, reach: f64) -> [f64; 2] {
        let place = |cell: u32| self.grid.place(DVec3::splat(f64::from(cell) * self.width()))[axis];
        let corner = place(cell);
        let (size, reach) =
            (self.width() * self.grid.cell_size(), reach * self.width() * self.grid.cell_size());
        let low = if cell == 0 { f64::NEG_INFINITY } else { corner - reach };
        let high = if cell == self.last(axis) { f64::INFINITY } else { corner + size + reach };
        [low, high]
    }

    fn for_each(&self, triangle: &[DVec3], visit: &mut impl FnMut(UVec3, u32, Polygon)) {
        for x in self.range(triangle, 0) {
            let in_x = self.clipped(triangle, 0, x, REACH);
            if in_x.len() < 3 {
                continue;
            }
            for y in self.range(&in_x, 1) {
                let in_y = self.clipped(&in_x, 1, y, REACH);
                if in_y.len() < 3 {
                    continue;
                }
                for z in self.range(&in_y, 2) {
                    let mut part = self.clipped(&in_y, 2, z, REACH);
                    if part.len() < 3 {
                        continue;
                    }
                    let cell = UVec3::new(x, y, z);
                    for axis in 0..3 {
                        part = self.clipped(&part, axis, cell[axis], 0.0);
                    }
                    visit(cell << self.level, self.level, part);
                }
            }
        }
    }

    fn clipped(&self, polygon: &[DVec3], axis: usize, cell: u32, reach: f64) -> Polygon {
        let [low, high] = self.slab(axis, cell, reach);
        clip_between(polygon, axis, low, high)
    }
}

/// Clips a triangle against the cells of an octree. `visit` gets each cell that the triangle
/// reaches, by its corner in smallest cells and its level, and the polygon inside. The polygon's
/// area is zero if the triangle only touches the cell. The polygons add up to the triangle.
pub fn for_each_cell(triangle: [DVec3; 3], cells: &Cells, mut visit: impl FnMut(UVec3, u32, Polygon)) {
    let bits = cells.grid.depth().max(cells.grid.shift);
    in_cube(&triangle, cells, UVec3::ZERO, bits, &mut visit);
}

/// As [`for_each_cell`], for the cells in a cube of that level.
fn in_cube(
    polygon: &[DVec3],
    cells: &Cells,
    corner: UVec3,
    bits: u32,
    visit: &mut impl FnMut(UVec3, u32, Polygon),
) {
    let Cells { grid, .. } = cells;
    if corner.cmpge(grid.cells).any() {
        return;
    }
    let [least, most] = cells.levels_in(corner, 1 << bits);
    // A brick has equal cells: the smallest that some of its points want.
    let of_brick = bits - BRICK_BITS;
    if least == most || least >= of_brick {
        let level = least.min(of_brick);
        let (low, high) = (corner >> level, (corner >> level) + ((1 << (bits - level)) - 1));
        return Slabs { grid, level, low, high }.for_each(polygon, visit);
    }
    let (level, child) = (bits - 1, 1 << (bits - 1));
    for octant in 0..8u32 {
        let inside = corner + UVec3::new(octant & 1, octant >> 1 & 1, octant >> 2) * child;
        let low = inside >> level;
        let cube = Slabs { grid, level, low, high: low };
        let in_x = cube.clipped(polygon, 0, low.x, REACH);
        let in_y = cube.clipped(&in_x, 1, low.y, REACH);
        let part = cube.clipped(&in_y, 2, low.z, REACH);
        if part.len() >= 3 && inside.cmplt(grid.cells).all() {
            in_cube(&part, cells, inside, level, visit);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::grid::grid;
    use glam::Vec3;

    #[test]
    fn parts_add_up_to_the_triangle() {
        let grid = grid(Vec3::splat(-1.0), Vec3::splat(1.0), 32);
        let corners =
            [[-1.0, -0.9, -0.3], [0.97, -0.2, 0.8], [0.1, 1.0, -1.0], [0.4, 0.4, 0.4], [-0.7, 0.0, 1.0]];
        for i in 0..corners.len() {
            let triangle = [0, 1, 2].map(|k| DVec3::from(corners[(i + k) % corners.len()]));
            let mut sum = 0.0;
            for_each_cell(triangle, &Cells::uniform(grid), |cell, _, part| {
                sum += area(&part);
                for p in &part {
                    let inside = (*p - grid.corner(cell)) / grid.cell_size();
                    assert!(
                        inside.cmpge(DVec3::splat(-1e-9)).all()
                            && inside.cmple(DVec3::splat(1.0 + 1e-9)).all()
                    );
                }
            });
            let whole = area(&triangle);
            assert!((sum - whole).abs() < 1e-12 * whole, "{sum} of {whole}");
        }
    }

    #[test]
    fn a_triangle_in_a_cell_boundary_is_counted_once_and_found_on_both_sides() {
        let mut grid = grid(Vec3::ZERO, Vec3::splat(2.0), 16);
        grid.smallest.low = Vec3::ZERO;
        let x = 4.0 * grid.cell_size();
        let triangle = [[x, 0.1, 0.1], [x, 0.9, 0.2], [x, 0.3, 1.1]].map(DVec3::from);
        let mut areas = [0.0; 16];
        let mut seen = [false; 16];
        for_each_cell(triangle, &Cells::uniform(grid), |cell, _, part| {
            areas[cell.x as usize] += area(&part);
            seen[cell.x as usize] = true;
        });
        assert!(seen[3] && seen[4]);
        // A polygon of zero width in the neighbour may repeat the face. The pull avoids this case
        // for real surfaces.
        assert!((areas[4] - area(&triangle)).abs() < 1e-12);
    }
}
