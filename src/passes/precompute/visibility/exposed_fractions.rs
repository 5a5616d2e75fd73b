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
use crate::passes::precompute::kept::{Kept, bounds, names::name_of};
use crate::passes::precompute::rays::{RayQuery, Rays};
use crate::scene::{Measure, Quality, fragment::Fragment};
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
    tracer: (&Rays, &SceneBuffers),
    quality: &Quality,
    kept: Option<&Kept>,
) -> Result<Vec<f32>> {
    let fragments: Vec<u32> = (0..geometry.hvds.fragments.len() as u32).collect();
    let find = |fragments: &[u32]| exposed(geometry, tracer, quality, fragments);
    let Some(kept) = kept else { return find(&fragments) };
    let fragment = |&fragment: &u32| &geometry.hvds.fragments[fragment as usize];
    let reach = |fragment: &Fragment| GAP.max(COVERED_SIGHT) * geometry.hvds.cell_size_of(fragment.cluster);
    let name = |number: &u32| {
        let fragment = fragment(number);
        let words = [fragment.side & 1, reach(fragment).to_bits()];
        name_of(fragment.corners.iter().copied(), words)
    };
    let is_kept = |number: &u32, _: &f32| {
        let fragment = fragment(number);
        let bounds = bounds(fragment.corners.iter().copied());
        bounds.is_some_and(|bounds| kept.is_clear(bounds, reach(fragment)))
    };
    kept.all("exposed fractions", &fragments, name, is_kept, find)
}

/// The same of some fragments.
fn exposed(
    geometry: &Geometry<'_>,
    (rays, buffers): (&Rays, &SceneBuffers),
    quality: &Quality,
    fragments: &[u32],
) -> Result<Vec<f32>> {
    let seed = quality.seed;
    let mut all = outside_solids(geometry, seed, fragments);
    if !geometry.opacity.is_empty() {
        // Exact, unlike the factors that drawn points estimate: those points are outside of holes.
        let solid = |(&fragment, open): (&u32, &mut f32)| {
            *open *= geometry.solid_fraction(fragment as usize) as f32;
        };
        fragments.par_iter().zip(&mut all).for_each(solid);
    }
    if !quality.takes(Measure::CoveredSurface) {
        return Ok(all);
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
    let left = fragments.iter().zip(&mut all).filter(|(_, open)| **open > 0.0);
    let left: Vec<(usize, &mut f32)> = left.map(|(&fragment, open)| (fragment as usize, open)).collect();
    let queries: Vec<_> = left.par_iter().map(|&(fragment, _)| ahead(fragment)).collect();
    let sizes = left.par_iter().map(|&(fragment, _)| cell(fragment));
    let largest_cell = sizes.reduce(|| 0.0, f32::max);
    let answers = rays.trace_within(buffers, &queries, GAP * largest_cell)?;
    let is_near = |fragment: usize, t: f32| t >= 0.0 && t < GAP * cell(fragment);
    let hits = left.into_iter().zip(answers).filter(|((fragment, _), answer)| is_near(*fragment, answer.t));
    let (near, open): (Vec<usize>, Vec<&mut f32>) = hits.map(|(fragment, _)| fragment).unzip();
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
    let answers = rays.trace_within(buffers, &queries, COVERED_SIGHT * largest_cell)?;
    let answers = answers.chunks_exact((POINTS * RAYS) as usize);
    for ((&fragment, open), answers) in near.iter().zip(open).zip(answers) {
        let is_covered = |t: f32| t >= 0.0 && t < COVERED_SIGHT * cell(fragment);
        let points = answers.chunks_exact(RAYS as usize);
        let covered = points.filter(|point| point.iter().all(|answer| is_covered(answer.t))).count();
        *open *= 1.0 - covered as f32 / POINTS as f32;
    }
    Ok(all)
}

/// Returns the fraction of each fragment that is not interior.
fn outside_solids(geometry: &Geometry<'_>, seed: u32, fragments: &[u32]) -> Vec<f32> {
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
    fragments.par_iter().map(|&fragment| exposed(fragment as usize)).collect()
}
