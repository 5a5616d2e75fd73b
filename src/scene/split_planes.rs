//! Split planes of base clusters. Light differs on the two sides of a wall that stands on a
//! surface, however near they are, so the cluster is split along the wall. A cluster of stacked
//! surfaces is split between them.

use super::cluster_key::{self, Key, Keyed};
use super::fragment::{Fragment, Plane};
use super::{clip, stacked_surfaces};
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Largest cosine between the normals of a surface and a wall that stands on it: 45°.
const STANDS: f64 = std::f64::consts::FRAC_1_SQRT_2;
/// Largest distance of a wall's foot from the surface, and smallest height of a wall, in cells.
const TOUCH: f64 = 0.02;
const HEIGHT: f64 = 0.1;
/// Smallest fraction of a cluster's area that a split plane may cut off.
const MIN_FRACTION: f64 = 0.02;

fn over(plane: Plane, point: DVec3) -> f64 {
    let [x, y, z, w] = plane.map(f64::from);
    DVec3::new(x, y, z).dot(point) - w
}

/// The walls along which clusters are split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Walls {
    /// Walls split no cluster.
    None,
    /// Walls without thickness. Light reaches both of their sides, so both sides of the
    /// surface below them are visible.
    Sheets,
    /// Walls of every thickness.
    All,
}

/// What splits base clusters.
#[derive(Clone, Copy, Debug)]
pub struct Splits {
    /// Walls that stand on them.
    pub walls: Walls,
    /// Whether stacked surfaces do.
    pub are_stacked: bool,
}

/// Splits the fragments of clusters with stacked surfaces, and of clusters on which a wall of this
/// kind stands in the same cell. `is_sheet`: whether light reaches both sides of a side's triangle.
/// `smallest_m`: width of the smallest cells, metres. Returns the plane of each split cluster, by
/// the key of its first half.
pub(super) fn split(
    fragments: &mut Keyed<Fragment>,
    smallest_m: f64,
    normal_of: impl Fn(u32) -> Vec3,
    is_sheet: impl Fn(u32) -> bool,
    splits: Splits,
) -> HashMap<Key, Plane> {
    let mut order: Vec<u32> = (0..fragments.len() as u32).collect();
    let cell_of = |index: u32| cluster_key::cell(fragments[index as usize].0);
    order.sort_by_key(|&index| (cell_of(index), fragments[index as usize].0));
    let mut planes = HashMap::new();
    for cell in order.chunk_by(|&a, &b| cell_of(a) == cell_of(b)) {
        let cell_size = smallest_m * f64::from(1u32 << cluster_key::level(fragments[cell[0] as usize].0));
        let all: Vec<&(Key, Fragment)> = cell.iter().map(|&index| &fragments[index as usize]).collect();
        for cluster in all.chunk_by(|a, b| a.0 == b.0) {
            let stands = |side: u32| match splits.walls {
                Walls::None => false,
                Walls::Sheets => is_sheet(side),
                Walls::All => true,
            };
            let wall = || wall_on(cluster, &all, cell_size, &normal_of, &stands);
            let stacked = || stacked_surfaces::between(cluster, cell_size, &normal_of);
            if let Some(plane) = splits.are_stacked.then(stacked).flatten().or_else(wall) {
                planes.insert(cluster[0].0, plane);
            }
        }
    }
    if planes.is_empty() {
        return planes;
    }
    let mut cut = Vec::with_capacity(fragments.len());
    for (key, fragment) in fragments.drain(..) {
        let Some(&plane) = planes.get(&key) else {
            cut.push((key, fragment));
            continue;
        };
        let polygon: Vec<DVec3> = fragment.corners.iter().map(|corner| corner.as_dvec3()).collect();
        for part in 0..2 {
            let kept = clip::clip_by(&polygon, |p| if part == 0 { -over(plane, p) } else { over(plane, p) });
            let area_m2 = clip::area(&kept);
            if area_m2 > 0.0 {
                let corners = kept.iter().map(|p| p.as_vec3()).collect();
                let key = if part == 0 { key } else { cluster_key::second_half(key) };
                cut.push((key, Fragment { corners, area_m2, ..fragment }));
            }
        }
    }
    *fragments = cut;
    planes
}

