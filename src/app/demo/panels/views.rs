//! The panel that selects the picture's content.

use egui::{DragValue, Slider, Ui};

use super::row;
use crate::app::demo::light_map::legend;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Request, UiState, Verdict, View};
use crate::app::false_colours::Quantity;
use crate::app::heatmap;

const EXPOSURE: std::ops::RangeInclusive<f32> = -10.0..=10.0;

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
            let value = |value| DragValue::new(value).range(0.0..=1e9).max_decimals(3);
            let speed = 0.01 * range.high;
            ui.add(value(&mut range.low).speed(speed));
            ui.label("to");
            ui.add(value(&mut range.high).speed(speed));
            fits = ui.button("Fit").on_hover_text("Three decades up to the picture's brightest").clicked();
        });
        range.high = range.high.max(1e-6);
        range.low = range.low.min(0.9 * range.high);
        ui.small("Logarithmic; linear from 0. The pointer shows values.");
        if fits {
            ui_state.light_range = None;
        }
    }
    if let View::Cells(level) = &mut ui_state.view {
        let levels = session.renderer().map_or(1, crate::renderer::Renderer::hvds_level_count);
        row(ui, "Level", |ui| ui.add(Slider::new(level, 0..=levels.saturating_sub(1))));
        if let Some(renderer) = session.renderer() {
            ui.small(format!("Cells of {:.3} m", renderer.hvds_cell_size_m(*level)));
        }
    }
    if ui_state.view == View::Inspect && ui_state.place.is_none() {
        ui.small(
            "Click a surface: gather rays of the nearest cache point, light path of the nearest entry point.",
        );
    }
    let stops = &mut session.display.exposure_stops;
    row(ui, "Exposure", |ui| ui.add(Slider::new(stops, EXPOSURE).step_by(0.25).suffix(" stops")));
    row(ui, "Resolution", |ui| {
        for (scale, name) in [(1.0, "full"), (0.5, "half"), (0.25, "quarter")] {
            ui.selectable_value(&mut ui_state.scale, scale, name);
        }
    });
    let mut vsync = ui_state.vsync;
    if ui.checkbox(&mut vsync, "Wait for the screen").changed() {
        ui_state.requests.push(Request::Vsync);
    }
    let mut compares = ui_state.split.is_some();
    if ui.checkbox(&mut compares, "Compare with Monte Carlo (M)").changed() {
        ui_state.split = compares.then_some(0.5);
    }
    if let Some(wipe) = &mut ui_state.split {
        row(ui, "Wipe", |ui| ui.add(Slider::new(wipe, 0.0..=1.0).show_value(false)));
        ui.checkbox(&mut ui_state.shows_error, "Our error in its place (7)");
        if ui_state.shows_error {
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
}
