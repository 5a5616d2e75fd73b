//! Validity of cache records; mirrors `glsl/include/records.glsl`. Placement uses it, too.

use crate::types::CachePoint;
use glam::Vec3;

/// Cosine of the angle up to which facets share records.
pub const FACETS_ALIKE: f32 = 0.9;

/// sin² of 1°: a point at less than 1° from a record's plane is on its surface, however narrow
/// the record's surroundings.
const FLAT_SINE2: f32 = 0.0003;

/// Sum of the weights of valid records below which relaxed ones join them.
pub const MIN_WEIGHT: f32 = 0.1;

/// Tolerances of a record in height and normals.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    pub(crate) above2: f32,
    pub(crate) below2: f32,
    pub(crate) facets: f32,
    pub(crate) inverse_normal_error: f32,
    /// Factor of its weight behind its nearest occluder plane.
    behind: f32,
}

impl Tolerance {
    /// Valid records: 1 / sqrt(1 - cos 10°) between normals, 12° above the plane between both and
    /// 4° below it. [Tabellion §4; Ward]
    pub const VALID: Self =
        Self { above2: 0.04, below2: 0.004, facets: FACETS_ALIKE, inverse_normal_error: 8.1131, behind: 0.0 };
    /// Relaxed validity, where valid records are few: 45° above the plane, 30° below it, 90°
    /// between facets, 72° between normals.
    pub const RELAXED: Self =
        Self { above2: 0.5, below2: 0.25, facets: 0.0, inverse_normal_error: 1.2, behind: 0.1 };
    /// What placement asks first of every surface if the budget does not suffice: 60° between
    /// facets, 30° between normals.
    pub(crate) const SPARSE: Self =
        Self { above2: 0.5, below2: 0.25, facets: 0.5, inverse_normal_error: 2.7321, behind: 0.0 };
}

/// Height of a point at offset `d` from a record above the plane between both. Shading normals give
/// zero on a sphere, facets give zero on a facet whose shading normals lean.
fn height_between(d: Vec3, n: Vec3, facet: Vec3, record: &CachePoint) -> f32 {
    let heights = [(record.normal, n), (record.facet, facet)].map(|(a, b)| 0.5 * d.dot(a + b));
    if heights[0].abs() < heights[1].abs() { heights[0] } else { heights[1] }
}

/// Weight of a record at a point `x` with shading normal `n`, on a facet with that geometric
/// normal, as placement takes it: positive inside its validity, 1 at its centre.
pub fn cover_weight(x: Vec3, n: Vec3, facet: Vec3, record: &CachePoint, within: Tolerance) -> f32 {
    let d = x - record.position;
    let distance2 = d.dot(d);
    let height = height_between(d, n, facet, record);
    let reach = 0.01 * record.radius;
    let height2 = if height > 0.0 { within.above2 } else { within.below2 };
    if height * height > height2 * (distance2 + reach * reach) {
        return 0.0;
    }
    let part = if d.dot(record.occluder) > 1.0 { within.behind } else { 1.0 };
    if facet.dot(record.facet) < within.facets {
        return 0.0;
    }
    let position_error = distance2.sqrt() / record.radius;
    let normal_error = (1.0 - n.dot(record.normal)).max(0.0).sqrt() * within.inverse_normal_error;
    part * (1.0 - position_error.max(normal_error))
}

