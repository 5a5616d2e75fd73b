//! Surfaces that emit, divided into parts: parallelograms and triangles with a uniform radiance.
//! All surface of one material is one light, which can be dimmed and coloured as a whole.

use std::collections::{BTreeMap, HashMap};

use glam::{DVec3, Vec3};

use super::Triangle;
use super::material::Sides;
use crate::types::{SHAPE_SURFACE, SHAPE_TRIANGLE, SHAPE_TWO_SIDED};

/// Parts of a light in frames. A mesh of more parts is represented by that many small squares.
pub const MAX_PARTS: usize = 64;

/// A piece of emitting surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Corner that both edges start from, metres.
    pub corner: Vec3,
    /// First edge; the front is where `edge_u × edge_v` points.
    pub edge_u: Vec3,
    /// Second edge from the corner.
    pub edge_v: Vec3,
    /// [`SHAPE_SURFACE`], [`SHAPE_TRIANGLE`], [`SHAPE_TWO_SIDED`].
    pub shape: u32,
}

/// The emitting surface of one material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Emitter {
    /// All of its surface.
    pub surface: Vec<Part>,
    /// At most [`MAX_PARTS`] parts that represent it in frames, neighbours together: all of its
    /// surface, or squares around points of it.
    pub parts: Vec<Part>,
}

impl Part {
    /// `edge_u × edge_v`.
    pub fn cross(&self) -> DVec3 {
        self.edge_u.as_dvec3().cross(self.edge_v.as_dvec3())
    }

    /// Area of one side, m².
    pub fn area_m2(&self) -> f64 {
        self.cross().length() * if self.shape & SHAPE_TRIANGLE == 0 { 1.0 } else { 0.5 }
    }

    /// Centre of mass, metres.
    fn centre(&self) -> DVec3 {
        let fraction = if self.shape & SHAPE_TRIANGLE == 0 { 0.5 } else { 1.0 / 3.0 };
        self.corner.as_dvec3() + fraction * (self.edge_u + self.edge_v).as_dvec3()
    }

    /// A square of that area around the part's centre of mass, in its plane.
    fn square(&self, area_m2: f64) -> Self {
        let normal = self.cross().normalize();
        let side = area_m2.sqrt();
        let edge_u = side * self.edge_u.as_dvec3().normalize();
        let edge_v = normal.cross(edge_u);
        let corner = self.centre() - 0.5 * (edge_u + edge_v);
        let [corner, edge_u, edge_v] = [corner, edge_u, edge_v].map(|vector| vector.as_vec3());
        Self { corner, edge_u, edge_v, shape: self.shape & !SHAPE_TRIANGLE }
    }
}

/// Emitters by material. `emits` returns the sides of a material that emit; `None` if it does not.
pub fn emitters(triangles: &[Triangle], emits: impl Fn(u32) -> Option<Sides>) -> BTreeMap<u32, Emitter> {
    let mut by_material: BTreeMap<u32, (Sides, Vec<[Vec3; 3]>)> = BTreeMap::new();
    for triangle in triangles {
        if let Some(sides) = emits(triangle.material) {
            let [a, b, c] = triangle.positions;
            let corners = if sides == Sides::Back { [a, c, b] } else { [a, b, c] };
            by_material.entry(triangle.material).or_insert((sides, Vec::new())).1.push(corners);
        }
    }
    let emitter = |(material, (sides, triangles)): (u32, (Sides, Vec<[Vec3; 3]>))| {
        let mut surface = shapes(&triangles);
        if sides == Sides::Both {
            surface.iter_mut().for_each(|part| part.shape |= SHAPE_TWO_SIDED);
        }
        let parts = if surface.len() <= MAX_PARTS { surface.clone() } else { squares(&surface) };
        (material, Emitter { surface, parts })
    };
    by_material.into_iter().map(emitter).collect()
}

/// Largest distance between the fourth corner of a parallelogram and a triangle's corner, over the
/// length of the diagonal.
const APART: f32 = 1e-4;

