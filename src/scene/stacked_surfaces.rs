//! Stacked surfaces in one cell face the same way and cover each other, such as a screen close to a
//! wall. The gap between them may be bright while the room is dark, so they need separate clusters.
//! [Yue §5, Figure 3]

use super::cluster_key::Key;
use super::fragment::{Fragment, Plane};
use glam::{DVec2, DVec3, Vec3};

/// Smallest distance between stacked surfaces, in cells.
const APART: f64 = 4e-3;
/// One surface covers another if their bounding boxes share this fraction of the smaller box.
const COVERS: f64 = 0.25;

/// Fragments between two heights, and their bounding box as seen along the normal.
#[derive(Clone, Copy)]
struct Slab {
    bottom: f64,
    top: f64,
    low: DVec2,
    high: DVec2,
}

impl Slab {
    fn with(self, other: &Self) -> Self {
        Self {
            bottom: self.bottom.min(other.bottom),
            top: self.top.max(other.top),
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    fn area(low: DVec2, high: DVec2) -> f64 {
        (high - low).max(DVec2::ZERO).element_product()
    }

    fn covers(&self, other: &Self) -> bool {
        let shared = Self::area(self.low.max(other.low), self.high.min(other.high));
        shared > COVERS * Self::area(self.low, self.high).min(Self::area(other.low, other.high))
    }
}

/// The plane half-way between two stacked surfaces of a cluster, in the widest gap. `None` if no
/// surface covers another.
pub(super) fn between(
    cluster: &[&(Key, Fragment)],
    cell_size: f64,
    normal_of: &impl Fn(u32) -> Vec3,
) -> Option<Plane> {
    if cluster.len() < 2 {
        return None;
    }
    let normal = |fragment: &Fragment| fragment.area_m2 * normal_of(fragment.side).as_dvec3();
    let normal = cluster.iter().map(|(_, fragment)| normal(fragment)).sum::<DVec3>().normalize_or_zero();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let slab = |fragment: &Fragment| {
        let none = Slab {
            bottom: f64::INFINITY,
            top: f64::NEG_INFINITY,
            low: DVec2::INFINITY,
            high: DVec2::NEG_INFINITY,
        };
        fragment.corners.iter().map(|corner| corner.as_dvec3()).fold(none, |slab, p| {
            let (height, place) = (normal.dot(p), DVec2::new(tangent.dot(p), bitangent.dot(p)));
            slab.with(&Slab { bottom: height, top: height, low: place, high: place })
        })
    };
    let mut slabs: Vec<Slab> = cluster.iter().map(|(_, fragment)| slab(fragment)).collect();
    slabs.sort_by(|a, b| a.bottom.total_cmp(&b.bottom));
    let mut over: Vec<Slab> = slabs.clone();
    for index in (1..slabs.len()).rev() {
        over[index - 1] = over[index - 1].with(&over[index]);
    }
    let (mut under, mut best) = (slabs[0], (APART * cell_size, None));
    for (slab, over) in slabs[1..].iter().zip(&over[1..]) {
        let apart = slab.bottom - under.top;
        if apart > best.0 && over.covers(&under) {
            best = (apart, Some(0.5 * (slab.bottom + under.top)));
        }
        under = under.with(slab);
    }
    let [x, y, z] = normal.as_vec3().to_array();
    best.1.map(|height| [x, y, z, height as f32])
}

#[cfg(test)]
mod tests {
    use crate::scene::hvds::Hvds;
    use crate::scene::{Triangle, grid, surfaces};
    use glam::Vec3;

    /// A horizontal square from `low` to `high` in x and z.
    fn level(y: f32, low: f32, high: f32) -> [Triangle; 2] {
        let p = [[low, low], [low, high], [high, high], [high, low]].map(|[x, z]| Vec3::new(x, y, z));
        [[0, 1, 2], [0, 2, 3]].map(|corners| {
            let mut t = Triangle {
                positions: corners.map(|k| p[k]),
                normals: [Vec3::ZERO; 3],
                material: 0,
                object: 0,
            };
            t.normals = [t.geometric_normal(); 3];
            t
        })
    }

    /// Counts for that surface over a floor: halves of split clusters, and clusters that hold
    /// surface of both heights.
    fn parted(upper: [Triangle; 2], both: [f32; 2]) -> [usize; 2] {
        let triangles = [level(0.0, 0.0, 2.0), upper].concat();
        let surfaces: Vec<_> = triangles.iter().map(|t| surfaces::surface(t, [true, true])).collect();
        let grid = grid::grid(Vec3::ZERO, Vec3::new(2.0, 1.0, 2.0), 16);
        let hvds = Hvds::build(&triangles, &surfaces, grid);
        let mut heights = vec![[false; 2]; hvds.levels[0].len()];
        for fragment in hvds.fragments.iter().filter(|fragment| fragment.area_m2 > 1e-6) {
            let middle = fragment.corners.iter().sum::<Vec3>() / fragment.corners.len() as f32;
            heights[fragment.cluster as usize][usize::from(middle.y > 0.5 * (both[0] + both[1]))] = true;
            let surface = &surfaces[fragment.side as usize / 2];
            let is_back = fragment.side % 2 == 1;
            let cell = hvds.cell_at(middle, surface.normal_of(is_back));
            assert_eq!(hvds.base_cluster(cell, surface.side_code(is_back), middle), Some(fragment.cluster));
        }
        let whole = 2.0 * triangles.iter().map(Triangle::area_m2).sum::<f64>();
        for level in &hvds.levels {
            let sum: f64 = level.clone().map(|c| f64::from(hvds.areas_m2[c as usize])).sum();
            assert!((sum - whole).abs() < 1e-5 * whole, "{sum} of {whole}");
        }
        let mixed = heights.iter().filter(|heights| **heights == [true; 2]).count();
        [hvds.split_clusters().count(), mixed]
    }

    #[test]
    fn what_covers_a_surface_in_its_cell_is_a_cluster_of_its_own() {
        let [split, mixed] = parted(level(0.03, 0.5, 1.5), [0.0, 0.03]);
        // Cells of 2/15 m, fronts and backs.
        assert!(split > 2 * 2 * 40 && mixed < split / 8, "{split} split, {mixed} hold both");
        assert_eq!(parted(level(0.5, 0.5, 1.5), [0.0, 0.5]), [0, 0], "not in one cell");
        assert_eq!(parted(level(0.03, 2.0, 2.5), [0.0, 0.03])[0], 0, "beside, not over it");
    }
}
