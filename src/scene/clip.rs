//! Exact clipping of triangles against grid cells, in f64.

use crate::types;
use glam::{DVec3, UVec3};

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

/// Clips a triangle against the cells of a grid. `visit` gets each cell that the triangle reaches,
/// and the polygon inside. The polygon's area is zero if the triangle only touches the cell. The
/// polygons add up to the triangle.
pub fn for_each_cell(triangle: [DVec3; 3], grid: &types::Grid, mut visit: impl FnMut(UVec3, Polygon)) {
    let range = |polygon: &[DVec3], axis: usize| {
        let low = f64::from(grid.low[axis]);
        let scaled = polygon.iter().map(|p| (p[axis] - low) / grid.cell_size());
        let (min, max) = scaled.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(s), b.max(s)));
        let last = grid.cells[axis] - 1;
        // The first and last cell include everything outside the grid, as the device's clamp does.
        ((min - REACH).max(0.0) as u32).min(last)..=((max + REACH).max(0.0) as u32).min(last)
    };
    let slab = |axis: usize, cell: u32, reach: f64| {
        let corner = grid.corner(UVec3::splat(cell))[axis];
        let low = if cell == 0 { f64::NEG_INFINITY } else { corner - reach };
        let high =
            if cell == grid.cells[axis] - 1 { f64::INFINITY } else { corner + grid.cell_size() + reach };
        (low, high)
    };
    let reach = REACH * grid.cell_size();
    for x in range(&triangle, 0) {
        let (low, high) = slab(0, x, reach);
        let in_x = clip_between(&triangle, 0, low, high);
        if in_x.len() < 3 {
            continue;
        }
        for y in range(&in_x, 1) {
            let (low, high) = slab(1, y, reach);
            let in_y = clip_between(&in_x, 1, low, high);
            if in_y.len() < 3 {
                continue;
            }
            for z in range(&in_y, 2) {
                let (low, high) = slab(2, z, reach);
                let mut part = clip_between(&in_y, 2, low, high);
                if part.len() < 3 {
                    continue;
                }
                let cell = UVec3::new(x, y, z);
                for axis in 0..3 {
                    let (low, high) = slab(axis, cell[axis], 0.0);
                    part = clip_between(&part, axis, low, high);
                }
                visit(cell, part);
            }
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
            for_each_cell(triangle, &grid, |cell, part| {
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
        grid.low = Vec3::ZERO;
        let x = 4.0 * grid.cell_size();
        let triangle = [[x, 0.1, 0.1], [x, 0.9, 0.2], [x, 0.3, 1.1]].map(DVec3::from);
        let mut areas = [0.0; 16];
        let mut seen = [false; 16];
        for_each_cell(triangle, &grid, |cell, part| {
            areas[cell.x as usize] += area(&part);
            seen[cell.x as usize] = true;
        });
        assert!(seen[3] && seen[4]);
        // A polygon of zero width in the neighbour may repeat the face. The pull avoids this case
        // for real surfaces.
        assert!((areas[4] - area(&triangle)).abs() < 1e-12);
    }
}
