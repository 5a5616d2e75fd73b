//! Near-light correction: a light closer to a surface than the spacing of entry points illuminates
//! an area between them, which they sample poorly or not at all. Rays from the light sample it
//! instead, and the entry points around share the result. In: entry points, a point or spot light.
//! Out: corrections of its form factors; then the corrected form factors.

use crate::cpu::lights::{lattice_point, sample_light};
use crate::error::Result;
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use crate::passes::precompute::rays::{RayAnswer, RayQuery, Rays};
use crate::types::{LIGHT_POINT, LIGHT_SPOT, LightSource, NO_SIDE, PathVertex, Surface};
use glam::Vec3;
use std::f32::consts::{PI, TAU};
use std::sync::Arc;

gpu_struct! {
    /// Correction of a form factor.
    pub struct NearFactor {
        /// Index of the entry point.
        pub point: u32,
        /// Factor of the form factor.
        pub kept: f32,
        /// Added afterwards, 1/m².
        pub added: f32,
    }
}

gpu_struct! {
    pub struct NearLightsPush {
        /// Form factors that change.
        pub count: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[NearFactor::LAYOUT, NearLightsPush::LAYOUT];

/// Distance of a light from the nearest surface, in mean spacings of entry points: below the first
/// the correction applies in full, above the second not at all. The unit is the mean spacing
/// because the bound of 1/d² depends on it.
const CLOSE: [f32; 2] = [2.0, 4.0];
/// Distance from the light, in mean spacings: within half of it rays determine the light, beyond it
/// entry points do.
const REACH: f32 = 8.0;
/// Distance, in local spacings, within which entry points share the light of a hit: with fewer of
/// them the light would come from single paths.
const SHARED: f32 = 16.0;
/// Height, in local spacings, from which an entry point must see the light, over low obstacles.
/// Entry points differ in height from the hit by no more than this, or by half the distance to the
/// next surface above the hit.
const OVER: f32 = 2.0;
/// Offset, in local spacings, of rays upwards from a hit.
const OFF: f32 = 0.01;
/// Minimum cosine between the normals of a hit and an entry point that shares its light.
const ALIKE: f32 = 0.7;
/// Rays from a light.
const RAYS: u32 = 1024;

/// The entry points, sorted by position.
pub struct NearLights {
    context: Arc<Context>,
    pipeline: Pipeline,
    /// Sorted along the rows of a grid.
    points: Vec<Point>,
    /// Key of each occupied cell, and its first point; the end last.
    cells: Vec<(u64, u32)>,
    low: Vec3,
    spacing: f32,
    area_m2: f32,
}

/// An entry point.
#[derive(Clone, Copy)]
struct Point {
    position: Vec3,
    normal: Vec3,
    index: u32,
    area_m2: f32,
}

impl NearLights {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "near_lights";

    /// Sorts the entry points, with a mean area of `area_m2`, by position. It omits those on
    /// materials that may be glossy: beams handle these.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        entry_points: &[PathVertex],
        surfaces: &[Surface],
        may_be_glossy: impl Fn(u32) -> bool,
        area_m2: f32,
    ) -> Result<Self> {
        let mut made = Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            points: Vec::new(),
            cells: Vec::new(),
            low: entry_points.iter().fold(Vec3::INFINITY, |low, point| low.min(point.position)),
            spacing: area_m2.sqrt(),
            area_m2,
        };
        let mut sorted: Vec<(u64, Point)> = (0..)
            .zip(entry_points)
            .filter(|(_, point)| {
                point.weight > 0.0 && !may_be_glossy(surfaces[point.side as usize / 2].material)
            })
            .map(|(index, point)| {
                let normal = surfaces[point.side as usize / 2].normal_of(point.side % 2 == 1);
                let area_m2 = point.weight * area_m2;
                let point = Point { position: point.position, normal, index, area_m2 };
                (made.cell(point.position), point)
            })
            .collect();
        sorted.sort_unstable_by_key(|(cell, point)| (*cell, point.index));
        for (place, (cell, point)) in (0..).zip(sorted) {
            if made.cells.last().is_none_or(|last| last.0 != cell) {
                made.cells.push((cell, place));
            }
            made.points.push(point);
        }
        made.cells.push((u64::MAX, made.points.len() as u32));
        Ok(made)
    }

    fn cell(&self, place: Vec3) -> u64 {
        let cell = (place - self.low) / (REACH * self.spacing);
        cell.to_array().into_iter().fold(0, |key, along| key << 21 | (along.clamp(0.0, 2_097_151.0) as u64))
    }

    /// The entry points within `reach` metres of a position.
    fn within(&self, place: Vec3, reach: f32) -> impl Iterator<Item = &Point> {
        let step = REACH * self.spacing;
        let rows = (reach / step).ceil() as i32;
        let at = move |x: i32, y: i32, z: i32| place + step * Vec3::new(x as f32, y as f32, z as f32);
        let columns = (-rows..=rows).flat_map(move |x| (-rows..=rows).map(move |y| (x, y)));
        let mut spans: Vec<[u64; 2]> =
            columns.map(|(x, y)| [-rows, rows].map(|z| self.cell(at(x, y, z)))).collect();
        // Cells below the lowest corner have equal keys.
        spans.sort_unstable();
        spans.dedup();
        let points = spans.into_iter().flat_map(|[first, last]| {
            let [first, end] = [first, last + 1].map(|key| self.cells.partition_point(|cell| cell.0 < key));
            &self.points[self.cells[first].1 as usize..self.cells[end].1 as usize]
        });
        points.filter(move |point| point.position.distance(place) < reach)
    }

    /// Spacing of entry points beside a light, metres. `None` if no surface is near enough for a
    /// correction. Entry points are denser in cavities and corners.
    fn spacing_at(&self, light_position: Vec3) -> Option<f32> {
        // A surface that near has an entry point at hardly more than its distance.
        let beside = self.within(light_position, (CLOSE[1] + 1.5) * self.spacing);
        let (count, area_m2) =
            beside.fold((0.0, 0.0), |(count, area), point| (count + 1.0, area + point.area_m2));
        (count > 0.0).then(|| (area_m2 / count).sqrt())
    }

    /// Returns the corrections of a light's form factors (empty if the light is far from all
    /// surfaces), and the device time of its rays in milliseconds. `is_diffuse` reports whether a
    /// side takes part in transport and is diffuse.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn find(
        &self,
        (rays, scene): (&Rays, &SceneBuffers),
        surfaces: &[Surface],
        is_diffuse: impl Fn(u32) -> bool,
        light: &LightSource,
    ) -> Result<(Vec<NearFactor>, f64)> {
        let light_position = light.position;
        let is_small = [LIGHT_POINT, LIGHT_SPOT].contains(&light.kind);
        let Some(spacing) = self.spacing_at(light_position).filter(|_| is_small) else {
            return Ok((Vec::new(), 0.0));
        };
        let directions = directions(light);
        let queries: Vec<RayQuery> = directions
            .iter()
            .map(|(direction, _)| RayQuery { origin: light_position, direction: *direction })
            .collect();
        let (answers, lamp_ms) = rays.trace_timed(scene, &queries)?;
        let met = |t: f32, side: u32| side != NO_SIDE && t > 0.0 && is_diffuse(side);
        let hits: Vec<(f32, u32, Vec3, f32)> = answers
            .iter()
            .zip(&directions)
            .filter(|(answer, _)| met(answer.t, answer.side))
            .map(|(answer, (direction, flux))| {
                (answer.t, answer.side, light_position + answer.t * *direction, *flux)
            })
            .collect();
        let height = hits.iter().fold(f32::INFINITY, |least, hit| least.min(hit.0)) / self.spacing;
        let care = ((CLOSE[1] - height) / (CLOSE[1] - CLOSE[0])).clamp(0.0, 1.0);
        if care == 0.0 {
            return Ok((Vec::new(), lamp_ms));
        }
        let reach = REACH * self.spacing;
        // Fraction of the light at that distance that rays determine.
        let by_rays = |distance: f32| care * (2.0 - 2.0 * distance / reach).clamp(0.0, 1.0);
        let around: Vec<&Point> = self.within(light_position, reach + SHARED * spacing).collect();
        let hits: Vec<_> = hits.into_iter().filter(|hit| hit.0 < reach).collect();
        let normal = |side: u32| surfaces[side as usize / 2].normal_of(side % 2 == 1);
        let places = hits.iter().map(|hit| (hit.2, normal(hit.1)));
        let (clearances, clearances_ms) = self.clearances((rays, scene), spacing, places)?;
        let height = clearances.iter().copied().fold(OVER * spacing, f32::min);
        let (seen, seen_ms) = self.seen((rays, scene), light_position, &around, height)?;
        let mut added = vec![0.0_f64; around.len()];
        let mut fractions = Vec::new();
        for (&(distance, side, place, flux), clearance) in hits.iter().zip(clearances) {
            let normal = normal(side);
            fractions.clear();
            fractions.extend(seen.iter().filter_map(|&index| {
                let point = around[index as usize];
                let off = point.position.distance_squared(place) / (SHARED * spacing).powi(2);
                let is_level = (point.position - place).dot(normal).abs() < clearance;
                let is_near = off < 1.0 && is_level && point.normal.dot(normal) > ALIKE;
                is_near.then(|| (index, f64::from((1.0 - off) * point.area_m2)))
            }));
            let all: f64 = fractions.iter().map(|fraction| fraction.1).sum();
            for &(index, fraction) in &fractions {
                added[index as usize] += fraction / all * f64::from(by_rays(distance) * flux);
            }
        }
        let factor = |(point, added): (&&Point, f64)| {
            let distance = point.position.distance(light_position);
            let by_rays = if distance < reach { by_rays(distance) } else { 0.0 };
            // The bound of 1/d² loses light, which the correction restores here.
            let excess = if distance < reach { care * self.area_m2 / PI / distance.powi(2) } else { 0.0 };
            let kept = if by_rays < 1.0 { (1.0 - by_rays) * (1.0 + excess) } else { 0.0 };
            NearFactor { point: point.index, kept, added: (added / f64::from(point.area_m2)) as f32 }
        };
        let mut factors: Vec<NearFactor> = around.iter().zip(added).map(factor).collect();
        factors.retain(|factor| factor.kept != 1.0 || factor.added != 0.0);
        Ok((factors, lamp_ms + clearances_ms + seen_ms))
    }

    /// Height above and below each hit, metres, within which points count as its surface; and
    /// device time, milliseconds.
    fn clearances(
        &self,
        (rays, scene): (&Rays, &SceneBuffers),
        spacing: f32,
        places: impl Iterator<Item = (Vec3, Vec3)>,
    ) -> Result<(Vec<f32>, f64)> {
        let up = |(place, normal): (Vec3, Vec3)| RayQuery {
            origin: place + OFF * spacing * normal,
            direction: normal,
        };
        let (answers, ms) = rays.trace_timed(scene, &places.map(up).collect::<Vec<_>>())?;
        let most = OVER * spacing;
        let clearance = |t: f32| if t < 0.0 { most } else { (0.5 * (t + OFF * spacing)).min(most) };
        Ok((answers.iter().map(|answer| clearance(answer.t)).collect(), ms))
    }

    /// Entry points that see the light from `height` above their surface; a wall between them and
    /// the light blocks it. Also returns device time, milliseconds.
    fn seen(
        &self,
        (rays, scene): (&Rays, &SceneBuffers),
        light_position: Vec3,
        around: &[&Point],
        height: f32,
    ) -> Result<(Vec<u32>, f64)> {
        let segment = |point: &&Point| {
            let over = height * point.normal;
            RayQuery { origin: light_position + over, direction: point.position - light_position }
        };
        let queries: Vec<RayQuery> = around.iter().map(segment).collect();
        let (answers, ms) = rays.trace_timed(scene, &queries)?;
        let is_seen = |(_, answer): &(u32, RayAnswer)| !(0.0..1.0).contains(&answer.t);
        Ok(((0..).zip(answers).filter(is_seen).map(|(index, _)| index).collect(), ms))
    }

    /// Uploads the corrections of [`Self::find`].
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn upload(&self, factors: &[NearFactor]) -> Result<Buffer> {
        Buffer::from_slice(&self.context, "near factors", factors)
    }

    /// Corrects the form factors of a light. Records into an open pass.
    pub fn record(&self, pass: &mut PassScope<'_>, found: &Buffer, count: u32, factors: &Buffer) {
        let bindings = [("NearFactors", found), ("FormFactors", factors)];
        pass.dispatch(&self.pipeline, [count, 1, 1], &NearLightsPush { count }, &bindings);
    }
}

