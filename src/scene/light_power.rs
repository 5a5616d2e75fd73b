//! A light's power in photometric units and its colour temperature, for panels.

use glam::{DVec2, DVec3, Vec3};

use super::photometry::{Extent, KELVIN, black_body, luminance, lux};
use super::white_balance::XYZ_FROM_REC709;
use super::{Light, LightKind};

impl Light {
    fn extent(&self) -> Option<Extent> {
        if let Some(luminaire) = &self.luminaire {
            return Some(Extent::SolidAngle(luminaire.profile.steradians()));
        }
        match self.kind {
            LightKind::Point { .. } => Some(Extent::SPHERE),
            LightKind::Spot { angle, penumbra, .. } => Some(Extent::cone(angle.into(), penumbra.into())),
            LightKind::Area { edge_u, edge_v, .. } => {
                Some(Extent::Surface(edge_u.cross(edge_v).length().into()))
            }
            LightKind::Directional { .. } => Some(Extent::Infinity),
            LightKind::Surface { .. } | LightKind::Sky { .. } => None,
        }
    }

    /// Luminous flux and its unit; of a directional light the illuminance of a facing surface.
    /// `None` for surfaces and the sky.
    pub fn power(&self) -> Option<(f64, &'static str)> {
        let extent = self.extent()?;
        let unit = if extent == Extent::Infinity { "lx" } else { "lm" };
        Some((lux(self.kind.emission()) * extent.flux(), unit))
    }

    /// Changes [`Self::power`]. The colour stays; a black light becomes white.
    pub fn set_power(&mut self, amount: f64) {
        let (Some(extent), emission) = (self.extent(), self.kind.emission()) else { return };
        let colour = if emission == Vec3::ZERO { Vec3::ONE } else { emission };
        self.kind = self.kind.with_emission(colour * (amount / (extent.flux() * lux(colour))) as f32);
    }
}

impl LightKind {
    /// Correlated colour temperature, 1667 to 25 000 K: that of the black body whose CIE 1960
    /// chromaticity is nearest. White, and black, have that of D65, about 6500 K.
    pub fn kelvin(&self) -> f64 {
        let emission = self.emission().as_dvec3();
        let own = chromaticity(if emission == DVec3::ZERO { DVec3::ONE } else { emission });
        let away = |mired: f64| chromaticity(black_body(1e6 / mired)).distance_squared(own);
        // Equal steps in reciprocal temperature are about equal in chromaticity. The nearest of
        // some steps brackets the minimum.
        let [first, last] = [1e6 / *KELVIN.end(), 1e6 / *KELVIN.start()];
        let step = (last - first) / STEPS;
        let nearest = (0..=STEPS as u32).map(|place| first + step * f64::from(place));
        let nearest = nearest.min_by(|a, b| away(*a).total_cmp(&away(*b))).expect("there are steps");
        let [mut low, mut high] = [(nearest - step).max(first), (nearest + step).min(last)];
        for _ in 0..50 {
            let third = (high - low) / 3.0;
            if away(low + third) > away(high - third) { low += third } else { high -= third }
        }
        2e6 / (low + high)
    }

    /// The light with the colour of a black body of that temperature, 1667 to 25 000 K, as bright.
    #[must_use]
    pub fn with_kelvin(self, kelvin: f64) -> Self {
        let colour = black_body(kelvin.clamp(*KELVIN.start(), *KELVIN.end()));
        let power = luminance(self.emission().as_dvec3());
        self.with_emission((power * colour).as_vec3())
    }
}

/// Steps of the reciprocal temperature between which the nearest black body is searched.
const STEPS: f64 = 64.0;

/// CIE 1960 u and v of linear Rec.709.
fn chromaticity(colour: DVec3) -> DVec2 {
    let DVec3 { x, y, z } = XYZ_FROM_REC709 * colour;
    DVec2::new(4.0 * x, 6.0 * y) / (x + 15.0 * y + 3.0 * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_temperatures_are_read_back() {
        let spot = LightKind::Spot {
            position: Vec3::ZERO,
            direction: Vec3::X,
            intensity: Vec3::new(3.0, 2.0, 1.0),
            angle: 0.7,
            penumbra: 0.3,
        };
        let sun = LightKind::Directional { direction: Vec3::X, irradiance: Vec3::ONE };
        for kind in [spot, sun] {
            for amount in [1.0, 800.0] {
                let mut light = Light::new("", kind);
                light.set_power(amount);
                let (found, unit) = light.power().unwrap();
                assert!((found / amount - 1.0).abs() < 1e-5, "{found} {unit}");
            }
            for kelvin in [1700.0, 2700.0, 4000.0, 6500.0, 20_000.0] {
                let warm = kind.with_kelvin(kelvin);
                assert!((warm.kelvin() / kelvin - 1.0).abs() < 1e-4, "{}", warm.kelvin());
                assert!((lux(warm.emission()) / lux(kind.emission()) - 1.0).abs() < 1e-5);
            }
        }
        // White is D65. Off the locus, the nearest black body counts.
        assert!((sun.kelvin() - 6504.0).abs() < 10.0, "{}", sun.kelvin());
        assert_eq!(sun.with_emission(Vec3::ZERO).kelvin(), sun.kelvin());
        let blue = sun.with_emission(Vec3::new(0.1, 0.1, 1.0)).kelvin();
        assert!((blue - 25_000.0).abs() < 1.0, "{blue}");
        let mut sun = Light::new("", sun);
        assert_eq!(sun.power().unwrap().1, "lx");
        sun.set_power(0.0);
        sun.set_power(683.0);
        assert!((sun.kind.emission() - Vec3::ONE).length() < 1e-5);
    }
}
