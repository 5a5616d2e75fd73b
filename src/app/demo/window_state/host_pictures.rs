//! Pictures beside and over the main picture.

use super::{Over, WindowState};
use crate::app::demo::cells;
use crate::app::demo::light_map::LightMap;
use crate::app::demo::reference::Reference;
use crate::app::demo::ui_state::{Verdict, View};
use crate::app::false_colours::Scale;
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
            _ => found.display(&self.session.display),
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

    /// Updates the colours over the picture: of cells, or of illuminance and luminance.
    pub(super) fn colour_over(&mut self) -> Result<()> {
        let Some(renderer) = self.session.renderer() else {
            self.over.of = None;
            return Ok(());
        };
        let (version, size) = (self.session.version, renderer.size());
        let (of, pixels) = match self.ui_state.view {
            View::Cells(level) => {
                let of = Over::Cells(version, level);
                if self.over.of == Some(of) {
                    return Ok(());
                }
                (of, cells::colours(renderer, level, self.session.display.exposure_stops)?)
            }
            View::FalseColours(quantity) => {
                let light = match self.overlays.light.take().filter(|light| light.is_of(renderer, version)) {
                    Some(light) => light,
                    None => LightMap::new(renderer, version)?,
                };
                let values = light.values(quantity);
                let range = *self.ui_state.light_range.get_or_insert_with(|| Scale::of(values));
                let of = Over::Light(version, quantity, range);
                let is_shown = self.over.of == Some(of);
                let pixels = match is_shown {
                    true => Vec::new(),
                    false => values.iter().map(|&value| range.colour(value)).collect(),
                };
                self.overlays.light = Some(light);
                if is_shown {
                    return Ok(());
                }
                (of, pixels)
            }
            _ => {
                self.over.of = None;
                return Ok(());
            }
        };
        self.over.show(&self.context, &mut self.painter, of, size, &pixels)?;
        self.window.request_redraw();
        Ok(())
    }
}