/// Directions from a point or spot light, evenly over its cone, and the flux of each per unit of
/// its intensity, sr.
fn directions(light: &LightSource) -> Vec<(Vec3, f32)> {
    let unit = LightSource { emission: Vec3::ONE, ..*light };
    let (axis, least) = match light.kind {
        LIGHT_SPOT => (light.axis, light.outer_angle.cos()),
        _ => (Vec3::Y, -1.0),
    };
    let (tangent, bitangent) = axis.any_orthonormal_pair();
    let turn = PI * (3.0 - 5.0_f32.sqrt());
    let directions = (0..RAYS).map(|ray| {
        let cosine = 1.0 - (1.0 - least) * (ray as f32 + 0.5) / RAYS as f32;
        let (sine, angle) = ((1.0 - cosine * cosine).max(0.0).sqrt(), turn * ray as f32);
        let direction = cosine * axis + sine * (angle.cos() * tangent + angle.sin() * bitangent);
        let place = (light.position + direction).as_dvec3();
        let intensity = sample_light(&unit, place, lattice_point(light, 0)).map_or(0.0, |s| s.irradiance.x);
        (direction, intensity as f32 * TAU * (1.0 - least) / RAYS as f32)
    });
    directions.filter(|direction| direction.1 > 0.0).collect()
}
