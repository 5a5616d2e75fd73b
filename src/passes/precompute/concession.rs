//! Where surfaces bend in so many places that the budget of records is far too small for them: normals further apart share a record, and
//! records stand closest where the scene's cameras are.

use super::cache_points::Geometry;
use super::rays::{RayQuery, Rays};
use super::sides::{plastic_sequence, sphere};
use crate::cpu::records::Tolerance;
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::scene::hvds::Hvds;
use crate::types::{CachePoint, NO_SIDE, Surface};
use glam::{IVec3, Vec3};

/// Normals so many times further apart share a record.
pub(super) const WIDER: f32 = 2.0;
/// Radii are so many times larger where no camera sees the surface from its place.
const ELSEWHERE: f64 = 3.0;
/// Rays that look around from a camera.
const RAYS_PER_CAMERA: u32 = 1 << 16;

/// What is conceded; nothing as a rule.
pub(super) struct Concession(Option<Vec<bool>>);

impl Concession {
    /// Nothing.
    pub(super) fn none() -> Self {
        Self(None)
    }

    /// `seen` of the base clusters.
    pub(super) fn new(seen: Vec<bool>) -> Self {
        Self(Some(seen))
    }

    /// By which radii are larger in a base cluster.
    pub(super) fn scale(&self, cluster: u32) -> f64 {
        match &self.0 {
            Some(seen) if !seen[cluster as usize] => ELSEWHERE,
            _ => 1.0,
        }
    }

    /// The same at a point.
    pub(super) fn scale_at(&self, geometry: &Geometry<'_>, point: &CachePoint) -> f64 {
        let (hvds, surface) = (geometry.hvds, &geometry.surfaces[point.side as usize / 2]);
        let cell = hvds.grid.index_of(hvds.grid.cell_of(point.position, point.facet));
        let code = surface.side_code(point.side % 2 == 1);
        hvds.base_cluster(cell, code, point.position).map_or(1.0, |cluster| self.scale(cluster))
    }

    /// The largest scale.
    pub(super) fn largest_scale(&self) -> f64 {
        if self.0.is_some() { ELSEWHERE } else { 1.0 }
    }

    /// What records are valid for.
    pub(super) fn tolerance(&self) -> Tolerance {
        if self.0.is_some() { Tolerance::widened(WIDER) } else { Tolerance::VALID }
    }
}

/// Which base clusters are seen from some of `places`, wherever one looks, and those beside them that face alike.
///
/// # Errors
/// The device lacks memory or failed.
pub fn seen_from(
    places: &[Vec3],
    (rays, buffers): (&Rays, &SceneBuffers),
    hvds: &Hvds,
    surfaces: &[Surface],
) -> Result<Vec<bool>> {
    let mut seen = vec![false; hvds.levels[0].len()];
    let most = hvds.grid.cells.as_ivec3() - 1;
    for &origin in places {
        let direction = |ray| {
            let [x, y, _] = plastic_sequence(ray);
            sphere([x, y])
        };
        let look = |ray| RayQuery { origin, direction: direction(ray) };
        let queries: Vec<RayQuery> = (0..RAYS_PER_CAMERA).map(look).collect();
        for (query, answer) in queries.iter().zip(rays.trace(buffers, &queries)?) {
            if answer.side == NO_SIDE {
                continue;
            }
            let (surface, back) = (&surfaces[answer.side as usize / 2], answer.side % 2 == 1);
            let position = origin + answer.t * query.direction;
            let cell = hvds.grid.cell_of(position, surface.normal_of(back)).as_ivec3();
            for index in 0..27 {
                let step = IVec3::new(index % 3, index / 3 % 3, index / 9) - 1;
                let cell = (cell + step).clamp(IVec3::ZERO, most).as_uvec3();
                let cluster = hvds.base_cluster(hvds.grid.index_of(cell), surface.side_code(back), position);
                if let Some(cluster) = cluster {
                    seen[cluster as usize] = true;
                }
            }
        }
    }
    Ok(seen)
}