/// The triangles, with pairs that form parallelograms merged.
fn shapes(triangles: &[[Vec3; 3]]) -> Vec<Part> {
    let key = |from: Vec3, to: Vec3| [from, to].map(|point| point.to_array().map(f32::to_bits));
    let mut edges = HashMap::new();
    for (index, corners) in triangles.iter().enumerate() {
        for side in 0..3 {
            edges.insert(key(corners[side], corners[(side + 1) % 3]), (index, side));
        }
    }
    let mut is_merged = vec![false; triangles.len()];
    let mut parts = Vec::new();
    for (index, corners) in triangles.iter().enumerate() {
        if is_merged[index] {
            continue;
        }
        let [a, b, c] = *corners;
        // The neighbour across a diagonal has its third corner opposite to this one's.
        let neighbour = (0..3).find_map(|side| {
            let (from, to, third) = (corners[side], corners[(side + 1) % 3], corners[(side + 2) % 3]);
            let &(other, place) = edges.get(&key(to, from))?;
            let opposite = triangles[other][(place + 2) % 3];
            let is_parallelogram =
                (from + to - third).distance(opposite) <= APART * from.distance(to) && other != index;
            (is_parallelogram && !is_merged[other]).then_some((other, third, from, to))
        });
        parts.push(match neighbour {
            Some((other, corner, from, to)) => {
                is_merged[other] = true;
                Part { corner, edge_u: from - corner, edge_v: to - corner, shape: SHAPE_SURFACE }
            }
            None => Part { corner: a, edge_u: b - a, edge_v: c - a, shape: SHAPE_SURFACE | SHAPE_TRIANGLE },
        });
    }
    parts
}

/// Squares that represent a surface of many parts: one for each equal fraction of the area along
/// a space-filling curve, with areas of about that fraction.
fn squares(surface: &[Part]) -> Vec<Part> {
    let (low, high) = surface
        .iter()
        .map(Part::centre)
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), centre| {
            (low.min(centre), high.max(centre))
        });
    let scale = 1023.0 / (high - low).max_element().max(f64::MIN_POSITIVE);
    let place = |part: &Part| {
        let cell = ((part.centre() - low) * scale).as_uvec3();
        cell.to_array().into_iter().enumerate().map(|(axis, cell)| spread(cell) << axis).sum::<u32>()
    };
    let mut order: Vec<(u32, &Part)> = surface.iter().map(|part| (place(part), part)).collect();
    order.sort_by_key(|&(place, _)| place);
    let total: f64 = surface.iter().map(Part::area_m2).sum();
    let area = total / MAX_PARTS as f64;
    let typical = typical_parts(&order, area);
    let (mut chosen, mut end) = (Vec::new(), 0.0);
    for (_, part) in order {
        end += part.area_m2();
        // A large part may hold the middle of several fractions: it then gets as many squares, all
        // at its centre.
        while chosen.len() < MAX_PARTS && (chosen.len() as f64 + 0.5) * area <= end {
            chosen.push(*typical[chosen.len()].unwrap_or(part));
        }
    }
    let place = |point: DVec3| (point - 0.5 * (low + high)) * scale / 1023.0;
    let areas = areas_that_emit_alike(&chosen, surface, area, |part| measures(part, place));
    chosen.iter().zip(areas).map(|(part, area)| part.square(area)).collect()
}

/// Directions in which the squares ought to emit as the surface does.
const DIRECTIONS: usize = 48;
/// Intensities in these directions; area; centre of mass, for all and by normal.
const MEASURES: usize = DIRECTIONS + 1 + 3 + 9;
/// Weight of changed areas beside wrong measures. With less, areas grow many times their mean, and
/// directions between those of the measures get worse.
const STIFFNESS: f64 = 0.01;
/// Least share of the mean area that a square keeps.
const LEAST_SHARE: f64 = 0.25;

