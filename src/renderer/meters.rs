//! Light meters: irradiance at the scene's measuring points, from the light of the last frame. On
//! request; no frame needs it.

use super::Renderer;
use super::lights::{has_parts, one_light};
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::frame::{gather::Gather, needed_records::RecordList};
use crate::passes::meters::Meters;
use crate::scene::{Light, LightKind};
use crate::types::{CachePoint, Record};
use glam::Vec3;
use std::sync::Arc;

/// Minimum number of point samples of an area light. Pixels have fewer, because a frame has many.
/// A Fibonacci number: its lattice is the most even, and 1024 points err fifteen times as much.
const SAMPLES: u32 = 1597;

/// Irradiance at a measuring point, W/m², red, green, blue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measured {
    /// From the lights. Of a sky only what its bright spots send.
    pub direct: Vec3,
    /// From surfaces and the rest of the sky.
    pub indirect: Vec3,
    /// The point is in a solid, where nothing is measured.
    pub is_in_solid: bool,
}

impl Measured {
    /// All irradiance, W/m².
    pub fn irradiance(&self) -> Vec3 {
        self.direct + self.indirect
    }
}

/// The pipelines and the list of the cache points at measuring points, which follow all others.
pub(super) struct MeterPasses {
    meters: Meters,
    records: RecordList,
    first_record: usize,
    /// The measuring points; several cache points are at each.
    points: Vec<CachePoint>,
    records_at_point: usize,
}

impl MeterPasses {
    /// `None` without measuring points. Otherwise their number, and that of cache points at each.
    pub(super) fn new(
        context: &Arc<Context>,
        gather: &Gather,
        [count, times]: [usize; 2],
    ) -> Result<Option<Self>> {
        if count == 0 {
            return Ok(None);
        }
        let all = gather.point_count();
        let first = all - (count * times) as u32;
        let records: Vec<CachePoint> = gather.cache_points.read_range(first as usize, count * times)?;
        let points: Vec<CachePoint> = records.into_iter().step_by(times).collect();
        let chunk = gather.merged_rays.records_per_chunk;
        Ok(Some(Self {
            meters: Meters::new(context, &points)?,
            records: RecordList::fixed(context, all, chunk, &(first..all).collect::<Vec<_>>())?,
            first_record: first as usize,
            points,
            records_at_point: times,
        }))
    }
}

/// The lights with as many point samples as a measurement needs.
fn sampled(lights: &[Light]) -> Vec<Light> {
    let sampled = |light: &Light| match light.kind {
        LightKind::Area { corner, edge_u, edge_v, radiance, samples } => Light {
            kind: LightKind::Area { corner, edge_u, edge_v, radiance, samples: samples.max(SAMPLES) },
            ..light.clone()
        },
        _ => light.clone(),
    };
    lights.iter().map(sampled).collect()
}

impl Renderer {
    /// Irradiance at all measuring points, meter by meter, from the lights of the last frame.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn measured(&self) -> Result<Vec<Measured>> {
        let Some(own) = &self.meters else { return Ok(Vec::new()) };
        let gather = &self.transport.gather;
        self.context.run(|rec| {
            let sources = self.transport.all_sources(&self.world.buffers, self.lights.sky());
            gather.record(rec, sources, &own.records);
        })?;
        let times = own.records_at_point;
        let records: Vec<Record> = gather.records.read_range(own.first_record, own.points.len() * times)?;
        let mean = |records: &[Record]| -> Vec3 {
            records.iter().map(|record| record.irradiance).sum::<Vec3>() / times as f32
        };
        self.with_direct(own, records.chunks(times).map(mean))
    }

    /// The same with path-traced indirect light: `paths` from each point, and at least one of them
    /// for each gather ray.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn measured_by_paths(&self, paths: u32) -> Result<Vec<Measured>> {
        let Some(own) = &self.meters else { return Ok(Vec::new()) };
        let hemisphere = self.transport.gather.hemisphere;
        let samples = (paths / hemisphere.rays()).max(1);
        self.with_direct(own, self.traced_irradiance(&own.points, hemisphere, samples)?.into_iter())
    }

    /// Adds direct light to indirect irradiance, W/m² without the emission scale, at all points.
    fn with_direct(&self, own: &MeterPasses, indirect: impl Iterator<Item = Vec3>) -> Result<Vec<Measured>> {
        let scale = self.lights.emission_scale;
        let measured = own.points.iter().zip(indirect).map(|(point, indirect)| {
            let is_in_solid = point.radius == 0.0;
            let indirect = if is_in_solid { Vec3::ZERO } else { scale * indirect };
            Measured { direct: Vec3::ZERO, indirect, is_in_solid }
        });
        let mut measured: Vec<Measured> = measured.collect();
        let (rows, sources) = self.lights.tables(&sampled(&self.world.scene.lights));
        let table = Buffer::from_slice(&self.context, "lights of meters", &rows.bytes())?;
        for (index, source) in sources.iter().enumerate() {
            let light = one_light(&table, &rows, (index, self.lights.channel(index)), source);
            if source.emission == Vec3::ZERO || !has_parts(&light) {
                continue;
            }
            self.context.run(|rec| own.meters.record(rec, &self.world.buffers, light))?;
            let factors: Vec<f32> = own.meters.irradiance.read()?;
            for (measured, factor) in measured.iter_mut().zip(factors) {
                measured.direct += source.emission * factor;
            }
        }
        self.world.buffers.refuse_truncated_loops(Meters::STEM, 1)?;
        Ok(measured)
    }
}
