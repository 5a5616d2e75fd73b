//! Cache points: dense candidates on the surfaces, rejected wherever an accepted record already speaks for them.
//! [Yue §1, Tabellion]
//!
//! Deterministic: candidates have a fixed order, and a candidate's fate depends on earlier ones only. Covering: candidates
//! are drawn as densely as the radii ask, and random probes of the whole surface become candidates themselves where
//! no record serves them. Radii are clamped in world space, because the camera moves, and by the neighbourhood's
//! clearance, so that no record reaches over what its own rays missed. [Krivanek 2006]

use super::Progress;
use super::clearance::Surveyor;
pub use super::coverage::Placed;
use super::coverage::{Neighbourhood, Records};
use crate::cpu::sampling::hash;
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::SceneBuffers;
use crate::scene::{Triangle, hvds::Hvds, hvds::Piece};
use crate::types::{CachePoint, Surface};
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// A point counts as covered from this record weight on; records then overlap enough to blend.
const COVERED: f32 = 0.3;
/// Radii are clamped between these multiples of one length, which the budget decides. [Tabellion §4] has 1.5 and 10 pixels.
const RADIUS_RANGE: [f64; 2] = [1.0, 5.0];
/// Normals further apart than this do not share a record, radians.
const NORMAL_RANGE: f64 = 0.174_53;
/// Records that random sequential packing fits into one squared spacing.
const PACKING: f64 = 0.7;
/// Candidates for each record that is expected.
const CANDIDATES_PER_RECORD: f64 = 24.0;
/// Share of the budget that placement aims at; its estimate is good to a few per cent.
const BUDGET_SHARE: f64 = 0.9;
/// Probes for coverage, a round; and the share of them that may stay uncovered.
const PROBES: u32 = 200_000;
const UNCOVERED_SHARE: f64 = 5e-5;
const PROBE_ROUNDS: u32 = 6;

/// The accepted cache points.
pub struct Placement {
    /// In order of acceptance.
    pub points: Vec<Placed>,
    /// Lower clamp of their radii, metres.
    pub least_radius: f32,
    /// Candidates looked at.
    pub candidates: u64,
    /// The budget sufficed: all but a tiny share of the surface has a record.
    pub is_covering: bool,
}

/// How far away other surfaces are, all over the active sides: a sample a piece.
pub struct Survey {
    surveyor: Surveyor,
    samples: Vec<CachePoint>,
    clearances: Vec<f32>,
}

impl Survey {
    /// Measures the clearance of a point on each piece.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(
        context: &Arc<Context>,
        buffers: &SceneBuffers,
        geometry: &Geometry<'_>,
        seed: u32,
        progress: &mut dyn Progress,
    ) -> Result<Self> {
        let surveyor = Surveyor::new(context, geometry.scene_size, seed)?;
        let pieces = &geometry.hvds.pieces;
        progress.stage("clearances", pieces.len() as u64);
        let samples: Vec<CachePoint> = (0..pieces.len()).map(|piece| geometry.draw(piece, 0, seed)).collect();
        let measured = surveyor.measure(buffers, &samples, Some(progress))?;
        let clearances = measured.iter().map(|clearance| clearance.distance).collect();
        Ok(Self { surveyor, samples, clearances })
    }

    /// What the samples around say of the clearance at the middle of each piece of another cut of the same surface, metres.
    pub fn clearances_of(&self, geometry: &Geometry<'_>, other: &Hvds) -> Vec<f32> {
        let neighbourhood = Neighbourhood::new(&geometry.hvds.grid, &self.samples, &self.clearances);
        let middle = |piece: &Piece| {
            let position = piece.corners.iter().sum::<Vec3>() / piece.corners.len() as f32;
            neighbourhood.clamp(&geometry.point(piece.side, position), geometry.scene_size)
        };
        other.pieces.iter().map(middle).collect()
    }
}

/// Places at most `budget` cache points on the pieces of the active sides.
///
/// # Errors
/// The device lacks memory or failed.
pub fn place(
    survey: &Survey,
    buffers: &SceneBuffers,
    geometry: &Geometry<'_>,
    budget: u32,
    seed: u32,
    progress: &mut dyn Progress,
) -> Result<Placement> {
    if budget == 0 {
        return Ok(Placement {
            points: Vec::new(),
            least_radius: geometry.scene_size,
            candidates: 0,
            is_covering: true,
        });
    }
    let Survey { surveyor, samples, clearances } = survey;
    let (mut unit, largest) = spread(geometry, clearances, budget);
    let mut step = 1.1;
    loop {
        let neighbourhood = Neighbourhood::new(&geometry.hvds.grid, samples, clearances);
        let mut records = Records::new(&geometry.hvds.grid, RADIUS_RANGE[1] * unit);
        let attempt = Attempt { buffers, geometry, surveyor, neighbourhood, unit, budget, seed };
        let placement = attempt.run(&mut records, clearances, progress)?;
        if placement.is_covering || unit >= largest {
            return Ok(placement);
        }
        unit *= step;
        // The estimate is rarely far off; where it is, small steps would take long.
        step = 1.4;
    }
}

