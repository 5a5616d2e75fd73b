//! Sums of the lights' buffers, weighted by the emissions: a change of colour traces no ray. In: a
//! buffer for each light, per unit emission. Out: sums.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    pub struct LightSumPush {
        /// Values of a light.
        pub count: u32,
        /// 1: adds to the sums so far; 0: starts from zero.
        pub adds: u32,
        /// Stride of the values of a light; 0 if no light is active.
        pub step: u32,
        /// Factor of the whole sum.
        pub scale: f32,
        /// Emission of the first light.
        pub emission_0: Vec3,
        /// Emission of the second light; zero for an unused one.
        pub emission_1: Vec3,
        /// Emission of the third.
        pub emission_2: Vec3,
        /// Emission of the fourth.
        pub emission_3: Vec3,
        /// Emission of the fifth; unused, like the following ones, with up to four lights.
        pub emission_4: Vec3,
        /// Emission of the sixth.
        pub emission_5: Vec3,
        /// Emission of the seventh.
        pub emission_6: Vec3,
        /// Emission of the eighth.
        pub emission_7: Vec3,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[LightSumPush::LAYOUT];

/// Numbers of lights that one dispatch sums. Unused ones cost reads, but further dispatches would
/// pass the sums through memory.
const LIGHTS: [usize; 4] = [1, 2, 4, 8];

/// Values that a workgroup sums.
pub const GROUP_VALUES: u32 = 64;

/// Pipelines that sum the buffers of lights.
pub struct LightSum {
    pipelines: [Pipeline; LIGHTS.len()],
    /// The buffer for a scene without active light: one dark value.
    dark: Buffer,
}

impl LightSum {
    /// Stem of shader and reference.
    pub const STEM: &str = "light_sum";

    /// Prepares sums of numbers.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        Self::with_shader(context, Self::STEM)
    }

    /// Prepares sums of `LightFlux`s, which yield `ClusterFlux`es.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn of_clusters(context: &Arc<Context>) -> Result<Self> {
        Self::with_shader(context, "hvds_sum")
    }

    /// Prepares sums of colours: three floats a value.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn of_colours(context: &Arc<Context>) -> Result<Self> {
        Self::with_shader(context, "gloss_sum")
    }

    fn with_shader(context: &Arc<Context>, shader: &'static str) -> Result<Self> {
        let pipeline = |lights: usize| Pipeline::new(context, shader, &[("LIGHTS", lights as u32)]);
        let [one, two, four, eight] = LIGHTS.map(pipeline);
        // As large as the largest value.
        let dark = Buffer::from_slice(context, "no light", &[0.0_f32; 4])?;
        Ok(Self { pipelines: [one?, two?, four?, eight?], dark })
    }

    /// Sums the first `count` values of every light, in order, each times its emission, and
    /// scales the sum; it is zero without lights. Records into an open pass with barriers between
    /// its own dispatches.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        lights: &[(Vec3, &Buffer)],
        count: u32,
        scale: f32,
        sums: &Buffer,
    ) {
        self.record_counted(pass, lights, (count, None), scale, sums);
    }

    /// As [`Self::record`], of at most `count` values. If `counted` is given, the device has stored
    /// the number of workgroups, of [`GROUP_VALUES`] values each, at that offset of the buffer.
    pub fn record_counted(
        &self,
        pass: &mut PassScope<'_>,
        lights: &[(Vec3, &Buffer)],
        (count, counted): (u32, Option<(&Buffer, u64)>),
        scale: f32,
        sums: &Buffer,
    ) {
        let dark_lights = [(Vec3::ZERO, &self.dark)];
        let (lights, step) = if lights.is_empty() { (&dark_lights[..], 0) } else { (lights, 1) };
        let most = LIGHTS[LIGHTS.len() - 1];
        let groups = lights.len().div_ceil(most);
        for (group, lights) in lights.chunks(most).enumerate() {
            let emission = |place: usize| lights.get(place).map_or(Vec3::ZERO, |light| light.0);
            let light = |place: usize| lights.get(place).unwrap_or(&lights[0]).1;
            let push = LightSumPush {
                count,
                adds: u32::from(group > 0),
                step,
                scale: if group + 1 == groups { scale } else { 1.0 },
                emission_0: emission(0),
                emission_1: emission(1),
                emission_2: emission(2),
                emission_3: emission(3),
                emission_4: emission(4),
                emission_5: emission(5),
                emission_6: emission(6),
                emission_7: emission(7),
            };
            if group > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            let pipeline = &self.pipelines[LIGHTS.partition_point(|&fewer| fewer < lights.len())];
            let bindings = [
                ("Light0", light(0)),
                ("Light1", light(1)),
                ("Light2", light(2)),
                ("Light3", light(3)),
                ("Light4", light(4)),
                ("Light5", light(5)),
                ("Light6", light(6)),
                ("Light7", light(7)),
                ("LightSums", sums),
            ];
            match counted {
                Some(groups) => pass.dispatch_indirect(pipeline, groups, &push, &bindings),
                None => pass.dispatch(pipeline, [count, 1, 1], &push, &bindings),
            };
        }
    }
}
