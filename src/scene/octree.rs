//! The octree of cells, as lookups read it: a grid of top nodes; inner nodes with eight children;
//! bricks of 8×8×8 equal cells. [Yue §2] A header of five words holds the index of the first cell,
//! the finest cell at the grid's low corner, and `CellGrid::shift`. Then come the top nodes. A word
//! of a top node or a child is the index of its first child, or the index of a brick's first cell
//! with the bit `BRICK`. A word of a cell is the first index of its list of clusters; the next word
//! ends the list. The first brick is empty.

use super::grid::{BRICK_BITS, CellGrid};
use glam::UVec3;

/// Marks the word of a brick; mirrors `BRICK` in `glsl/include/grid.glsl`.
const BRICK: u32 = 1 << 31;
/// Cells of a brick.
const BRICK_CELLS: u32 = 1 << (3 * BRICK_BITS);

/// A cell of an octree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Index of its word.
    pub word: usize,
    /// Its width is two to that power, in finest cells.
    pub level: u32,
}

/// The words of an octree.
#[derive(Clone, Debug, Default)]
pub struct Octree {
    /// See the module.
    pub words: Vec<u32>,
}

/// Number of the child, of width 2^bits, that holds a finest cell.
fn octant(cell: UVec3, bits: u32) -> u32 {
    let octant = cell >> bits & 1;
    octant.x | octant.y << 1 | octant.z << 2
}

/// Place of a cell of that level in its brick.
fn place(cell: UVec3, level: u32) -> u32 {
    let inner = cell >> level & ((1 << BRICK_BITS) - 1);
    (inner.z << BRICK_BITS | inner.y) << BRICK_BITS | inner.x
}

/// Words before the top nodes.
const HEADER: usize = 5;

fn header(grid: &CellGrid, first_cell: u32) -> [u32; HEADER] {
    let [x, y, z] = grid.first.to_array();
    [first_cell, x, y, z, grid.shift]
}

/// Index of the word of the top node that holds a finest cell.
fn top(grid: &CellGrid, cell: UVec3) -> usize {
    let (nodes, node) = (grid.top_nodes(), cell >> grid.shift);
    HEADER + ((node.z * nodes.y + node.y) * nodes.x + node.x) as usize
}

impl Octree {
    /// The octree with these disjoint cells, given by corner in finest cells and level. Also
    /// returns the index of each one's word. All lists are empty.
    pub fn new(grid: &CellGrid, cells: &[(UVec3, u32)]) -> (Self, Vec<usize>) {
        let mut nodes = vec![BRICK; HEADER + grid.top_nodes().element_product() as usize];
        let mut bricks = 1;
        let mut of_cells = Vec::with_capacity(cells.len());
        for &(corner, level) in cells {
            let (mut node, mut bits) = (top(grid, corner), grid.shift);
            while bits > level + BRICK_BITS {
                bits -= 1;
                if nodes[node] == BRICK {
                    nodes[node] = nodes.len() as u32;
                    nodes.resize(nodes.len() + 8, BRICK);
                }
                node = (nodes[node] + octant(corner, bits)) as usize;
            }
            if nodes[node] == BRICK {
                nodes[node] = BRICK | bricks;
                bricks += 1;
            }
            of_cells.push((nodes[node] & !BRICK, place(corner, level)));
        }
        let first_cell = nodes.len() as u32;
        for word in nodes[HEADER..].iter_mut().filter(|word| **word & BRICK != 0) {
            *word = BRICK | (first_cell + (*word & !BRICK) * BRICK_CELLS);
        }
        let mut words = nodes;
        words[..HEADER].copy_from_slice(&header(grid, first_cell));
        words.resize((first_cell + bricks * BRICK_CELLS + 1) as usize, 0);
        let word = |(brick, place): (u32, u32)| (first_cell + brick * BRICK_CELLS + place) as usize;
        (Self { words }, of_cells.into_iter().map(word).collect())
    }

    /// Index of the first cell's word. The words of cells end with one more.
    pub fn first_cell(&self) -> usize {
        self.words[0] as usize
    }

