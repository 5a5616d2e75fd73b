//! Density estimate at the irradiance points. [Christensen 1999] In: points, their reach and mass
//! (m²), photons. Out: W/m².

use crate::error::Result;
use crate::gpu::{Buffer, Context, MAX_LOOP_ITERATIONS, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::precompute::Chunks;
use crate::passes::reference::photon_map::{PhotonGrid, PhotonMap};
use std::sync::Arc;

gpu_struct! {
    pub struct PhotonIrradiancePush {
        /// The cells of the map.
        pub grid: PhotonGrid,
        /// Radius of the kernel, metres.
        pub radius: f32,
        /// First point of this dispatch.
        pub first_point: u32,
        /// One past the last.
        pub end_point: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[PhotonIrradiancePush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "photon_irradiance";

/// Maximum number of photons of one bucket in an estimate; a random fraction represents more.
pub const MAX_PHOTONS: u32 = 1024;
// An estimate reads 27 buckets.
const _: () = assert!(27 * MAX_PHOTONS < MAX_LOOP_ITERATIONS);

/// The irradiance points.
#[derive(Clone, Copy)]
pub struct Points<'a> {
    /// A `MapEntry` for each photon.
    pub entries: &'a Buffer,
    /// Sixteen bytes a point.
    pub reaches: &'a Buffer,
    /// Number of irradiance points.
    pub count: u32,
}

/// The pipeline of the density estimate.
pub struct PhotonIrradiance {
    context: Arc<Context>,
    pipeline: Pipeline,
    chunks: Chunks,
}

impl PhotonIrradiance {
    /// Creates the pipeline.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &[("MAX_PHOTONS", MAX_PHOTONS)])?,
            chunks: Chunks::new(1 << 10, u32::MAX),
        })
    }

    /// Sums the photons of `map` around each point, and divides by `masses`. Adds the device time
    /// in milliseconds to `ms`.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    #[expect(clippy::too_many_arguments, reason = "two calls, at one place")]
    pub fn estimate(
        &mut self,
        points: Points<'_>,
        map: &PhotonMap,
        grid: PhotonGrid,
        radius: f32,
        masses: &Buffer,
        irradiances: &Buffer,
        ms: &mut f64,
    ) -> Result<()> {
        self.chunks.run(points.count, |first, chunk| {
            let push = PhotonIrradiancePush { grid, radius, first_point: first, end_point: first + chunk };
            let ((), timings) = self.context.run(|rec| {
                rec.pass(STEM).dispatch(
                    &self.pipeline,
                    [chunk, 1, 1],
                    &push,
                    &[
                        ("Points", points.entries),
                        ("Reaches", points.reaches),
                        ("MapEntries", &map.entries),
                        ("EntryOffsets", &map.entry_offsets),
                        ("Masses", masses),
                        ("Irradiances", irradiances),
                    ],
                );
            })?;
            *ms += timings[0].ms;
            Ok(timings[0].ms)
        })
    }
}
