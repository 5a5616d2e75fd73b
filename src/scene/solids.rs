//! Watertight solids: surfaces without a border that are wound outwards. Solids may interpenetrate.
//! Their interior surface is inactive, because no light reaches it.

use crate::scene::{Scene, Triangle};
use glam::{DVec3, UVec2, Vec2, Vec3, Vec3Swizzles};
use std::collections::{HashMap, HashSet};

/// Largest number of columns of the table along x and along z.
const MAX_COLUMNS: f32 = 2048.0;

/// The solids of a scene.
pub struct Solids {
    /// The solid of each triangle.
    parts: Vec<Option<u32>>,
    /// Corners of the triangles of solids.
    corners: Vec<[DVec3; 3]>,
    /// Low corner of the table of columns in x and z, metres.
    low: Vec2,
    /// Columns to a metre.
    scale: Vec2,
    columns: UVec2,
    /// First index in `listed` of each column, and the end.
    first: Vec<u32>,
    /// The triangles that overlap each column, the highest first.
    listed: Vec<Listed>,
}

/// A triangle of a solid, in a column. Most triangles are passed over by their box.
#[derive(Clone, Copy, Default)]
struct Listed {
    /// Box in x and z, metres.
    low: Vec2,
    high: Vec2,
    /// Largest y, metres.
    top: f32,
    solid: u32,
    /// Index of its corners.
    corners: u32,
}

impl Listed {
    fn new(solid: u32, corners: u32, triangle: &Triangle) -> Self {
        let [low, high] = [Vec3::min, Vec3::max]
            .map(|bound| triangle.positions.into_iter().reduce(bound).unwrap_or_default());
        Self { low: low.xz(), high: high.xz(), top: high.y, solid, corners }
    }
}

impl Solids {
    /// Finds the solids of a scene. A surface with holes is not one. Nor is a closed surface around
    /// a viewpoint: its inside is part of the scene.
    pub fn of_scene(scene: &Scene) -> Self {
        let mut parts = parts(&scene.triangles);
        let cut = scene.opacity.micromaps().filter_map(|(triangle, _)| parts[triangle]);
        let cut: HashSet<u32> = cut.collect();
        parts.iter_mut().for_each(|part| *part = part.filter(|part| !cut.contains(part)));
        Self::outside_of(&scene.triangles, parts, &scene.viewpoints())
    }

    /// The solids of a scene that has none.
    pub fn none() -> Self {
        Self::from_parts(&[], Vec::new())
    }

    fn outside_of(triangles: &[Triangle], parts: Vec<Option<u32>>, viewpoints: &[Vec3]) -> Self {
        let closed = Self::from_parts(triangles, parts);
        let entered: Vec<u32> = viewpoints.iter().flat_map(|&point| closed.solids_around(point)).collect();
        if entered.is_empty() {
            return closed;
        }
        let is_left = |part: &u32| !entered.contains(part);
        Self::from_parts(triangles, closed.parts.into_iter().map(|part| part.filter(is_left)).collect())
    }

    /// The solids of the given triangles.
    fn from_parts(triangles: &[Triangle], parts: Vec<Option<u32>>) -> Self {
        let of_solids: Vec<(u32, &Triangle)> =
            parts.iter().zip(triangles).filter_map(|(part, triangle)| Some(((*part)?, triangle))).collect();
        let points =
            || of_solids.iter().flat_map(|(_, triangle)| triangle.positions).map(|p| Vec2::new(p.x, p.z));
        let (low, high) =
            points().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let count = (of_solids.len() as f32).sqrt().clamp(1.0, MAX_COLUMNS).floor();
        let scale = count / (high - low).max(Vec2::splat(f32::MIN_POSITIVE));
        let columns = UVec2::splat(count as u32);
        let mut solids = Self {
            corners: of_solids.iter().map(|(_, t)| t.positions.map(Vec3::as_dvec3)).collect(),
            low,
            scale,
            columns,
            first: vec![0; columns.element_product() as usize + 1],
            listed: Vec::new(),
            parts: Vec::new(),
        };
        let under = |triangle: &Triangle| {
            let [low, high] = [Vec3::min, Vec3::max].map(|bound| {
                let corner = triangle.positions.into_iter().reduce(bound).unwrap_or_default();
                solids.column(corner)
            });
            (low.y..=high.y).flat_map(move |z| (low.x..=high.x).map(move |x| (z * columns.x + x) as usize))
        };
        let mut first = vec![0_u32; solids.first.len()];
        of_solids.iter().flat_map(|(_, triangle)| under(triangle)).for_each(|column| first[column + 1] += 1);
        for column in 1..first.len() {
            first[column] += first[column - 1];
        }
        let mut listed = vec![Listed::default(); first.last().map_or(0, |&end| end as usize)];
        let mut next = first.clone();
        for (index, (solid, triangle)) in (0..).zip(&of_solids) {
            for column in under(triangle) {
                listed[next[column] as usize] = Listed::new(*solid, index, triangle);
                next[column] += 1;
            }
        }
        for ends in first.windows(2) {
            listed[ends[0] as usize..ends[1] as usize].sort_by(|a, b| b.top.total_cmp(&a.top));
        }
        (solids.first, solids.listed, solids.parts) = (first, listed, parts);
        solids
    }

