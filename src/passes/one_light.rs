//! A light whose rows a pass traces, and how the work is cut into dispatches.

use crate::gpu::Buffer;

/// Point samples of a light that one dispatch takes: more would keep a slow device busy for longer than watchdogs bear,
/// and turn one shader's loops more often than lavapipe lets them.
const SAMPLES_A_DISPATCH: u32 = 8;

/// One light of the table.
#[derive(Clone, Copy)]
pub struct OneLight<'a> {
    /// `LightSource`s.
    pub table: &'a Buffer,
    /// Which.
    pub index: u32,
    /// Point samples that stand for it.
    pub samples: u32,
    /// Traces rays although they cannot bring light: from points that face away or stand outside the light's cone.
    pub traces_all: bool,
}

impl OneLight<'_> {
    /// The samples by dispatch: the first and the one behind the last. The first dispatch writes, later ones add.
    pub fn spans(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let samples = self.samples;
        let firsts = (0..samples).step_by(SAMPLES_A_DISPATCH as usize);
        firsts.map(move |first| (first, samples.min(first + SAMPLES_A_DISPATCH)))
    }
}
