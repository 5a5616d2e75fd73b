//! What each light contributes to the illuminance of the picture.

use super::{Session, Stage};
use crate::app::false_colours::values;
use crate::error::{Error, Result};

/// Largest number of stored values, 256 MiB: lights times pixels.
const MAX_VALUES: usize = 1 << 26;

/// Illuminance by one light.
pub(in crate::app::demo) struct Contribution {
    pub(in crate::app::demo) light: String,
    /// Of each pixel, lx, row by row from the top.
    pub(in crate::app::demo) lux: Vec<f32>,
}

impl Session {
    /// Contributions to the shown picture. Empty until they are found.
    pub(in crate::app::demo) fn contributions(&self) -> &[Contribution] {
        let found = self.contributions.as_ref().filter(|(of, _)| self.shown.as_ref() == Some(of));
        found.map_or(&[], |(_, contributions)| contributions)
    }

    /// Finds the contributions once for a picture at rest, with a frame for each light. Returns
    /// whether it did.
    ///
    /// # Errors
    /// [`Error::Usage`] for too many lights or pixels; or the device failed.
    pub(in crate::app::demo) fn follow_contributions(&mut self) -> Result<bool> {
        let requested = self.requested();
        let is_shown = self.shown.as_ref() == Some(&requested);
        let is_known = self.contributions.as_ref().is_some_and(|(of, _)| *of == requested);
        let Stage::Ready(ready) = &mut self.stage else { return Ok(false) };
        if is_known || self.is_held || !is_shown || self.recorded.is_some() {
            return Ok(false);
        }
        let size = ready.renderer.size().map(|side| side as usize);
        let active = ready.renderer.scene().lights.iter().filter(|light| light.is_active()).count();
        if active * size[0] * size[1] > MAX_VALUES {
            let why = format!("{active} lights are too many for a picture of this size");
            return Err(Error::Usage(format!("the contributions of lights are not shown: {why}")));
        }
        self.end_frames(0)?;
        let Stage::Ready(ready) = &mut self.stage else { return Ok(false) };
        let found = ready.renderer.light_irradiances()?;
        let lights = &ready.renderer.scene().lights;
        let contribution = |(light, irradiance): (usize, Vec<[f32; 3]>)| Contribution {
            light: lights[light].name.clone(),
            lux: values(&irradiance).into_iter().map(|lux| lux as f32).collect(),
        };
        self.contributions = Some((requested, found.into_iter().map(contribution).collect()));
        // Frames of other lights were shown.
        self.shown = None;
        Ok(true)
    }
}
