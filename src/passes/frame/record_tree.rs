//! The record tree: which records can have weight at a surface point. An octree over the spheres of
//! validity: a record rests in the cells of its size that its sphere meets, if its facet suits the
//! surface in them. A point asks the cells around it, the largest first. [Yue §4; Ward 1988 §4]
//! It depends neither on the camera nor on the lights. In: cache points, triangles, metres. Out:
//! cells and lists.

use crate::cpu::records::Tolerance;
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::nearest_records::NearestRecords;
use crate::scene::Triangle;
use crate::types::CachePoint;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

gpu_struct! {
    /// How a position becomes a cell of the tree's deepest level.
    pub struct TreeGrid {
        /// Lowest corner of the root, metres.
        pub low: Vec3,
        /// Cells of the deepest level a metre.
        pub scale: f32,
        /// Root cell of the tree of valid records.
        pub valid: u32,
        /// Root cell of the tree of relaxed records.
        pub relaxed: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[TreeGrid::LAYOUT];

/// Levels below the root.
const LEVELS: u32 = 20;
/// Levels whose children are made in parallel.
const PARALLEL_LEVELS: u32 = 2;
/// Number of triangles of a cell up to which each record is compared with each of them.
const FEW_TRIANGLES: usize = 32;
/// No children, or no list.
const EMPTY: u32 = u32::MAX;

/// The tree on the device: one for valid and one for relaxed records.
pub struct RecordTree {
    pub(super) grid: TreeGrid,
    pub(super) record_count: u32,
    /// Of each cell: the first of its eight children, the list of its own records.
    pub(super) cells: Buffer,
    /// Of each cell with records: the number of its own ones, then these.
    pub(super) lists: Buffer,
    pub(super) nearest: NearestRecords,
}

impl RecordTree {
    /// Builds the trees of all cache points. A cell without a triangle has no list.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(context: &Arc<Context>, points: &[CachePoint], triangles: &[Triangle]) -> Result<Self> {
        let (grid, tree) = trees(points, triangles);
        Ok(Self {
            grid,
            record_count: points.len() as u32,
            cells: Buffer::from_slice(context, GrowsWith::GatherRays.named("record tree"), &tree.cells)?,
            lists: Buffer::from_slice(context, GrowsWith::GatherRays.named("record lists"), &tree.lists)?,
            nearest: NearestRecords::new(context, points)?,
        })
    }

    /// Bytes of cells and lists.
    pub fn bytes(&self) -> u64 {
        self.cells.bytes() + self.lists.bytes() + self.nearest.bytes()
    }
}

/// The tree of valid and the tree of relaxed records, in one list of cells.
fn trees(points: &[CachePoint], triangles: &[Triangle]) -> (TreeGrid, Tree) {
    let root = root_of(points);
    // A cell of the deepest level, and what an f32 of the largest coordinate rounds.
    let farthest = root.low.abs().max((root.low + root.size).abs()).max_element();
    let margin = root.size / f64::from(1 << (LEVELS - 1)) + 4.0 * f64::from(f32::EPSILON) * farthest;
    let facets: Vec<Facet> = triangles.iter().map(Facet::of).collect();
    let all = || Items {
        records: (0..points.len() as u32).collect(),
        triangles: (0..triangles.len() as u32).collect(),
    };
    let mut tree = Tree::default();
    let mut roots = [0; 2];
    // Few pixels need relaxed records, so that long lists cost less than many.
    for (place, (tolerance, few, small)) in
        roots.iter_mut().zip([(Tolerance::VALID, 8, 0.5), (Tolerance::RELAXED, 64, 1.0)])
    {
        let builder = Builder { points, triangles, facets: &facets, tolerance, few, small, margin };
        let made = builder.make(root, all(), 0, &mut tree);
        *place = tree.cells.len() as u32;
        tree.cells.push(made);
    }
    tree.lists.resize(tree.lists.len().max(1), 0);
    let grid = TreeGrid {
        low: root.low.as_vec3(),
        scale: (f64::from(1 << LEVELS) / root.size) as f32,
        valid: roots[0],
        relaxed: roots[1],
    };
    (grid, tree)
}

/// A cube of the octree.
#[derive(Clone, Copy)]
struct Cell {
    low: DVec3,
    size: f64,
}

impl Cell {
    fn child(self, octant: usize) -> Self {
        let size = 0.5 * self.size;
        let side = DVec3::new((octant & 1) as f64, (octant >> 1 & 1) as f64, (octant >> 2) as f64);
        Self { low: self.low + size * side, size }
    }
}

/// The cube around all spheres.
fn root_of(points: &[CachePoint]) -> Cell {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for point in points {
        let (position, radius) = (point.position.as_dvec3(), f64::from(point.radius));
        (low, high) = (low.min(position - radius), high.max(position + radius));
    }
    if points.is_empty() {
        return Cell { low: DVec3::ZERO, size: 1.0 };
    }
    // The corner is exact on the device, and the outermost spheres end inside.
    let size = (high - low).max_element();
    let low = (low - 1e-3 * size).as_vec3().as_dvec3();
    Cell { low, size: 1.01 * size.max(1e-30) }
}

/// What meets a cell; indices ascend.
struct Items {
    records: Vec<u32>,
    triangles: Vec<u32>,
}

/// What kernels read of a cell.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct TreeCell {
    /// The first of its eight children, or [`EMPTY`].
    children: u32,
    /// List of the records that rest here, or [`EMPTY`].
    list: u32,
}

