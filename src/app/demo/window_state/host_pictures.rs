//! Pictures beside and over the main picture.

use super::{Over, WindowState};
use crate::app::demo::cells;
use crate::app::demo::levels::{Levels, zebra};
use crate::app::demo::light_map::LightMap;
use crate::app::demo::reference::Reference;
use crate::app::demo::ui_state::{Beside, Verdict, View};
use crate::app::false_colours::Scale;
use crate::app::heatmap;
use crate::error::{Error, Result};
use crate::metrics::{NoisyError, half_noise};
use crate::renderer::Layer;

impl WindowState {
    /// Shows the newest Monte Carlo picture, or our error against it, while the split view is on.
    pub(super) fn follow_reference(&mut self) -> Result<()> {
        self.leaving.take_if(|leaving| leaving.has_ended());
        if !self.ui_state.shows_monte_carlo() {
            self.ui_state.verdict = None;
            if let Some(mut reference) = self.reference.take() {
                reference.stop();
                self.leaving = Some(reference);
            }
            return self.follow_snapshot();
        }
        if matches!(self.beside.of, Some((Beside::Snapshot(_), _))) {
            self.beside.of = None;
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
        let of = (self.ui_state.beside, self.session.display);
        if !reference.advance()? && self.beside.of == Some(of) {
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
            Some(error) if of.0 == Beside::Error => heatmap::of_relative_error(&error.map(found.size)),
            _ => found.display(&self.session.display),
        };
        self.beside.show(&self.context, &mut self.painter, of, found.size, &pixels)?;
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

    /// Finds what each light contributes, if the pointer shows it.
    pub(super) fn follow_contributions(&mut self) -> Result<()> {
        if !self.ui_state.shows_contributions || !matches!(self.ui_state.view, View::FalseColours(_)) {
            return Ok(());
        }
        match self.session.follow_contributions() {
            Ok(true) => self.window.request_redraw(),
            Ok(false) => (),
            Err(error) => {
                self.ui_state.shows_contributions = false;
                match error {
                    Error::Usage(_) => self.tell_alarm(&error),
                    error => return Err(error),
                }
            }
        }
        Ok(())
    }

    /// Reads the light meters, if their panel is open.
    pub(super) fn follow_readings(&mut self) -> Result<()> {
        if self.ui_state.meters.is_open && self.session.follow_readings()? {
            self.window.request_redraw();
        }
        Ok(())
    }

    /// Updates the stripes and the histogram of the picture.
    pub(super) fn follow_levels(&mut self) -> Result<()> {
        let (version, ui_state) = (self.session.version, &mut self.ui_state);
        let Some(renderer) = self.session.renderer() else {
            (self.zebra.of, ui_state.levels) = (None, None);
            return Ok(());
        };
        self.zebra.of = self.zebra.of.filter(|_| ui_state.shows_zebra);
        ui_state.levels.take_if(|_| !ui_state.shows_histogram);
        let lacks_zebra = ui_state.shows_zebra && self.zebra.of != Some(version);
        let is_new = |levels: &Levels| levels.version == version;
        let lacks_levels = ui_state.shows_histogram && !ui_state.levels.as_ref().is_some_and(is_new);
        if !lacks_zebra && !lacks_levels {
            return Ok(());
        }
        let codes = renderer.display()?;
        if lacks_levels {
            let layer = match ui_state.view {
                View::Direct => Layer::Direct,
                View::Indirect => Layer::Indirect,
                _ => Layer::Beauty,
            };
            let radiance = renderer.layer(layer)?;
            let display = self.session.display.constants();
            ui_state.levels = Some(Levels::new(version, &radiance, &codes, &display));
        }
        if lacks_zebra {
            let size = renderer.size();
            let stripes = zebra(&codes, size);
            self.zebra.show(&self.context, &mut self.painter, version, size, &stripes)?;
        }
        self.window.request_redraw();
        Ok(())
    }
}
