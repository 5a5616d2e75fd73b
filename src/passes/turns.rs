//! What kernels say whose loops the device ended: lavapipe ends all of an invocation, without a word, once they have turned 65 535 times
//! (`glsl/include/turns.glsl`).

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context};
use crate::types::CUT_SHORT;
use std::sync::Arc;

/// Refuses what a kernel found, if the device ended its loops.
///
/// # Errors
/// [`Error::OutOfMemory`] says what to do.
pub(super) fn refuse(is_cut_short: bool, stem: &str, lights: u32) -> Result<()> {
    if !is_cut_short {
        return Ok(());
    }
    // Each light takes a ray from where a ray ends.
    let advice = if lights > 16 { "use fewer lights, or triangles" } else { "use triangles" };
    Err(Error::OutOfMemory(format!(
        "`{stem}`: rays meet more of the scene than the device goes through at once; {advice} that lie over one another less, shorter ones"
    )))
}

/// A word for kernels that have no other: [`CUT_SHORT`] once some invocation was.
pub(super) struct Word(pub(super) Buffer);

impl Word {
    pub(super) fn new(context: &Arc<Context>) -> Result<Self> {
        Ok(Self(Buffer::from_slice(context, "cut short", &[0_u32])?))
    }

    /// As [`refuse`], by what the word says.
    pub(super) fn check(&self, stem: &str, lights: u32) -> Result<()> {
        refuse(self.0.read::<u32>()?[0] == CUT_SHORT, stem, lights)
    }
}
