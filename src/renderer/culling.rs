//! Culling statistics: the work with lights that frames skip. They are counted on request; no
//! frame needs them.

use super::Renderer;
use crate::cpu::lights::{lattice_point, sample_light};
use crate::error::Result;
use crate::types::LightSource;
use glam::Vec3;
use std::collections::BTreeMap;

/// Maximum number of tested pairs of an entry point and a light sample. If an area light has more,
/// the test takes every n-th entry point.
const ASKED: usize = 1 << 22;

#[doc(hidden)]
impl Renderer {
    /// Fractions of work, 0..=1, that a frame with all lights stale skips. Also the number of entry
    /// points that no light reaches.
    pub(super) fn skipped_light(&self) -> Result<(BTreeMap<String, f64>, u64)> {
        let mut skipped = BTreeMap::new();
        let active: Vec<&[LightSource]> = self.lights.active_parts().collect();
        let lights = f64::from(self.lights.count());
        if lights > 0.0 {
            skipped.insert("lights that are off or black".into(), 1.0 - active.len() as f64 / lights);
        }
        let points = self.transport.form_factors.entry_points()?;
        let intensities = self.lights.intensities();
        let (mut rays, mut turned_away) = (0_u64, 0_u64);
        for light in active.into_iter().flatten() {
            let step = (points.len() * light.samples as usize).div_ceil(ASKED);
            for point in points.iter().step_by(step.max(1)) {
                let normal = self.world.normal(point.side);
                let is_turned = |number: &u32| {
                    let place = lattice_point(light, *number);
                    let found = sample_light(light, intensities, point.position.as_dvec3(), place);
                    found.is_none_or(|found| normal.as_dvec3().dot(found.direction) <= 0.0)
                };
                rays += u64::from(light.samples);
                turned_away += (0..light.samples).filter(is_turned).count() as u64;
            }
        }
        if rays > 0 {
            let what = "shadow rays of entry points that face away from a light or stand outside its cone";
            skipped.insert(what.into(), turned_away as f64 / rays as f64);
        }
        let flux = self.path_flux()?;
        Ok((skipped, flux.iter().filter(|flux| **flux == Vec3::ZERO).count() as u64))
    }
}