/// Measures of a part per area. `place` maps the bounds of the surface to the unit cube.
fn measures(part: &Part, place: impl Fn(DVec3) -> DVec3) -> [f64; MEASURES] {
    let (normal, place) = (part.cross().normalize(), place(part.centre()));
    let is_two_sided = part.shape & SHAPE_TWO_SIDED != 0;
    let intensity = |index: usize| {
        let turned = index as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        let height = 1.0 - (2 * index + 1) as f64 / DIRECTIONS as f64;
        let radius = (1.0 - height * height).sqrt();
        let cosine = normal.dot(DVec3::new(radius * turned.cos(), height, radius * turned.sin()));
        if is_two_sided { cosine.abs() } else { cosine.max(0.0) }
    };
    let places = [1.0].into_iter().chain(place.to_array());
    let by_normal = normal.to_array().into_iter().flat_map(|n| (n * place).to_array());
    let mut all = (0..DIRECTIONS).map(intensity).chain(places).chain(by_normal);
    std::array::from_fn(|_| all.next().unwrap_or(0.0))
}

/// Areas of the squares at `chosen` parts, `mean` on average. Equal areas would emit up to a tenth
/// more in some directions than the surface does, and less in others. These have its measures, by
/// least squares with conjugate gradients.
fn areas_that_emit_alike(
    chosen: &[Part],
    surface: &[Part],
    mean: f64,
    measures: impl Fn(&Part) -> [f64; MEASURES],
) -> Vec<f64> {
    let rows: Vec<_> = chosen.iter().map(&measures).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let sum = |terms: &mut dyn Iterator<Item = (f64, [f64; MEASURES])>| {
        let add = |sum: [f64; MEASURES], (area, row): (f64, [f64; MEASURES])| {
            std::array::from_fn(|k| sum[k] + area * row[k])
        };
        terms.fold([0.0; MEASURES], add)
    };
    let wanted = sum(&mut surface.iter().map(|part| (part.area_m2() / mean, measures(part))));
    let found = sum(&mut rows.iter().map(|row| (1.0, *row)));
    let stiffness = STIFFNESS * rows.iter().map(|row| dot(row, row)).sum::<f64>() / MEASURES as f64;
    let mut residual: [f64; MEASURES] = std::array::from_fn(|k| wanted[k] - found[k]);
    let (mut direction, mut multipliers) = (residual, [0.0; MEASURES]);
    let mut square = dot(&residual, &residual);
    for _ in 0..MEASURES {
        if square == 0.0 {
            break;
        }
        let changes = rows.iter().map(|row| dot(row, &direction));
        let image = sum(&mut changes.zip(rows.iter().copied()));
        let image: [f64; MEASURES] = std::array::from_fn(|k| image[k] + stiffness * direction[k]);
        let step = square / dot(&direction, &image);
        multipliers = std::array::from_fn(|k| multipliers[k] + step * direction[k]);
        residual = std::array::from_fn(|k| residual[k] - step * image[k]);
        let before = std::mem::replace(&mut square, dot(&residual, &residual));
        direction = std::array::from_fn(|k| residual[k] + square / before * direction[k]);
    }
    let changes: Vec<f64> = rows.iter().map(|row| dot(row, &multipliers)).collect();
    let lowest = changes.iter().copied().fold(0.0, f64::min);
    let fraction = if lowest < LEAST_SHARE - 1.0 { (LEAST_SHARE - 1.0) / lowest } else { 1.0 };
    let shares: Vec<f64> = changes.iter().map(|change| 1.0 + fraction * change).collect();
    // The power is exact.
    let scale = mean * chosen.len() as f64 / shares.iter().sum::<f64>();
    shares.iter().map(|share| share * scale).collect()
}

/// The part of each fraction of the surface whose normal is closest to the mean. A square with the
/// mean normal itself would light the surface beside it.
fn typical_parts<'a>(order: &[(u32, &'a Part)], area: f64) -> Vec<Option<&'a Part>> {
    let mut end = 0.0;
    let mut groups: Vec<Vec<&Part>> = vec![Vec::new(); MAX_PARTS];
    for &(_, part) in order {
        let middle = end + 0.5 * part.area_m2();
        groups[((middle / area) as usize).min(MAX_PARTS - 1)].push(part);
        end += part.area_m2();
    }
    let normal = |part: &Part| part.cross().normalize();
    let typical = |group: Vec<&'a Part>| {
        let mean: DVec3 = group.iter().map(|part| part.area_m2() * normal(part)).sum();
        group.into_iter().max_by(|a, b| mean.dot(normal(a)).total_cmp(&mean.dot(normal(b))))
    };
    groups.into_iter().map(typical).collect()
}

