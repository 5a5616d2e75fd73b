//! The surface on which cache points are placed.

use super::fragment_points::{name_of, plane_sequence, point_in_polygon};
use crate::cpu::math::ClearDistance;
use crate::cpu::sampling::hash;
use crate::scene::{CellSizes, Naming, OpacityMaps, Triangle};
use crate::scene::{fragment::Fragment, hvds::Hvds, solids::Solids};
use crate::types::{CachePoint, Surface};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// The scene as placement reads it.
pub struct Geometry<'a> {
    /// In BVH order.
    pub triangles: &'a [Triangle],
    /// Holes of the triangles.
    pub opacity: &'a OpacityMaps,
    /// In BVH order.
    pub surfaces: &'a [Surface],
    /// The hierarchy with the fragments on which candidates are drawn.
    pub hvds: &'a Hvds,
    /// What random decisions are named by.
    pub naming: Naming,
    /// Name of each fragment, by [`Self::names_of`].
    pub names: Vec<u32>,
    /// Diagonal of the scene, metres.
    pub scene_size: f32,
    /// Sizes of its cells.
    pub cell_sizes: &'a CellSizes,
    /// Watertight solids that may contain surface.
    pub solids: &'a Solids,
    /// Offset of ray origins from surfaces.
    pub clear_distance: ClearDistance,
}

/// Points tried for one outside of holes.
const TRIES: u32 = 256;

impl Geometry<'_> {
    /// A name for each fragment: its number, or one that follows from its place alone.
    pub fn names_of(hvds: &Hvds, naming: Naming) -> Vec<u32> {
        let by_place = |fragment: &Fragment| name_of(&fragment.corners, fragment.side % 2 == 1);
        let name = |(number, fragment)| naming.pick(number as u32, || by_place(fragment));
        hvds.fragments.par_iter().enumerate().map(name).collect()
    }

    /// Whether a point of a side is in a hole.
    pub(super) fn is_hole(&self, point: &CachePoint) -> bool {
        self.opacity.is_hole_at(self.triangles, point.side / 2, point.position.as_dvec3())
    }

    /// Fraction of a fragment that is no hole.
    pub(super) fn solid_fraction(&self, fragment: usize) -> f64 {
        let Fragment { side, corners, .. } = &self.hvds.fragments[fragment];
        if !self.opacity.has_holes(side / 2) {
            return 1.0;
        }
        let corners: Vec<DVec3> = corners.iter().map(|corner| corner.as_dvec3()).collect();
        self.opacity.solid_fraction_of(self.triangles, side / 2, &corners)
    }

    /// A point of the surface, moved off it to the side that it is on.
    pub(super) fn off_surface(&self, point: &CachePoint) -> Vec3 {
        point.position + self.clear_distance.at(point.position) * point.facet
    }

    /// Whether a watertight solid contains a point of the surface.
    pub(super) fn is_interior(&self, point: &CachePoint) -> bool {
        self.solids.hold(self.off_surface(point))
    }

    /// Candidate number `index` of a fragment: uniform over it, low-discrepancy in `index`. The
    /// radius is left at zero. On a side with holes it is uniform over the rest, unless that is so
    /// small that all tries miss it.
    pub(super) fn draw(&self, fragment: usize, index: u32, seed: u32) -> CachePoint {
        let name = self.names[fragment];
        let drawn = self.draw_from(fragment, index, hash(name ^ hash(seed)));
        if !self.opacity.has_holes(drawn.side / 2) {
            return drawn;
        }
        let again = |attempt| self.draw_from(fragment, attempt, hash(index ^ hash(name ^ hash(!seed))));
        let mut tries = std::iter::once(drawn).chain((0..TRIES).map(again));
        tries.find(|point| !self.is_hole(point)).unwrap_or(drawn)
    }

    /// Point number `index` of the sequence with this shift, on a fragment.
    fn draw_from(&self, fragment: usize, index: u32, shift: u32) -> CachePoint {
        let Fragment { side, corners, .. } = &self.hvds.fragments[fragment];
        let u = plane_sequence(index, shift);
        let corner_mean = self.triangles[*side as usize / 2].positions.iter().sum::<Vec3>() / 3.0;
        // Slightly off the triangle's edges: a ray from a point on an edge may slip out
        // between two surfaces.
        self.point(*side, point_in_polygon(corners, u).lerp(corner_mean, 1.0 / 32_768.0))
    }

    pub(super) fn point(&self, side: u32, position: Vec3) -> CachePoint {
        let triangle = &self.triangles[side as usize / 2];
        let [p0, p1, p2] = triangle.positions.map(Vec3::as_dvec3);
        let normal = triangle.cross();
        let inside = position.as_dvec3();
        let weight =
            |a: DVec3, b: DVec3| (a - inside).cross(b - inside).dot(normal) / normal.length_squared();
        let (w0, w1) = (weight(p1, p2), weight(p2, p0));
        let [n0, n1, n2] = triangle.normals.map(Vec3::as_dvec3);
        let shading = (w0 * n0 + w1 * n1 + (1.0 - w0 - w1) * n2).normalize().as_vec3();
        CachePoint {
            position,
            radius: 0.0,
            normal: if side % 2 == 1 { -shading } else { shading },
            side,
            occluder: Vec3::ZERO,
            facet: self.surfaces[side as usize / 2].normal_of(side % 2 == 1),
            inverse_reach: 0.0,
            stream: 0,
        }
    }
}
