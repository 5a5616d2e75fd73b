//! Direct light at the measuring points of light meters. No picture needs it. In: measuring points,
//! lights. Out: for one light the irradiance at each point, per unit emission.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::one_light::LightKernel;
use crate::passes::{OneLight, SceneBuffers};
use crate::types::CachePoint;

gpu_struct! {
    pub struct MetersPush {
        pub point_count: u32,
        /// Row of the part of the light.
        pub light: u32,
        /// First point sample of the light.
        pub first_sample: u32,
        /// One past the last.
        pub end_sample: u32,
        /// `ADDS` or 0.
        pub flags: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[MetersPush::LAYOUT];

/// The pipelines, and the irradiance from one light.
pub struct Meters {
    kernel: LightKernel,
    points: Buffer,
    point_count: u32,
    /// Irradiance at each measuring point per unit of the light's emission.
    pub irradiance: Buffer,
}

impl Meters {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "meters";

    /// Uploads the measuring points and allocates the result.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, points: &[CachePoint]) -> Result<Self> {
        Ok(Self {
            kernel: LightKernel::new(context, Self::STEM, &[])?,
            points: Buffer::from_slice(context, "measuring points", points)?,
            point_count: points.len() as u32,
            irradiance: Buffer::storage(context, "metered irradiance", 4 * points.len() as u64)?,
        })
    }

    /// Measures a light by a shadow ray to each of its point samples. A light without parts brings
    /// nothing: the caller leaves it out.
    pub fn record(&self, rec: &mut Recorder, scene: &SceneBuffers, light: OneLight<'_>) {
        let mut pass = rec.pass(Self::STEM);
        let dispatches = light.parts().flat_map(|part| part.spans().map(move |span| (part, span)));
        for (number, (part, (first_sample, end_sample))) in dispatches.enumerate() {
            if number > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            let push = MetersPush {
                point_count: self.point_count,
                light: part.row,
                first_sample,
                end_sample,
                flags: part.flags(),
            };
            let bindings = [
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Lights", part.table),
                ("MeasuringPoints", &self.points),
                ("LightIrradiance", &self.irradiance),
                ("TruncatedLoops", &scene.truncated_loops),
            ];
            pass.dispatch(self.kernel.of(part), [self.point_count, 1, 1], &push, &bindings);
        }
    }
}
