//! Errors for truncated loops (`MAX_LOOP_ITERATIONS` in `src/gpu/quirks.rs`).

use crate::error::{Error, Result};

/// Returns an error if the loops of a kernel were truncated.
///
/// # Errors
/// [`Error::OutOfMemory`] with a hint.
pub(super) fn refuse(is_truncated: bool, stem: &str, lights: u32) -> Result<()> {
    if !is_truncated {
        return Ok(());
    }
    // Each hit takes one shadow ray a light.
    let hint = if lights > 16 { "use fewer lights, or triangles" } else { "use triangles" };
    Err(Error::OutOfMemory(format!(
        "`{stem}`: rays meet more of the scene than the device goes through at once; {hint} that lie over one another less, shorter ones"
    )))
}