#[derive(Default)]
struct Tree {
    cells: Vec<TreeCell>,
    lists: Vec<u32>,
}

impl Tree {
    /// Appends a tree of its own. Returns its root as a cell of this tree.
    fn graft(&mut self, (branch, root): (Self, TreeCell)) -> TreeCell {
        let (cells, lists) = (self.cells.len() as u32, self.lists.len() as u32);
        let moved_by = |index: u32, by: u32| if index == EMPTY { EMPTY } else { index + by };
        let moved = |cell: TreeCell| TreeCell {
            children: moved_by(cell.children, cells),
            list: moved_by(cell.list, lists),
        };
        self.cells.extend(branch.cells.into_iter().map(moved));
        self.lists.extend(branch.lists);
        moved(root)
    }

    /// Appends a list. Returns its index, or [`EMPTY`].
    fn list(&mut self, records: &[u32]) -> u32 {
        if records.is_empty() {
            return EMPTY;
        }
        let first = self.lists.len() as u32;
        self.lists.push(records.len() as u32);
        self.lists.extend_from_slice(records);
        first
    }
}

/// The plane of a triangle.
struct Facet {
    /// Unit geometric normal.
    normal: Vec3,
    /// Its shading normals are its geometric normal.
    is_flat: bool,
}

impl Facet {
    fn of(triangle: &Triangle) -> Self {
        let [a, b, c] = triangle.positions.map(Vec3::as_dvec3);
        let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
        let is_flat = triangle.normals.iter().all(|shading| shading.dot(normal).abs() > FLAT);
        Self { normal, is_flat }
    }
}

/// Cosine between shading and geometric normal from which they are taken as equal: the heights that
/// both give differ by less than [`ROUNDED`] of the distance.
const FLAT: f32 = 0.999_999;
const ROUNDED: f64 = 2e-3;

struct Builder<'a> {
    points: &'a [CachePoint],
    triangles: &'a [Triangle],
    facets: &'a [Facet],
    tolerance: Tolerance,
    /// A cell with at most this many records is a leaf.
    few: usize,
    /// A record rests in cells of at most this size, over its radius: few of them reach beyond its
    /// sphere, and a sphere meets few of them.
    small: f64,
    /// Enlarges cells by more than a position is rounded, metres.
    margin: f64,
}

