//! The base grid of the volumetric hierarchy, and the normal codes that divide a cell's
//! surface into clusters.

use crate::scene::cell_sizes::CellSizes;
use crate::types;
use glam::{DVec3, IVec3, UVec3, Vec3};
use std::ops::Deref;

/// Factor of the resolution of the finest level over the requested one. Where surfaces are nearer
/// than a requested cell, clusters are smaller than that cell.
const REFINED: u32 = 2;
/// Maximum number of cells of the full width along an axis.
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

/// Cells of a brick of the octree along each axis, as a power of two.
pub const BRICK_BITS: u32 = 3;

/// The cells of a scene: a grid of the smallest ones, and where they are larger.
#[derive(Clone, Debug)]
pub struct Cells {
    /// The smallest cells.
    pub grid: CellGrid,
    /// Which cells are larger.
    pub sizes: CellSizes,
}

impl Cells {
    /// Cells over a box, with `cells` (a power of two) of the full width along its longest axis.
    pub fn new(low: Vec3, high: Vec3, cells: u32, sizes: &CellSizes) -> Self {
        let full = grid(low, high, cells);
        let Some(centre) = sizes.regions.first() else {
            return Self::uniform(full);
        };
        let halvings = sizes.max_halvings();
        let inverse_cell = full.inverse_cell * (halvings as f32).exp2();
        let cell = 1.0 / f64::from(inverse_cell);
        // Coordinates are exact near the smallest cells.
        let origin = (centre.low.as_dvec3() - PAD * cell).as_vec3();
        let [before, behind] =
            [origin - low, high - origin].map(|extent| (extent.as_dvec3() / cell).max(DVec3::ZERO));
        let first = (before + PAD).ceil().as_uvec3();
        let smallest = types::Grid {
            low: origin,
            inverse_cell,
            cells: first + (behind + PULL).as_uvec3() + UVec3::ONE,
            pull: (PULL * cell) as f32,
        };
        let grid = CellGrid { smallest, first, shift: halvings + BRICK_BITS };
        Self { grid, sizes: sizes.clone() }
    }

    /// Cells of one size.
    pub fn uniform(grid: CellGrid) -> Self {
        Self { grid, sizes: CellSizes::default() }
    }

    /// Levels of the smallest and of the largest cells in a cube, which is given in smallest cells.
    pub(super) fn levels_in(&self, corner: UVec3, width: u32) -> [u32; 2] {
        let [low, high] =
            [corner.as_dvec3(), (corner.as_dvec3() + f64::from(width))].map(|place| self.grid.place(place));
        self.sizes.levels_in(low, high)
    }
}

/// A grid of cubic cells over a box: `cells` (a power of two) along its longest axis.
pub fn grid(low: Vec3, high: Vec3, cells: u32) -> CellGrid {
    let extent = (high - low).as_dvec3();
    // The padding at both ends shares one cell. A flat or tiny scene still gets cells
    // of positive size.
    let cell = (extent.max_element() / (f64::from(cells) - 1.0)).max(1e-30);
    // The only rounding: all else derives from the f32 values that the device reads.
    let inverse_cell = (1.0 / cell) as f32;
    let cell = 1.0 / f64::from(inverse_cell);
    let count = (extent / cell + PAD + PULL).as_uvec3() + UVec3::ONE;
    CellGrid::new(types::Grid {
        low: (low.as_dvec3() - PAD * cell).as_vec3(),
        inverse_cell,
        cells: count.min(UVec3::splat(cells)),
        pull: (PULL * cell) as f32,
    })
}

/// The smallest cells, and the top nodes of the octree over them.
#[derive(Clone, Copy, Debug)]
pub struct CellGrid {
    /// As the device reads them.
    pub smallest: types::Grid,
    /// The cell at the grid's low corner. Near it, coordinates are exact.
    pub first: UVec3,
    /// Width of a top node: two to that power, in smallest cells.
    pub shift: u32,
}

impl Deref for CellGrid {
    type Target = types::Grid;

    fn deref(&self) -> &types::Grid {
        &self.smallest
    }
}

impl CellGrid {
    /// A grid whose cells have one size, with the first cell at its low corner.
    pub fn new(smallest: types::Grid) -> Self {
        Self { smallest, first: UVec3::ZERO, shift: BRICK_BITS }
    }

    /// Edge of a finest cell, metres.
    pub fn cell_size(&self) -> f64 {
        1.0 / f64::from(self.inverse_cell)
    }

    /// Lowest and highest corner of all cells, metres.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let [low, high] = [-self.first.as_vec3(), (self.cells - self.first).as_vec3()]
            .map(|corner| self.low + corner / self.inverse_cell);
        (low, high)
    }

    /// Number of top nodes of the octree along each axis.
    pub fn top_nodes(&self) -> UVec3 {
        ((self.cells - 1) >> self.shift) + 1
    }

    /// Levels from the finest cells to the one cell that holds them all.
    pub fn depth(&self) -> u32 {
        self.cells.max_element().next_power_of_two().ilog2()
    }

    /// Finest cell of a point on the side that `normal` faces; mirrors
    /// `cell_at` in `glsl/include/grid.glsl`.
    pub fn cell_of(&self, position: Vec3, normal: Vec3) -> UVec3 {
        let inside = position - self.pull * normal;
        let place = ((inside - self.low) * self.inverse_cell).floor().as_ivec3();
        let cell = place.saturating_add(self.first.as_ivec3());
        cell.clamp(IVec3::ZERO, self.cells.as_ivec3() - 1).as_uvec3()
    }

    /// Position of a point given in finest cells, metres.
    pub fn place(&self, cells: DVec3) -> DVec3 {
        self.low.as_dvec3() + (cells - self.first.as_dvec3()) * self.cell_size()
    }

    /// A position in finest cells.
    pub fn in_cells(&self, position: DVec3) -> DVec3 {
        (position - self.low.as_dvec3()) / self.cell_size() + self.first.as_dvec3()
    }

    /// Low corner of a cell in f64, metres.
    pub fn corner(&self, cell: UVec3) -> DVec3 {
        self.place(cell.as_dvec3())
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
        grid.smallest.low = Vec3::ZERO;
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
