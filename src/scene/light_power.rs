//! A light's power in photometric units and its colour temperature, for panels.

use glam::{DVec3, Vec3};

use super::LightKind;
use super::photometry::{Extent, KELVIN, black_body, luminance, lux};

impl LightKind {
    fn extent(&self) -> Option<Extent> {
        match *self {
            Self::Point { .. } => Some(Extent::SPHERE),
            Self::Spot { angle, penumbra, .. } => Some(Extent::cone(angle.into(), penumbra.into())),
            Self::Area { edge_u, edge_v, .. } => Some(Extent::Surface(edge_u.cross(edge_v).length().into())),
            Self::Directional { .. } => Some(Extent::Infinity),
            Self::Surface { .. } | Self::Sky { .. } => None,
        }
    }

    /// Luminous flux and its unit; of a directional light the illuminance of a facing surface.
    /// `None` for surfaces and the sky.
    pub fn power(&self) -> Option<(f64, &'static str)> {
        let extent = self.extent()?;
        let unit = if extent == Extent::Infinity { "lx" } else { "lm" };
        Some((lux(self.emission()) * extent.flux(), unit))
    }

    /// The light with another [`Self::power`]. Its colour stays; a black light becomes white.
    #[must_use]
    pub fn with_power(self, amount: f64) -> Self {
        let (Some(extent), emission) = (self.extent(), self.emission()) else { return self };
        let colour = if emission == Vec3::ZERO { Vec3::ONE } else { emission };
        self.with_emission(colour * (amount / (extent.flux() * lux(colour))) as f32)
    }

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
                let (found, unit) = kind.with_power(amount).power().unwrap();
                assert!((found / amount - 1.0).abs() < 1e-5, "{found} {unit}");
            }
            for kelvin in [1700.0, 2700.0, 4000.0, 6500.0, 20_000.0] {
                let warm = kind.with_kelvin(kelvin);
                assert!((warm.kelvin() / kelvin - 1.0).abs() < 1e-4, "{}", warm.kelvin());
                assert!((lux(warm.emission()) / lux(kind.emission()) - 1.0).abs() < 1e-5);
            }
        }
        assert_eq!(sun.power().unwrap().1, "lx");
        assert!((sun.with_power(0.0).with_power(683.0).emission() - Vec3::ONE).length() < 1e-5);
    }
}
