//! The hierarchical volumetric data structure: which (level, cell, cluster code) triples hold
//! surface, their areas, and their nesting. [Yue §2]
//!
//! A triple that holds surface is a *cluster*. The cells are the leaves of an octree, of all sizes;
//! their clusters are the base. On level n, the clusters of all cells of 2ⁿ smallest cells' width
//! follow that are no leaves. Within a level, the order is by cluster code and then along a Morton
//! curve, so that neighbours on a surface are close together.

use crate::scene::cluster_key::{self, Key, Keyed};
use crate::scene::fragment::{Fragment, Plane};
use crate::scene::grid::{CellGrid, Cells};
use crate::scene::octree::{Cell, Octree};
use crate::scene::split_planes::{self, CellCluster, Splits, Walls};
use crate::scene::{Triangle, clip};
use crate::types;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// The clusters of a scene.
#[derive(Clone, Debug)]
pub struct Hvds {
    /// The smallest cells.
    pub grid: CellGrid,
    /// Clusters of each level, base first, root last.
    pub levels: Vec<Range<u32>>,
    /// The base cells, with their lists in `cell_clusters`.
    pub octree: Octree,
    /// Level of the cell of each base cluster, without the unweighted ones.
    pub cell_levels: Vec<u8>,
    /// Clusters of the base cells: `code << 26 | cluster`. The split plane follows a cluster that
    /// is split ([`Self::clusters_in`]).
    pub cell_clusters: Vec<u32>,
    /// Exact surface area of each cluster, m². An unweighted cluster has the area of its cluster.
    pub areas_m2: Vec<f32>,
    /// The unweighted cluster of each base cluster, for readers nearby
    /// ([`Self::with_unweighted`]); [`types::NO_CLUSTER`] if it has none.
    pub unweighted: Vec<u32>,
    /// The cluster one level up; [`types::NO_CLUSTER`] at the root.
    pub parents: Vec<u32>,
    /// First child, in `children`, of each cluster above the base, and the end.
    pub child_offsets: Vec<u32>,
    /// The children of all clusters, in order of their parents.
    pub children: Vec<u32>,
    /// Fragments of active sides in base cells.
    pub fragments: Vec<Fragment>,
    /// Whether each cluster is visibility-inconsistent, so that it stands for none of its children.
    /// Empty if no cluster is.
    pub inconsistent: Vec<bool>,
}

impl Hvds {
    /// Builds the clusters of all active sides. Base clusters are split between stacked surfaces,
    /// and along walls without thickness that stand on them. `surfaces` goes with `triangles`.
    pub fn build(triangles: &[Triangle], surfaces: &[types::Surface], grid: CellGrid) -> Self {
        let splits = Splits { walls: Walls::Sheets, are_stacked: true };
        Self::build_with(triangles, surfaces, &Cells::uniform(grid), splits)
    }

    /// Builds the clusters with base clusters split along all walls that stand on them.
    pub fn build_split(triangles: &[Triangle], surfaces: &[types::Surface], grid: CellGrid) -> Self {
        let splits = Splits { walls: Walls::All, are_stacked: true };
        Self::build_with(triangles, surfaces, &Cells::uniform(grid), splits)
    }

    /// Builds the clusters with what splits them.
    pub fn build_with(
        triangles: &[Triangle],
        surfaces: &[types::Surface],
        cells: &Cells,
        splits: Splits,
    ) -> Self {
        let (mut parts, mut fragments) = cut_sides(triangles, surfaces, cells);
        let grid = cells.grid;
        let normal_of = |side: u32| surfaces[side as usize / 2].normal_of(side % 2 == 1);
        let is_sheet =
            |side: u32| [false, true].iter().all(|&b| surfaces[side as usize / 2].side_is_active(b));
        let planes = split_planes::split(&mut fragments, grid.cell_size(), normal_of, is_sheet, splits);
        if splits.walls == Walls::All || !planes.is_empty() {
            // Cells that a triangle only touches count too. A split cluster's
            // halves count separately.
            parts.retain(|part| part.1 == 0.0 && !planes.contains_key(&part.0));
            parts.extend(fragments.iter().map(|(key, fragment)| (*key, fragment.area_m2)));
        }
        Self::from_fragments(grid, parts, fragments, &planes)
    }

