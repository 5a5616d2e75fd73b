//! What kernels say whose loops the device ended: lavapipe ends all of an invocation, without a
//! word, once they have run 65 535 times (`glsl/include/loop_limit.glsl`).

use crate::error::{Error, Result};

/// Refuses what a kernel found, if the device ended its loops.
///
/// # Errors
/// [`Error::OutOfMemory`] says what to do.
pub(super) fn refuse(is_truncated: bool, stem: &str, lights: u32) -> Result<()> {
    if !is_truncated {
        return Ok(());
    }
    // Each light takes a ray from where a ray ends.
    let hint = if lights > 16 { "use fewer lights, or triangles" } else { "use triangles" };
    Err(Error::OutOfMemory(format!(
        "`{stem}`: rays meet more of the scene than the device goes through at once; {hint} that lie over one another less, shorter ones"
    )))
}
