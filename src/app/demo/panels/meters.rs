//! The panel of light meters: what they read, what they should read, and the search for powers.

use egui::{CollapsingHeader, DragValue, RichText, Ui};
use glam::Vec3;

use super::light;
use crate::app::demo::meters::fresh;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Request, UiState};
use crate::renderer::Reading;
use crate::scene::meter::{Meter, MeterShape};

/// Draws the panel, which is open at first if the scene has meters.
pub(super) fn section(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let opens = std::mem::take(&mut ui_state.meters.opens);
    let drawn = CollapsingHeader::new(RichText::new("Light meters").strong())
        .default_open(!session.document.meters.is_empty())
        .open(opens.then_some(true))
        .show(ui, |ui| meters(ui, session, ui_state));
    ui_state.meters.is_open = drawn.body_returned.is_some();
    // Its button ends the painting.
    ui_state.meters.paints &= ui_state.meters.is_open;
}

fn meters(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let readings: Vec<Reading> = session.readings().to_vec();
    let origin = session.scene.origin.as_vec3();
    let mut removed = None;
    for (index, meter) in session.document.meters.iter_mut().enumerate() {
        let is_chosen = ui_state.meters.chosen == Some(index);
        ui.horizontal(|ui| {
            if ui.selectable_label(is_chosen, &meter.name).clicked() {
                ui_state.meters.chosen = (!is_chosen).then_some(index);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.small_button("✖").on_hover_text("Remove").clicked() {
                    removed = Some(index);
                }
                let wanted = ui_state.meters.wanted.entry(meter.name.clone()).or_insert(0.0);
                let value = DragValue::new(wanted)
                    .speed(5.0)
                    .range(0.0..=1e6)
                    .clamp_existing_to_range(false)
                    .update_while_editing(false)
                    .max_decimals(0);
                let text =
                    |value: f64, _| if value > 0.0 { format!("{value:.0} lx") } else { "–".to_owned() };
                ui.add(value.custom_formatter(text)).on_hover_text("Wanted mean; 0: any");
                ui.label("wanted");
            });
        });
        match readings.get(index) {
            Some(reading) => ui.label(words(reading)),
            None if ui_state.meters.paints => ui.small("Measured when the painting ends."),
            None => ui.small("Measured when the light paths are traced."),
        };
        if is_chosen {
            place(ui, meter, origin);
        }
    }
    if let Some(index) = removed {
        session.document.meters.remove(index);
        ui_state.meters.chosen = None;
    }
    adding(ui, session, ui_state);
    solving(ui, session, ui_state);
}

/// Mean, minimum and uniformity, as EN 12464-1 asks for them.
fn words(reading: &Reading) -> String {
    let solids = match reading.in_solids {
        0 => String::new(),
        count => format!(", {count} points in solids"),
    };
    let Reading { mean, min, max, .. } = reading;
    format!("{mean:.0} lx, {min:.0} to {max:.0}, uniformity {:.2}{solids}", reading.uniformity())
}

/// Draws the numbers of the chosen meter. Light paths are traced anew once an edit ends.
fn place(ui: &mut Ui, meter: &mut Meter, origin: Vec3) {
    match &mut meter.shape {
        MeterShape::Region { points } => {
            ui.small(format!("{} points", points.len()));
        }
        MeterShape::Point { position, .. } => light::place(ui, "Position", position, origin),
        MeterShape::Plane { corner, edge_u, edge_v, .. } => {
            let before = (*edge_u, *edge_v);
            light::place(ui, "Corner", corner, origin);
            light::place(ui, "Edge u", edge_u, Vec3::ZERO);
            light::place(ui, "Edge v", edge_v, Vec3::ZERO);
            if edge_u.cross(*edge_v).length() <= 1e-5 * edge_u.length() * edge_v.length() {
                // Parallel edges span no area.
                (*edge_u, *edge_v) = before;
            }
        }
    }
}

/// Draws the buttons that add a meter at the clicked place.
fn adding(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let added = ui.horizontal(|ui| {
        ui.label("Add");
        let is_there = ui_state.place.is_some();
        let mut button = |text, hint| {
            let button = ui.add_enabled(is_there, egui::Button::new(text).small());
            button.on_hover_text(hint).on_disabled_hover_text("Click a surface first").clicked()
        };
        let plane = button("plane", "On the clicked surface, a metre wide at most");
        let added = (plane || button("point", "On the clicked surface")).then_some(plane);
        let paints = ui_state.meters.paints;
        let brush = ui.selectable_label(paints, "region");
        let hint = "Paint it: drag over surfaces, with Ctrl to erase; measured when you click here again";
        if brush.on_hover_text(hint).clicked() {
            ui_state.meters.paints = !paints;
        }
        added
    });
    if let (Some(is_plane), Some(place)) = (added.inner, ui_state.place) {
        let (low, high) = session.scene.bounds();
        let meter =
            fresh(&session.document.meters, (place.position, place.normal), (high - low).length(), is_plane);
        session.document.meters.push(meter);
        ui_state.meters.chosen = Some(session.document.meters.len() - 1);
    }
}

/// Draws which lights may change, and the button that searches for their powers.
fn solving(ui: &mut Ui, session: &Session, ui_state: &mut UiState) {
    let meters = &mut ui_state.meters;
    if session.document.meters.is_empty() {
        return;
    }
    ui.collapsing("Lights that may change", |ui| {
        for entry in &session.document.lights {
            let mut may_change = !meters.kept.contains(&entry.id);
            if ui.checkbox(&mut may_change, &entry.light.name).changed() {
                match may_change {
                    true => meters.kept.remove(&entry.id),
                    false => meters.kept.insert(entry.id),
                };
            }
        }
    });
    let is_wanted = session.document.meters.iter().any(|meter| meters.wants(meter) > 0.0);
    let button = ui.add_enabled(is_wanted && session.renderer().is_some(), egui::Button::new("Find powers"));
    let hint = "Powers of the lights that give the wanted means; Ctrl+Z takes them back";
    if button.on_hover_text(hint).on_disabled_hover_text("Type a wanted illuminance first").clicked() {
        ui_state.requests.push(Request::Solve);
    }
}