    /// Whether the back of each triangle looks into a solid.
    pub fn backs(&self) -> impl Iterator<Item = bool> {
        self.parts.iter().map(Option::is_some)
    }

    /// Whether the scene has no solids.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Whether a point is inside a solid.
    pub fn hold(&self, point: Vec3) -> bool {
        self.solids_around(point).next().is_some()
    }

    /// The solids around a point: a ray straight up leaves each of them more often than it enters.
    pub fn solids_around(&self, point: Vec3) -> impl Iterator<Item = u32> + use<> {
        self.turns(point).into_iter().filter(|found| found.1 > 0).map(|found| found.0)
    }

    /// For each solid that a ray straight up meets: its exits minus its entries.
    fn turns(&self, point: Vec3) -> Vec<(u32, i32)> {
        let Self { low, scale, columns, .. } = self;
        let place = (Vec2::new(point.x, point.z) - low) * scale;
        if self.is_empty() || place.cmplt(Vec2::ZERO).any() || place.cmpgt(columns.as_vec2()).any() {
            return Vec::new();
        }
        let column = self.column(point);
        let column = (column.y * columns.x + column.x) as usize;
        let listed = &self.listed[self.first[column] as usize..self.first[column + 1] as usize];
        let mut left: Vec<(u32, i32)> = Vec::new();
        for Listed { low, high, solid, corners, .. } in
            listed.iter().take_while(|listed| listed.top >= point.y)
        {
            if point.xz().cmplt(*low).any() || point.xz().cmpgt(*high).any() {
                continue;
            }
            let turns = passes(self.corners[*corners as usize], point.as_dvec3());
            match left.iter_mut().find(|found| found.0 == *solid) {
                _ if turns == 0 => {}
                Some(found) => found.1 += turns,
                None => left.push((*solid, turns)),
            }
        }
        left
    }

    /// The column over a point in x and z.
    fn column(&self, point: Vec3) -> UVec2 {
        let place = (Vec2::new(point.x, point.z) - self.low) * self.scale;
        place.max(Vec2::ZERO).as_uvec2().min(self.columns - 1)
    }
}

/// Crossing of a triangle by a ray straight up: 1 from its back to its front, -1 the other way, 0
/// none. Triangles that share an edge agree about its sides, bit for bit.
fn passes(corners: [DVec3; 3], point: DVec3) -> i32 {
    let [a, b, c] = corners.map(|corner| corner - point);
    // Twice the signed area of the triangle of an edge and the point, seen from above.
    let area = |p: DVec3, q: DVec3| p.z * q.x - p.x * q.z;
    let areas = [area(b, c), area(c, a), area(a, b)];
    let sum = areas[0] + areas[1] + areas[2];
    if sum == 0.0 || areas.iter().any(|area| *area * sum < 0.0) {
        return 0;
    }
    let height = (areas[0] * a.y + areas[1] * b.y + areas[2] * c.y) / sum;
    if height <= 0.0 {
        0
    } else if sum > 0.0 {
        1
    } else {
        -1
    }
}

