//! Closed surfaces, which all parts of built-in models consist of.

use glam::{DAffine3, DVec3};

/// Facets that meet at less than this angle, degrees, form one curved surface.
const CREASE_DEGREES: f64 = 42.0;

/// A closed surface under construction: facets share corners by index, wound
/// counter-clockwise from outside.
#[derive(Clone, Debug, Default)]
pub(super) struct Solid {
    pub(super) points: Vec<DVec3>,
    pub(super) facets: Vec<[u32; 3]>,
    /// Index into a part's materials for each facet; empty if all have the first.
    pub(super) finishes: Vec<u8>,
}

impl Solid {
    /// Adds a corner and returns its index.
    pub(super) fn point(&mut self, p: DVec3) -> u32 {
        self.points.push(p);
        (self.points.len() - 1) as u32
    }

    /// Adds a planar or nearly planar quadrilateral as two facets.
    pub(super) fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.facets.push([a, b, c]);
        self.facets.push([a, c, d]);
    }

    /// Adds a quadrilateral split along the diagonal that bends the surface less.
    pub(super) fn bent_quad(&mut self, [a, b, c, d]: [u32; 4]) {
        let at = |index: u32| self.points[index as usize];
        if at(a).distance_squared(at(c)) <= at(b).distance_squared(at(d)) {
            self.quad([a, b, c, d]);
        } else {
            self.quad([b, c, d, a]);
        }
    }

    /// Gives all facets added since the last call this finish.
    pub(super) fn finish_as(&mut self, finish: u8) {
        self.finishes.resize(self.facets.len(), finish);
    }

    /// Adds another solid at its own position.
    pub(super) fn join(&mut self, other: Self) {
        let first = self.points.len() as u32;
        self.points.extend(other.points);
        self.facets.extend(other.facets.iter().map(|facet| facet.map(|corner| corner + first)));
        self.finishes.extend(other.finishes);
    }

    /// Moves every corner.
    pub(super) fn bend(mut self, place: impl Fn(DVec3) -> DVec3) -> Self {
        self.points.iter_mut().for_each(|p| *p = place(*p));
        self
    }

    /// The transformed solid; a mirror image keeps its outside.
    pub(super) fn moved(self, by: &DAffine3) -> Self {
        let mut moved = self.bend(|p| by.transform_point3(p));
        if by.matrix3.determinant() < 0.0 {
            moved.facets.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        moved
    }

    /// Computes normals that are smooth across the default crease angle.
    pub(super) fn smooth(self) -> Part {
        self.smooth_below(CREASE_DEGREES)
    }

    /// Computes normals that are smooth around a turned solid with that many cuts, even with few.
    pub(super) fn smooth_round(self, cuts: usize) -> Part {
        self.smooth_below((400.0 / cuts as f64).clamp(CREASE_DEGREES, 95.0))
    }

    /// Computes normals that are smooth if facets meet at less than that angle, degrees.
    pub(super) fn smooth_below(self, crease_degrees: f64) -> Part {
        let cosine = crease_degrees.to_radians().cos();
        let crosses: Vec<DVec3> = self.facets.iter().map(|corners| self.cross(*corners)).collect();
        let (offsets, around) = self.facets_around();
        let mut part = Part { finishes: self.finishes.clone(), ..Part::default() };
        // Vertices of each corner so far: few, since most corners have one normal.
        let mut made: Vec<Vec<u32>> = vec![Vec::new(); self.points.len()];
        for (corners, cross) in self.facets.iter().zip(&crosses) {
            let front = cross.normalize_or_zero();
            let indices = corners.map(|corner| {
                let corner = corner as usize;
                let neighbours = &around[offsets[corner]..offsets[corner + 1]];
                let crosses = neighbours.iter().map(|&facet| crosses[facet as usize]);
                let alike = crosses.filter(|other| other.dot(front) >= cosine * other.length());
                let normal = alike.sum::<DVec3>().normalize_or(front);
                let known = made[corner].iter().find(|&&vertex| part.normals[vertex as usize] == normal);
                known.copied().unwrap_or_else(|| {
                    let vertex = part.positions.len() as u32;
                    part.positions.push(self.points[corner]);
                    part.normals.push(normal);
                    made[corner].push(vertex);
                    vertex
                })
            });
            part.facets.push(indices);
        }
        part
    }

    fn cross(&self, corners: [u32; 3]) -> DVec3 {
        let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
        (b - a).cross(c - a)
    }

    /// Facets around each corner, as offsets into a list.
    fn facets_around(&self) -> (Vec<usize>, Vec<u32>) {
        let mut offsets = vec![0; self.points.len() + 1];
        let corners = || self.facets.iter().flatten().map(|&corner| corner as usize);
        corners().for_each(|corner| offsets[corner + 1] += 1);
        (1..offsets.len()).for_each(|at| offsets[at] += offsets[at - 1]);
        let mut next = offsets.clone();
        let mut around = vec![0; self.facets.len() * 3];
        for (at, corner) in corners().enumerate() {
            around[next[corner]] = (at / 3) as u32;
            next[corner] += 1;
        }
        (offsets, around)
    }
}

/// A finished solid: vertices with normals, for any number of placements.
#[derive(Clone, Debug, Default)]
pub(super) struct Part {
    pub(super) positions: Vec<DVec3>,
    /// Unit normals, one per position.
    pub(super) normals: Vec<DVec3>,
    pub(super) facets: Vec<[u32; 3]>,
    /// See [`Solid::finishes`].
    pub(super) finishes: Vec<u8>,
}
