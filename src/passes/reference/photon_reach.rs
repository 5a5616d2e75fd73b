//! Distance from irradiance points along their surface to the next wall. In: points. Out: sixteen
//! bytes a point.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::SceneBuffers;
use crate::passes::precompute::Chunks;
use std::sync::Arc;

gpu_struct! {
    pub struct PhotonReachPush {
        /// Radius of the density estimate, metres.
        pub radius: f32,
        /// First point of this dispatch.
        pub first_point: u32,
        /// One past the last.
        pub end_point: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[PhotonReachPush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "photon_reach";

/// Bytes a point.
pub const REACH_BYTES: u64 = 16;

/// Traces sixteen rays from each of `count` points (`MapEntry`s). Adds the device time in
/// milliseconds to `ms`.
///
/// # Errors
/// The device lacks memory or failed, or loops were truncated.
pub fn trace(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    points: &Buffer,
    count: u32,
    radius: f32,
    ms: &mut f64,
) -> Result<Buffer> {
    let pipeline = Pipeline::new(context, STEM, &[])?;
    let reaches = Buffer::storage(context, "reaches", u64::from(count) * REACH_BYTES)?;
    Chunks::new(1 << 12, u32::MAX).run(count, |first, chunk| {
        let push = PhotonReachPush { radius, first_point: first, end_point: first + chunk };
        let ((), timings) = context.run(|rec| {
            rec.pass(STEM).dispatch(
                &pipeline,
                [chunk, 1, 1],
                &push,
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Points", points),
                    ("Reaches", &reaches),
                    ("TruncatedLoops", &scene.truncated_loops),
                ],
            );
        })?;
        *ms += timings[0].ms;
        Ok(timings[0].ms)
    })?;
    scene.refuse_truncated_loops(STEM, 0)?;
    Ok(reaches)
}