/// What placement knows of the scene.
pub struct Geometry<'a> {
    /// In BVH order.
    pub triangles: &'a [Triangle],
    /// In BVH order.
    pub surfaces: &'a [Surface],
    /// Its pieces are where candidates are drawn.
    pub hvds: &'a Hvds,
    /// Diagonal of the scene, metres.
    pub scene_size: f32,
}

impl Geometry<'_> {
    /// Candidate number `index` of a piece: uniform over it, low-discrepancy in `index`. The radius is left at zero.
    fn draw(&self, piece: usize, index: u32, seed: u32) -> CachePoint {
        let Piece { side, corners, .. } = &self.hvds.pieces[piece];
        let u = plane_sequence(index, hash(piece as u32 ^ hash(seed)));
        let corner_mean = self.triangles[*side as usize / 2].positions.iter().sum::<Vec3>() / 3.0;
        // Off the triangle's edges by a hair: a ray from a point on an edge may slip out between two surfaces.
        self.point(*side, point_in_polygon(corners, u).lerp(corner_mean, 1.0 / 32_768.0))
    }

    fn point(&self, side: u32, position: Vec3) -> CachePoint {
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
            wall: Vec3::ZERO,
            facet: self.surfaces[side as usize / 2].normal_of(side % 2 == 1),
        }
    }

    /// Distances along a piece over which its shading normal turns by [`NORMAL_RANGE`], where it turns fastest and where it
    /// turns slowest, metres.
    fn normal_reach(&self, piece: usize) -> [f64; 2] {
        let triangle = &self.triangles[self.hvds.pieces[piece].side as usize / 2];
        let turn = |a: usize, b: usize| {
            // The chord between unit normals is the angle, for the small angles of a smooth surface.
            let angle = f64::from((triangle.normals[a] - triangle.normals[b]).length());
            angle / f64::from((triangle.positions[a] - triangle.positions[b]).length())
        };
        let turns = [turn(0, 1), turn(1, 2), turn(2, 0)];
        let fastest = turns.into_iter().fold(1e-12, f64::max);
        let slowest = turns.into_iter().fold(fastest, f64::min).max(1e-12);
        [NORMAL_RANGE / fastest, NORMAL_RANGE / slowest]
    }

    /// Records that a piece needs at a given unit of length, where `clearance` is what its rays see.
    fn expected_records(&self, piece: usize, clearance: f32, unit: f64) -> f64 {
        let spacing = f64::from(1.0 - COVERED);
        let reach = self.normal_reach(piece);
        let [across, along] = reach.map(|reach| spacing * reach.min(radius(clearance, unit)));
        PACKING * self.hvds.pieces[piece].area_m2 / (across * along)
    }

    /// The same if the piece were flat.
    fn expected_flat_records(&self, piece: usize, clearance: f32, unit: f64) -> f64 {
        let spacing = f64::from(1.0 - COVERED) * radius(clearance, unit);
        PACKING * self.hvds.pieces[piece].area_m2 / (spacing * spacing)
    }
}

/// Radius of a record before its neighbourhood is known, metres.
fn radius(clearance: f32, unit: f64) -> f64 {
    (0.5 * f64::from(clearance)).clamp(RADIUS_RANGE[0] * unit, RADIUS_RANGE[1] * unit)
}

/// The length that scales all radii, such that the expected number of records meets the budget; and the one beyond which
/// the budget had better leave something uncovered. Where curvature asks for many records whatever the length, the
/// expectation is too high for them: flat pieces are granted a quarter of the budget at first, and an eighth in any case.
fn spread(geometry: &Geometry<'_>, clearances: &[f32], budget: u32) -> (f64, f64) {
    let sum = |expected: &dyn Fn(usize) -> f64| (0..geometry.hvds.pieces.len()).map(expected).sum::<f64>();
    let curved = |unit: f64| sum(&|i| geometry.expected_records(i, clearances[i], unit));
    let flat = |unit: f64| sum(&|i| geometry.expected_flat_records(i, clearances[i], unit));
    let length = |expected: &dyn Fn(f64) -> f64, records: f64| {
        let size = f64::from(geometry.scene_size);
        let (mut low, mut high) = (1e-7 * size, size);
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            if expected(middle) > records { low = middle } else { high = middle }
        }
        high
    };
    let records = BUDGET_SHARE * f64::from(budget);
    let unit = length(&curved, records).min(length(&flat, records / 4.0));
    (unit, length(&flat, records / 8.0))
}

