//! Photometric units: illuminance of irradiance, and lights stated in lumens, candela, lux, nits or
//! watts, with a colour temperature.

use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;
use std::ops::RangeInclusive;

use super::value::{Node, POWER, Section};
use crate::Result;

/// Lumens of one watt at 555 nm. It is the convention of glTF and of most renderers, whose spectra
/// are three colours.
pub const LUMENS_A_WATT: f64 = 683.0;
/// Luminance of linear Rec.709.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);
/// Colour temperatures of [`black_body`], K.
pub(crate) const KELVIN: RangeInclusive<f64> = 1667.0..=25_000.0;

/// Keys that state a light's power instead of its radiometric emission.
pub(super) const POWERS: [&str; 5] = ["lumens", "candela", "nits", "lux", "watts"];
/// Keys of its colour beside them.
const COLOURS: [&str; 2] = ["kelvin", "tint"];

/// Illuminance of an irradiance: W/m² become lx. Likewise W become lm, and W/sr cd.
pub fn lux(irradiance: Vec3) -> f64 {
    LUMENS_A_WATT * luminance(irradiance.as_dvec3())
}

pub(super) fn luminance(colour: DVec3) -> f64 {
    LUMINANCE.dot(colour)
}

/// Colour of a black body of that temperature, linear Rec.709 of luminance 1. Colours outside of
/// Rec.709 lose their negative part.
///
/// The chromaticity is the cubic fit of [Kang 2002] to the Planckian locus.
pub(super) fn black_body(kelvin: f64) -> DVec3 {
    let t = 1e3 / kelvin;
    let cubic = |[a, b, c, d]: [f64; 4], x: f64| ((a * x + b) * x + c) * x + d;
    let x = match kelvin {
        ..4000.0 => cubic([-0.266_123_9, -0.234_358_9, 0.877_695_6, 0.179_910], t),
        _ => cubic([-3.025_846_9, 2.107_037_9, 0.222_634_7, 0.240_390], t),
    };
    let y = match kelvin {
        ..2222.0 => cubic([-1.106_381_4, -1.348_110_20, 2.185_558_32, -0.202_196_83], x),
        ..4000.0 => cubic([-0.954_947_6, -1.374_185_93, 2.091_370_15, -0.167_488_67], x),
        _ => cubic([3.081_758_0, -5.873_386_70, 3.751_129_97, -0.370_014_83], x),
    };
    let colour = of_chromaticity(DVec2::new(x, y)).max(DVec3::ZERO);
    colour / luminance(colour)
}

/// Linear Rec.709 (white D65) of luminance 1 with these CIE 1931 chromaticities.
fn of_chromaticity(xy: DVec2) -> DVec3 {
    let xyz = DVec3::new(xy.x / xy.y, 1.0, (1.0 - xy.x - xy.y) / xy.y);
    DVec3::new(
        DVec3::new(3.240_970, -1.537_383, -0.498_611).dot(xyz),
        DVec3::new(-0.969_244, 1.875_968, 0.041_555).dot(xyz),
        DVec3::new(0.055_630, -0.203_977, 1.056_972).dot(xyz),
    )
}

/// What a light's power is spread over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Extent {
    /// Intensity on the axis times this solid angle, sr, is the flux.
    SolidAngle(f64),
    /// A surface of this area, m², that emits to one side.
    Surface(f64),
    /// Light from infinity has no flux.
    Infinity,
}

impl Extent {
    /// The sphere of all directions.
    pub(super) const SPHERE: Self = Self::SolidAngle(4.0 * PI);

    /// A cone of that half-angle, radians. The intensity falls to zero over its outer `penumbra`,
    /// linearly in the angle.
    pub(super) fn cone(angle: f64, penumbra: f64) -> Self {
        let inner = angle * (1.0 - penumbra);
        // The integral of the intensity over the sphere.
        let edge = match angle - inner {
            0.0 => angle.cos(),
            width => (angle.sin() - inner.sin()) / width,
        };
        Self::SolidAngle(2.0 * PI * (1.0 - edge))
    }

    /// Keys that it can have.
    fn powers(self) -> &'static [&'static str] {
        match self {
            Self::SolidAngle(_) => &["lumens", "candela", "watts"],
            Self::Surface(_) => &["lumens", "nits", "watts"],
            Self::Infinity => &["lux"],
        }
    }

    /// Flux of a light of unit emission, W.
    pub(super) fn flux(self) -> f64 {
        match self {
            Self::SolidAngle(steradians) => steradians,
            Self::Surface(area_m2) => PI * area_m2,
            Self::Infinity => 1.0,
        }
    }
}

