//! Own records of the view: how long their rays take once, and what they add to a frame.

use std::time::Instant;

use serde::Serialize;

use super::measure::Summary;
use super::text::{line, milliseconds};
use crate::error::Result;
use crate::renderer::{Renderer, Work};

/// Own records, and frames with a moved light.
#[derive(Serialize)]
pub(super) struct Refined {
    count: u32,
    /// Wall-clock time until the picture with own records, seconds.
    seconds: f64,
    /// Device time of a frame without own records, milliseconds.
    without_ms: Summary,
    /// The same with them.
    with_ms: Summary,
}

/// Times frames of a moved light before and after the view gets own records. `None` if it has none.
pub(super) fn measure(renderer: &mut Renderer, frames: usize) -> Result<Option<Refined>> {
    // The view of before has no own records.
    renderer.force(Work::View);
    renderer.frame()?;
    if !renderer.may_refine() {
        return Ok(None);
    }
    let without_ms = lit(renderer, frames)?;
    let start = Instant::now();
    let count = renderer.refine()?;
    renderer.frame()?;
    let seconds = start.elapsed().as_secs_f64();
    let with_ms = lit(renderer, frames)?;
    Ok((count > 0).then_some(Refined { count, seconds, without_ms, with_ms }))
}

/// Device time of frames with a moved light.
fn lit(renderer: &mut Renderer, frames: usize) -> Result<Summary> {
    let mut times_ms = Vec::with_capacity(frames);
    for _ in 0..frames {
        renderer.force(Work::Light(0));
        times_ms.push(renderer.frame()?.device_ms);
    }
    Ok(Summary::from_times(times_ms))
}

impl Refined {
    /// Adds the lines.
    pub(super) fn write(&self, text: &mut String) {
        let Self { count, seconds, without_ms, with_ms } = self;
        let [without, with] = [without_ms, with_ms].map(|times| milliseconds(times.median));
        line(text, format_args!("\nown records: {count}, once a view, in {seconds:.2} s"));
        line(text, format_args!("Tlight with them {with} ms, without {without} ms"));
    }
}