/// Bits of a number with two zeros after each, for ten bits.
fn spread(bits: u32) -> u32 {
    (0..10).map(|bit| (bits >> bit & 1) << (3 * bit)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(positions: [[f32; 3]; 3]) -> Triangle {
        Triangle { positions: positions.map(Vec3::from), normals: [Vec3::Y; 3], material: 0, object: 0 }
    }

    fn emitter(triangles: &[Triangle]) -> Emitter {
        emitters(triangles, |_| Some(Sides::Front)).remove(&0).unwrap()
    }

    #[test]
    fn two_triangles_of_a_quad_are_one_part() {
        let [a, b, c, d] = [[0.0, 1.0, 0.0], [0.0, 1.0, 2.0], [3.0, 1.0, 2.0], [3.0, 1.0, 0.0]];
        for quad in [[[a, b, c], [a, c, d]], [[b, c, a], [d, a, c]], [[a, b, d], [d, b, c]]] {
            let found = emitter(&quad.map(triangle));
            assert_eq!(found.surface.len(), 1, "{quad:?}");
            assert_eq!(found.surface, found.parts);
            let part = found.surface[0];
            assert!((part.cross() - DVec3::new(0.0, 6.0, 0.0)).length() < 1e-6, "{part:?}");
        }
        // A kite is no parallelogram.
        let kite = [[a, b, [4.0, 1.0, 4.0]], [a, [4.0, 1.0, 4.0], d]].map(triangle);
        assert_eq!(emitter(&kite).surface.len(), 2);
    }

    #[test]
    fn squares_keep_the_area_and_lie_on_the_surface() {
        // A hemisphere of 800 triangles.
        let point = |i: usize, j: usize| {
            let (height, around) = (i as f32 / 20.0, j as f32 / 20.0 * std::f32::consts::TAU);
            let radius = (1.0 - height * height).max(0.0).sqrt();
            [radius * around.cos(), height, radius * around.sin()]
        };
        let quads = (0..20).flat_map(|i| (0..20).map(move |j| (i, j)));
        let triangles: Vec<Triangle> = quads
            .flat_map(|(i, j)| {
                let corners = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
                [[0, 1, 2], [0, 2, 3]].map(|corner| triangle(corner.map(|index| corners[index])))
            })
            .filter(|triangle| triangle.area_m2() > 1e-9)
            .collect();
        let found = emitter(&triangles);
        assert_eq!(found.parts.len(), MAX_PARTS);
        let area = |parts: &[Part]| parts.iter().map(Part::area_m2).sum::<f64>();
        assert!((area(&found.parts) / area(&found.surface) - 1.0).abs() < 1e-5);
        for part in &found.parts {
            assert!((part.centre().length() - 1.0).abs() < 0.02, "{part:?}");
        }
        // Light of one side of the hemisphere, from above, from beside it and from below.
        let sun = |x: f64, y: f64| DVec3::new(x, y, 0.0).normalize();
        for from in
            [sun(0.0, 1.0), sun(1.0, 0.0), sun(0.6, 0.8), sun(-0.8, 0.6), sun(1.0, -1.0), sun(-1.0, -2.0)]
        {
            let seen = |parts: &[Part]| {
                parts
                    .iter()
                    .map(|part| part.cross().normalize().dot(from).max(0.0) * part.area_m2())
                    .sum::<f64>()
            };
            let [all, few] = [&found.surface, &found.parts].map(|parts| seen(parts));
            println!("{from}: {few:.4} of {all:.4}");
            assert!((few - all).abs() < 4e-3 * area(&found.surface), "{from}: {few} of {all}");
        }
    }
}
