//! Exposed area fractions of fragments. Interpenetrating solids hide part of each other's surface,
//! and surface on top of other surface covers it except for a gap that no cell resolves. Hidden
//! surface receives no light. It gets no entry points, and its area is subtracted from its cluster.
//! Nor do holes have an area.

use super::sides::{plastic_sequence, sphere};
use crate::cpu::gather_rays::COVERED_SIGHT;
use crate::cpu::sampling::hash;
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::precompute::geometry::Geometry;
use crate::passes::precompute::rays::{RayQuery, Rays};
use crate::scene::{Measure, Quality};
use rayon::prelude::*;

/// Tested points of a fragment, and of a fragment whose first points disagree.
const POINTS: u32 = 4;
const MORE_POINTS: u32 = 32;
/// Maximum distance of a covering surface, in cells.
const GAP: f32 = 1.0 / 16.0;
/// Rays of each point.
const RAYS: u32 = 12;

/// Returns the fraction of each fragment that is neither a hole nor interior nor covered, 0..=1.
///
/// # Errors
/// The device lacks memory or failed.
pub fn exposed_fractions(
    geometry: &Geometry<'_>,
    (rays, buffers): (&Rays, &SceneBuffers),
    quality: &Quality,
) -> Result<Vec<f32>> {
    let seed = quality.seed;
    let mut open = outside_solids(geometry, seed);
    if !geometry.opacity.is_empty() {
        // Exact, unlike the factors that drawn points estimate: those points are outside of holes.
        let solid = |(fragment, open): (usize, &mut f32)| *open *= geometry.solid_fraction(fragment) as f32;
        open.par_iter_mut().enumerate().for_each(solid);
    }
    if !quality.takes(Measure::CoveredSurface) {
        return Ok(open);
    }
    let cell = |fragment: usize| geometry.hvds.cell_size_of(geometry.hvds.fragments[fragment].cluster);
    let origin = |fragment: usize, index: u32| {
        let point = geometry.draw(fragment, index, seed);
        (geometry.off_surface(&point), point.facet)
    };
    let ahead = |fragment: usize| {
        let (origin, direction) = origin(fragment, 0);
        RayQuery { origin, direction }
    };
    let left: Vec<usize> = (0..open.len()).filter(|&fragment| open[fragment] > 0.0).collect();
    let queries: Vec<_> = left.par_iter().copied().map(ahead).collect();
    let answers = rays.trace(buffers, &queries)?;
    let near = |(&fragment, t): (&usize, f32)| (t >= 0.0 && t < GAP * cell(fragment)).then_some(fragment);
    let near: Vec<usize> = left.iter().zip(answers.iter().map(|answer| answer.t)).filter_map(near).collect();
    let around = |ray: u32| {
        let fragment = near[(ray / (POINTS * RAYS)) as usize];
        let (origin, normal) = origin(fragment, ray / RAYS % POINTS);
        let of_fragment = ray % (POINTS * RAYS);
        let first = geometry.naming.pick(ray - of_fragment, || hash(geometry.names[fragment]) >> 8);
        let [x, y, _] = plastic_sequence((first + of_fragment) ^ hash(seed) >> 8);
        RayQuery { origin, direction: (normal + sphere([x, y])).try_normalize().unwrap_or(normal) }
    };
    let queries: Vec<_> =
        (0..near.len() * (POINTS * RAYS) as usize).into_par_iter().map(|ray| around(ray as u32)).collect();
    let answers = rays.trace(buffers, &queries)?;
    for (&fragment, answers) in near.iter().zip(answers.chunks_exact((POINTS * RAYS) as usize)) {
        let is_covered = |t: f32| t >= 0.0 && t < COVERED_SIGHT * cell(fragment);
        let points = answers.chunks_exact(RAYS as usize);
        let covered = points.filter(|point| point.iter().all(|answer| is_covered(answer.t))).count();
        open[fragment] *= 1.0 - covered as f32 / POINTS as f32;
    }
    Ok(open)
}

/// Returns the fraction of each fragment that is not interior.
fn outside_solids(geometry: &Geometry<'_>, seed: u32) -> Vec<f32> {
    let fragments = &geometry.hvds.fragments;
    if geometry.solids.is_empty() {
        return vec![1.0; fragments.len()];
    }
    let exposed = |fragment: usize| {
        let is_open = |index: &u32| !geometry.is_interior(&geometry.draw(fragment, *index, seed));
        let open = (0..POINTS).filter(is_open).count() as u32;
        if open == 0 || open == POINTS {
            return (open / POINTS) as f32;
        }
        (open + (POINTS..MORE_POINTS).filter(is_open).count() as u32) as f32 / MORE_POINTS as f32
    };
    (0..fragments.len()).into_par_iter().map(exposed).collect()
}
