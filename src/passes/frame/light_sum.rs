//! Sums of the lights' buffers, weighted by the emissions: a change of colour traces no ray. In: a
//! buffer (row) for each light, per unit emission. Out: sums.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    pub struct LightSumPush {
        /// Values of a row.
        pub count: u32,
        /// 1: adds to the sums so far; 0: starts from zero.
        pub adds: u32,
        /// Stride of the values of a row; 0 if no light is active.
        pub step: u32,
        /// Factor of the whole sum.
        pub scale: f32,
        /// Emission of the first row's light.
        pub emission_0: Vec3,
        /// Emission of the second row's light; zero for an unused row.
        pub emission_1: Vec3,
        /// Emission of the third.
        pub emission_2: Vec3,
        /// Emission of the fourth.
        pub emission_3: Vec3,
        /// Emission of the fifth; unused, like the following ones, with up to four rows.
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

/// Numbers of rows that one dispatch reads. Unused rows cost reads, but further dispatches would
/// pass the sums through memory.
const ROWS: [usize; 4] = [1, 2, 4, 8];

/// Values that a workgroup sums.
pub const GROUP_VALUES: u32 = 64;

/// Pipelines that sum the buffers of lights.
pub struct LightSum {
    pipelines: [Pipeline; ROWS.len()],
    /// The row for a scene without active light: one dark value.
    no_row: Buffer,
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

    /// Prepares sums of `ClusterLayer`s, which yield `ClusterFlux`es.
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
        let pipeline = |rows: usize| Pipeline::new(context, shader, &[("ROWS", rows as u32)]);
        let [one, two, four, eight] = ROWS.map(pipeline);
        // As large as the largest value.
        let no_row = Buffer::from_slice(context, "no row", &[0.0_f32; 4])?;
        Ok(Self { pipelines: [one?, two?, four?, eight?], no_row })
    }

    /// Sums the first `count` values of every row, in order, each times its light's emission, and
    /// scales the sum; it is zero without rows. Records into an open pass with barriers between
    /// its own dispatches.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        rows: &[(Vec3, &Buffer)],
        count: u32,
        scale: f32,
        sums: &Buffer,
    ) {
        self.record_counted(pass, rows, (count, None), scale, sums);
    }

    /// As [`Self::record`], of at most `count` values. If `counted` is given, the device has stored
    /// the number of workgroups, of [`GROUP_VALUES`] values each, at that offset of the buffer.
    pub fn record_counted(
        &self,
        pass: &mut PassScope<'_>,
        rows: &[(Vec3, &Buffer)],
        (count, counted): (u32, Option<(&Buffer, u64)>),
        scale: f32,
        sums: &Buffer,
    ) {
        let no_rows = [(Vec3::ZERO, &self.no_row)];
        let (rows, step) = if rows.is_empty() { (&no_rows[..], 0) } else { (rows, 1) };
        let most = ROWS[ROWS.len() - 1];
        let groups = rows.len().div_ceil(most);
        for (group, rows) in rows.chunks(most).enumerate() {
            let emission = |place: usize| rows.get(place).map_or(Vec3::ZERO, |row| row.0);
            let row = |place: usize| rows.get(place).unwrap_or(&rows[0]).1;
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
            let pipeline = &self.pipelines[ROWS.partition_point(|&fewer| fewer < rows.len())];
            let bindings = [
                ("Row0", row(0)),
                ("Row1", row(1)),
                ("Row2", row(2)),
                ("Row3", row(3)),
                ("Row4", row(4)),
                ("Row5", row(5)),
                ("Row6", row(6)),
                ("Row7", row(7)),
                ("LightSums", sums),
            ];
            match counted {
                Some(groups) => pass.dispatch_indirect(pipeline, groups, &push, &bindings),
                None => pass.dispatch(pipeline, [count, 1, 1], &push, &bindings),
            };
        }
    }
}