    fn from_fragments(
        grid: CellGrid,
        mut parts: Keyed<f64>,
        mut fragments: Keyed<Fragment>,
        planes: &HashMap<Key, Plane>,
    ) -> Self {
        parts.sort_by_key(|part| part.0);

        let base = merge(parts);
        for (key, fragment) in &mut fragments {
            fragment.cluster = base.partition_point(|cluster| cluster.0 < *key) as u32;
        }
        let mut hvds = Self {
            grid,
            levels: Vec::new(),
            octree: Octree::default(),
            cell_levels: base.iter().map(|&(key, _)| cluster_key::level(key) as u8).collect(),
            cell_clusters: Vec::new(),
            areas_m2: base.iter().map(|&(_, area)| area as f32).collect(),
            unweighted: vec![types::NO_CLUSTER; base.len()],
            parents: vec![types::NO_CLUSTER; base.len()],
            child_offsets: Vec::new(),
            children: Vec::new(),
            fragments: fragments.into_iter().map(|(_, fragment)| fragment).collect(),
            inconsistent: Vec::new(),
        };
        hvds.list_cells(&base, planes);
        hvds.add_levels(base);
        hvds.link_children();
        hvds
    }

    /// Adds the clusters above the base, level by level.
    fn add_levels(&mut self, base: Keyed<f64>) {
        self.levels.push(0..base.len() as u32);
        let numbered = |first: u32, clusters: Keyed<f64>| -> Vec<(Key, u32, f64)> {
            (first..).zip(clusters).map(|(cluster, (key, area))| (key, cluster, area)).collect()
        };
        let depth = self.grid.depth().max(1);
        let mut leaves: Vec<Vec<(Key, u32, f64)>> = vec![Vec::new(); depth as usize];
        for leaf in numbered(0, base) {
            leaves[(cluster_key::level(leaf.0) as usize).min(depth as usize - 1)].push(leaf);
        }
        let mut below: Vec<(Key, u32, f64)> = Vec::new();
        for (level, leaves) in (1..).zip(leaves) {
            let is_mixed = !below.is_empty() && !leaves.is_empty();
            below.extend(leaves);
            below.iter_mut().for_each(|child| child.0 = cluster_key::above(child.0, level));
            if is_mixed {
                below.sort_by_key(|child| child.0);
            }
            let first = self.areas_m2.len() as u32;
            let merged = merge(below.iter().map(|&(key, _, area)| (key, area)));
            let mut parent = 0;
            for &(key, child, _) in &below {
                parent += usize::from(merged[parent].0 != key);
                self.parents[child as usize] = first + parent as u32;
            }
            self.areas_m2.extend(merged.iter().map(|&(_, area)| area as f32));
            self.parents.resize(self.areas_m2.len(), types::NO_CLUSTER);
            self.levels.push(first..self.areas_m2.len() as u32);
            below = numbered(first, merged);
        }
    }

    /// The clusters without fragments: cells, areas and nesting.
    pub fn without_fragments(&self) -> Self {
        Self {
            grid: self.grid,
            levels: self.levels.clone(),
            octree: self.octree.clone(),
            cell_levels: self.cell_levels.clone(),
            cell_clusters: self.cell_clusters.clone(),
            areas_m2: self.areas_m2.clone(),
            unweighted: self.unweighted.clone(),
            parents: self.parents.clone(),
            child_offsets: self.child_offsets.clone(),
            children: self.children.clone(),
            fragments: Vec::new(),
            inconsistent: self.inconsistent.clone(),
        }
    }

    /// Number of clusters.
    pub fn cluster_count(&self) -> u32 {
        self.areas_m2.len() as u32
    }

    /// The parent cluster if it may stand for this one; else [`types::NO_CLUSTER`].
    pub fn coarser(&self, cluster: u32) -> u32 {
        let parent = self.parents[cluster as usize];
        let is_inconsistent =
            self.inconsistent.get(parent as usize).is_some_and(|&inconsistent| inconsistent);
        if is_inconsistent { types::NO_CLUSTER } else { parent }
    }

    /// The cluster of that level around a base cluster, or the next one above a wider cell.
    pub fn above(&self, mut cluster: u32, level: usize) -> u32 {
        let first = self.levels[level.min(self.levels.len() - 1)].start;
        while cluster < first && self.parents[cluster as usize] != types::NO_CLUSTER {
            cluster = self.parents[cluster as usize];
        }
        cluster
    }

    /// Sums a quantity of the fragments over every cluster of every level.
    pub fn sum_up(&self, of_fragment: impl IntoIterator<Item = f64>) -> Vec<f32> {
        let mut of_base = vec![0.0; self.levels[0].len()];
        for (fragment, value) in self.fragments.iter().zip(of_fragment) {
            of_base[fragment.cluster as usize] += value;
        }
        self.sum_levels(self.copied_to_unweighted(of_base))
    }

