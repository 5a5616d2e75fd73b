//! How much of the work with lights frames leave out, and of the light their bounds take away, for people: counted when asked, not in frames.

use super::Renderer;
use crate::cpu::lights::{lattice_point, sample_light};
use crate::error::Result;
use crate::types::{LightSource, NO_SIDE, PixelSurface};
use glam::{DVec3, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Pairs of an entry point and a sample of a light that are asked at most: of area lights with many samples, every so many points.
const ASKED: usize = 1 << 22;

impl Renderer {
    /// Shares of work, 0..=1, that a frame in which all lights are new leaves out; of entry points that no light reaches, the
    /// number is returned, too.
    pub(super) fn skipped_light(&self) -> Result<(BTreeMap<String, f64>, u64)> {
        let mut skipped = BTreeMap::new();
        let shining: Vec<&LightSource> = self.lights.shining_sources().collect();
        let lights = f64::from(self.lights.count());
        if lights > 0.0 {
            skipped.insert("lights that are off or black".into(), 1.0 - shining.len() as f64 / lights);
        }
        let points = self.form_factors.entry_points()?;
        let (mut rays, mut turned_away) = (0_u64, 0_u64);
        for light in shining {
            let step = (points.len() * light.samples as usize).div_ceil(ASKED);
            for point in points.iter().step_by(step.max(1)) {
                let normal = self.normal(point.side);
                let is_turned = |number: &u32| {
                    let found = sample_light(light, point.position.as_dvec3(), lattice_point(light, *number));
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

    /// Shares of the light of entry points and of pixels, 0..=1, that 1/d² would bring besides and its bounded form does not: what lights
    /// so near take away that a point is no longer small beside their distance. A light that few points are near to may lose more, or
    /// less, than it: by chance, and uncounted.
    pub(super) fn bounded_light(&self) -> Result<BTreeMap<String, f64>> {
        let weights = self.form_factors.weights();
        let area_m2 = self.form_factors.area_m2();
        let points = self.form_factors.entry_points()?;
        let pixels: Vec<PixelSurface> = self.primary.pixels.read()?;
        let (mut at_points, mut at_pixels) = (Light::default(), Light::default());
        for (light, factors, layer) in self.lights.traced() {
            let power = f64::from(light.emission.element_sum());
            let found: Vec<f32> = factors.read()?;
            for ((point, found), weight) in
                points.iter().zip(found).zip(weights).filter(|((_, found), _)| *found > 0.0)
            {
                let normal = self.normal(point.side);
                at_points.add(
                    light,
                    point.position,
                    normal,
                    area_m2,
                    power * f64::from(*weight) * f64::from(found),
                );
            }
            let found: Vec<f32> = layer.read_range(0, pixels.len())?;
            for (pixel, found) in
                pixels.iter().zip(found).filter(|(pixel, found)| pixel.side != NO_SIDE && *found > 0.0)
            {
                at_pixels.add(light, pixel.position, pixel.normal, pixel.footprint, power * f64::from(found));
            }
        }
        let shares = [
            ("light at entry points beside lights", at_points),
            ("light at pixels beside lights", at_pixels),
        ];
        Ok(shares.map(|(name, light)| (name.to_owned(), light.share())).into())
    }

    fn normal(&self, side: u32) -> Vec3 {
        let normal = self.surfaces[side as usize / 2].normal;
        if side % 2 == 1 { -normal } else { normal }
    }
}

/// Light that was found, and what the bound took away of it.
#[derive(Default)]
struct Light {
    found: f64,
    removed: f64,
}

impl Light {
    /// Adds light that a surface point of that extent (m²) was found to get of a light. Of area lights, all point samples that the point
    /// faces are taken to be seen alike.
    fn add(&mut self, light: &LightSource, position: Vec3, normal: Vec3, area_m2: f32, found: f64) {
        let (mut bounded, mut removed) = (0.0, 0.0);
        for number in 0..light.samples {
            let Some(sample) = sample_light(light, position.as_dvec3(), lattice_point(light, number)) else {
                continue;
            };
            // [Wallace]
            let excess = f64::from(area_m2) / PI / sample.distance.powi(2);
            let open = normal.as_dvec3().dot(sample.direction).max(0.0) * sample.irradiance.dot(DVec3::ONE)
                / (1.0 + excess);
            bounded += open;
            removed += open * excess;
        }
        self.found += found;
        self.removed += if bounded > 0.0 { found * removed / bounded } else { 0.0 };
    }

    fn share(&self) -> f64 {
        if self.removed > 0.0 { self.removed / (self.found + self.removed) } else { 0.0 }
    }
}
