//! A light's power in photometric units and its colour temperature, for panels.

use glam::{DVec3, Vec3};

use super::photometry::{Extent, KELVIN, black_body, luminance, lux};
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
    /// Temperature of the black body with its ratio of red to green, 1667 to 25 000 K, as
    /// [`Self::with_kelvin`] takes it.
    pub fn kelvin(&self) -> f64 {
        let emission = self.emission().as_dvec3();
        let ratio = |colour: DVec3| colour.x / colour.y.max(1e-9);
        let wanted = if emission == DVec3::ZERO { 1.0 } else { ratio(emission) };
        // The ratio decreases with the temperature.
        let [mut low, mut high] = [*KELVIN.start(), *KELVIN.end()];
        for _ in 0..50 {
            let middle = (low * high).sqrt();
            if ratio(black_body(middle)) > wanted { low = middle } else { high = middle }
        }
        low
    }

    /// The light with the colour of a black body of that temperature, 1667 to 25 000 K, as bright.
    #[must_use]
    pub fn with_kelvin(self, kelvin: f64) -> Self {
        let colour = black_body(kelvin.clamp(*KELVIN.start(), *KELVIN.end()));
        let power = luminance(self.emission().as_dvec3());
        self.with_emission((power * colour).as_vec3())
    }
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
        let mut sun = Light::new("", sun);
        assert_eq!(sun.power().unwrap().1, "lx");
        sun.set_power(0.0);
        sun.set_power(683.0);
        assert!((sun.kind.emission() - Vec3::ONE).length() < 1e-5);
    }
}