    /// The clusters without interior surface: `open` is the exposed area fraction, 0..=1, of each
    /// fragment. Clusters stay, even without any exposed area.
    #[must_use]
    pub fn without_interior(mut self, open: &[f32]) -> Self {
        if open.iter().all(|&open| open == 1.0) {
            return self;
        }
        for (fragment, &open) in self.fragments.iter_mut().zip(open) {
            fragment.open = open;
        }
        self.fragments.retain(|fragment| fragment.open > 0.0);
        self.areas_m2 = self.sum_up(self.fragments.iter().map(Fragment::open_area_m2));
        self
    }

    /// The clusters with marks of the visibility-inconsistent ones.
    #[must_use]
    pub fn with_inconsistent(self, inconsistent: Vec<bool>) -> Self {
        Self { inconsistent, ..self }
    }

    /// The children of a cluster; none of a base cluster.
    pub fn children_of(&self, cluster: u32) -> &[u32] {
        let Some(above) = cluster.checked_sub(self.levels[0].end) else { return &[] };
        let [first, end] = [0, 1].map(|next| self.child_offsets[above as usize + next] as usize);
        &self.children[first..end]
    }

    /// Size of the cell of a base cluster that is no unweighted one, metres.
    pub fn cell_size_of(&self, cluster: u32) -> f32 {
        self.grid.cell_size() as f32 * self.scale_of(cluster)
    }

    /// Size of that cell over the smallest one's.
    pub fn scale_of(&self, cluster: u32) -> f32 {
        (1u32 << self.cell_levels[cluster as usize]) as f32
    }

    /// The base cell of a point on the side that `normal` faces.
    pub fn cell_at(&self, position: Vec3, normal: Vec3) -> Cell {
        self.octree.cell_at(&self.grid, self.grid.cell_of(position, normal))
    }

    /// The clusters of a base cell.
    pub fn clusters_in(&self, cell: Cell) -> impl Iterator<Item = CellCluster> {
        let [first, end] = [0, 1].map(|next| self.octree.words[cell.word + next] as usize);
        split_planes::read(&self.cell_clusters[first..end])
    }

    /// The base clusters that are halves of a split one.
    pub fn split_clusters(&self) -> impl Iterator<Item = u32> {
        let split = split_planes::read(&self.cell_clusters).filter(|found| found.plane.is_some());
        split.flat_map(|found| [found.cluster, found.cluster + 1])
    }

    /// The cluster of a base cell that holds a point of a surface with that code.
    pub fn base_cluster(&self, cell: Cell, code: u32, position: Vec3) -> Option<u32> {
        self.clusters_in(cell).find(|found| found.code == code).map(|found| found.at(position))
    }

    /// Fills the octree and the lists of its cells; `base` is in cluster order.
    fn list_cells(&mut self, base: &[(Key, f64)], planes: &HashMap<Key, Plane>) {
        // The second half of a split cluster follows the first, and shares its entry.
        let is_entry = |key: Key| {
            let first = cluster_key::first_half(key);
            first == key || !planes.contains_key(&first)
        };
        let entries: Vec<(Key, u32)> =
            base.iter().map(|found| found.0).zip(0..).filter(|&(key, _)| is_entry(key)).collect();
        let place = |&(key, _): &(Key, u32)| (cluster_key::corner(key), cluster_key::level(key));
        let cells: Vec<_> = entries.iter().map(place).collect();
        let (octree, words) = Octree::new(&self.grid, &cells);
        self.octree = octree;
        let mut order: Vec<(usize, u32, Key)> =
            words.into_iter().zip(entries).map(|(word, (key, cluster))| (word, cluster, key)).collect();
        order.sort_unstable_by_key(|entry| (entry.0, entry.1));
        let mut next = self.octree.first_cell();
        for (word, cluster, key) in order {
            self.octree.words[next..=word].fill(self.cell_clusters.len() as u32);
            next = next.max(word + 1);
            split_planes::write(&mut self.cell_clusters, cluster_key::code(key), cluster, planes.get(&key));
        }
        self.octree.words[next..].fill(self.cell_clusters.len() as u32);
    }

    /// Whether each base cluster has the level of the cell whose list it is in.
    pub fn has_cell_levels(&self) -> bool {
        let mut is_right = true;
        self.octree.each_cell(&self.grid, |word, level| {
            let mut listed = self.clusters_in(Cell { word, level });
            is_right &= listed.all(|found| u32::from(self.cell_levels[found.cluster as usize]) == level);
        });
        is_right
    }

