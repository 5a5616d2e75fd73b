//! The hierarchical volumetric data structure: which (level, cell, cluster code) triples hold
//! surface, their areas, and their nesting. [Yue §2]
//!
//! A triple that holds surface is a *cluster*. Clusters are numbered level by level from the base.
//! Within a level, the order is by cluster code and then along a Morton curve. So the children of a
//! cluster are contiguous one level down, in order, and neighbours on a surface are close together.

use crate::scene::fragment::{Fragment, Keyed, Plane};
use crate::scene::split_planes::{self, CellCluster, PART_BITS, Splits, Walls};
use crate::scene::{Triangle, clip};
use crate::types;
use glam::{UVec3, Vec3};
use std::collections::HashMap;
use std::ops::Range;

/// The clusters of a scene.
#[derive(Clone, Debug)]
pub struct Hvds {
    /// The base grid.
    pub grid: types::Grid,
    /// Clusters of each level, base first, root last.
    pub levels: Vec<Range<u32>>,
    /// First index in `cell_clusters` of each base cell, and the end.
    pub cell_offsets: Vec<u32>,
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
    /// First child of each cluster one level down, and the end; zero for base clusters.
    pub child_offsets: Vec<u32>,
    /// Fragments of active sides in base cells.
    pub fragments: Vec<Fragment>,
    /// Whether each cluster is visibility-inconsistent, so that it stands for none of its children.
    /// Empty if no cluster is.
    pub inconsistent: Vec<bool>,
}

/// Key of a base cluster: cluster code, then Morton index of the cell, then three bits for the side
/// of a split plane. Each level up drops three bits, first those of the split plane.
fn key(code: u32, cell: UVec3) -> u64 {
    let spread = |v: u32| (0..15).fold(0u64, |m, bit| m | (u64::from(v >> bit) & 1) << (3 * bit));
    let cell = spread(cell.z) << 2 | spread(cell.y) << 1 | spread(cell.x);
    u64::from(code) << 48 | cell << PART_BITS
}

fn key_up(key: u64) -> u64 {
    (key >> 48) << 48 | (key & ((1 << 48) - 1)) >> 3
}

impl Hvds {
    /// Builds the clusters of all active sides. Base clusters are split between stacked surfaces,
    /// and along walls without thickness that stand on them. `surfaces` goes with `triangles`;
    /// `cells` is a power of two.
    pub fn build(triangles: &[Triangle], surfaces: &[types::Surface], grid: types::Grid, cells: u32) -> Self {
        Self::build_with(triangles, surfaces, grid, cells, Splits { walls: Walls::Sheets, are_stacked: true })
    }

    /// Builds the clusters with base clusters split along all walls that stand on them.
    pub fn build_split(
        triangles: &[Triangle],
        surfaces: &[types::Surface],
        grid: types::Grid,
        cells: u32,
    ) -> Self {
        Self::build_with(triangles, surfaces, grid, cells, Splits { walls: Walls::All, are_stacked: true })
    }

    /// Builds the clusters with what splits them.
    pub fn build_with(
        triangles: &[Triangle],
        surfaces: &[types::Surface],
        grid: types::Grid,
        cells: u32,
        splits: Splits,
    ) -> Self {
        let (mut parts, mut fragments) = cut_sides(triangles, surfaces, &grid);
        let normal_of = |side: u32| surfaces[side as usize / 2].normal_of(side % 2 == 1);
        let is_sheet =
            |side: u32| [false, true].iter().all(|&b| surfaces[side as usize / 2].side_is_active(b));
        let planes = split_planes::split(
            &mut fragments,
            grid.cell_size(),
            normal_of,
            split_planes::cell_key,
            is_sheet,
            splits,
        );
        if splits.walls == Walls::All || !planes.is_empty() {
            // Cells that a triangle only touches count too. A split cluster's
            // halves count separately.
            parts.retain(|part| part.1 == 0.0 && !planes.contains_key(&part.0));
            parts.extend(fragments.iter().map(|(key, fragment)| (*key, fragment.area_m2)));
        }
        Self::from_fragments(grid, cells, parts, fragments, &planes)
    }

