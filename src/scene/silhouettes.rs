//! Edges at which the shadow of a scene may end, whatever the light. Between two points of one
//! triangle, a light can only appear or disappear where the line to it meets such an edge: where
//! the surface folds as seen from the light, where it ends, or where two surfaces intersect.

use super::mesh_edges::{Mesh, Side};
use super::{Triangle, bvh::Bvh, host_bvh::HostBvh};
use crate::types::SilhouetteEdge;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// An edge is cut into pieces of at most this fraction of the scene's diagonal, so that
/// invocations that draw them have similar work.
const PIECE: f32 = 1.0 / 32.0;

/// The edges of these triangles, which are in the order of the tree.
pub fn edges(bvh: &Bvh, triangles: &[Triangle], mesh: &Mesh) -> Vec<SilhouetteEdge> {
    let mut found: Vec<SilhouetteEdge> = mesh.edges().filter_map(|edge| fold(mesh, edge)).collect();
    found.extend(intersections(bvh, triangles, mesh));
    let (low, high) = mesh
        .places
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &place| (low.min(place), high.max(place)));
    let longest = PIECE * (high - low).length();
    found.iter().flat_map(|edge| pieces(edge, longest)).collect()
}

/// The edge if it may be a silhouette. An edge of one triangle, or of more than two, is one for
/// every light: both of its opposite corners are the same.
fn fold(mesh: &Mesh, edge: &[Side]) -> Option<SilhouetteEdge> {
    let [from, to] = edge[0].ends.map(|end| mesh.places[end as usize]);
    let first = mesh.opposite(edge[0]);
    let second = if let [_, second] = edge { mesh.opposite(*second) } else { first };
    (!mesh.is_flat(edge)).then_some(SilhouetteEdge { from, to, first, second })
}

/// The lines along which triangles intersect that have no edge in common.
fn intersections(bvh: &Bvh, triangles: &[Triangle], mesh: &Mesh) -> Vec<SilhouetteEdge> {
    let Mesh { corners, places, .. } = mesh;
    let tree = HostBvh::without_holes(bvh, triangles);
    let met = mesh.edges().flat_map_iter(|edge| {
        let ends = edge[0].ends;
        let [from, to] = ends.map(|end| places[end as usize]);
        let near = tree.near(from, to - from).into_iter();
        let others = near.filter(move |&other| ends.iter().all(|end| !corners[other as usize].contains(end)));
        let points = others.filter_map(move |other| {
            let point = crossing([from, to].map(Vec3::as_dvec3), triangles[other as usize].positions)?;
            Some((other, point.as_vec3()))
        });
        points.flat_map(|(other, point)| {
            edge.iter().map(move |side| ([side.triangle.min(other), side.triangle.max(other)], point))
        })
    });
    let mut met: Vec<([u32; 2], Vec3)> = met.collect();
    met.par_sort_unstable_by_key(|(pair, point)| (*pair, point.to_array().map(f32::to_bits)));
    let line = |chunk: &[([u32; 2], Vec3)]| {
        let [own, other] = chunk[0].0.map(|triangle| corners[triangle as usize]);
        // Two triangles with one corner in common may intersect from there on.
        let common = own.into_iter().filter(|corner| other.contains(corner)).map(|c| places[c as usize]);
        let points: Vec<Vec3> = chunk.iter().map(|met| met.1).chain(common).collect();
        let far = |from: Vec3| {
            points
                .iter()
                .copied()
                .max_by(|a, b| a.distance(from).total_cmp(&b.distance(from)))
                .unwrap_or(from)
        };
        let from = far(points[0]);
        SilhouetteEdge { from, to: far(from), first: from, second: from }
    };
    met.chunk_by(|a, b| a.0 == b.0).map(line).collect()
}

/// Where a line from one point to another meets a triangle. `None` if it is parallel.
fn crossing([from, to]: [DVec3; 2], triangle: [Vec3; 3]) -> Option<DVec3> {
    let [a, b, c] = triangle.map(Vec3::as_dvec3);
    let across = (b - a).cross(c - a);
    let [before, after] = [from, to].map(|point| across.dot(point - a));
    if before * after > 0.0 || before == after {
        return None;
    }
    let point = from.lerp(to, before / (before - after));
    // A little beyond the edges, where rounding decides.
    let is_inside = [(a, b), (b, c), (c, a)]
        .iter()
        .all(|(p, q)| (*q - *p).cross(point - *p).dot(across) >= -1e-6 * across.length_squared());
    is_inside.then_some(point)
}

/// An edge in equal pieces of at most that length.
fn pieces(edge: &SilhouetteEdge, longest: f32) -> impl Iterator<Item = SilhouetteEdge> + use<> {
    let SilhouetteEdge { from, to, first, second } = *edge;
    let count = (from.distance(to) / longest).ceil().max(1.0) as u32;
    let end = move |piece: u32| if piece == count { to } else { from.lerp(to, piece as f32 / count as f32) };
    (0..count).map(move |piece| SilhouetteEdge { from: end(piece), to: end(piece + 1), first, second })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn edges_of(mut triangles: Vec<Triangle>) -> Vec<SilhouetteEdge> {
        let bvh = Bvh::build(&triangles).unwrap();
        triangles = bvh.order.iter().map(|&index| triangles[index as usize]).collect();
        edges(&bvh, &triangles, &Mesh::of(&triangles))
    }

    fn square(corner: Vec3, u: Vec3, v: Vec3) -> Vec<Triangle> {
        let normals = [u.cross(v).normalize(); 3];
        let corners = [[corner, corner + u, corner + u + v], [corner, corner + u + v, corner + v]];
        corners.map(|positions| Triangle { positions, normals, material: 0, object: 0 }).to_vec()
    }

    /// Total length of edges that are silhouettes for every light, and of others.
    fn lengths(edges: &[SilhouetteEdge]) -> [f32; 2] {
        let sum = |always: bool| {
            let of_kind = edges.iter().filter(|edge| (edge.first == edge.second) == always);
            of_kind.map(|edge| edge.from.distance(edge.to)).sum()
        };
        [sum(true), sum(false)]
    }

    #[test]
    fn a_square_ends_at_its_outline_and_its_diagonal_is_flat() {
        let [always, folds] = lengths(&edges_of(square(Vec3::ZERO, Vec3::X, Vec3::Y)));
        assert!((always - 4.0).abs() < 1e-5 && folds == 0.0, "{always} {folds}");
    }

    #[test]
    fn two_squares_that_meet_at_an_edge_fold_there() {
        let both = [square(Vec3::ZERO, Vec3::X, Vec3::Y), square(Vec3::ZERO, Vec3::X, Vec3::Z)].concat();
        let [always, folds] = lengths(&edges_of(both));
        assert!((always - 6.0).abs() < 1e-5 && (folds - 1.0).abs() < 1e-5, "{always} {folds}");
    }

    /// The line of intersection is an edge, also where one square pierces only half of the other.
    #[test]
    fn squares_that_intersect_have_an_edge_at_the_intersection() {
        let floor = square(Vec3::ZERO, Vec3::X, Vec3::Y);
        let wall = square(Vec3::new(0.3, 0.4, -0.5), 2.0 * Vec3::Y, Vec3::Z);
        let found = edges_of([floor, wall].concat());
        let on_line = found
            .iter()
            .filter(|edge| [edge.from, edge.to].iter().all(|p| (p.x - 0.3).abs() + p.z.abs() < 1e-5));
        let length: f32 = on_line.map(|edge| edge.from.distance(edge.to)).sum();
        assert!((length - 0.6).abs() < 1e-5, "{length}");
    }
}