/// One try at a given unit of length.
struct Attempt<'a> {
    buffers: &'a SceneBuffers,
    geometry: &'a Geometry<'a>,
    surveyor: &'a Surveyor,
    neighbourhood: Neighbourhood<'a>,
    unit: f64,
    budget: u32,
    seed: u32,
}

impl Attempt<'_> {
    fn run(
        &self,
        records: &mut Records,
        clearances: &[f32],
        progress: &mut dyn Progress,
    ) -> Result<Placement> {
        let mut candidates = self.candidates(clearances);
        let mut looked_at = candidates.len() as u64;
        progress.stage("cache points", looked_at);
        let mut first = 0;
        let mut batch = 4096;
        let mut has_room = true;
        while first < candidates.len() && has_room {
            let end = candidates.len().min(first + batch);
            has_room = self.accept(records, &candidates[first..end])?;
            progress.advance(end as u64);
            first = end;
            batch *= 2;
        }
        for round in 0..PROBE_ROUNDS {
            if !has_room {
                break;
            }
            candidates = self.probes(round);
            looked_at += candidates.len() as u64;
            let bare = records.uncovered(&candidates, 0.0);
            if bare.len() as f64 <= UNCOVERED_SHARE * candidates.len() as f64 {
                break;
            }
            has_room = self.accept(records, &bare)?;
        }
        Ok(Placement {
            points: std::mem::take(&mut records.points),
            least_radius: (RADIUS_RANGE[0] * self.unit) as f32,
            candidates: looked_at,
            is_covering: has_room,
        })
    }

    /// All candidates in a fixed shuffled order, each piece as densely as its records will stand.
    fn candidates(&self, clearances: &[f32]) -> Vec<CachePoint> {
        let mut drawn: Vec<(u32, CachePoint)> = Vec::new();
        for (index, &clearance) in clearances.iter().enumerate() {
            let count = CANDIDATES_PER_RECORD * self.geometry.expected_records(index, clearance, self.unit);
            for i in 0..count.ceil() as u32 {
                let key = hash(hash(index as u32) ^ i);
                drawn.push((key, self.geometry.draw(index, 1 + i, self.seed)));
            }
        }
        drawn.sort_by_key(|candidate| candidate.0);
        drawn.into_iter().map(|candidate| candidate.1).collect()
    }

    /// Random points over the whole active surface, in proportion to area, at least one a piece.
    fn probes(&self, round: u32) -> Vec<CachePoint> {
        let area: f64 = self.geometry.hvds.pieces.iter().map(|piece| piece.area_m2).sum();
        let mut probes = Vec::new();
        for (index, piece) in self.geometry.hvds.pieces.iter().enumerate() {
            let count = (f64::from(PROBES) * piece.area_m2 / area).ceil() as u32;
            probes.extend((0..count).map(|i| self.geometry.draw(index, i, hash(self.seed ^ 0x5eed ^ round))));
        }
        probes
    }

    /// Accepts, in order, candidates that nothing covers yet. False once the budget is spent.
    fn accept(&self, records: &mut Records, candidates: &[CachePoint]) -> Result<bool> {
        let open = records.uncovered(candidates, COVERED);
        let clearances = self.surveyor.measure(self.buffers, &open, None)?;
        for (mut candidate, clearance) in open.into_iter().zip(clearances) {
            if records.cover(&candidate, COVERED) {
                continue;
            }
            if records.points.len() as u32 >= self.budget {
                return Ok(false);
            }
            candidate.wall = clearance.wall;
            let clearance = self.neighbourhood.clamp(&candidate, clearance.distance);
            let [low, high] = RADIUS_RANGE.map(|bound| (bound * self.unit) as f32);
            candidate.radius = (0.5 * clearance).clamp(low, high);
            records.insert(Placed { point: candidate, clearance });
        }
        Ok(true)
    }
}

/// Uniform point in a convex polygon.
fn point_in_polygon(corners: &[Vec3], u: [f32; 2]) -> Vec3 {
    let area = |i: usize| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]).length();
    let total: f32 = (1..corners.len() - 1).map(area).sum();
    let mut rest = u[0] * total;
    let mut fan = 1;
    while fan + 2 < corners.len() && rest > area(fan) {
        rest -= area(fan);
        fan += 1;
    }
    let along = (rest / area(fan).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0).sqrt();
    let side = corners[fan].lerp(corners[fan + 1], u[1]);
    corners[0].lerp(side, along)
}

/// Point of the two-dimensional additive recurrence on the plastic number, shifted by a seed.
fn plane_sequence(index: u32, seed: u32) -> [f32; 2] {
    let g: f64 = 1.324_717_957_244_746;
    let shift = [f64::from(seed), f64::from(hash(seed))].map(|bits| bits / 4_294_967_296.0);
    [1.0, 2.0]
        .map(|power: f64| ((shift[power as usize - 1] + f64::from(index) * g.powf(-power)).fract()) as f32)
}
