//! Light meters of the session: readings of the shown picture, and powers that give wanted ones.

use std::collections::HashSet;

use super::{Session, Stage};
use crate::app::meters::Goal;
use crate::error::{Error, Result};
use crate::renderer::{Measured, Reading};

impl Session {
    /// Readings of all meters, of the last picture that was measured. Empty until then.
    pub(in crate::app::demo) fn readings(&self) -> &[Reading] {
        self.readings.as_ref().map_or(&[], |(_, readings)| readings)
    }

    /// Measures the picture once, when nothing moves. Returns whether it did.
    pub(in crate::app::demo) fn follow_readings(&mut self) -> Result<bool> {
        let Stage::Ready(ready) = &self.stage else {
            self.readings = None;
            return Ok(false);
        };
        let is_known = self.readings.as_ref().is_some_and(|(version, _)| *version == self.version);
        let is_shown = self.shown.as_ref() == Some(&self.requested());
        if is_known || self.is_held || !is_shown || self.recorded.is_some() {
            return Ok(false);
        }
        let scene = ready.renderer.scene();
        if scene.meters != self.document.meters {
            self.readings = None;
            return Ok(false);
        }
        let points = ready.renderer.measured()?;
        let readings = Measured::by_meter(scene, &points).into_iter().map(Reading::new).collect();
        self.readings = Some((self.version, readings));
        Ok(true)
    }

    /// Changes the powers of lights so that meters have the wanted means, as one undo step.
    /// `wanted`: meter and lx. Lights that are `kept` stay. Returns a line for each meter.
    ///
    /// # Errors
    /// There are no light paths, no wishes or no lights that may change; or the device failed.
    pub(in crate::app::demo) fn find_powers(
        &mut self,
        wanted: &[(usize, f64)],
        kept: &HashSet<u64>,
    ) -> Result<Vec<String>> {
        let refuse = |why: &str| Err(Error::Usage(why.to_owned()));
        self.end_frames(0)?;
        let Stage::Ready(ready) = &mut self.stage else {
            return refuse("powers can be found when the light paths are traced");
        };
        if ready.renderer.scene().meters != self.document.meters || wanted.is_empty() {
            return refuse("powers can be found when the meters are measured and an illuminance is wanted");
        }
        let goals: Vec<Goal> = wanted.iter().map(|&(meter, lux)| Goal { meter, lux }).collect();
        // The search switches lights, which the next frame sets right.
        self.shown = None;
        let (ids, found) = ready.find_powers(&goals, kept)?;
        for (id, &(_, kind, factor)) in ids.iter().zip(&found.lights) {
            if let Some(entry) = self.document.lights.iter_mut().find(|entry| entry.id == *id) {
                if factor > 0.0 {
                    entry.light.kind = kind;
                } else {
                    entry.light.is_on = false;
                }
            }
        }
        self.history.settle(&self.document);
        let meters = &self.document.meters;
        Ok(goals.iter().zip(&found.rendered).map(|(goal, rendered)| goal.said(meters, *rendered)).collect())
    }
}
