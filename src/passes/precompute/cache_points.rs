//! Cache points: dense candidates on the surfaces, rejected wherever an accepted record is valid.
//! [Yue §1, Tabellion]
//!
//! Deterministic: candidates have a fixed order, and only earlier ones affect a candidate.
//! Covering: the density of candidates follows from the radii, and random probes of the whole
//! surface become candidates where no record is valid. Radii are clamped in world space, because
//! the camera moves. They are also clamped by the clearance of the neighbourhood, so that no record
//! extends over surface that its own rays missed. [Krivanek 2006]

pub use super::budget::RADIUS_RANGE;
use super::budget::{Demand, spread, total};
pub use super::coverage::Placed;
use super::coverage::{Cover, Neighbourhood, Records, earlier_covers};
use super::fragment_points::probed_fragments;
use super::geometry::Geometry;
use super::kept::Kept;
use super::visibility::clearance::{Clearance, ClearanceProbe};
use super::{Progress, advance, begin_stage};
use crate::cpu::sampling::hash;
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::SceneBuffers;
use crate::scene::{Measure, Quality, fragment::Fragment, hvds::Hvds};
use crate::types::CachePoint;
use glam::Vec3;
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::{Arc, atomic::AtomicU32};

/// Candidates for each expected record.
const CANDIDATES_PER_RECORD: f64 = 24.0;
/// Expected number of records, in budgets, beyond which the budget cannot suffice.
const HOPELESS: f64 = 1.5;
/// If the budget does not suffice, relaxed records first cover all surface, before any surface gets
/// its full density.
const SPARSE_FIRST: [Cover; 2] = [Cover::SPARSE, Cover::DENSE];
/// Candidates of the first batch, and minimum number of batches.
const MIN_BATCH: usize = 4096;
const BATCHES: usize = 24;
/// Candidates in one measurement of clearances.
const MEASURED: usize = 2048;
/// Coverage probes in one iteration, and the fraction of them that may stay uncovered.
const PROBES: u32 = 200_000;
const UNCOVERED_FRACTION: f64 = 5e-5;
const PROBE_ROUNDS: u32 = 6;

/// The accepted cache points.
pub struct Placement {
    /// In order of acceptance.
    pub points: Vec<Placed>,
    /// Lower clamp of their radii where the spacing is least, metres.
    pub min_radius: f32,
    /// Number of tested candidates.
    pub candidates: u64,
    /// Whether the budget sufficed: all but a tiny fraction of the surface has a record.
    pub is_covering: bool,
}

/// Clearances measured all over the active surface: one sample a fragment, or fewer in a cluster
/// with many fragments.
pub struct SizeField<'a> {
    probe: ClearanceProbe<'a>,
    samples: Vec<CachePoint>,
    clearances: Vec<f32>,
}

impl<'a> SizeField<'a> {
    /// Measures the clearances of points on the fragments.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(
        context: &Arc<Context>,
        buffers: &SceneBuffers,
        geometry: &Geometry<'_>,
        (seed, kept): (u32, Option<&'a Kept>),
        progress: &mut dyn Progress,
    ) -> Result<Self> {
        let probe = ClearanceProbe::new(context, geometry, (seed, kept))?;
        let fragments = probed_fragments(&geometry.hvds.fragments, &geometry.names);
        begin_stage(progress, "clearances", fragments.len() as u64)?;
        let samples: Vec<_> =
            fragments.par_iter().map(|&fragment| geometry.draw(fragment, 0, seed)).collect();
        let measured = probe.measure(buffers, &samples, Some(progress))?;
        // Interior surface is no surface.
        let open = samples.into_iter().zip(measured).filter(|(_, measured)| measured.distance >= 0.0);
        let (samples, clearances) = open.map(|(sample, measured)| (sample, measured.distance)).unzip();
        Ok(Self { probe, samples, clearances })
    }

