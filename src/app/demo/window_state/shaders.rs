//! Reloaded shaders in the window.

use std::time::Instant;

use super::WindowState;
use crate::error::{Error, Result};
use crate::passes::reference::path_trace::PathTrace;

/// Number of shaders that a note names.
const NAMED: usize = 3;

impl WindowState {
    /// Reloads the shaders whose sources have changed, and requests what they compute anew. If they
    /// cannot be reloaded, an alarm gives the reason.
    pub(super) fn follow_shaders(&mut self, now: Instant) -> Result<()> {
        let Some(shaders) = &mut self.shaders else { return Ok(()) };
        match shaders.look(&self.context, now) {
            Ok(stems) if stems.is_empty() => Ok(()),
            Ok(stems) => self.on_shaders(&stems),
            Err(Error::Usage(why)) => {
                self.tell_alarm(&Error::Usage(format!("shaders not reloaded: {why}")));
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    fn on_shaders(&mut self, stems: &[&str]) -> Result<()> {
        let named = stems.iter().take(NAMED).copied().collect::<Vec<_>>().join(", ");
        let more = match stems.len().saturating_sub(NAMED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let retraces = self.session.shaders_replaced(stems)?;
        self.was_ready &= !retraces;
        if stems.contains(&PathTrace::STEM) {
            self.restart_reference();
        }
        let traced = if retraces { "; light paths are traced again" } else { "" };
        self.tell(format!("shaders reloaded: {named}{more}{traced}"));
        Ok(())
    }
}