/// The solid of each triangle: a connected surface whose edges balance in direction, with a
/// positive signed volume. Solids that share a corner count as one.
fn parts(triangles: &[Triangle]) -> Vec<Option<u32>> {
    let mut corners: HashMap<[u32; 3], usize> = HashMap::new();
    let mut parent = Vec::new();
    let indexed: Vec<[usize; 3]> = triangles
        .iter()
        .map(|triangle| {
            triangle.positions.map(|p| {
                // Adding zero makes -0 equal to 0.
                *corners.entry((p + 0.0).to_array().map(f32::to_bits)).or_insert_with(|| {
                    parent.push(parent.len());
                    parent.len() - 1
                })
            })
        })
        .collect();
    let mut edges: HashMap<[usize; 2], i32> = HashMap::new();
    for &[a, b, c] in &indexed {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let roots = [from, to].map(|corner| root(&mut parent, corner));
            parent[roots[0]] = roots[1];
            *edges.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    let mut is_solid = vec![true; parent.len()];
    for (edge, balance) in edges {
        is_solid[root(&mut parent, edge[0])] &= balance == 0;
    }
    let parts: Vec<usize> = indexed.iter().map(|corners| root(&mut parent, corners[0])).collect();
    let mut volumes = vec![0.0; is_solid.len()];
    for (triangle, &part) in triangles.iter().zip(&parts) {
        let [a, b, c] = triangle.positions.map(Vec3::as_dvec3);
        volumes[part] += a.dot(b.cross(c));
    }
    is_solid.iter_mut().zip(volumes).for_each(|(solid, volume)| *solid &= volume > 0.0);
    parts.into_iter().map(|part| is_solid[part].then_some(part as u32)).collect()
}

/// The representative corner of a surface.
fn root(parent: &mut [usize], mut corner: usize) -> usize {
    while parent[corner] != corner {
        parent[corner] = parent[parent[corner]];
        corner = parent[corner];
    }
    corner
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{OpacityMaps, shapes};

    fn cube(size: f32) -> Vec<Triangle> {
        shapes::closed_box(Vec3::splat(size), 0.5).triangles
    }

    fn turned(triangle: &Triangle) -> Triangle {
        let [a, b, c] = triangle.positions;
        Triangle { positions: [a, c, b], ..*triangle }
    }

    #[test]
    fn backs_of_solids_are_inside_unless_somebody_looks_from_there() {
        // A room has its fronts inside, a block outside. The last one lacks a facet.
        let room = cube(2.0);
        let mut all = room.clone();
        all.extend(cube(0.5).iter().map(turned));
        let found = |all: &[Triangle], eye: &[Vec3]| {
            Solids::outside_of(all, parts(all), eye).backs().collect::<Vec<bool>>()
        };
        let with_block = found(&all, &[Vec3::new(0.6, 0.0, 0.0)]);
        assert!(with_block[..room.len()].iter().all(|solid| !solid));
        assert!(with_block[room.len()..].iter().all(|solid| *solid));
        assert!(found(&all, &[Vec3::ZERO]).iter().all(|solid| !solid), "an eye inside");
        all.pop();
        assert!(found(&all, &[]).iter().all(|solid| !solid), "a border");
    }

    #[test]
    fn a_surface_with_holes_is_no_solid() {
        let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
        scene.triangles.iter_mut().for_each(|triangle| *triangle = turned(triangle));
        scene.cameras[0].position = Vec3::new(0.0, 3.0, 0.0);
        assert!(Solids::of_scene(&scene).backs().all(|solid| solid));
        let levels: Vec<u32> = (0..scene.triangles.len() as u32).map(|index| u32::from(index == 5)).collect();
        scene.opacity = OpacityMaps::new(&levels, |_, centre| centre.x > 0.5);
        assert!(Solids::of_scene(&scene).backs().all(|solid| !solid));
    }

    #[test]
    fn points_are_inside_solids_and_not_between_them() {
        // A ball and three blocks in a row: the first block reaches into the second, and the
        // third is hollow.
        let mut all = shapes::integrating_sphere(0.5, 4, 0.5, Vec3::ZERO, 1.0).triangles;
        all.iter_mut().for_each(|triangle| *triangle = turned(triangle));
        let mut add = |triangles: &[Triangle], at: Vec3| {
            all.extend(triangles.iter().map(|triangle| Triangle {
                positions: triangle.positions.map(|corner| corner + at),
                ..*triangle
            }));
        };
        let block: Vec<Triangle> = cube(1.0).iter().map(turned).collect();
        for x in [2.0, 2.75, 5.0] {
            add(&block, Vec3::X * x);
        }
        add(&cube(0.5), Vec3::X * 5.0);
        let solids = Solids::outside_of(&all, parts(&all), &[Vec3::new(0.0, 3.0, 0.0)]);
        let inside = |point: Vec3| {
            let ball = point.length() < 0.495;
            let block = |x: f32| (point - Vec3::X * x).abs().max_element() < 0.5;
            // The hollow's surface is wound inwards, so it is no solid and its block
            // counts as filled.
            ball || block(2.0) || block(2.75) || block(5.0)
        };
        let mut count = 0;
        for i in 0..20_000_u32 {
            let step = |by: f64| ((f64::from(i) * by).fract() as f32) - 0.5;
            let point =
                Vec3::new(7.0 * step(0.819_172_5) + 2.5, 1.4 * step(0.671_043_6), 1.4 * step(0.549_700_5));
            if point.length() > 0.49 && point.length() < 0.51 {
                continue;
            }
            assert_eq!(solids.hold(point), inside(point), "{point}");
            count += u32::from(inside(point));
        }
        assert!(count > 4_000);
    }
}