impl Builder<'_> {
    /// Makes the children of a cell that is `level` levels below the root, and its list. Returns
    /// what kernels read of it.
    fn make(&self, cell: Cell, items: Items, level: u32, tree: &mut Tree) -> TreeCell {
        let Items { records, triangles } = items;
        let is_large =
            |&record: &u32| cell.size <= self.small * f64::from(self.points[record as usize].radius);
        let (own, below): (Vec<u32>, Vec<u32>) = if records.len() <= self.few || level == LEVELS {
            (records, Vec::new())
        } else {
            records.into_iter().partition(is_large)
        };
        let list = tree.list(&own);
        if below.is_empty() {
            return TreeCell { children: EMPTY, list };
        }
        let first = tree.cells.len();
        tree.cells.resize(first + 8, TreeCell { children: EMPTY, list: EMPTY });
        let below = Items { records: below, triangles };
        let fill = |octant: usize, tree: &mut Tree| {
            let child = cell.child(octant);
            self.make(child, self.items_in(child, &below), level + 1, tree)
        };
        let children: Vec<TreeCell> = if level < PARALLEL_LEVELS {
            let branch = |octant: usize| {
                let mut branch = Tree::default();
                let root = fill(octant, &mut branch);
                (branch, root)
            };
            let branches: Vec<_> = (0..8).into_par_iter().map(branch).collect();
            branches.into_iter().map(|branch| tree.graft(branch)).collect()
        } else {
            (0..8).map(|octant| fill(octant, tree)).collect()
        };
        tree.cells[first..first + 8].copy_from_slice(&children);
        TreeCell { children: first as u32, list }
    }

    fn items_in(&self, cell: Cell, items: &Items) -> Items {
        let half = 0.5 * cell.size + self.margin;
        let middle = cell.low + 0.5 * cell.size;
        let meets = |&index: &u32| meets(&self.triangles[index as usize], middle, half);
        let triangles: Vec<u32> = items.triangles.iter().copied().filter(meets).collect();
        let is_near = |&record: &u32| {
            let point = &self.points[record as usize];
            let apart = ((point.position.as_dvec3() - middle).abs() - half).max(DVec3::ZERO);
            let radius = f64::from(point.radius);
            let may_serve = |&index: &u32| self.may_serve(point, &self.facets[index as usize], middle, half);
            // Rounding on the device must not lose a positive weight.
            apart.length_squared() <= 1.002 * radius * radius
                && (triangles.len() > FEW_TRIANGLES || triangles.iter().any(may_serve))
        };
        let records = items.records.iter().copied().filter(is_near).collect();
        Items { records, triangles }
    }

    /// Whether a record may have weight on a facet in a cube: the tests of `record_weight` that
    /// follow from the facet alone.
    fn may_serve(&self, point: &CachePoint, facet: &Facet, middle: DVec3, half: f64) -> bool {
        let Facet { normal, is_flat } = *facet;
        // The pixel sees either side.
        let facing = point.facet.dot(normal);
        if facing.abs() < self.tolerance.facets - 1e-3 {
            return false;
        }
        if !is_flat || point.normal.dot(point.facet) < FLAT {
            return true;
        }
        // On flat surfaces the height above the plane between both follows from their facets.
        let between = 0.5 * (point.facet + normal * facing.signum()).as_dvec3();
        let apart = middle - point.position.as_dvec3();
        let distance = apart.length() + 3.0_f64.sqrt() * half + 0.01 * f64::from(point.radius);
        let height = apart.dot(between).abs() - half * between.abs().element_sum();
        height <= (f64::from(self.tolerance.above2.max(self.tolerance.below2)).sqrt() + ROUNDED) * distance
    }
}