    /// Whether each of these points is in a solid.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn in_solids(&self, buffers: &SceneBuffers, points: &[CachePoint]) -> Result<Vec<bool>> {
        let measured = self.probe.measure(buffers, points, None)?;
        Ok(measured.iter().map(|clearance| clearance.distance < 0.0).collect())
    }

    /// Interpolated clearance, metres, at the middle of each fragment of another hierarchy of
    /// the same surface.
    pub fn clearances_of(&self, geometry: &Geometry<'_>, other: &Hvds) -> Vec<f32> {
        let neighbourhood = Neighbourhood::new(geometry.hvds, &self.samples, &self.clearances);
        let middle = |fragment: &Fragment| {
            neighbourhood.clamp(&geometry.point(fragment.side, fragment.middle()), geometry.scene_size)
        };
        other.fragments.par_iter().map(middle).collect()
    }
}

/// Places at most `quality.cache_points` cache points on the fragments of the active sides.
///
/// # Errors
/// The device lacks memory or failed.
pub fn place(
    size_field: &SizeField<'_>,
    buffers: &SceneBuffers,
    geometry: &Geometry<'_>,
    quality: &Quality,
    progress: &mut dyn Progress,
) -> Result<Placement> {
    let budget = quality.cache_points;
    if budget == 0 {
        return Ok(Placement {
            points: Vec::new(),
            min_radius: geometry.scene_size,
            candidates: 0,
            is_covering: true,
        });
    }
    let SizeField { probe, samples, clearances } = size_field;
    let neighbourhood = &Neighbourhood::new(geometry.hvds, samples, clearances);
    let demands = &Demand::of_fragment(geometry, &size_field.clearances_of(geometry, geometry.hvds));
    let [mut unit, largest, sparse] =
        spread(demands, geometry.scene_size, budget).map(|unit| geometry.naming.rounded(unit));
    let mut is_last = total(demands, |demand| demand.records(largest)) > HOPELESS * f64::from(budget);
    let first = unit;
    let mut known = HashMap::new();
    let (low, high) = geometry.hvds.grid.bounds();
    loop {
        if is_last {
            unit = sparse;
        }
        let largest = geometry.cell_sizes.max_stretched(low, high, RADIUS_RANGE[1] * unit);
        let mut records = Records::new(&geometry.hvds.grid, largest, largest / (RADIUS_RANGE[1] * unit));
        let hints = demands.iter().map(|_| AtomicU32::new(u32::MAX)).collect();
        let attempt =
            Attempt { buffers, geometry, probe, neighbourhood, demands, unit, is_last, quality, hints };
        let placement = attempt.run(&mut records, &mut known, progress)?;
        if placement.is_covering || is_last {
            return Ok(placement);
        }
        // The estimate is rarely far off. If it is, longer radii blur more than relaxed records do.
        is_last = unit > first;
        unit *= 1.1;
    }
}

/// A candidate's rank and position; ordered by both.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Candidate {
    rank: u32,
    fragment: u32,
    /// Index of its point on the fragment.
    index: u32,
}

/// Clearances that an earlier attempt measured, by [`place_of`].
type Known = HashMap<[u32; 4], Clearance>;

/// The position and side that determine a clearance.
fn place_of(candidate: &CachePoint) -> [u32; 4] {
    let [x, y, z] = candidate.position.to_array().map(f32::to_bits);
    [x, y, z, candidate.side]
}

/// One attempt at a given unit of length.
struct Attempt<'a> {
    buffers: &'a SceneBuffers,
    geometry: &'a Geometry<'a>,
    probe: &'a ClearanceProbe<'a>,
    neighbourhood: &'a Neighbourhood<'a>,
    demands: &'a [Demand<'a>],
    unit: f64,
    /// No other attempt follows.
    is_last: bool,
    quality: &'a Quality,
    /// A record that covers some point of each fragment: it most likely covers others, too.
    hints: Vec<AtomicU32>,
}

