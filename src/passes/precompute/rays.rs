//! Closest hits of an explicit list of rays, or any hits of segments. In: origins and directions
//! (metres). Out: distance and side.

use super::{Chunks, each_part};
use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, HostBlock, HostUpload, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::{SceneBuffers, loop_limit};
use crate::types::LOOP_TRUNCATED;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A ray to trace.
    pub struct RayQuery {
        /// Origin; the caller keeps it off its own surface.
        pub origin: Vec3,
        /// Direction of any length.
        pub direction: Vec3,
    }
}

gpu_struct! {
    /// The hit of a ray.
    pub struct RayAnswer {
        /// Distance in units of the direction's length; negative if nothing was hit.
        pub t: f32,
        /// 2·triangle + (1 if the back side); `NO_SIDE` if nothing was hit; `LOOP_TRUNCATED` if the
        /// loop was truncated.
        pub side: u32,
    }
}

gpu_struct! {
    pub struct RaysPush {
        /// Rays in the list.
        pub ray_count: u32,
        /// How far they go, in units of their directions.
        pub reach: f32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[RayQuery::LAYOUT, RayAnswer::LAYOUT, RaysPush::LAYOUT];

/// Reach of rays that find every hit, in units of their directions.
const FAR: f32 = 1e30;

/// The pipeline that traces lists of rays.
pub struct Rays {
    context: Arc<Context>,
    pipeline: Pipeline,
    /// Reach of rays for which the caller states none.
    reach: f32,
}

impl Rays {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "rays";
    /// Maximum number of rays of one dispatch.
    pub const LIMIT: u32 = 1 << 18;

    /// Creates the pipeline that finds closest hits.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        Self::with(context, false)
    }

    /// Creates the pipeline that finds any hit between a ray's origin and the end of its direction.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn of_segments(context: &Arc<Context>) -> Result<Self> {
        Self::with(context, true)
    }

    fn with(context: &Arc<Context>, are_segments: bool) -> Result<Self> {
        let constants = [("SEGMENTS", u32::from(are_segments))];
        let pipeline = Pipeline::new(context, Self::STEM, &constants)?;
        Ok(Self { context: context.clone(), pipeline, reach: if are_segments { 1.0 } else { FAR } })
    }

    /// Traces all rays.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn trace(&self, scene: &SceneBuffers, queries: &[RayQuery]) -> Result<Vec<RayAnswer>> {
        Ok(self.trace_timed(scene, queries)?.0)
    }

    /// Traces all rays as far as `reach`, in units of their directions, and finds nothing beyond.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn trace_within(
        &self,
        scene: &SceneBuffers,
        queries: &[RayQuery],
        reach: f32,
    ) -> Result<Vec<RayAnswer>> {
        Ok(self.traced(scene, queries, reach)?.0)
    }

    /// Traces all rays. Returns the hits and the device time, milliseconds.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn trace_timed(&self, scene: &SceneBuffers, queries: &[RayQuery]) -> Result<(Vec<RayAnswer>, f64)> {
        self.traced(scene, queries, self.reach)
    }

    fn traced(
        &self,
        scene: &SceneBuffers,
        queries: &[RayQuery],
        reach: f32,
    ) -> Result<(Vec<RayAnswer>, f64)> {
        // Dispatches of a submission share the buffers.
        let limit = (queries.len() as u32).clamp(1, 2 * Self::LIMIT);
        let asked = Buffer::storage(&self.context, "ray queries", u64::from(limit) * 24)?;
        let answered = Buffer::storage(&self.context, "ray answers", u64::from(limit) * 8)?;
        let from_host = HostUpload::of(&self.context, "ray queries on the host", &asked)?;
        let to_host = HostBlock::of(&self.context, "ray answers on the host", &answered)?;
        let (mut answers, mut device_ms) = (Vec::with_capacity(queries.len()), 0.0);
        Chunks::new(1 << 14, limit).run_batches(queries.len() as u32, |first, parts| {
            let (first, count) = (first as usize, parts.last().map_or(0, |part| part.end as usize));
            from_host.write(&queries[first..first + count]);
            let ((), timings) = self.context.run(|rec| {
                each_part(rec, parts, |rec, part| {
                    let push = RaysPush { ray_count: part.end - part.start, reach };
                    rec.copy_from_host::<RayQuery>(&from_host, part.clone(), &asked);
                    rec.barrier(TRANSFER_TO_COMPUTE);
                    self.record(rec, scene, &asked, &answered, push);
                    rec.barrier(COMPUTE_TO_TRANSFER);
                    rec.copy_elements_to_host::<RayAnswer>(&answered, &to_host, part);
                });
            })?;
            answers.extend(to_host.read::<RayAnswer>(count));
            loop_limit::refuse(
                answers[first..].iter().any(|answer| answer.side == LOOP_TRUNCATED),
                Self::STEM,
                0,
            )?;
            device_ms += timings.iter().map(|timing| timing.ms).sum::<f64>();
            Ok(timings)
        })?;
        Ok((answers, device_ms))
    }

    /// Traces the rays `repeats` times, after one untimed run, and returns the device time of each,
    /// milliseconds. Takes one dispatch: rays beyond [`Self::LIMIT`] are ignored.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn time(&self, scene: &SceneBuffers, queries: &[RayQuery], repeats: usize) -> Result<Vec<f64>> {
        let queries = &queries[..queries.len().min(Self::LIMIT as usize)];
        let asked = Buffer::from_slice(&self.context, "ray queries", queries)?;
        let answered = Buffer::storage(&self.context, "ray answers", queries.len().max(1) as u64 * 8)?;
        let push = RaysPush { ray_count: queries.len() as u32, reach: self.reach };
        self.dispatch(scene, &asked, &answered, push)?;
        (0..repeats).map(|_| self.dispatch(scene, &asked, &answered, push)).collect()
    }

    /// Traces the rays of one dispatch and returns the device time, milliseconds.
    fn dispatch(
        &self,
        scene: &SceneBuffers,
        asked: &Buffer,
        answered: &Buffer,
        push: RaysPush,
    ) -> Result<f64> {
        let ((), timings) = self.context.run(|rec| self.record(rec, scene, asked, answered, push))?;
        Ok(timings[0].ms)
    }

    fn record(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        asked: &Buffer,
        answered: &Buffer,
        push: RaysPush,
    ) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [push.ray_count, 1, 1],
            &push,
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Queries", asked),
                ("Answers", answered),
            ],
        );
    }
}