    fn from_fragments(
        grid: types::Grid,
        cells: u32,
        mut parts: Keyed<f64>,
        mut fragments: Keyed<Fragment>,
        planes: &HashMap<u64, Plane>,
    ) -> Self {
        parts.sort_by_key(|part| part.0);

        let mut level = merge(&parts);
        for (key, fragment) in &mut fragments {
            fragment.cluster = level.partition_point(|cluster| cluster.0 < *key) as u32;
        }
        let mut hvds = Self {
            grid,
            levels: Vec::new(),
            cell_offsets: Vec::new(),
            cell_clusters: Vec::new(),
            areas_m2: Vec::new(),
            unweighted: Vec::new(),
            parents: Vec::new(),
            child_offsets: vec![0],
            fragments: fragments.into_iter().map(|(_, fragment)| fragment).collect(),
            inconsistent: Vec::new(),
        };
        hvds.cell_table(&level, planes);
        for depth in 0..=cells.ilog2() {
            let first = hvds.areas_m2.len() as u32;
            let next_first = first + level.len() as u32;
            hvds.levels.push(first..next_first);
            let key_up = |key| if depth == 0 { key_up(key_up(key)) } else { key_up(key) };
            let up: Keyed<f64> = level.iter().map(|&(key, area)| (key_up(key), area)).collect();
            let parents = merge(&up);
            let mut parent = 0;
            for (index, &(_, area)) in level.iter().enumerate() {
                hvds.areas_m2.push(area as f32);
                if depth == cells.ilog2() {
                    hvds.parents.push(types::NO_CLUSTER);
                    continue;
                }
                if parents[parent].0 != up[index].0 {
                    parent += 1;
                }
                hvds.parents.push(next_first + parent as u32);
            }
            level = parents;
        }
        hvds.link_children();
        hvds.unweighted = vec![types::NO_CLUSTER; hvds.levels[0].len()];
        hvds
    }

