//! The edges of the welded mesh, and those at which pixels of some camera may change.

use super::Triangle;
use crate::types::{EVERY_VIEW, MeshEdge};
use glam::Vec3;
use rayon::prelude::*;

/// Cosine of an angle of a millionth, up to which two triangles are in one plane.
const FLAT: f64 = 1.0 - 0.5e-12;

/// Triangles whose corners at equal places are one corner.
pub struct Mesh {
    /// The corners of each triangle, by number.
    pub corners: Vec<[u32; 3]>,
    /// The place of each number.
    pub places: Vec<Vec3>,
    /// The sides of all triangles, sorted, so that those of one edge are together.
    sides: Vec<Side>,
}

/// A side of a triangle.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Side {
    /// The corners at its ends, by number; the lower one first.
    pub ends: [u32; 2],
    /// Index of the triangle in its list.
    pub triangle: u32,
}

impl Mesh {
    /// Welds triangles at places of equal bits.
    pub fn of(triangles: &[Triangle]) -> Self {
        // Both zeros are one place.
        let key = |place: Vec3| (place + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut order: Vec<([u32; 3], u32)> = triangles
            .par_iter()
            .enumerate()
            .flat_map_iter(|(index, triangle)| {
                (3 * index as u32..).zip(triangle.positions).map(move |(corner, place)| (key(place), corner))
            })
            .collect();
        order.par_sort_unstable();
        let mut corners = vec![[0; 3]; triangles.len()];
        let mut places = Vec::new();
        for alike in order.chunk_by(|a, b| a.0 == b.0) {
            for &(_, corner) in alike {
                corners[corner as usize / 3][corner as usize % 3] = places.len() as u32;
            }
            places.push(Vec3::from_array(alike[0].0.map(f32::from_bits)));
        }
        let sides = corners.par_iter().enumerate().flat_map_iter(|(triangle, &[a, b, c])| {
            let side = move |[a, b]: [u32; 2]| Side { ends: [a.min(b), a.max(b)], triangle: triangle as u32 };
            [[a, b], [b, c], [c, a]].map(side).into_iter().filter(|side| side.ends[0] != side.ends[1])
        });
        let mut sides: Vec<Side> = sides.collect();
        sides.par_sort_unstable();
        Self { corners, places, sides }
    }

    /// The edges: for each, the sides of the triangles that have it.
    pub fn edges(&self) -> impl ParallelIterator<Item = &[Side]> {
        self.sides.par_chunk_by(|a, b| a.ends == b.ends)
    }

    /// The corner of a side's triangle that is not on it.
    pub fn opposite(&self, side: Side) -> Vec3 {
        let corners = self.corners[side.triangle as usize];
        let corner = corners.into_iter().find(|corner| !side.ends.contains(corner));
        self.places[corner.unwrap_or(side.ends[0]) as usize]
    }

    /// Cosine of the angle by which two triangles turn at their edge; -1 at the edge of one
    /// triangle, or of more than two.
    pub fn cosine(&self, edge: &[Side]) -> f64 {
        let &[first, second] = edge else { return -1.0 };
        let [from, to] = first.ends.map(|end| self.places[end as usize].as_dvec3());
        let across = |side| (to - from).cross(self.opposite(side).as_dvec3() - from).normalize_or_zero();
        -across(first).dot(across(second))
    }

    /// Whether the triangles of an edge are in one plane.
    pub fn is_flat(&self, edge: &[Side]) -> bool {
        self.cosine(edge) > FLAT
    }

    /// The edges at which a pixel may show two surfaces. Where materials meet, or facets turn by
    /// more than the angle with cosine `crease`, in every view; where they turn less, in views that
    /// have an outline there. They are sorted by length: invocations beside each other have similar
    /// work when they draw them.
    pub fn seen_edges(&self, triangles: &[Triangle], crease: f64) -> Vec<MeshEdge> {
        let named = |side: Side| {
            let corners = self.corners[side.triangle as usize];
            let opposite = corners.iter().position(|corner| !side.ends.contains(corner));
            4 * side.triangle + opposite.unwrap_or(0) as u32
        };
        let material = |side: &Side| triangles[side.triangle as usize].material;
        let seen = |edge: &[Side]| {
            let is_seam = edge.iter().any(|side| material(side) != material(&edge[0]));
            let is_always = is_seam || self.cosine(edge) < crease;
            let other = if is_always { EVERY_VIEW } else { named(edge[1]) };
            let [from, to] = edge[0].ends.map(|end| self.places[end as usize]);
            // Its exponent alone, so that edges of about equal length keep their order.
            let length = from.distance(to).to_bits() >> 23;
            (is_always || !self.is_flat(edge)).then(|| (length, MeshEdge { own: named(edge[0]), other }))
        };
        let mut found: Vec<(u32, MeshEdge)> = self.edges().filter_map(seen).collect();
        found.par_sort_by_key(|(length, _)| *length);
        found.into_iter().map(|(_, edge)| edge).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quad(corners: [Vec3; 4], material: u32) -> Vec<Triangle> {
        let [a, b, c, d] = corners;
        let normals = [(b - a).cross(c - a).normalize(); 3];
        [[a, b, c], [a, c, d]].map(|positions| Triangle { positions, normals, material, object: 0 }).to_vec()
    }

    /// A strip along z that turns at x = 0 by an angle. Its two sides have these materials.
    fn strip(angle: f32, materials: [u32; 2]) -> Vec<Triangle> {
        let (left, right) = (-Vec3::X, Vec3::new(angle.cos(), angle.sin(), 0.0));
        let first = quad([left, Vec3::ZERO, Vec3::Z, left + Vec3::Z], materials[0]);
        let second = quad([-Vec3::ZERO, right, right + Vec3::Z, Vec3::Z], materials[1]);
        [first, second].concat()
    }

    /// Edges that every view has, and others.
    fn counts(triangles: &[Triangle]) -> [usize; 2] {
        let edges = Mesh::of(triangles).seen_edges(triangles, 0.9);
        let always = edges.iter().filter(|edge| edge.other == EVERY_VIEW).count();
        [always, edges.len() - always]
    }

    /// Six edges end; the diagonals are flat.
    #[test]
    fn an_edge_is_seen_where_materials_or_facets_change() {
        assert_eq!(counts(&strip(0.0, [1, 1])), [6, 0]);
        assert_eq!(counts(&strip(0.0, [1, 2])), [7, 0]);
        assert_eq!(counts(&strip(0.3, [1, 1])), [6, 1]);
        assert_eq!(counts(&strip(0.5, [1, 1])), [7, 0]);
        assert_eq!(counts(&strip(-2.0, [1, 1])), [7, 0]);
    }

    #[test]
    fn three_triangles_at_one_edge_end_there() {
        let fin = quad([Vec3::ZERO, Vec3::Y, Vec3::Y + Vec3::Z, Vec3::Z], 1);
        assert_eq!(counts(&[strip(0.3, [1, 1]), fin].concat()), [10, 0]);
    }

    /// The names lead back to the ends.
    #[test]
    fn an_edge_names_the_corners_opposite() {
        let triangles = strip(0.3, [1, 1]);
        let edges = Mesh::of(&triangles).seen_edges(&triangles, 0.9);
        let fold = edges.iter().find(|edge| edge.other != EVERY_VIEW).unwrap();
        for name in [fold.own, fold.other] {
            let corners = triangles[name as usize / 4].positions;
            let opposite = name as usize % 4;
            let mut ends = [corners[(opposite + 1) % 3], corners[(opposite + 2) % 3]];
            ends.sort_by(|a, b| a.z.total_cmp(&b.z));
            assert_eq!(ends, [Vec3::ZERO, Vec3::Z]);
        }
    }
}
