//! Pass replay: one pass of the frame recorded again and again, for a profiler.

use super::dirty::Work;
use super::passes::{self, PASSES};
use super::report::{Columns, FrameWatch};
use super::{FrameReport, Renderer};
use crate::error::Result;

#[doc(hidden)]
impl Renderer {
    /// Names of all passes that frames may have. The scene determines the passes of a frame.
    pub fn pass_names() -> impl Iterator<Item = &'static str> + Clone {
        PASSES.iter().map(|pass| pass.stem)
    }

    /// Records all occurrences of one pass as in a frame with all results stale. The report also
    /// holds the pass that must precede it; all other results stay. The previous frame must have
    /// computed everything; the next one does. Panics if no pass has this name.
    ///
    /// # Errors
    /// The device failed.
    pub fn replay(&mut self, pass: &str) -> Result<FrameReport> {
        let pass = passes::named(pass);
        let recorded: Vec<&'static str> = pass.renewed_by.into_iter().chain([pass.stem]).collect();
        self.force(Work::Everything);
        let plan = self.plan();
        self.lights.prepare_near(&plan, &mut self.transport.near_lights)?;
        let watch = FrameWatch::start(&self.context);
        let ((), passes) = self.context.run(|rec| {
            rec.only(&recorded);
            self.record(rec, &plan);
        })?;
        let (bytes, rays) = self.costs(&plan, &passes);
        let [frame_ms, pipelines_ms] = watch.stop(&self.context);
        Ok(FrameReport {
            columns: Columns::from_passes(&passes),
            passes,
            frame_ms,
            pipelines_ms,
            bytes,
            rays,
            counts: self.frame_counts(&plan),
            gathered: 0,
            lights_unchanged: [0.0, 0.0],
            device_ms: 0.0,
            needs_precompute: false,
        })
    }
}