    /// The cell that holds a finest cell.
    pub fn cell_at(&self, grid: &CellGrid, cell: UVec3) -> Cell {
        let (mut word, mut bits) = (self.words[top(grid, cell)], grid.shift);
        while word & BRICK == 0 {
            bits -= 1;
            word = self.words[(word + octant(cell, bits)) as usize];
        }
        let level = bits - BRICK_BITS;
        Cell { word: ((word & !BRICK) + place(cell, level)) as usize, level }
    }

    /// Visits the cells that the box from `low` to `high` touches, both in finest cells; some of
    /// them more than once. `level` is that of the cells that are expected.
    pub fn visit(&self, grid: &CellGrid, [low, high]: [UVec3; 2], level: u32, mut found: impl FnMut(usize)) {
        let [low, high] = [low, high].map(|corner| corner >> level);
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                let mut before = None;
                for x in low.x..=high.x {
                    let corner = UVec3::new(x, y, z) << level;
                    // Cells of a brick are consecutive along x.
                    let in_brick = x & ((1 << BRICK_BITS) - 1);
                    before = match before {
                        Some(word) if in_brick > 0 => Some(word + 1),
                        _ if corner.cmpge(grid.cells).any() => None,
                        _ => {
                            Some(self.cell_at(grid, corner)).filter(|at| at.level == level).map(|at| at.word)
                        }
                    };
                    match before {
                        Some(word) => found(word),
                        None => self.visit_cube(grid, corner, level, &mut found),
                    }
                }
            }
        }
    }

    /// Visits the cells of a cube of that level, or the larger one around it.
    fn visit_cube(&self, grid: &CellGrid, corner: UVec3, level: u32, found: &mut impl FnMut(usize)) {
        if corner.cmpge(grid.cells).any() {
            return;
        }
        let cell = self.cell_at(grid, corner);
        if cell.level >= level {
            return found(cell.word);
        }
        for octant in 0..8 {
            let inside = UVec3::new(octant & 1, octant >> 1 & 1, octant >> 2) << (level - 1);
            self.visit_cube(grid, corner + inside, level - 1, found);
        }
    }

    /// Whether all words refer to what exists, for that grid and lists of `entries` words.
    pub fn is_sound(&self, grid: &CellGrid, entries: usize) -> bool {
        let (words, nodes) = (&self.words, HEADER + grid.top_nodes().element_product() as usize);
        let Some(&first_cell) = words.first() else { return false };
        let first = first_cell as usize;
        let cells = words.len().wrapping_sub(first + 1);
        if first < nodes
            || first >= words.len()
            || words[..HEADER] != header(grid, first_cell)
            || !cells.is_multiple_of(BRICK_CELLS as usize)
        {
            return false;
        }
        let lists = &words[first..];
        let is_sorted = lists[0] == 0 && lists.windows(2).all(|pair| pair[0] <= pair[1]);
        if !is_sorted || lists.last().is_none_or(|&end| end as usize != entries) {
            return false;
        }
        // Widths of the nodes; children follow their parents.
        let mut bits = vec![None; first];
        bits[HEADER..nodes].fill(Some(grid.shift));
        (HEADER..first).all(|node| match (words[node] & BRICK == 0, bits[node]) {
            (true, Some(bits_of_node)) => {
                let children = words[node] as usize;
                let is_after = children > node && children + 8 <= first && children >= nodes;
                if is_after && bits_of_node > BRICK_BITS {
                    bits[children..children + 8].fill(Some(bits_of_node - 1));
                }
                is_after && bits_of_node > BRICK_BITS
            }
            (false, Some(_)) => {
                let cell = ((words[node] & !BRICK) as usize).wrapping_sub(first);
                cell.is_multiple_of(BRICK_CELLS as usize) && cell < cells
            }
            (_, None) => false,
        })
    }

    /// Visits every word of a cell with the cell's level.
    pub fn each_cell(&self, grid: &CellGrid, mut visit: impl FnMut(usize, u32)) {
        let mut open: Vec<(usize, u32)> = (0..grid.top_nodes().element_product() as usize)
            .map(|node| (HEADER + node, grid.shift))
            .collect();
        while let Some((node, bits)) = open.pop() {
            let word = self.words[node];
            if word & BRICK == 0 {
                open.extend((word as usize..word as usize + 8).map(|child| (child, bits - 1)));
            } else {
                let first = (word & !BRICK) as usize;
                (first..first + BRICK_CELLS as usize).for_each(|cell| visit(cell, bits - BRICK_BITS));
            }
        }
    }
}