    /// Lists the children of each cluster from `parents`.
    pub fn link_children(&mut self) {
        let base = self.levels[0].end;
        let above = |parent: &u32| (*parent != types::NO_CLUSTER).then(|| (parent - base) as usize);
        self.child_offsets = vec![0; self.parents.len() - base as usize + 1];
        for parent in self.parents.iter().filter_map(above) {
            self.child_offsets[parent + 1] += 1;
        }
        for cluster in 1..self.child_offsets.len() {
            self.child_offsets[cluster] += self.child_offsets[cluster - 1];
        }
        let mut next = self.child_offsets.clone();
        self.children = vec![0; self.child_offsets.last().map_or(0, |&end| end as usize)];
        for (child, parent) in (0..).zip(&self.parents) {
            if let Some(parent) = above(parent) {
                self.children[next[parent] as usize] = child;
                next[parent] += 1;
            }
        }
    }
}

/// Clips every active side against the cells. Returns (cluster key, area) of each polygon, and the
/// fragments without cluster numbers.
fn cut_sides(
    triangles: &[Triangle],
    surfaces: &[types::Surface],
    cells: &Cells,
) -> (Keyed<f64>, Keyed<Fragment>) {
    // Triangles of a task: one may reach many cells.
    const TASK: usize = 32;
    let tasks = triangles.par_chunks(TASK).zip(surfaces.par_chunks(TASK)).enumerate();
    let pieces: Vec<_> = tasks
        .map(|(task, (triangles, surfaces))| {
            let (mut parts, mut fragments) = (Vec::new(), Vec::new());
            for (index, (triangle, surface)) in (TASK * task..).zip(triangles.iter().zip(surfaces)) {
                for back in [false, true].into_iter().filter(|&back| surface.side_is_active(back)) {
                    let side = 2 * index as u32 + u32::from(back);
                    cut_side((triangle, surface, back), side, cells, &mut parts, &mut fragments);
                }
            }
            (parts, fragments)
        })
        .collect();
    let (mut parts, mut fragments) = (Vec::new(), Vec::new());
    for (mut more_parts, mut more_fragments) in pieces {
        parts.append(&mut more_parts);
        fragments.append(&mut more_fragments);
    }
    (parts, fragments)
}

fn cut_side(
    (triangle, surface, back): (&Triangle, &types::Surface, bool),
    side: u32,
    cells: &Cells,
    parts: &mut Keyed<f64>,
    fragments: &mut Keyed<Fragment>,
) {
    let code = surface.side_code(back);
    let normal = if back { -surface.normal } else { surface.normal };
    let pull = (cells.grid.pull * normal).as_dvec3();
    let pulled = triangle.positions.map(|p| p.as_dvec3() - pull);
    clip::for_each_cell(pulled, cells, |corner, level, polygon| {
        let (area_m2, key) = (clip::area(&polygon), cluster_key::key(code, corner, level));
        parts.push((key, area_m2));
        if area_m2 > 0.0 {
            let corners = polygon.iter().map(|&p| (p + pull).as_vec3()).collect();
            fragments.push((key, Fragment { side, cluster: 0, area_m2, open: 1.0, corners }));
        }
    });
}