/// As [`cover_weight`], for a pixel: the shader's `record_weight`. It is zero for a point that is
/// further off the record's plane than half the distance to the nearest occluder: cloth in front of
/// the surface, or the spine of a book beside the crevice of the record. Placement has no such
/// test, because it would fill every crevice with records. Beyond half of the record's clearance,
/// its radius without a lower bound, the weight falls with the distance.
pub fn record_weight(x: Vec3, n: Vec3, facet: Vec3, record: &CachePoint, within: Tolerance) -> f32 {
    let d = x - record.position;
    let height = height_between(d, n, facet, record);
    let is_beyond = height * height * record.occluder.length_squared() > 0.25;
    if is_beyond && height * height > FLAT_SINE2 * d.length_squared() {
        return 0.0;
    }
    cover_weight(x, n, facet, record, within) / (d.length() * record.inverse_reach).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(normal: Vec3) -> CachePoint {
        CachePoint {
            position: Vec3::ZERO,
            radius: 1.0,
            normal,
            side: 0,
            occluder: Vec3::ZERO,
            facet: Vec3::Y,
            inverse_reach: 0.0,
            stream: 0,
        }
    }

    #[test]
    fn a_facet_has_no_height_over_itself_however_its_normals_lean() {
        // Two points near one vertex of a coarse mesh: both normals lean the same way, by 10°.
        let leaning = Vec3::new(0.17, 0.98, 0.0).normalize();
        let there = Vec3::new(-0.3, 0.0, 0.0);
        assert!(
            (cover_weight(there, leaning, Vec3::Y, &record(leaning), Tolerance::VALID) - 0.7).abs() < 1e-6
        );
        // The table under the rim of a plate is another surface.
        assert_eq!(
            cover_weight(there - 0.03 * Vec3::Y, Vec3::Y, Vec3::Y, &record(Vec3::Y), Tolerance::VALID),
            0.0
        );
    }

    #[test]
    fn a_sphere_has_no_height_over_itself_however_its_facets_lie() {
        let [sine, cosine] = [0.1f32.sin(), 0.1f32.cos()];
        let (x, n) = (Vec3::new(sine, cosine - 1.0, 0.0), Vec3::new(sine, cosine, 0.0));
        let facet = Vec3::new(-0.3, 1.0, 0.0).normalize();
        let height = 0.5 * x.dot(Vec3::Y + facet) / x.length();
        assert!(height < -0.1, "facets alone would have it beneath");
        assert!(cover_weight(x, n, facet, &record(Vec3::Y), Tolerance::VALID) > 0.0);
    }

    #[test]
    fn relaxed_records_face_elsewhere_and_placement_asks_for_closer_ones() {
        // Around a baluster, normals turn with the position, and no point has height.
        let weight = |degrees: f32, within: Tolerance| {
            let [sine, cosine] = [degrees.to_radians().sin(), degrees.to_radians().cos()];
            let (x, n) = (0.1 * Vec3::new(sine, cosine - 1.0, 0.0), Vec3::new(sine, cosine, 0.0));
            cover_weight(x, n, n, &record(Vec3::Y), within)
        };
        for (within, limit) in
            [(Tolerance::VALID, 10.0), (Tolerance::SPARSE, 30.0), (Tolerance::RELAXED, 71.6)]
        {
            assert!(weight(limit - 1.0, within) > 0.0, "{limit}");
            assert!(weight(limit + 1.0, within) <= 0.0, "{limit}");
        }
        // The nearer its normal, the more a record counts.
        assert!(weight(20.0, Tolerance::RELAXED) > 2.0 * weight(50.0, Tolerance::RELAXED));
    }

    #[test]
    fn behind_its_occluder_a_record_counts_only_where_others_are_few() {
        // A wall stands across, 0.2 m away.
        let beside = CachePoint { occluder: Vec3::X / 0.2, ..record(Vec3::Y) };
        let weight =
            |at: f32, within: Tolerance| record_weight(at * Vec3::X, Vec3::Y, Vec3::Y, &beside, within);
        for (at, valid, relaxed) in [(0.1, 0.9, 0.9), (0.3, 0.0, 0.07), (-0.3, 0.7, 0.7)] {
            for (within, expected) in
                [(Tolerance::VALID, valid), (Tolerance::SPARSE, valid), (Tolerance::RELAXED, relaxed)]
            {
                assert!((weight(at, within) - expected).abs() < 1e-6, "{at}: {}", weight(at, within));
            }
        }
    }

    #[test]
    fn a_record_counts_less_beyond_half_of_its_clearance() {
        let narrow = CachePoint { inverse_reach: 1.0 / 0.1, ..record(Vec3::Y) };
        let weight = |at: f32| record_weight(at * Vec3::X, Vec3::Y, Vec3::Y, &narrow, Tolerance::VALID);
        for (at, expected) in [(0.05, 0.95), (0.1, 0.9), (0.2, 0.8 / 2.0), (0.5, 0.5 / 5.0)] {
            assert!((weight(at) - expected).abs() < 1e-6, "{at}: {}", weight(at));
        }
        let there = cover_weight(0.5 * Vec3::X, Vec3::Y, Vec3::Y, &narrow, Tolerance::VALID);
        assert!((there - 0.5).abs() < 1e-6, "placement counts it as it is: {there}");
    }

    #[test]
    fn a_record_in_a_narrow_place_says_nothing_of_what_is_outside() {
        let weight = |record: &CachePoint, height: f32| {
            record_weight(Vec3::new(0.4, height, 0.0), Vec3::Y, Vec3::Y, record, Tolerance::VALID)
        };
        // Under cloth 10 cm away, and between two books: beyond half the distance, and within it.
        for occluder in [Vec3::Y / 0.1, Vec3::NEG_X / 0.1] {
            let narrow = CachePoint { occluder, ..record(Vec3::Y) };
            assert_eq!(weight(&narrow, 0.06), 0.0);
            assert!(weight(&narrow, 0.04) > 0.5);
            // Placement accepts the record for both.
            let outside = Vec3::new(0.4, 0.06, 0.0);
            assert!(cover_weight(outside, Vec3::Y, Vec3::Y, &narrow, Tolerance::VALID) > 0.5);
        }
        // With the occluder a millimetre away, flat surface is still one surface.
        let narrow = CachePoint { occluder: Vec3::NEG_X / 0.001, ..record(Vec3::Y) };
        assert!(weight(&narrow, 0.005) > 0.5);
        assert_eq!(weight(&narrow, 0.01), 0.0);
    }
}
