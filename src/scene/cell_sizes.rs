//! Sizes of the finest cells over a scene. Cells are small in regions of interest and grow with the
//! distance from them, so that a room on a kilometre of ground is as right as the room alone. In a
//! scene without such a region, all cells are equal.

use crate::types::Guide;
use glam::{DVec3, Vec3};

/// Widths of cells as fractions of the *full* width, which follows from the longest side of a scene
/// and its settings.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CellSizes {
    /// Regions of small cells, the smallest cells first. Empty: all cells have their full width.
    pub regions: Vec<Region>,
    /// Distance from a region at which cells have their full width, metres.
    pub reach_m: f64,
}

/// Growth of stretched lengths with the distance from a region.
const GROWTH: f64 = 0.3;

/// Exponent of the area of an entry point in its distance from a region. The light that goes from
/// there to the region falls as fast.
const FALL: f64 = 3.0;

/// A box of equally small cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Lowest corner, metres.
    pub low: Vec3,
    /// Highest corner, metres.
    pub high: Vec3,
    /// Its cells have the full width over two to that power.
    pub halvings: u32,
}

impl Region {
    /// Length of its longest side, metres.
    pub fn side(&self) -> f32 {
        (self.high - self.low).max_element()
    }

    /// Distance from the nearest point of a box, metres.
    fn distance_from(&self, low: DVec3, high: DVec3) -> f64 {
        let apart = (self.low.as_dvec3() - high).max(low - self.high.as_dvec3()).max(DVec3::ZERO);
        apart.length()
    }

    /// Distance from the farthest point of a box, metres.
    fn farthest_from(&self, low: DVec3, high: DVec3) -> f64 {
        let apart = (self.low.as_dvec3() - low).max(high - self.high.as_dvec3()).max(DVec3::ZERO);
        apart.length()
    }
}

impl CellSizes {
    /// Halvings of the smallest cells.
    pub fn max_halvings(&self) -> u32 {
        self.regions.first().map_or(0, |region| region.halvings)
    }

    /// Width of the cells at a point, as a fraction of the full width: at most one.
    pub fn fraction_at(&self, point: Vec3) -> f64 {
        self.fraction(|region| region.distance_from(point.as_dvec3(), point.as_dvec3()))
    }

    /// Area of an entry point at a point, over that in the region with the smallest cells; mirrors
    /// `nominal_weight` in `glsl/include/guides.glsl`.
    pub fn nominal_weight(&self, point: Vec3) -> f64 {
        let of_region = |region: &Region| {
            let ball = self.guide(region);
            let distance = (point.distance(ball.centre) - ball.radius).max(0.0);
            f64::from(ball.weight) * f64::from(1.0 + distance / (1.5 * ball.radius)).powf(FALL)
        };
        self.regions.iter().map(of_region).reduce(f64::min).unwrap_or(1.0)
    }

    /// Balls around the regions: light paths aim at them.
    pub fn guides(&self) -> Vec<Guide> {
        self.regions.iter().map(|region| self.guide(region)).collect()
    }

    fn guide(&self, region: &Region) -> Guide {
        Guide {
            centre: 0.5 * (region.low + region.high),
            radius: 0.5 * region.low.distance(region.high),
            weight: (self.max_halvings() as f32 - region.halvings as f32).exp2().powi(2),
        }
    }

    /// A length at a point, metres, that is `least_m` in the region with the smallest cells. It
    /// grows with the distance from the regions by 0.3 of it, so that a record of that radius
    /// reaches no region.
    #[inline]
    pub fn stretched(&self, point: Vec3, least_m: f64) -> f64 {
        if self.regions.is_empty() {
            return least_m;
        }
        let of_region = |region: &Region| {
            let distance = region.distance_from(point.as_dvec3(), point.as_dvec3());
            let coarser = f64::from(self.max_halvings() - region.halvings).exp2();
            least_m * coarser + GROWTH * distance
        };
        self.regions.iter().map(of_region).reduce(f64::min).unwrap_or(least_m)
    }

    /// At least the largest stretched length in a box.
    pub fn max_stretched(&self, low: Vec3, high: Vec3, least_m: f64) -> f64 {
        let corners = (0..8).map(|corner| {
            let is_high = [1, 2, 4].map(|bit| corner & bit != 0);
            Vec3::select(is_high.into(), high, low)
        });
        // The distance from a box is convex.
        corners.map(|corner| self.stretched(corner, least_m)).fold(least_m, f64::max)
    }

    fn fraction(&self, distance_m: impl Fn(&Region) -> f64) -> f64 {
        let wanted =
            |region: &Region| (-f64::from(region.halvings)).exp2().max(distance_m(region) / self.reach_m);
        self.regions.iter().map(wanted).fold(1.0, f64::min)
    }

    /// Levels of the smallest and of the largest cells that points of a box want. Level 0 has the
    /// smallest cells of all.
    pub fn levels_in(&self, low: DVec3, high: DVec3) -> [u32; 2] {
        let level = |fraction: f64| {
            // At most the level of the full width.
            (fraction.log2() + f64::from(self.max_halvings())).floor().max(0.0) as u32
        };
        let least = self.fraction(|region| region.distance_from(low, high));
        let most = self.fraction(|region| region.farthest_from(low, high));
        [level(least), level(most)]
    }

    /// Longest side of the region with the smallest cells, rounded down to a power of two, metres.
    /// `None` without any region.
    pub fn least_side_m(&self) -> Option<f32> {
        let least = self.regions.first()?;
        Some(f32::from_bits(least.side().to_bits() >> 23 << 23))
    }

    /// Largest extent of the regions, from corner to corner, metres; `None` without any.
    pub fn span_m(&self) -> Option<f32> {
        let span = |region: &Region| (region.high - region.low).length();
        self.regions.iter().map(span).reduce(f32::max)
    }
}
