//! The number of records that a surface needs, and the unit length at which their total
//! meets the budget.

use super::geometry::Geometry;
use crate::scene::CellSizes;
use crate::scene::fragment::Fragment;
use glam::Vec3;
use rayon::prelude::*;

/// A point counts as covered from this record weight on; records then overlap enough to blend.
pub(super) const COVERED: f32 = 0.3;
/// Radii are clamped between these multiples of a unit length, which follows from the budget.
/// [Tabellion §4] has 1.5 and 10 pixels.
pub const RADIUS_RANGE: [f64; 2] = [1.0, 5.0];
/// Normals further apart than this do not share a record, radians: the 10° of `Tolerance::VALID`.
const NORMAL_RANGE: f64 = 0.174_53;
/// Records that random sequential packing fits into one squared spacing.
const PACKING: f64 = 0.7;
/// Fraction of the budget that placement aims at; its estimate is accurate to a few per cent.
const BUDGET_FRACTION: f64 = 0.9;

/// The need of records of one fragment.
pub(super) struct Demand<'a> {
    area_m2: f64,
    /// Distances over which its shading normal turns by [`NORMAL_RANGE`], where it turns fastest
    /// and where slowest, metres.
    reach: [f64; 2],
    /// Clearance at the fragment, metres.
    clearance: f64,
    /// Its middle, and sizes over the scene.
    place: (Vec3, &'a CellSizes),
}

impl<'a> Demand<'a> {
    /// The demand of every fragment, given their clearances.
    pub(super) fn of_fragment(geometry: &Geometry<'a>, clearances: &[f32]) -> Vec<Self> {
        let fragments = geometry.hvds.fragments.par_iter().zip(clearances);
        let demand = |(fragment, &clearance): (&Fragment, &f32)| {
            let triangle = &geometry.triangles[fragment.side as usize / 2];
            let turn = |a: usize, b: usize| {
                // The chord between unit normals is the angle, for the small angles of a smooth
                // surface.
                let angle = f64::from((triangle.normals[a] - triangle.normals[b]).length());
                angle / f64::from((triangle.positions[a] - triangle.positions[b]).length())
            };
            let turns = [turn(0, 1), turn(1, 2), turn(2, 0)];
            let fastest = turns.into_iter().fold(1e-12, f64::max);
            let slowest = turns.into_iter().fold(fastest, f64::min).max(1e-12);
            let reach = [NORMAL_RANGE / fastest, NORMAL_RANGE / slowest];
            let place = (fragment.middle(), geometry.cell_sizes);
            Self { area_m2: fragment.open_area_m2(), reach, clearance: clearance.into(), place }
        };
        fragments.map(demand).collect()
    }

    /// Radius of a record before its neighbourhood is known, metres.
    fn radius(&self, unit: f64) -> f64 {
        let (middle, sizes) = self.place;
        let [low, high] = RADIUS_RANGE.map(|bound| sizes.stretched(middle, bound * unit));
        (0.5 * self.clearance).clamp(low, high)
    }

    /// Area that one record covers at a given unit of length, m².
    pub(super) fn fraction(&self, unit: f64) -> f64 {
        let spacing = f64::from(1.0 - COVERED);
        let [across, along] = self.reach.map(|reach| spacing * reach.min(self.radius(unit)));
        across * along / PACKING
    }

    /// Rank of the fragment if the budget does not suffice, 0..256: twice the area to a record
    /// comes one step earlier.
    pub(super) fn order(&self, unit: f64, scene_size: f32) -> u32 {
        let ratio = f64::from(scene_size).powi(2) / self.fraction(unit);
        ratio.log2().clamp(0.0, 255.0) as u32
    }

    /// Number of records that it needs at a given unit of length.
    pub(super) fn records(&self, unit: f64) -> f64 {
        self.area_m2 / self.fraction(unit)
    }

    /// The number of records if it were flat.
    fn flat_records(&self, unit: f64) -> f64 {
        let spacing = f64::from(1.0 - COVERED) * self.radius(unit);
        PACKING * self.area_m2 / (spacing * spacing)
    }
}

/// The sum over all demands, with the bits of a sum on one core.
pub(super) fn total(demands: &[Demand<'_>], records: impl Fn(&Demand<'_>) -> f64 + Sync + Send) -> f64 {
    let each: Vec<f64> = demands.par_iter().map(records).collect();
    each.iter().sum()
}

/// Returns three unit lengths that scale all radii. The first meets the budget in expectation, and
/// gives flat fragments at least a quarter of it: strong curvature needs many records at any
/// length, and its expected number is too high. The second is the longest acceptable length, at
/// which flat fragments take an eighth. The third is for scenes that no length suits: curved
/// surface is covered sparsely and flat fragments take six tenths.
pub(super) fn spread(demands: &[Demand<'_>], scene_size: f32, budget: u32) -> [f64; 3] {
    let curved = |unit: f64| total(demands, |demand| demand.records(unit));
    let flat = |unit: f64| total(demands, |demand| demand.flat_records(unit));
    let length = |expected: &dyn Fn(f64) -> f64, records: f64| {
        let size = f64::from(scene_size);
        let (mut low, mut high) = (1e-7 * size, size);
        for _ in 0..60 {
            let middle = (low * high).sqrt();
            if expected(middle) > records { low = middle } else { high = middle }
        }
        high
    };
    let records = BUDGET_FRACTION * f64::from(budget);
    let unit = length(&curved, records).min(length(&flat, records / 4.0));
    [unit, length(&flat, records / 8.0), length(&flat, 0.6 * records)]
}

#[cfg(test)]
mod tests {
    use super::*;

    static EVEN: CellSizes = CellSizes { regions: Vec::new(), reach_m: 0.0 };

    fn demand(area_m2: f64, reach: f64, clearance: f64) -> Demand<'static> {
        Demand { area_m2, reach: [reach, 1e9], clearance, place: (Vec3::ZERO, &EVEN) }
    }

    #[test]
    fn the_unit_spends_the_budget_and_stays_below_the_largest() {
        // Free surface, surface beside walls, and curved surface.
        let demands = [demand(10.0, 1e9, 3.0), demand(2.0, 1e9, 0.02), demand(0.5, 0.05, 0.4)];
        for budget in [1_000, 40_000] {
            let [unit, largest, _] = spread(&demands, 5.0, budget);
            let expected: f64 = demands.iter().map(|demand| demand.records(unit)).sum();
            assert!((expected / (0.9 * f64::from(budget)) - 1.0).abs() < 1e-6, "{expected} of {budget}");
            assert!(unit < largest);
        }
    }

    #[test]
    fn curvature_that_eats_the_budget_leaves_flat_surface_its_part() {
        let demands = [demand(10.0, 1e9, 3.0), demand(1.0, 1e-4, 3.0)];
        let [unit, largest, sparse] = spread(&demands, 5.0, 10_000);
        // All area is 1.1 times the flat area.
        let flat = |unit: f64| 1.1 * demands[0].records(unit) / 9_000.0;
        for (unit, fraction) in [(unit, 0.25), (largest, 0.125), (sparse, 0.6)] {
            assert!((flat(unit) - fraction).abs() < 1e-6, "{} instead of {fraction}", flat(unit));
        }
    }

    #[test]
    fn what_one_record_covers_most_of_comes_first() {
        let [wide, narrow, tiny] = [1.0, 0.01, 1e-4].map(|reach| demand(1.0, reach, 1.0).order(0.1, 5.0));
        assert!(wide < narrow && narrow < tiny && tiny < 256, "{wide} {narrow} {tiny}");
    }
}