/// The wall that touches most of a cluster and divides it.
fn wall_on(
    cluster: &[&(Key, Fragment)],
    all: &[&(Key, Fragment)],
    cell_size: f64,
    normal_of: &impl Fn(u32) -> Vec3,
    stands: &impl Fn(u32) -> bool,
) -> Option<Plane> {
    if !all.iter().any(|(_, fragment)| stands(fragment.side)) {
        return None;
    }
    let area: f64 = cluster.iter().map(|(_, fragment)| fragment.area_m2).sum();
    let mean = |of: &dyn Fn(&Fragment) -> DVec3| {
        cluster.iter().map(|(_, fragment)| fragment.area_m2 * of(fragment)).sum::<DVec3>() / area
    };
    let normal = mean(&|fragment| normal_of(fragment.side).as_dvec3()).normalize_or_zero();
    let centre = |fragment: &Fragment| {
        fragment.corners.iter().sum::<Vec3>().as_dvec3() / fragment.corners.len() as f64
    };
    let mut middle = None;
    let mut walls: Vec<(f64, Plane)> = Vec::new();
    for (key, fragment) in all.iter().filter(|other| other.0 != cluster[0].0).map(|other| (other.0, &other.1))
    {
        let wall = normal_of(fragment.side).as_dvec3();
        if wall.dot(normal).abs() >= STANDS || key == cluster[0].0 || !stands(fragment.side) {
            continue;
        }
        let middle = *middle.get_or_insert_with(|| mean(&centre));
        let height = |p: DVec3| normal.dot(p - middle);
        let polygon: Vec<DVec3> = fragment.corners.iter().map(|corner| corner.as_dvec3()).collect();
        let heights = polygon.iter().map(|&p| height(p));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
        if low > TOUCH * cell_size || high < HEIGHT * cell_size {
            continue;
        }
        let band = HEIGHT * cell_size;
        let foot = clip::clip_by(&clip::clip_by(&polygon, |p| band - height(p)), |p| band + height(p));
        let along = normal.cross(wall).normalize_or_zero();
        let extent = foot.iter().map(|p| along.dot(*p));
        let (first, last) = extent.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), s| (a.min(s), b.max(s)));
        if last - first > TOUCH * cell_size {
            let plane = [wall.x, wall.y, wall.z, wall.dot(polygon[0])].map(|value| value as f32);
            walls.push((last - first, plane));
        }
    }
    walls.sort_by(|a, b| b.0.total_cmp(&a.0));
    let in_front = |plane: Plane, fragment: &Fragment| {
        let polygon: Vec<DVec3> = fragment.corners.iter().map(|corner| corner.as_dvec3()).collect();
        clip::area(&clip::clip_by(&polygon, |p| over(plane, p)))
    };
    // In a corner, the wall along the cluster's edge may touch more of it than a wall that
    // stands on it.
    let cuts = |plane: &Plane| {
        let fraction = cluster.iter().map(|(_, fragment)| in_front(*plane, fragment)).sum::<f64>() / area;
        (MIN_FRACTION..=1.0 - MIN_FRACTION).contains(&fraction)
    };
    walls.into_iter().map(|wall| wall.1).find(cuts)
}

/// A base cluster of a cell's list, with its split plane. The next cluster is then its second half.
pub struct CellCluster {
    /// Cluster code of its sides.
    pub code: u32,
    /// The cluster, or its first half.
    pub cluster: u32,
    /// Plane between the halves; the second half is the next cluster.
    pub plane: Option<Plane>,
}

impl CellCluster {
    /// The cluster, or the half of it that holds a point.
    pub fn at(&self, position: Vec3) -> u32 {
        let behind = |[x, y, z, w]: Plane| Vec3::new(x, y, z).dot(position) < w;
        self.cluster + u32::from(self.plane.is_some_and(|plane| !behind(plane)))
    }
}

/// Code of the word in a cell's list that marks the preceding cluster as split. The bits of the
/// plane's four floats follow.
pub(super) const SPLIT: u32 = 63;

/// Appends a cluster, split or not, to a cell's list.
pub(super) fn write(list: &mut Vec<u32>, code: u32, cluster: u32, plane: Option<&Plane>) {
    list.push(code << 26 | cluster);
    if let Some(plane) = plane {
        list.push(SPLIT << 26);
        list.extend(plane.map(f32::to_bits));
    }
}

/// Reads a cell's list.
pub(super) fn read(list: &[u32]) -> impl Iterator<Item = CellCluster> {
    let mut rest = list;
    std::iter::from_fn(move || {
        let (&entry, after) = rest.split_first()?;
        let is_split = after.first().is_some_and(|&next| next >> 26 == SPLIT);
        let plane = is_split.then(|| std::array::from_fn(|k| f32::from_bits(after[1 + k])));
        rest = if is_split { &after[5..] } else { after };
        Some(CellCluster { code: entry >> 26, cluster: entry & 0x03ff_ffff, plane })
    })
}

