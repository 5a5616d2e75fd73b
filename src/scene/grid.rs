//! The base grid of the volumetric hierarchy, and the normal codes that divide a cell's
//! surface into clusters.

use crate::types;
use glam::{DVec3, UVec3, Vec3};

/// Factor of the resolution of the finest level over the requested one. Where surfaces are nearer
/// than a requested cell, clusters are smaller than that cell.
const REFINED: u32 = 2;
/// Maximum number of finest cells along an axis: the table of cells is dense.
pub const FINEST: u32 = 256;

/// Cells of the finest level along an axis, for `cells` requested ones.
pub fn finest_cells(cells: u32) -> u32 {
    (REFINED * cells).min(FINEST)
}

/// Normal codes: one for each of the 26 neighbours of a cube, about 30° apart.
pub const CODE_COUNT: u32 = 26;

/// Offset of the scene's low corner in the first cell, in cells. It is irrational, so that no wall
/// at round coordinates coincides with a cell boundary.
const PAD: f64 = 0.381_966_011_250_105;

/// Distance by which lookups move inside the surface, in cells.
const PULL: f64 = 1.0 / 64.0;

/// A grid of cubic cells over a box: `cells` (a power of two) along its longest axis.
pub fn grid(low: Vec3, high: Vec3, cells: u32) -> types::Grid {
    let extent = (high - low).as_dvec3();
    // The padding at both ends shares one cell. A flat or tiny scene still gets cells
    // of positive size.
    let cell = (extent.max_element() / (f64::from(cells) - 1.0)).max(1e-30);
    // The only rounding: all else derives from the f32 values that the device reads.
    let inverse_cell = (1.0 / cell) as f32;
    let cell = 1.0 / f64::from(inverse_cell);
    let count = (extent / cell + PAD + PULL).as_uvec3() + UVec3::ONE;
    types::Grid {
        low: (low.as_dvec3() - PAD * cell).as_vec3(),
        inverse_cell,
        cells: count.min(UVec3::splat(cells)),
        pull: (PULL * cell) as f32,
    }
}

impl types::Grid {
    /// Edge of a base cell, metres.
    pub fn cell_size(&self) -> f64 {
        1.0 / f64::from(self.inverse_cell)
    }

    /// Number of base cells.
    pub fn cell_count(&self) -> usize {
        self.cells.as_usizevec3().element_product()
    }

    /// Base cell of a point on the side that `normal` faces; mirrors
    /// `grid_cell` in `glsl/include/grid.glsl`.
    pub fn cell_of(&self, position: Vec3, normal: Vec3) -> UVec3 {
        let inside = position - self.pull * normal;
        let scaled = (inside - self.low) * self.inverse_cell;
        scaled.max(Vec3::ZERO).as_uvec3().min(self.cells - UVec3::ONE)
    }

    /// Index of a cell in the cell table.
    pub fn index_of(&self, cell: UVec3) -> usize {
        let [x, y, z] = cell.as_usizevec3().to_array();
        (z * self.cells.y as usize + y) * self.cells.x as usize + x
    }

    /// Low corner of a cell in f64, metres.
    pub fn corner(&self, cell: UVec3) -> DVec3 {
        self.low.as_dvec3() + cell.as_dvec3() * self.cell_size()
    }
}

/// Code of a unit normal: the nearest of the 26 directions from a cube's centre to its neighbours.
pub fn normal_code(normal: Vec3) -> u32 {
    let n = normal.as_dvec3();
    let mut best = (f64::NEG_INFINITY, 0);
    for code in 0..CODE_COUNT {
        let alignment = n.dot(code_direction(code));
        if alignment > best.0 {
            best = (alignment, code);
        }
    }
    best.1
}

/// Code that all sides in a cluster share: the normal code, and whether the sides are fronts or
/// backs. `normal` is that of the side. A thin hollow part, such as a handle or a spout, needs the
/// second bit: its outside and the far wall of its inside lie in one cell and face the same way,
/// but only the outside is lit.
pub fn cluster_code(normal: Vec3, back: bool) -> u32 {
    2 * normal_code(normal) + u32::from(back)
}

/// Unit direction of a normal code.
pub fn code_direction(code: u32) -> DVec3 {
    // The 27 cells of a 3×3×3 cube without the middle one.
    let cell = if code < 13 { code } else { code + 1 };
    let axis = |step: u32| f64::from((cell / step) % 3) - 1.0;
    DVec3::new(axis(1), axis(3), axis(9)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_nearest_directions() {
        for code in 0..CODE_COUNT {
            assert_eq!(normal_code(code_direction(code).as_vec3()), code);
        }
        for n in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
            assert_eq!(code_direction(normal_code(n)).as_vec3(), n);
            assert!(normal_code(n) != normal_code(-n));
        }
    }

    #[test]
    fn two_sides_of_a_wall_on_a_cell_boundary_fall_behind_themselves() {
        let mut grid = grid(Vec3::ZERO, Vec3::splat(2.0), 64);
        grid.low = Vec3::ZERO;
        let wall = Vec3::new(8.0 / grid.inverse_cell, 0.5, 0.5);
        assert_eq!(grid.cell_of(wall, Vec3::X).x, 7);
        assert_eq!(grid.cell_of(wall, Vec3::NEG_X).x, 8);
    }

    #[test]
    fn the_grid_covers_its_box() {
        for (high, cells) in
            [(Vec3::new(2.0, 1.0, 0.5), 64), (Vec3::new(0.0, 3.0, 0.0), 8), (Vec3::splat(1e-3), 256)]
        {
            let grid = grid(Vec3::ZERO, high, cells);
            assert_eq!(grid.cells.max_element(), cells);
            let scaled = (high - grid.low) * grid.inverse_cell;
            assert!(scaled.cmplt(grid.cells.as_vec3()).all(), "{scaled} in {}", grid.cells);
        }
    }
}
