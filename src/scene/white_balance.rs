//! White balance: a chromatic adaptation that displays light of another colour as white.

use super::photometry::{KELVIN, black_body};
use glam::{DMat3, DVec2, DVec3, Mat3};

/// CIE 1931 XYZ of linear Rec.709 with white D65, by columns [ITU-R BT.709].
pub(super) const XYZ_FROM_REC709: DMat3 = DMat3::from_cols(
    DVec3::new(0.412_390_8, 0.212_639_0, 0.019_330_8),
    DVec3::new(0.357_584_3, 0.715_168_7, 0.119_194_8),
    DVec3::new(0.180_480_8, 0.072_192_3, 0.950_532_2),
);
/// Cone responses of XYZ, by columns [Bradford; Lam 1985].
const CONES_FROM_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(0.8951, -0.7502, 0.0389),
    DVec3::new(0.2664, 1.7135, -0.0685),
    DVec3::new(-0.1614, 0.0367, 1.0296),
);
/// Correlated colour temperature of D65, K.
const D65_K: f32 = 6504.0;
/// Distance from D65 within which the white moves from the Planckian locus to D65, mired. D65 lies
/// beside the locus: without it, the picture would jump at D65.
const BLEND_MIRED: f64 = 25.0;
const TINT_MAX: f32 = 50.0;

/// The colour that is displayed as white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WhiteBalance {
    /// Colour temperature of a black body, K; 6504 is the white of Rec.709.
    pub kelvin: f32,
    /// Distance from the Planckian locus in CIE 1960 uv, thousandths. Positive: the light is
    /// greener than a black body, so the picture becomes more magenta.
    pub tint: f32,
}

impl Default for WhiteBalance {
    fn default() -> Self {
        Self { kelvin: D65_K, tint: 0.0 }
    }
}

impl WhiteBalance {
    /// Range of the colour temperature, K.
    pub const KELVIN: std::ops::RangeInclusive<f32> = *KELVIN.start() as f32..=*KELVIN.end() as f32;
    /// Range of the tint.
    pub const TINT: std::ops::RangeInclusive<f32> = -TINT_MAX..=TINT_MAX;

    /// Linear Rec.709 as it is displayed, from linear Rec.709. `None` if it is the identity.
    ///
    /// The Bradford cone responses are scaled so that this white becomes the white of Rec.709
    /// [von Kries 1902]. The white keeps its luminance.
    pub fn matrix(&self) -> Option<Mat3> {
        if *self == Self::default() {
            return None;
        }
        let gain = CONES_FROM_XYZ * d65() / (CONES_FROM_XYZ * self.white());
        let adapted = CONES_FROM_XYZ.inverse() * DMat3::from_diagonal(gain) * CONES_FROM_XYZ;
        Some((XYZ_FROM_REC709.inverse() * adapted * XYZ_FROM_REC709).as_mat3())
    }

    /// XYZ of the white, Y = 1.
    fn white(&self) -> DVec3 {
        let kelvin = f64::from(self.kelvin);
        let mired = |kelvin: f64| 1e6 / kelvin;
        let distance = (mired(kelvin) - mired(D65_K.into())).abs();
        let weight = (1.0 - distance / BLEND_MIRED).max(0.0);
        let beside = uv(d65()) - locus(D65_K.into());
        let along = (locus(1.001 * kelvin) - locus(kelvin)).normalize();
        // Green lies above the locus.
        let across = if along.x > 0.0 { along.perp() } else { -along.perp() };
        let DVec2 { x: u, y: v } = locus(kelvin) + weight * beside + 1e-3 * f64::from(self.tint) * across;
        // x = 3u / (2u − 8v + 4) and y = 2v / (2u − 8v + 4).
        DVec3::new(1.5 * u / v, 1.0, (2.0 - 0.5 * u - 5.0 * v) / v)
    }
}

/// XYZ of D65, Y = 1.
fn d65() -> DVec3 {
    let white = XYZ_FROM_REC709 * DVec3::ONE;
    white / white.y
}

/// CIE 1960 uv of a black body.
fn locus(kelvin: f64) -> DVec2 {
    uv(XYZ_FROM_REC709 * black_body(kelvin))
}

/// CIE 1960 uv of XYZ.
fn uv(xyz: DVec3) -> DVec2 {
    DVec2::new(4.0 * xyz.x, 6.0 * xyz.y) / xyz.dot(DVec3::new(1.0, 15.0, 3.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn of(kelvin: f32, tint: f32) -> WhiteBalance {
        WhiteBalance { kelvin, tint }
    }

    fn spread(colour: Vec3) -> f32 {
        colour.max_element() / colour.min_element() - 1.0
    }

    #[test]
    fn light_of_that_temperature_becomes_white() {
        // Beyond the blend around D65. Below 1900 K black bodies lose their negative blue.
        for kelvin in [1800.0_f32, 2700.0, 3200.0, 4000.0, 5500.0, 8000.0, 20_000.0] {
            let light = black_body(kelvin.into()).as_vec3();
            let shown = of(kelvin, 0.0).matrix().unwrap() * light;
            assert!(spread(shown) < 2e-5, "{kelvin} K: {shown}");
            assert!((shown.y - 1.0).abs() < 1e-4, "{kelvin} K keeps its luminance: {shown}");
        }
        let lamp = black_body(2700.0).as_vec3();
        assert!(spread(of(6000.0, 0.0).matrix().unwrap() * lamp) > 1.0, "not at another temperature");
    }

    #[test]
    fn neutral_is_the_identity_and_its_surroundings_are_near() {
        assert_eq!(of(6504.0, 0.0).matrix(), None);
        // A step of 10 K near D65 is 0.24 mired: about a hundredth of the blend.
        for kelvin in [6494.0, 6514.0] {
            let shown = of(kelvin, 0.0).matrix().unwrap() * Vec3::ONE;
            assert!(spread(shown) < 0.005, "{kelvin} K: {shown}");
        }
        // The blend itself has no jump either.
        let mut before = of(4000.0, 0.0).matrix().unwrap() * Vec3::ONE;
        for step in 1..=600 {
            let shown = of(4000.0 + 10.0 * step as f32 + 0.5, 0.0).matrix().unwrap() * Vec3::ONE;
            assert!((shown - before).abs().max_element() < 0.01, "{step}: {before} to {shown}");
            before = shown;
        }
    }

    #[test]
    fn tint_moves_between_green_and_magenta() {
        for kelvin in [2700.0_f32, 6504.0, 12_000.0] {
            let light = black_body(kelvin.into()).as_vec3();
            let shown = |tint| of(kelvin, tint).matrix().map_or(light, |matrix| matrix * light);
            let [less, plain, more] = [-20.0, 0.0, 20.0].map(shown);
            let green = |colour: Vec3| colour.y / (colour.x * colour.z).sqrt();
            assert!(green(less) > 1.05 * green(plain), "{kelvin} K");
            assert!(green(plain) > 1.05 * green(more), "{kelvin} K");
        }
    }

    #[test]
    fn whites_of_the_whole_range_are_finite() {
        for kelvin in [1667.0, 25_000.0] {
            for tint in [-50.0, 50.0] {
                let matrix = of(kelvin, tint).matrix().unwrap();
                assert!(matrix.is_finite(), "{kelvin} K, tint {tint}: {matrix}");
            }
        }
    }
}
