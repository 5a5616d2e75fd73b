//! One light as the input of a pass, and how its work is split into dispatches.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::types::{LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_POINT, LIGHT_SPOT, LightSource};

/// Point samples of a light in one dispatch. More would exceed the watchdog of a slow device, and
/// the iteration limit ([`crate::gpu::MAX_LOOP_ITERATIONS`]).
const SAMPLES_A_DISPATCH: u32 = 8;

/// One light of the table.
#[derive(Clone, Copy)]
pub struct OneLight<'a> {
    /// Table of `LightSource`s.
    pub table: &'a Buffer,
    /// Index in the table.
    pub index: u32,
    /// One of the constants `LIGHT_*`.
    pub kind: u32,
    /// Number of its point samples.
    pub samples: u32,
    /// Traces rays although they cannot bring light: from points that face away or stand outside
    /// the light's cone.
    pub traces_all: bool,
}

impl<'a> OneLight<'a> {
    /// The light at `index`. Rays are traced only if they can bring light.
    pub fn new(table: &'a Buffer, index: u32, source: &LightSource) -> Self {
        Self { table, index, kind: source.kind, samples: source.samples, traces_all: false }
    }

    /// Ranges of samples by dispatch: the first and one past the last. The first dispatch writes,
    /// later ones add.
    pub fn spans(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let samples = self.samples;
        let firsts = (0..samples).step_by(SAMPLES_A_DISPATCH as usize);
        firsts.map(move |first| (first, samples.min(first + SAMPLES_A_DISPATCH)))
    }
}

/// A kernel for one light, specialised to each kind of light: see `glsl/include/light_kind.glsl`.
pub struct LightKernel([Pipeline; 4]);

impl LightKernel {
    /// Creates the pipelines of the shader with that stem, as [`Pipeline::new`] does.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>, stem: &'static str, constants: &[(&str, u32)]) -> Result<Self> {
        let of_kind = |kind| Pipeline::new(context, stem, &[constants, &[("LIGHT_KIND", kind)]].concat());
        Ok(Self([
            of_kind(LIGHT_POINT)?,
            of_kind(LIGHT_SPOT)?,
            of_kind(LIGHT_AREA)?,
            of_kind(LIGHT_DIRECTIONAL)?,
        ]))
    }

    /// The kernel for a light. Panics if there is no such kind.
    pub fn of(&self, light: OneLight<'_>) -> &Pipeline {
        &self.0[light.kind as usize]
    }
}