/// Whether a triangle may meet a cube: by the box around it, and by its plane.
fn meets(triangle: &Triangle, middle: DVec3, half: f64) -> bool {
    let [a, b, c] = triangle.positions.map(|position| position.as_dvec3() - middle);
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    if low.max_element() > half || high.min_element() < -half {
        return false;
    }
    let normal = (b - a).cross(c - a);
    normal.dot(a).abs() <= half * normal.abs().element_sum() * (1.0 + 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::records::cover_weight;
    use crate::cpu::sampling::hash;
    use std::collections::HashSet;

    /// Records that a position asks, as kernels do.
    fn asked(grid: TreeGrid, tree: &Tree, root: u32, position: Vec3) -> HashSet<u32> {
        let cell = ((position - grid.low) * grid.scale).as_uvec3();
        let (mut found, mut place) = (HashSet::new(), root);
        for bit in (0..=LEVELS).rev() {
            let TreeCell { children, list } = tree.cells[place as usize];
            if list != EMPTY {
                let first = list as usize;
                found.extend(&tree.lists[first + 1..][..tree.lists[first] as usize]);
            }
            if children == EMPTY {
                return found;
            }
            let [x, y, z] = cell.to_array().map(|axis| axis >> (bit - 1) & 1);
            place = children + (x | y << 1 | z << 2);
        }
        unreachable!("the deepest level has no children")
    }

    /// At the origin, and where an f32 resolves two millimetres. Some facets are wide and some are
    /// smaller than the cells.
    #[test]
    fn points_ask_every_record_that_has_weight_there() {
        for offset in [0.0, 3e4] {
            let mut state = 7_u32;
            let mut random = || {
                state = hash(state.wrapping_add(1));
                (state >> 8) as f32 / 16_777_216.0
            };
            let mut triangles = Vec::new();
            for size in [2.0, 0.05].iter().flat_map(|&size| [size; 12]) {
                let mut vector = || Vec3::new(random(), random(), random()) - 0.5;
                let corner = offset + 2.0 * vector();
                let corners = [corner, corner + size * vector(), corner + size * vector()];
                let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
                triangles.push(Triangle { positions: corners, normals: [normal; 3], material: 0, object: 0 });
            }
            let mut place = |index: usize| {
                let [a, b, c] = triangles[index].positions;
                let [u, v] = [random(), random()];
                let [u, v] = if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] };
                (a + u * (b - a) + v * (c - a), triangles[index].normals[0])
            };
            let point = |number: usize| {
                let (position, normal) = place(number % 24);
                let radius = if number.is_multiple_of(5) { 0.4 } else { 0.1 };
                let (occluder, inverse_reach, stream) = (Vec3::ZERO, 0.0, 0);
                CachePoint {
                    position,
                    radius,
                    normal,
                    side: 0,
                    occluder,
                    facet: normal,
                    inverse_reach,
                    stream,
                }
            };
            let points: Vec<CachePoint> = (0..1000).map(point).collect();
            let (grid, tree) = trees(&points, &triangles);
            let (mut served, mut spared) = (0, 0);
            for number in 0..2000 {
                let (position, normal) = place(number % 24);
                for (root, within) in [(grid.valid, Tolerance::VALID), (grid.relaxed, Tolerance::RELAXED)] {
                    let asked = asked(grid, &tree, root, position);
                    for (index, point) in (0..).zip(&points) {
                        let has_weight = cover_weight(position, normal, normal, point, within) > 1e-4;
                        assert!(!has_weight || asked.contains(&index), "{position} lacks record {index}");
                        served += u32::from(has_weight);
                    }
                    spared += points.len() - asked.len();
                }
            }
            assert!(served > 10_000 && spared > 3_000_000, "{served} weights, {spared} records spared");
        }
    }

    #[test]
    fn a_triangle_meets_the_cubes_on_its_plane_alone() {
        let corners = [Vec3::ZERO, Vec3::new(4.0, 0.0, 4.0), Vec3::new(0.0, 4.0, 4.0)];
        let triangle = Triangle { positions: corners, normals: [Vec3::Y; 3], material: 0, object: 0 };
        assert!(meets(&triangle, DVec3::new(1.0, 1.0, 2.0), 0.1));
        assert!(!meets(&triangle, DVec3::new(1.0, 1.0, 3.0), 0.3), "beside the plane");
        assert!(!meets(&triangle, DVec3::new(6.0, 1.0, 7.0), 0.5), "outside the box");
    }
}