    /// The clusters without fragments: cells, areas and nesting.
    pub fn without_fragments(&self) -> Self {
        Self {
            grid: self.grid,
            levels: self.levels.clone(),
            cell_offsets: self.cell_offsets.clone(),
            cell_clusters: self.cell_clusters.clone(),
            areas_m2: self.areas_m2.clone(),
            unweighted: self.unweighted.clone(),
            parents: self.parents.clone(),
            child_offsets: self.child_offsets.clone(),
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

    /// The clusters of a base cell, by its index in the table.
    pub fn clusters_in(&self, cell: usize) -> impl Iterator<Item = CellCluster> {
        split_planes::read(
            &self.cell_clusters[self.cell_offsets[cell] as usize..self.cell_offsets[cell + 1] as usize],
        )
    }

    /// The base clusters that are halves of a split one.
    pub fn split_clusters(&self) -> impl Iterator<Item = u32> {
        let split = split_planes::read(&self.cell_clusters).filter(|found| found.plane.is_some());
        split.flat_map(|found| [found.cluster, found.cluster + 1])
    }

    /// The cluster of a base cell that holds a point of a surface with that code.
    pub fn base_cluster(&self, cell: usize, code: u32, position: Vec3) -> Option<u32> {
        self.clusters_in(cell).find(|found| found.code == code).map(|found| found.at(position))
    }

    /// Fills the table from base cells to their clusters; `base` is in cluster order.
    fn cell_table(&mut self, base: &[(u64, f64)], planes: &HashMap<u64, Plane>) {
        let mut entries: Vec<(usize, u32, u64)> = Vec::with_capacity(base.len());
        for (cluster, &(key, _)) in (0..).zip(base) {
            // The second half of a split cluster follows the first, and shares its entry.
            if key & 1 == 1 && planes.contains_key(&(key ^ 1)) {
                continue;
            }
            let bits = (key & ((1 << 48) - 1)) >> PART_BITS;
            let gather =
                |shift: u32| (0..15).fold(0, |v, bit| v | ((bits >> (3 * bit + shift)) as u32 & 1) << bit);
            let cell = UVec3::new(gather(0), gather(1), gather(2));
            entries.push((self.grid.index_of(cell), cluster, key));
        }
        entries.sort_unstable_by_key(|entry| (entry.0, entry.1));
        self.cell_offsets = Vec::with_capacity(self.grid.cell_count() + 1);
        for (cell, cluster, key) in entries {
            self.cell_offsets.resize(cell + 1, self.cell_clusters.len() as u32);
            split_planes::write(&mut self.cell_clusters, (key >> 48) as u32, cluster, planes.get(&key));
        }
        self.cell_offsets.resize(self.grid.cell_count() + 1, self.cell_clusters.len() as u32);
    }

    /// Builds `child_offsets` from `parents`. The children of a cluster are contiguous, in the
    /// order of their parents.
    pub fn link_children(&mut self) {
        let base = self.levels[0].len();
        let mut child_offsets = vec![0; base];
        for (child, &parent) in self.parents.iter().enumerate() {
            if parent as usize == child_offsets.len() {
                child_offsets.push(child as u32);
            }
        }
        // The clusters of the last level have no parent, so they end the child range of
        // its last cluster.
        child_offsets.push(self.levels.last().map_or(0, |root| root.start));
        self.child_offsets = child_offsets;
    }
}

/// Clips every active side against the grid. Returns (cluster key, area) of each polygon, and the
/// fragments without cluster numbers.
fn cut_sides(
    triangles: &[Triangle],
    surfaces: &[types::Surface],
    grid: &types::Grid,
) -> (Keyed<f64>, Keyed<Fragment>) {
    let mut parts = Vec::new();
    let mut fragments = Vec::new();
    for (index, (triangle, surface)) in triangles.iter().zip(surfaces).enumerate() {
        for back in [false, true] {
            if !surface.side_is_active(back) {
                continue;
            }
            let code = surface.side_code(back);
            let normal = if back { -surface.normal } else { surface.normal };
            let pull = (grid.pull * normal).as_dvec3();
            let pulled = triangle.positions.map(|p| p.as_dvec3() - pull);
            clip::for_each_cell(pulled, grid, |cell, polygon| {
                let area_m2 = clip::area(&polygon);
                parts.push((key(code, cell), area_m2));
                if area_m2 > 0.0 {
                    let corners = polygon.iter().map(|&p| (p + pull).as_vec3()).collect();
                    let side = 2 * index as u32 + u32::from(back);
                    fragments
                        .push((key(code, cell), Fragment { side, cluster: 0, area_m2, open: 1.0, corners }));
                }
            });
        }
    }
    (parts, fragments)
}

/// Adds up the areas of equal keys. Keys are sorted and stay sorted.
fn merge(parts: &[(u64, f64)]) -> Keyed<f64> {
    let mut merged: Keyed<f64> = Vec::new();
    for &(key, area) in parts {
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
    use crate::scene::{grid, surfaces};

    fn tetrahedron() -> Vec<Triangle> {
        let p = [[0.0, 0.0, 0.0], [1.3, 0.1, 0.0], [0.2, 1.1, 0.3], [0.4, 0.2, 1.9]].map(Vec3::from);
        let face = |a: usize, b: usize, c: usize| {
            let mut t = Triangle { positions: [p[a], p[b], p[c]], normals: [Vec3::ZERO; 3], material: 0 };
            t.normals = [t.geometric_normal(); 3];
            t
        };
        vec![face(0, 2, 1), face(0, 1, 3), face(1, 2, 3), face(2, 0, 3)]
    }

    #[test]
    fn every_level_holds_the_whole_area_and_children_nest() {
        let triangles = tetrahedron();
        let surfaces: Vec<_> = triangles.iter().map(|t| surfaces::surface(t, [true, true])).collect();
        let grid = grid::grid(Vec3::ZERO, Vec3::new(1.3, 1.1, 1.9), 32);
        let hvds = Hvds::build(&triangles, &surfaces, grid, 32);
        let whole = 2.0 * triangles.iter().map(Triangle::area_m2).sum::<f64>();
        for level in &hvds.levels {
            let sum: f64 = level.clone().map(|c| f64::from(hvds.areas_m2[c as usize])).sum();
            assert!((sum - whole).abs() < 1e-5 * whole, "{sum} of {whole}");
        }
        assert_eq!(hvds.levels.len(), 6);
        assert!(hvds.levels[5].len() <= 8);
        for level in 1..hvds.levels.len() {
            for parent in hvds.levels[level].clone() {
                let children = hvds.child_offsets[parent as usize]..hvds.child_offsets[parent as usize + 1];
                assert!(!children.is_empty());
                assert!(
                    children
                        .clone()
                        .all(|c| hvds.parents[c as usize] == parent && hvds.levels[level - 1].contains(&c))
                );
            }
        }
        let listed: usize = hvds.cell_clusters.len();
        assert_eq!(listed, hvds.levels[0].len());
    }
}
