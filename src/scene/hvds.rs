//! The hierarchical volumetric data structure: which (level, cell, cluster code) hold surface, how much, and how they nest.
//! [Yue §2]
//!
//! Such a triple is a *cluster*. Only clusters that hold surface exist. They are numbered level by level from the base,
//! within a level by cluster code and then along a Morton curve, so that the children of a cluster stand together, in
//! order, one level down, and so do neighbours on a surface.

use crate::scene::{Triangle, clip};
use crate::types;
use glam::{UVec3, Vec3};
use std::ops::Range;

/// The part of one triangle side in one base cell: where candidate cache points are drawn.
#[derive(Clone, Debug)]
pub struct Piece {
    /// 2·triangle + (1 if the back side).
    pub side: u32,
    /// Its base cluster.
    pub cluster: u32,
    /// Exact area, m².
    pub area_m2: f64,
    /// Corners of the convex polygon, on the surface.
    pub corners: Vec<Vec3>,
}

/// The clusters of a scene.
#[derive(Clone, Debug)]
pub struct Hvds {
    /// The base grid.
    pub grid: types::Grid,
    /// Clusters of each level, base first, root last.
    pub levels: Vec<Range<u32>>,
    /// First place in `cell_clusters` of each base cell, and the end.
    pub cell_first: Vec<u32>,
    /// Clusters of the base cells: `code << 26 | cluster`.
    pub cell_clusters: Vec<u32>,
    /// Exact surface area of each cluster, m².
    pub areas_m2: Vec<f32>,
    /// The cluster one level up; [`types::NO_CLUSTER`] at the root.
    pub parents: Vec<u32>,
    /// First child of each cluster one level down, and the end; zero for base clusters.
    pub first_children: Vec<u32>,
    /// Parts of active sides in base cells.
    pub pieces: Vec<Piece>,
}

/// Key of a cluster at some level: cluster code, then Morton index of the cell. One level up it loses three bits.
fn key(code: u32, cell: UVec3) -> u64 {
    let spread = |v: u32| (0..16).fold(0u64, |m, bit| m | (u64::from(v >> bit) & 1) << (3 * bit));
    u64::from(code) << 48 | spread(cell.z) << 2 | spread(cell.y) << 1 | spread(cell.x)
}

fn key_up(key: u64) -> u64 {
    (key >> 48) << 48 | (key & ((1 << 48) - 1)) >> 3
}

impl Hvds {
    /// Builds the clusters of all active sides. `surfaces` goes with `triangles`; `cells` is a power of two.
    pub fn build(triangles: &[Triangle], surfaces: &[types::Surface], grid: types::Grid, cells: u32) -> Self {
        let (mut parts, mut pieces) = cut_sides(triangles, surfaces, &grid);
        parts.sort_by_key(|part| part.0);

        let mut level = merge(&parts);
        for (key, piece) in &mut pieces {
            piece.cluster = level.partition_point(|cluster| cluster.0 < *key) as u32;
        }
        let mut hvds = Self {
            grid,
            levels: Vec::new(),
            cell_first: Vec::new(),
            cell_clusters: Vec::new(),
            areas_m2: Vec::new(),
            parents: Vec::new(),
            first_children: vec![0],
            pieces: pieces.into_iter().map(|(_, piece)| piece).collect(),
        };
        hvds.cell_table(&level);
        for depth in 0..=cells.ilog2() {
            let first = hvds.areas_m2.len() as u32;
            let next_first = first + level.len() as u32;
            hvds.levels.push(first..next_first);
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
        hvds
    }

    /// Clusters in all.
    pub fn cluster_count(&self) -> u32 {
        self.areas_m2.len() as u32
    }

    /// Sums a quantity of the pieces over every cluster of every level.
    pub fn sum_up(&self, of_pieces: impl IntoIterator<Item = f64>) -> Vec<f32> {
        let mut sums = vec![0.0; self.areas_m2.len()];
        for (piece, value) in self.pieces.iter().zip(of_pieces) {
            sums[piece.cluster as usize] += value;
        }
        for cluster in 0..sums.len() {
            if self.parents[cluster] != types::NO_CLUSTER {
                sums[self.parents[cluster] as usize] += sums[cluster];
            }
        }
        sums.into_iter().map(|sum| sum as f32).collect()
    }

    /// Fills the table from base cells to their clusters; `base` is in cluster order.
    fn cell_table(&mut self, base: &[(u64, f64)]) {
        let mut entries: Vec<(usize, u32)> = Vec::with_capacity(base.len());
        for (cluster, &(key, _)) in base.iter().enumerate() {
            let gather =
                |shift: u32| (0..16).fold(0, |v, bit| v | ((key >> (3 * bit + shift)) as u32 & 1) << bit);
            let cell = UVec3::new(gather(0), gather(1), gather(2));
            entries.push((self.grid.index_of(cell), ((key >> 48) as u32) << 26 | cluster as u32));
        }
        entries.sort_unstable();
        self.cell_first = vec![0; self.grid.cell_count() + 1];
        for &(cell, _) in &entries {
            self.cell_first[cell + 1] += 1;
        }
        for cell in 0..self.grid.cell_count() {
            self.cell_first[cell + 1] += self.cell_first[cell];
        }
        self.cell_clusters = entries.into_iter().map(|entry| entry.1).collect();
    }

    fn link_children(&mut self) {
        let base = self.levels[0].len();
        let mut first_children = vec![0; base];
        for (child, &parent) in self.parents.iter().enumerate() {
            if parent as usize == first_children.len() {
                first_children.push(child as u32);
            }
        }
        // The last level's clusters are nobody's children: they end the children of the level's own last cluster.
        first_children.push(self.levels.last().map_or(0, |root| root.start));
        self.first_children = first_children;
    }
}

/// Things with the key of their cluster.
type Keyed<T> = Vec<(u64, T)>;

/// Cuts every active side along the grid: (cluster key, area) of each part, and the parts themselves, their clusters still
/// to be numbered.
fn cut_sides(
    triangles: &[Triangle],
    surfaces: &[types::Surface],
    grid: &types::Grid,
) -> (Keyed<f64>, Keyed<Piece>) {
    let mut parts = Vec::new();
    let mut pieces = Vec::new();
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
                    pieces.push((key(code, cell), Piece { side, cluster: 0, area_m2, corners }));
                }
            });
        }
    }
    (parts, pieces)
}

/// Adds up the areas of equal keys; keys come sorted and stay so.
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
                let children = hvds.first_children[parent as usize]..hvds.first_children[parent as usize + 1];
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