impl Attempt<'_> {
    fn run(
        &self,
        records: &mut Records,
        known: &mut Known,
        progress: &mut dyn Progress,
    ) -> Result<Placement> {
        let (mut looked_at, mut has_room) = (0, true);
        for &cover in &SPARSE_FIRST[usize::from(!self.is_last)..] {
            if has_room {
                let (candidates, is_done) = self.fill(records, known, cover, progress)?;
                (looked_at, has_room) = (looked_at + candidates, is_done);
            }
        }
        for round in 0..PROBE_ROUNDS {
            if !has_room {
                break;
            }
            let mut probes = self.probes();
            looked_at += probes.len() as u64;
            let seed = hash(self.quality.seed ^ 0x5eed ^ round);
            let uncovered = self.uncovered(records, &mut probes, seed, Cover::ANY);
            if uncovered.len() as f64 <= UNCOVERED_FRACTION * probes.len() as f64 {
                break;
            }
            has_room = self.accept(records, known, &uncovered, Cover::DENSE)?;
        }
        Ok(Placement {
            points: std::mem::take(&mut records.points),
            min_radius: (RADIUS_RANGE[0] * self.unit) as f32,
            candidates: looked_at,
            is_covering: has_room,
        })
    }

    /// Accepts candidates until `cover` holds for all. Returns their number, and false if the
    /// budget is spent.
    fn fill(
        &self,
        records: &mut Records,
        known: &mut Known,
        cover: Cover,
        progress: &mut dyn Progress,
    ) -> Result<(u64, bool)> {
        let mut candidates = self.candidates();
        begin_stage(progress, "cache points", candidates.len() as u64)?;
        let mut first = 0;
        let mut has_room = true;
        while first < candidates.len() && has_room {
            // Small batches first, while there are few records to cover the candidates.
            let batch = (first + MIN_BATCH).min(candidates.len().div_ceil(BATCHES)).max(MIN_BATCH);
            let end = candidates.len().min(first + batch);
            let open = self.uncovered(records, &mut candidates[first..end], self.quality.seed, cover);
            has_room = self.accept(records, known, &open, cover)?;
            advance(progress, end as u64)?;
            first = end;
        }
        Ok((candidates.len() as u64, has_room))
    }

    /// All candidates in a fixed shuffled order, in proportion to the expected records of each
    /// fragment. If the budget may not suffice, fragments with large records come first.
    fn candidates(&self) -> Vec<Candidate> {
        let of_fragment = |fragment: usize| {
            let count = CANDIDATES_PER_RECORD * self.demands[fragment].records(self.unit);
            let order =
                self.is_last.then(|| self.demands[fragment].order(self.unit, self.geometry.scene_size));
            // Hashed: `draw` shifts the points of seed 0 by a hash of the name itself.
            let name = hash(self.geometry.names[fragment]);
            let rank = move |i: u32| match order {
                None => hash(name ^ i),
                Some(order) => order << 24 | hash(name ^ i) >> 8,
            };
            let candidate = move |i| Candidate { rank: rank(i), fragment: fragment as u32, index: 1 + i };
            (0..count.ceil() as u32).map(candidate)
        };
        let mut candidates: Vec<_> =
            (0..self.demands.len()).into_par_iter().flat_map_iter(of_fragment).collect();
        candidates.par_sort_unstable();
        candidates
    }

    /// Factor of the spacing of records.
    fn spacing_at(&self, place: Vec3) -> f64 {
        self.geometry.cell_sizes.stretched(place, self.unit) / self.unit
    }

    /// Random points over the whole active surface, in proportion to area over squared spacing, at
    /// least one a fragment.
    fn probes(&self) -> Vec<Candidate> {
        let fragments = &self.geometry.hvds.fragments;
        let weight = |fragment: &Fragment| fragment.area_m2 / self.spacing_at(fragment.middle()).powi(2);
        let all = self.geometry.naming.rounded(fragments.iter().map(weight).sum());
        let counts =
            fragments.iter().map(|fragment| (f64::from(PROBES) * weight(fragment) / all).ceil() as u32);
        let of_fragment = |(fragment, count): (u32, u32)| (0..count).map(move |index| (fragment, index));
        let probes = (0..).zip(counts).flat_map(of_fragment);
        (0..).zip(probes).map(|(rank, (fragment, index))| Candidate { rank, fragment, index }).collect()
    }

    /// Returns the candidates that no record covers, in the order of their ranks.
    /// Reorders the list.
    fn uncovered(
        &self,
        records: &Records,
        candidates: &mut [Candidate],
        seed: u32,
        cover: Cover,
    ) -> Vec<CachePoint> {
        // Neighbours on the surface are consecutive, because they test the same records.
        candidates.par_sort_unstable_by_key(|candidate| (candidate.fragment, candidate.index));
        let candidates = &*candidates;
        let drawn = candidates.par_iter().map(|candidate| {
            let &Candidate { fragment, index, .. } = candidate;
            (candidate, self.geometry.draw(fragment as usize, index, seed))
        });
        let is_open = |(candidate, point): &(&Candidate, CachePoint)| {
            let fragment = &self.geometry.hvds.fragments[candidate.fragment as usize];
            !records.cover_near(&self.hints[candidate.fragment as usize], point, cover)
                && (fragment.open == 1.0
                    || !self.geometry.is_interior(point) && !self.geometry.is_hole(point))
        };
        let mut open: Vec<_> = drawn.filter(is_open).collect();
        open.par_sort_unstable_by_key(|drawn| drawn.0);
        open.into_iter().map(|drawn| drawn.1).collect()
    }

    /// Accepts, in order, candidates that no record covers yet. Returns false if the
    /// budget is spent.
    fn accept(
        &self,
        records: &mut Records,
        known: &mut Known,
        mut candidates: &[CachePoint],
        cover: Cover,
    ) -> Result<bool> {
        while !candidates.is_empty() {
            // A few at a time: candidates that these cover need no measurement.
            let mut open: Vec<CachePoint> = Vec::new();
            while open.len() < MEASURED && !candidates.is_empty() {
                let (next, rest) = candidates.split_at(candidates.len().min(MEASURED));
                let is_open = |candidate: &&CachePoint| !records.cover(candidate, cover);
                open.par_extend(next.par_iter().filter(is_open));
                candidates = rest;
            }
            let placed = self.placed(known, &open)?;
            let mut is_accepted = vec![false; placed.len()];
            for (index, covering) in earlier_covers(&placed, cover).iter().enumerate() {
                if covering.iter().any(|&earlier| is_accepted[earlier as usize]) {
                    continue;
                }
                if records.points.len() as u32 >= self.quality.cache_points {
                    return Ok(false);
                }
                is_accepted[index] = true;
                records.insert(placed[index]);
            }
        }
        Ok(true)
    }

    /// The records that candidates would become, in order, without those in solids.
    fn placed(&self, known: &mut Known, candidates: &[CachePoint]) -> Result<Vec<Placed>> {
        let is_new = |candidate: &&CachePoint| !known.contains_key(&place_of(candidate));
        let new: Vec<CachePoint> = candidates.iter().filter(is_new).copied().collect();
        let clearances = self.probe.measure(self.buffers, &new, None)?;
        known.extend(new.iter().map(place_of).zip(clearances));
        let known = &*known;
        let measured = candidates.par_iter().map(|candidate| (candidate, known[&place_of(candidate)]));
        let open = measured.filter(|(_, clearance)| clearance.distance >= 0.0);
        Ok(open.map(|(candidate, clearance)| self.record(*candidate, clearance)).collect())
    }

    /// The record at a candidate with that clearance.
    fn record(&self, mut point: CachePoint, clearance: Clearance) -> Placed {
        if self.quality.takes(Measure::OccluderPlanes) {
            point.occluder = clearance.occluder;
        }
        let clearance = match self.quality.takes(Measure::ClearanceBounds) {
            true => self.neighbourhood.clamp(&point, clearance.distance),
            false => clearance.distance,
        };
        let sizes = self.geometry.cell_sizes;
        let bound = |bound: f64| sizes.stretched(point.position, bound * self.unit) as f32;
        let [low, high] = RADIUS_RANGE.map(bound);
        point.radius = (0.5 * clearance).clamp(low, high);
        point.inverse_reach = 2.0 / clearance.max(1e-6 * self.geometry.scene_size);
        Placed { point, clearance, spacing: self.spacing_at(point.position) as f32 }
    }
}
