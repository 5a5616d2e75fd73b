//! Mirrors `glsl/include/photons.glsl`: cells, kernel and reach.

use crate::cpu::hemisphere::frame;
use crate::cpu::sampling::hash_pair;
use glam::{DVec2, DVec3, IVec3, Vec3};
use std::f64::consts::{FRAC_PI_8, PI};

/// Number of buckets of the cells' hash.
pub const BUCKETS: u32 = 65_535;
/// Minimum cosine between normals on one surface.
const SAME_NORMAL: f64 = 0.9;
/// Maximum distance from a plane that counts as in it, in radii.
pub const SAME_PLANE: f64 = 0.1;

/// The cells of a map.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    /// A corner of cell (0, 0, 0).
    pub low: Vec3,
    /// 1 / edge of a cell, 1/m.
    pub inverse_cell: f32,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position of the point, metres.
    pub position: Vec3,
    /// Unit geometric normal of its side.
    pub normal: Vec3,
}

impl Cells {
    /// The cell that holds a point.
    pub fn cell_of(self, position: Vec3) -> IVec3 {
        ((position - self.low) * self.inverse_cell).floor().as_ivec3()
    }

    /// The bucket of the cell that holds a point.
    pub fn bucket_of(self, position: Vec3) -> u32 {
        let [x, y, z] = self.cell_of(position).to_array().map(|index| index as u32);
        hash_pair(x, hash_pair(y, z)) % BUCKETS
    }
}

/// The kernel of the density estimate at `point` for a photon at `other`; not
/// normalised. [Epanechnikov 1969]
pub fn kernel(point: SurfacePoint, other: SurfacePoint, radius: f64) -> f64 {
    let (offset, normal) = (offset(point, other), point.normal.as_dvec3());
    if normal.dot(other.normal.as_dvec3()) < SAME_NORMAL || normal.dot(offset).abs() > SAME_PLANE * radius {
        return 0.0;
    }
    (1.0 - offset.length_squared() / radius.powi(2)).max(0.0)
}

/// The vector from one point to another, metres.
pub fn offset(from: SurfacePoint, to: SurfacePoint) -> DVec3 {
    to.position.as_dvec3() - from.position.as_dvec3()
}

/// The sector of an offset, of sixteen equal ones, by its angle.
pub fn sector(along: DVec2) -> usize {
    let angle = along.y.abs().atan2(along.x.abs());
    // Quarters of the right angle from the x axis up: near x, near the diagonal, past it, near y.
    let quarter = ((angle / FRAC_PI_8) as usize).min(3);
    let [is_steep, is_diagonal] = [quarter >= 2, quarter == 1 || quarter == 2];
    usize::from(along.x < 0.0)
        | usize::from(along.y < 0.0) << 1
        | usize::from(is_steep) << 2
        | usize::from(is_diagonal) << 3
}

/// The middle of a sector, unit: the middle angle among the sixteen that falls into it.
pub fn sector_direction(wanted: usize) -> DVec2 {
    let direction = |step: u32| DVec2::from_angle((f64::from(step) + 0.5) * FRAC_PI_8 - PI);
    (0..16).map(direction).find(|along| sector(*along) == wanted).unwrap_or(DVec2::X)
}

/// Whether no wall separates a point of that reach from `other` on its surface.
pub fn is_within_reach(reach: [u8; 16], point: SurfacePoint, other: SurfacePoint, radius: f64) -> bool {
    let (frame, offset) = (frame(point.normal), offset(point, other));
    let along = DVec2::new(offset.dot(frame.x_axis), offset.dot(frame.y_axis));
    let steps = reach[sector(along)];
    steps == u8::MAX || along.length() * 255.0 <= f64::from(steps) * radius
}