/// Whether a cell's list is well formed, with all clusters below `clusters`.
pub fn is_list(list: &[u32], clusters: usize) -> bool {
    let mut rest = list;
    while let Some((&entry, after)) = rest.split_first() {
        let is_split = after.first().is_some_and(|&next| next >> 26 == SPLIT);
        let last = (entry & 0x03ff_ffff) as usize + usize::from(is_split);
        if entry >> 26 == SPLIT || last >= clusters || (is_split && after.len() < 5) {
            return false;
        }
        rest = if is_split { &after[5..] } else { after };
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::hvds::Hvds;
    use crate::scene::{Triangle, grid, surfaces};
    use crate::types;

    /// A floor with a wall across it, oblique to the grid.
    fn floor_and_wall() -> Vec<Triangle> {
        let quad = |p: [[f32; 3]; 4]| {
            let p = p.map(Vec3::from);
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
        };
        let floor = quad([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [2.0, 0.0, 2.0], [2.0, 0.0, 0.0]]);
        let wall = quad([[0.7, -0.01, 0.0], [1.3, -0.01, 2.0], [1.3, 1.0, 2.0], [0.7, 1.0, 0.0]]);
        [floor, wall].concat()
    }

    #[test]
    fn a_wall_without_thickness_always_parts_the_floor_and_no_other_does() {
        let triangles = floor_and_wall();
        let grid = grid::grid(Vec3::ZERO, Vec3::new(2.0, 1.0, 2.0), 32);
        let split = |wall: [bool; 2], build: fn(&[Triangle], &[types::Surface], grid::CellGrid) -> Hvds| {
            let active = |index: usize| if index < 2 { [true, false] } else { wall };
            let surface = |(index, t): (usize, &Triangle)| surfaces::surface(t, active(index));
            let surfaces: Vec<_> = triangles.iter().enumerate().map(surface).collect();
            build(&triangles, &surfaces, grid).split_clusters().count()
        };
        let by_sheet = split([true; 2], Hvds::build);
        assert!(by_sheet > 2 * 25, "{by_sheet} parts of the floor");
        assert_eq!(split([true, false], Hvds::build), 0, "what has an inside parts nothing");
        assert!(split([true, false], Hvds::build_split) >= by_sheet, "unless all walls do");
    }

    #[test]
    fn a_wall_parts_the_floor_on_its_two_sides() {
        let triangles = floor_and_wall();
        let surfaces: Vec<_> = triangles.iter().map(|t| surfaces::surface(t, [true, true])).collect();
        let grid = grid::grid(Vec3::ZERO, Vec3::new(2.0, 1.0, 2.0), 32);
        let hvds = Hvds::build_split(&triangles, &surfaces, grid);
        let mut split = [false; 2];
        for fragment in hvds.fragments.iter().filter(|fragment| fragment.side < 4 && fragment.area_m2 > 1e-6)
        {
            // Distance over the wall on either side. A corner of up to a fiftieth of a cell is
            // not cut off.
            let over = fragment.corners.iter().map(|p| p.x - 0.7 - 0.3 * p.z);
            let (behind, front) = over.fold((0.0_f32, 0.0_f32), |(a, b), d| (a.max(-d), b.max(d)));
            assert!(
                behind.min(front) < 0.25 / grid.inverse_cell,
                "{:?} lies on both sides",
                fragment.corners
            );
            let middle = fragment.corners.iter().sum::<Vec3>() / fragment.corners.len() as f32;
            let normal = surfaces[fragment.side as usize / 2].normal_of(fragment.side % 2 == 1);
            let cell = hvds.cell_at(middle, normal);
            let code = surfaces[fragment.side as usize / 2].side_code(fragment.side % 2 == 1);
            assert_eq!(hvds.base_cluster(cell, code, middle), Some(fragment.cluster));
            let is_split = hvds.clusters_in(cell).any(|found| found.code == code && found.plane.is_some());
            assert!(!is_split || behind.min(front) < 1e-4, "{:?} lies on both sides", fragment.corners);
            split[usize::from(is_split)] = true;
        }
        assert_eq!(split, [true; 2], "some are split, some are not");
        let whole = 2.0 * triangles.iter().map(Triangle::area_m2).sum::<f64>();
        for level in &hvds.levels {
            let sum: f64 = level.clone().map(|c| f64::from(hvds.areas_m2[c as usize])).sum();
            assert!((sum - whole).abs() < 1e-5 * whole, "{sum} of {whole}");
        }
    }
}