/// The largest intensity of a light whose intensities were measured, W/sr: as [`emission`], or that
/// of the measurement, `peak_candela`.
pub(super) fn measured(section: &Section, extent: Extent, peak_candela: f64) -> Result<Vec3> {
    let is_stated = |key: &&str| section.get(key).is_some();
    if ["intensity"].iter().chain(&POWERS).any(is_stated) {
        return emission(section, "intensity", "W/sr", extent);
    }
    Ok((peak_candela / LUMENS_A_WATT * colour(section)?).as_vec3())
}

/// The emission of a light: the vector `key`, in `unit`, or a power with a colour.
pub(super) fn emission(section: &Section, key: &str, unit: &str, extent: Extent) -> Result<Vec3> {
    let stated: Vec<&str> = POWERS.into_iter().filter(|power| section.get(power).is_some()).collect();
    let [power] = stated[..] else {
        if let [first, second, ..] = stated[..] {
            return Err(section.fault_at(second, format!("{first} states the power: leave out one of them")));
        }
        if let Some(colour) = COLOURS.into_iter().find(|colour| section.get(colour).is_some()) {
            let powers = extent.powers().join(", ");
            return Err(section.fault_at(colour, format!("belongs to a power: {powers}")));
        }
        let expected = format!("three numbers, {unit}; or {}", extent.powers().join(", "));
        return Ok(section.need(section.vector(key, POWER)?, key, &expected)?.as_vec3());
    };
    if section.get(key).is_some() {
        return Err(section.fault_at(key, format!("{power} states the power: leave out one of them")));
    }
    let amount = section.number(power, POWER)?.unwrap_or(0.0);
    let unit_emission = match power {
        "lumens" => extent.flux() * LUMENS_A_WATT,
        "watts" => extent.flux(),
        _ => LUMENS_A_WATT,
    };
    Ok((amount / unit_emission * colour(section)?).as_vec3())
}

/// The colour of a light, of luminance 1.
fn colour(section: &Section) -> Result<DVec3> {
    let black_body = section.number("kelvin", KELVIN)?.map_or(DVec3::ONE, black_body);
    let colour = black_body * section.vector("tint", 0.0..=1.0)?.unwrap_or(DVec3::ONE);
    if colour == DVec3::ZERO {
        return Err(section.fault_at("tint", "must not be black: no power has that colour"));
    }
    Ok(colour / luminance(colour))
}

/// Whether a table of a light states a power.
pub(super) fn is_stated(table: &Node) -> bool {
    POWERS.into_iter().chain(["ies"]).any(|power| table.get(power).is_some())
}

/// Keys of a power and its colour.
pub(super) fn keys() -> Vec<&'static str> {
    [&POWERS[..], &COLOURS].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chromaticities of black bodies by Planck's law and the CIE 1931 observer, four digits.
    #[test]
    fn black_bodies_have_their_colours() {
        for (kelvin, x, y) in [
            (2000.0, 0.5267, 0.4133),
            (2856.0, 0.4476, 0.4074),
            (4000.0, 0.3805, 0.3768),
            (6500.0, 0.3135, 0.3237),
            (10_000.0, 0.2807, 0.2884),
        ] {
            let [found, expected] = [black_body(kelvin), of_chromaticity(DVec2::new(x, y))];
            assert!((luminance(found) - 1.0).abs() < 1e-9);
            let error = (found - expected).abs().max_element();
            assert!(error < 0.02, "{kelvin} K: {found} instead of {expected}");
        }
        // Daylight is white, lamps are red.
        assert!((black_body(6504.0) - DVec3::ONE).abs().max_element() < 0.06, "{}", black_body(6504.0));
        let lamp = black_body(2700.0);
        assert!(lamp.x > lamp.y && lamp.y > lamp.z && lamp.z > 0.0, "{lamp}");
    }

    /// Against numerical integration of the intensity.
    #[test]
    fn cones_have_their_flux() {
        for (degrees, penumbra) in [(30.0_f64, 0.0), (30.0, 0.4), (60.0, 1.0), (90.0, 0.1)] {
            let angle = degrees.to_radians();
            let inner = angle * (1.0 - penumbra);
            let steps = 20_000;
            let width = angle / f64::from(steps);
            let sum: f64 = (0..steps)
                .map(|step| {
                    let theta = (f64::from(step) + 0.5) * width;
                    let intensity = ((angle - theta) / (angle - inner).max(1e-12)).min(1.0);
                    2.0 * PI * theta.sin() * intensity * width
                })
                .sum();
            let Extent::SolidAngle(found) = Extent::cone(angle, penumbra) else { panic!("a cone") };
            assert!((found / sum - 1.0).abs() < 1e-6, "{degrees}° {penumbra}: {found} instead of {sum}");
        }
    }
}
