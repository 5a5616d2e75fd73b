//! Clamping statistics, counted on request; no frame needs them.

use super::Renderer;
use crate::cpu::blend::is_limited as blend_is_limited;
use crate::cpu::direct::sample_weight;
use crate::error::Result;
use crate::passes::frame::splat::{SplatWeight, WeightRange};
use crate::passes::precompute::neighbours::Neighbour;
use crate::types::{CachePoint, LIGHT_AREA, LIGHT_DIRECTIONAL, LightSource, NO_SIDE, PixelSurface, Record};
use glam::Vec3;
use std::collections::BTreeMap;
use std::f64::consts::PI;

#[doc(hidden)]
impl Renderer {
    /// Fractions of the light at entry points and at pixels, 0..=1, that clamping 1/d² removes.
    /// Clamping acts near a light, where the surface point is large beside its distance. If few
    /// points are near a light, chance adds an error that is not counted.
    pub(super) fn clamped_light(&self) -> Result<BTreeMap<String, f64>> {
        let weights = self.transport.form_factors.weights();
        let area_m2 = self.transport.form_factors.area_m2();
        let points = self.transport.form_factors.entry_points()?;
        let pixels: Vec<PixelSurface> = self.image.primary.pixels.read()?;
        let (mut at_points, mut at_pixels) = (Light::default(), Light::default());
        for (light, emission, [factors, irradiance], number) in self.lights.current(&self.dirty.lights) {
            let power = f64::from(emission.element_sum());
            let found: Vec<f32> = factors.read()?;
            // The near-light correction removes nothing.
            let mut is_exact = vec![false; points.len()];
            let corrected = self.lights.corrected_points(number, &self.transport.near_lights);
            corrected.for_each(|point| is_exact[point as usize] = true);
            let of_points = points.iter().zip(found).zip(weights.iter().zip(is_exact));
            for ((point, found), (weight, is_exact)) in of_points.filter(|((_, found), _)| *found > 0.0) {
                let found = power * f64::from(*weight) * f64::from(found);
                let area_m2 = if is_exact { 0.0 } else { area_m2 };
                at_points.add(light, point.position, self.world.normal(point.side), area_m2, found);
            }
            // A light without parts has no irradiance at pixels of its own.
            let count = if light.is_empty() { 0 } else { pixels.len() };
            let found: Vec<f32> = irradiance.read_range(0, count)?;
            for (pixel, found) in
                pixels.iter().zip(found).filter(|(pixel, found)| pixel.side != NO_SIDE && *found > 0.0)
            {
                at_pixels.add(light, pixel.position, pixel.normal, pixel.footprint, power * f64::from(found));
            }
        }
        let fractions = [
            ("light at entry points beside lights", at_points),
            ("light at pixels beside lights", at_pixels),
        ];
        Ok(fractions.map(|(name, light)| (name.to_owned(), light.fraction())).into())
    }

    /// Counts of clamped values that the last view uses: extrapolations of records to pixels, pixel
    /// sums, and blended records. Extrapolations are clamped at zero; at uncovered pixels, their
    /// change is clamped.
    pub(super) fn limited(&self) -> Result<[(&'static str, u64); 3]> {
        let pixels: Vec<PixelSurface> = self.image.primary.pixels.read()?;
        let records: Vec<Record> = self.transport.blend.records.read()?;
        let [ranges, weights] = self.splat.lists();
        let ranges: Vec<WeightRange> = ranges.read()?;
        let asked = self.counters.splat().weights;
        let [_, capacity] = self.splat.capacity();
        let end = asked.min(capacity) as usize;
        let weights: Vec<SplatWeight> = weights.read_range(0, end)?;
        let mut is_seen = vec![false; records.len()];
        let (mut extrapolations, mut sums) = (0, 0);
        for (pixel, range) in pixels.iter().zip(&ranges) {
            let (mut irradiance, mut offset, mut along) = (Vec3::ZERO, Vec3::ZERO, glam::Mat3::ZERO);
            for weight in weights.get(range.first as usize..(range.end as usize).min(end)).unwrap_or_default()
            {
                let record = &records[weight.record as usize];
                is_seen[weight.record as usize] = true;
                let moved = pixel.position - record.position;
                let change =
                    0.5 * record.translation.transpose() * moved + record.rotation.transpose() * pixel.normal;
                let is_uncovered = weight.weight < 0.0;
                let bounded = if is_uncovered {
                    change.clamp(-0.5 * record.irradiance, record.irradiance)
                } else {
                    change
                };
                let value = record.irradiance + bounded;
                extrapolations += u64::from(bounded != change || value.min_element() < 0.0);
                let fraction = weight.weight.abs();
                irradiance += fraction * value.max(Vec3::ZERO);
                offset += fraction * moved;
                along += if is_uncovered { glam::Mat3::ZERO } else { record.translation * fraction };
            }
            sums += u64::from((irradiance + 0.5 * along.transpose() * offset).min_element() < 0.0);
        }
        Ok([
            ("extrapolations of records that were limited", extrapolations),
            ("pixels clamped at zero", sums),
            ("records clamped at zero", self.limited_blends(&is_seen)?),
        ])
    }

    /// Number of the marked records that blending clamps: the blend, or the value of one neighbour,
    /// would fall below zero.
    fn limited_blends(&self, is_seen: &[bool]) -> Result<u64> {
        let [points, gathered] = [&self.transport.gather.cache_points, &self.transport.gather.records];
        let (points, gathered): (Vec<CachePoint>, Vec<Record>) = (points.read()?, gathered.read()?);
        let [first, neighbours] = self.transport.blend.lists();
        let (first, neighbours): (Vec<u32>, Vec<Neighbour>) = (first.read()?, neighbours.read()?);
        let is_limited = |index: usize| {
            let own = &neighbours[first[index] as usize..first[index + 1] as usize];
            let weights: Vec<(Record, f32)> =
                own.iter().map(|n| (gathered[n.record as usize], n.weight)).collect();
            blend_is_limited(&points[index], &weights)
        };
        Ok((0..is_seen.len()).filter(|&index| is_seen[index] && is_limited(index)).count() as u64)
    }
}

/// Light that was found, and light that clamping removed.
#[derive(Default)]
struct Light {
    found: f64,
    removed: f64,
}

impl Light {
    /// Adds the light `found` at a surface point of extent `area_m2`. Visibility is taken as the
    /// same for all of an area light that the point faces.
    fn add(&mut self, parts: &[LightSource], position: Vec3, normal: Vec3, area_m2: f32, found: f64) {
        let excess = |light: &LightSource| excess(light, position, normal, area_m2);
        let excess = parts.iter().map(excess).sum::<f64>() / parts.len().max(1) as f64;
        self.found += found;
        self.removed += found * excess;
    }

    fn fraction(&self) -> f64 {
        if self.removed > 0.0 { self.removed / (self.found + self.removed) } else { 0.0 }
    }
}

/// Light that clamping removes over the light that is left, for one part of a light.
fn excess(light: &LightSource, position: Vec3, normal: Vec3, area_m2: f32) -> f64 {
    let (position, normal, area_m2) = (position.as_dvec3(), normal.as_dvec3(), f64::from(area_m2));
    if light.kind == LIGHT_AREA {
        let [bounded, whole] = [area_m2, 0.0].map(|area_m2| sample_weight(light, position, normal, area_m2));
        return whole / bounded - 1.0;
    }
    if light.kind == LIGHT_DIRECTIONAL {
        return 0.0;
    }
    // [Wallace]
    area_m2 / PI / light.position.as_dvec3().distance_squared(position).max(1e-24)
}
