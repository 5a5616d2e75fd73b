//! The exposure of the picture: measured at the start, locked, or following every picture.

use super::Session;
use crate::app::exposure::Exposure;

impl Session {
    /// Whether the exposure follows every picture.
    pub(in crate::app::demo) fn follows_exposure(&self) -> bool {
        self.follows_exposure
    }

    /// Locks the exposure, or lets it follow every picture from the shown one on.
    pub(in crate::app::demo) fn follow_exposure(&mut self, follows: bool) {
        self.unmetered = None;
        if follows && !self.follows_exposure {
            // Renders again, because a frame is measured when it ends.
            self.shown = None;
        }
        self.follows_exposure = follows;
    }

    /// Exposes the picture by hand, and locks the exposure.
    pub(in crate::app::demo) fn expose(&mut self, stops: f32) {
        self.follow_exposure(false);
        self.display.exposure_stops = stops;
    }

    /// Exposes the picture by its mean, if the exposure follows it, or at the start.
    pub(super) fn meter(&mut self, pixels: &[[f32; 3]]) {
        let is_starting = self.unmetered == Some(self.display.exposure_stops);
        if !is_starting && !self.follows_exposure {
            return;
        }
        let (stops, said) = Exposure::Auto.stops(pixels);
        if is_starting {
            (self.metered, self.unmetered) = (said, Some(stops));
        }
        self.display.exposure_stops = stops;
    }
}
