//! Pictures beside and over the main picture.

use super::WindowState;
use crate::app::demo::cells;
use crate::app::demo::reference::Reference;
use crate::app::demo::ui_state::{Verdict, View};
use crate::app::heatmap;
use crate::error::Result;
use crate::metrics::{NoisyError, half_noise};
use crate::renderer::Layer;

impl WindowState {
    /// Shows the newest Monte Carlo picture, or our error against it, while the split view is on.
    pub(super) fn follow_reference(&mut self) -> Result<()> {
        self.leaving.take_if(|leaving| leaving.has_ended());
        if self.ui_state.split.is_none() {
            (self.beside.of, self.ui_state.verdict) = (None, None);
            if let Some(mut reference) = self.reference.take() {
                reference.stop();
                self.leaving = Some(reference);
            }
            return Ok(());
        }
        if self.session.renderer().is_none() {
            return Ok(());
        }
        if self.leaving.is_some() {
            // One tracer at a time: the device may lack memory for two.
            return Ok(());
        }
        if self.reference.is_none() {
            self.reference = Some(Reference::new(&self.context, &self.wake)?);
        }
        let Some(reference) = &mut self.reference else { return Ok(()) };
        if reference.follow(&self.session) {
            (self.beside.of, self.ui_state.verdict) = (None, None);
        }
        let shows_error = self.ui_state.shows_error;
        if !reference.advance()? && self.beside.of == Some(shows_error) {
            return Ok(());
        }
        let Some(found) = reference.newest() else { return Ok(()) };
        let halves = [&found.halves[0][..], &found.halves[1][..]];
        let error = match self.session.renderer() {
            Some(renderer) if renderer.size() == found.size => {
                Some(NoisyError::new(&renderer.layer(Layer::Beauty)?, halves))
            }
            _ => None,
        };
        let pixels = match &error {
            Some(error) if shows_error => heatmap::of_relative_error(&error.map(found.size)),
            _ => found.display(self.session.exposure_stops),
        };
        self.beside.show(&self.context, &mut self.painter, shows_error, found.size, &pixels)?;
        self.ui_state.verdict = error.map(|error| Verdict {
            samples: found.samples,
            relmse: error.relmse(),
            uncertainty: error.uncertainty(),
            noise: half_noise(halves),
        });
        Ok(())
    }

    /// Updates the cell colours if the cell view is on.
    pub(super) fn colour_cells(&mut self) -> Result<()> {
        let (View::Cells(level), Some(renderer)) = (self.ui_state.view, self.session.renderer()) else {
            self.over.of = None;
            return Ok(());
        };
        let of = (self.session.version, level);
        if self.over.of != Some(of) {
            let pixels = cells::colours(renderer, level, self.session.exposure_stops)?;
            self.over.show(&self.context, &mut self.painter, of, renderer.size(), &pixels)?;
            self.window.request_redraw();
        }
        Ok(())
    }
}
