//! The panel that selects the picture's content.

use egui::{DragValue, Slider, Ui};

use super::{exposure, row, wipe};
use crate::app::demo::light_map::legend;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Beside, Request, UiState, Verdict, View};
use crate::app::false_colours::Quantity;
use crate::app::heatmap;

pub(super) fn views(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    ui.horizontal_wrapped(|ui| {
        let level = if let View::Cells(level) = ui_state.view { level } else { 0 };
        for (view, name) in [
            (View::Beauty, "Picture"),
            (View::Direct, "Direct"),
            (View::Indirect, "Indirect"),
            (View::CachePoints, "Cache points"),
            (View::Cells(level), "Cells"),
            (View::Inspect, "Rays and paths"),
            (View::FalseColours(Quantity::Lux), "Illuminance"),
            (View::FalseColours(Quantity::Nits), "Luminance"),
        ] {
            if ui.selectable_value(&mut ui_state.view, view, name).changed() {
                ui_state.light_range = None;
            }
        }
    });
    if let (View::FalseColours(quantity), Some(range)) = (ui_state.view, &mut ui_state.light_range) {
        legend(ui, *range, quantity);
        let mut fits = false;
        row(ui, "Range", |ui| {
            let value = |value| {
                DragValue::new(value)
                    .range(0.0..=1e9)
                    .clamp_existing_to_range(false)
                    .update_while_editing(false)
                    .max_decimals(3)
            };
            let speed = 0.01 * range.high;
            ui.add(value(&mut range.low).speed(speed));
            ui.label("to");
            ui.add(value(&mut range.high).speed(speed));
            fits = ui.button("Fit").on_hover_text("Three decades up to the picture's brightest").clicked();
        });
        range.high = range.high.max(1e-6);
        range.low = range.low.min(0.9 * range.high);
        ui.small("Logarithmic; linear from 0. The pointer shows values.");
        let hint = "At the pointer; a frame for each light once nothing moves";
        ui.checkbox(&mut ui_state.shows_contributions, "Percentage of each light").on_hover_text(hint);
        if fits {
            ui_state.light_range = None;
        }
    }
    if let View::Cells(level) = &mut ui_state.view {
        let levels = session.renderer().map_or(1, crate::renderer::Renderer::hvds_level_count);
        row(ui, "Level", |ui| {
            ui.add(Slider::new(level, 0..=levels.saturating_sub(1)).clamping(egui::SliderClamping::Edits))
        });
        if let Some(renderer) = session.renderer() {
            ui.small(format!("Cells of {:.3} m", renderer.hvds_cell_size_m(*level)));
        }
    }
    if ui_state.view == View::Inspect && ui_state.place.is_none() {
        ui.small(
            "Click a surface: gather rays of the nearest cache point, light path of the nearest entry point.",
        );
    }
    exposure::exposure(ui, session, ui_state);
    row(ui, "Resolution", |ui| {
        for (scale, name) in [(1.0, "full"), (0.5, "half"), (0.25, "quarter")] {
            ui.selectable_value(&mut ui_state.scale, scale, name);
        }
    });
    let mut vsync = ui_state.vsync;
    if ui.checkbox(&mut vsync, "Wait for the screen").changed() {
        ui_state.requests.push(Request::Vsync);
    }
    monte_carlo(ui, ui_state);
}

/// Draws the comparison with Monte Carlo.
fn monte_carlo(ui: &mut Ui, ui_state: &mut UiState) {
    let mut compares = ui_state.shows_monte_carlo();
    if ui.checkbox(&mut compares, "Compare with Monte Carlo (M)").changed() {
        ui_state.split = compares.then_some(ui_state.split.unwrap_or(0.5));
        ui_state.beside = Beside::MonteCarlo;
    }
    if !ui_state.shows_monte_carlo() {
        return;
    }
    wipe(ui, ui_state);
    let mut shows_error = ui_state.beside == Beside::Error;
    if ui.checkbox(&mut shows_error, "Our error in its place (7)").changed() {
        ui_state.beside = if shows_error { Beside::Error } else { Beside::MonteCarlo };
    }
    if shows_error {
        ui.small(heatmap::RELATIVE_SCALE);
    }
    match ui_state.verdict {
        Some(Verdict { samples, relmse, uncertainty, noise }) => {
            ui.label(format!("ours: relMSE {relmse:.1e} ± {uncertainty:.0e}"));
            ui.label(format!("Monte Carlo: {samples} samples a pixel, noise {noise:.1e}"));
        }
        None => drop(ui.small("Monte Carlo begins.")),
    }
}