/// Adds up the areas of equal keys. Keys are sorted and stay sorted.
fn merge(parts: impl IntoIterator<Item = (Key, f64)>) -> Keyed<f64> {
    let mut merged: Keyed<f64> = Vec::new();
    for (key, area) in parts {
        match merged.last_mut() {
            Some(last) if last.0 == key => last.1 += area,
            _ => merged.push((key, area)),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::cell_sizes::{CellSizes, Region};
    use crate::scene::{grid, surfaces};

    fn tetrahedron() -> Vec<Triangle> {
        let p = [[0.0, 0.0, 0.0], [1.3, 0.1, 0.0], [0.2, 1.1, 0.3], [0.4, 0.2, 1.9]].map(Vec3::from);
        let face = |a: usize, b: usize, c: usize| {
            let mut t =
                Triangle { positions: [p[a], p[b], p[c]], normals: [Vec3::ZERO; 3], material: 0, object: 0 };
            t.normals = [t.geometric_normal(); 3];
            t
        };
        vec![face(0, 2, 1), face(0, 1, 3), face(1, 2, 3), face(2, 0, 3)]
    }

    /// Small cells around a speck on a plane of a kilometre.
    fn graded() -> (Vec<Triangle>, Vec<types::Surface>, Cells) {
        let mut triangles: Vec<Triangle> = tetrahedron();
        let corner = |x: f32, z: f32| Vec3::new(x, -0.02, z);
        let plane = [[-500.0, -500.0], [-500.0, 500.0], [500.0, 500.0], [500.0, -500.0]];
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let positions = corners.map(|index: usize| corner(plane[index][0], plane[index][1]));
            triangles.push(Triangle { positions, normals: [Vec3::Y; 3], material: 0, object: 0 });
        }
        let surfaces: Vec<_> = triangles.iter().map(|t| surfaces::surface(t, [true, true])).collect();
        let regions = vec![
            Region { low: Vec3::ZERO, high: Vec3::new(1.3, 1.1, 1.9), halvings: 8 },
            Region { low: Vec3::new(20.0, -1.0, 3.0), high: Vec3::new(30.0, 1.0, 10.0), halvings: 5 },
        ];
        let sizes = CellSizes { regions, reach_m: 125.0 };
        let (low, high) = (Vec3::new(-500.0, -0.02, -500.0), Vec3::new(500.0, 1.9, 500.0));
        (triangles, surfaces, Cells::new(low, high, 32, &sizes))
    }

    #[test]
    fn cells_of_many_sizes_hold_the_whole_area_and_every_point() {
        let (triangles, surfaces, cells) = graded();
        let splits = Splits { walls: Walls::Sheets, are_stacked: true };
        let hvds = Hvds::build_with(&triangles, &surfaces, &cells, splits);
        let whole = 2.0 * triangles.iter().map(Triangle::area_m2).sum::<f64>();
        let area = |cluster: u32| f64::from(hvds.areas_m2[cluster as usize]);
        assert!((hvds.levels[0].clone().map(area).sum::<f64>() / whole - 1.0).abs() < 1e-5);
        let roots = hvds.levels.last().unwrap();
        assert!((roots.clone().map(area).sum::<f64>() / whole - 1.0).abs() < 1e-5);
        for cluster in hvds.levels[0].end..hvds.cluster_count() {
            let sum: f64 = hvds.children_of(cluster).iter().map(|&child| area(child)).sum();
            assert!((sum - area(cluster)).abs() <= 1e-5 * sum && !hvds.children_of(cluster).is_empty());
        }
        let mut levels = [0; 16];
        hvds.cell_levels.iter().for_each(|&level| levels[usize::from(level)] += 1);
        assert!(levels[..9].iter().all(|&count| count > 10) && levels[9..] == [0; 7], "{levels:?}");
        assert!(hvds.has_cell_levels() && hvds.octree.is_sound(&hvds.grid, hvds.cell_clusters.len()));
        // Base clusters below a cluster are one range.
        for fragment in hvds.fragments.iter().filter(|fragment| fragment.area_m2 > 1e-6) {
            let middle = fragment.middle();
            let surface = &surfaces[fragment.side as usize / 2];
            let (is_back, cell_m) = (fragment.side % 2 == 1, hvds.cell_size_of(fragment.cluster));
            let cell = hvds.cell_at(middle, surface.normal_of(is_back));
            assert_eq!(hvds.base_cluster(cell, surface.side_code(is_back), middle), Some(fragment.cluster));
            let corners = &fragment.corners;
            assert!(corners.iter().all(|corner| corner.distance(middle) < 1.74 * cell_m));
            assert!(
                f64::from(cell_m) <= 1.01 * 1000.0 / 31.0 * cells.sizes.fraction_at(middle).max(1.0 / 256.0)
            );
        }
    }

    #[test]
    fn every_level_holds_the_whole_area_and_children_nest() {
        let triangles = tetrahedron();
        let surfaces: Vec<_> = triangles.iter().map(|t| surfaces::surface(t, [true, true])).collect();
        let grid = grid::grid(Vec3::ZERO, Vec3::new(1.3, 1.1, 1.9), 32);
        let hvds = Hvds::build(&triangles, &surfaces, grid);
        let whole = 2.0 * triangles.iter().map(Triangle::area_m2).sum::<f64>();
        for level in &hvds.levels {
            let sum: f64 = level.clone().map(|c| f64::from(hvds.areas_m2[c as usize])).sum();
            assert!((sum - whole).abs() < 1e-5 * whole, "{sum} of {whole}");
        }
        assert_eq!(hvds.levels.len(), 6);
        assert!(hvds.levels[5].len() <= 8);
        for level in 1..hvds.levels.len() {
            for parent in hvds.levels[level].clone() {
                let children = hvds.children_of(parent);
                assert!(!children.is_empty());
                let is_below =
                    |&c: &u32| hvds.parents[c as usize] == parent && hvds.levels[level - 1].contains(&c);
                assert!(children.iter().all(is_below));
            }
        }
        let listed: usize = hvds.cell_clusters.len();
        assert_eq!(listed, hvds.levels[0].len());
    }
}
