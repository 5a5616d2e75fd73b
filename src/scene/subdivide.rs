//! Divides triangles that are large beside their distance from the regions of small cells. A
//! position on a triangle is rounded in units of its corners: on a plane of ten kilometres, these
//! are half a millimetre.

use super::Triangle;
use super::cell_sizes::Region;
use glam::{Vec2, Vec3};

/// An edge is divided if it is longer than the distance from a region plus its side times this.
const SIDES: f32 = 2.0;
/// An edge that is shorter than its largest coordinate times this stays: its corners are rounded in
/// units of that coordinate, and so are those of its parts.
const COORDINATE: f32 = 0.25;
/// Each round halves the edges; a bound for broken inputs.
const ROUNDS: u32 = 40;

/// Divides the triangles, without cracks: an edge alone decides where it is divided. Triangles for
/// which `stays` holds are left. New triangles follow the others; each has the attributes of its
/// triangle. Returns their number.
pub(super) fn subdivide(
    triangles: &mut Vec<Triangle>,
    coordinates: &mut Vec<[Vec2; 3]>,
    regions: &[Region],
    stays: impl Fn(usize) -> bool,
) -> usize {
    let before = triangles.len();
    let mut open: Vec<usize> = (0..before).filter(|&index| !stays(index)).collect();
    for _ in 0..ROUNDS {
        let mut next = Vec::new();
        for index in open {
            let corners = triangles[index].positions;
            let is_long: [bool; 3] =
                [0, 1, 2].map(|edge| is_long(corners[edge], corners[(edge + 1) % 3], regions));
            let parts = parts(is_long);
            if parts.len() < 2 {
                continue;
            }
            let (whole, places) = (triangles[index], coordinates.get(index).copied());
            for (number, part) in parts.into_iter().enumerate() {
                let mut made = whole;
                let mut made_places = places.unwrap_or_default();
                for (corner, [a, b]) in part.into_iter().enumerate() {
                    made.positions[corner] = middle(whole.positions[a], whole.positions[b]);
                    if a != b {
                        let normal = whole.normals[a] + whole.normals[b];
                        made.normals[corner] = normal.try_normalize().unwrap_or(whole.normals[a]);
                    } else {
                        made.normals[corner] = whole.normals[a];
                    }
                    if let Some(places) = places {
                        made_places[corner] = 0.5 * (places[a] + places[b]);
                    }
                }
                let place = if number == 0 { index } else { triangles.len() };
                if number == 0 {
                    triangles[index] = made;
                } else {
                    triangles.push(made);
                }
                if places.is_some() {
                    match coordinates.get_mut(place) {
                        Some(own) => *own = made_places,
                        None => coordinates.push(made_places),
                    }
                }
                next.push(place);
            }
        }
        if next.is_empty() {
            break;
        }
        open = next;
    }
    triangles.len() - before
}

/// The middle of an edge, the same from both ends.
fn middle(a: Vec3, b: Vec3) -> Vec3 {
    (0.5 * (a.as_dvec3() + b.as_dvec3())).as_vec3()
}

/// Whether an edge is divided; the same from both ends.
fn is_long(a: Vec3, b: Vec3, regions: &[Region]) -> bool {
    let (a, b) = if a.to_array() < b.to_array() { (a, b) } else { (b, a) };
    let length = a.distance(b);
    let along = (b - a) / length.max(f32::MIN_POSITIVE);
    let is_near = |region: &Region| {
        let centre = 0.5 * (region.low + region.high);
        let nearest = a + along * along.dot(centre - a).clamp(0.0, length);
        let distance = nearest.distance(nearest.clamp(region.low, region.high));
        length > distance + SIDES * region.side()
    };
    length > COORDINATE * a.abs().max(b.abs()).max_element() && regions.iter().any(is_near)
}

/// The parts of a triangle whose marked edges are divided: their corners as pairs of corners of the
/// triangle, whose middle they are.
fn parts(divided: [bool; 3]) -> Vec<[[usize; 2]; 3]> {
    let corner = |index: usize| [index % 3; 2];
    let edge = |index: usize| [index % 3, (index + 1) % 3];
    match divided.iter().filter(|divided| **divided).count() {
        0 => vec![[corner(0), corner(1), corner(2)]],
        1 => {
            let e = divided.iter().position(|divided| *divided).unwrap_or(0);
            vec![[corner(e), edge(e), corner(e + 2)], [edge(e), corner(e + 1), corner(e + 2)]]
        }
        2 => {
            let e = (divided.iter().position(|divided| !*divided).unwrap_or(0) + 1) % 3;
            vec![
                [edge(e), corner(e + 1), edge(e + 1)],
                [corner(e), edge(e), edge(e + 1)],
                [corner(e), edge(e + 1), corner(e + 2)],
            ]
        }
        _ => vec![
            [corner(0), edge(0), edge(2)],
            [edge(0), corner(1), edge(1)],
            [edge(2), edge(1), corner(2)],
            [edge(0), edge(1), edge(2)],
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    #[test]
    fn a_plane_is_divided_around_a_region_without_cracks() {
        let corners =
            [[-5e3, 0.0, -5e3], [-5e3, 0.0, 5e3], [5e3, 0.0, 5e3], [5e3, 0.0, -5e3]].map(Vec3::from);
        let triangle = |corners_of: [usize; 3]| Triangle {
            positions: corners_of.map(|corner| corners[corner]),
            normals: [Vec3::Y; 3],
            material: 0,
            object: 0,
        };
        let mut triangles = vec![triangle([0, 1, 2]), triangle([0, 2, 3])];
        let place = |p: Vec3| Vec2::new(p.x, p.z) / 1e4;
        let mut coordinates: Vec<_> = triangles.iter().map(|t| t.positions.map(place)).collect();
        let regions = [Region { low: Vec3::splat(-0.3), high: Vec3::splat(0.4), halvings: 14 }];
        let added = subdivide(&mut triangles, &mut coordinates, &regions, |_| false);
        assert_eq!([triangles.len(), coordinates.len()], [added + 2; 2]);
        assert!((100..5_000).contains(&added), "{added}");
        let area: f64 = triangles.iter().map(Triangle::area_m2).sum();
        assert!((area / 1e8 - 1.0).abs() < 1e-6, "{area}");
        // Each inner edge has a triangle on both sides.
        let mut edges: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
        for (triangle, places) in triangles.iter().zip(&coordinates) {
            assert!(triangle.geometric_normal().y > 0.999);
            let far = places.iter().zip(triangle.positions).map(|(at, p)| at.distance(place(p)));
            assert!(far.fold(0.0, f32::max) < 1e-6);
            for edge in 0..3 {
                let [a, b] = [edge, (edge + 1) % 3].map(|corner| triangle.positions[corner]);
                assert!(!is_long(a, b, &regions));
                let bits = |p: Vec3| p.to_array().map(f32::to_bits);
                *edges.entry([bits(a).min(bits(b)), bits(a).max(bits(b))]).or_default() += 1;
            }
        }
        let is_rim = |edge: &[[u32; 3]; 2]| {
            (0..3).step_by(2).any(|axis| {
                let [a, b] = edge.map(|p| f32::from_bits(p[axis]));
                a == b && a.abs() == 5e3
            })
        };
        assert!(edges.iter().all(|(edge, &count)| count == if is_rim(edge) { 1 } else { 2 }));
    }
}
