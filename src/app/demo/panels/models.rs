//! The list of models: shown or hidden, moved, turned, added, removed.

use std::path::Path;

use egui::{DragValue, TextEdit, Ui};
use glam::{DVec3, Vec3};

use super::row;
use crate::app::demo::actions;
use crate::app::demo::dialogs::Purpose;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Chosen, Request, UiState};
use crate::scene::save::SceneText;

/// Draws a row for each model. Light paths are traced anew once an edit ends.
pub(super) fn models(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let (low, high) = session.scene.bounds();
    let speed = 0.002 * (high - low).length();
    let mut removed = None;
    for index in 0..session.document.parts.models.len() {
        let is_added = session.is_added(index);
        let model = &mut session.document.parts.models[index];
        let is_chosen = ui_state.chosen == Chosen::Model(index);
        ui.horizontal(|ui| {
            let mut is_shown = !model.is_hidden;
            ui.checkbox(&mut is_shown, "").on_hover_text("Shown or hidden");
            model.is_hidden = !is_shown;
            let name = ui.selectable_label(is_chosen, model.shown_name());
            if name.on_hover_text("Move and turn it").clicked() {
                ui_state.choose(if is_chosen { Chosen::Nothing } else { Chosen::Model(index) });
            }
            if is_added && ui.small_button("Remove").clicked() {
                removed = Some(index);
            }
        });
        if is_chosen {
            place(ui, session, index, speed);
        }
    }
    if let Some(index) = removed {
        session.document.parts.models.remove(index);
        ui_state.choose(Chosen::Nothing);
    }
    row(ui, "Add", |ui| {
        let path = TextEdit::singleline(&mut ui_state.model_to_add).desired_width(118.0);
        ui.add(path.hint_text("file, or drop it here"));
        let is_named = !ui_state.model_to_add.trim().is_empty();
        if ui.add_enabled(is_named, egui::Button::new("Add").small()).clicked() {
            let path = std::mem::take(&mut ui_state.model_to_add);
            actions::add_model(session, Path::new(path.trim()));
        }
        if ui.small_button("…").on_hover_text("Choose a model or a luminaire").clicked() {
            ui_state.requests.push(Request::Ask(Purpose::Add));
        }
    });
    row(ui, "Sky", |ui| {
        let own = session.text.as_ref().ok().and_then(SceneText::sky_image);
        let image = session.document.parts.sky_image.clone().or(own);
        let name = image.as_deref().map(Path::new).and_then(Path::file_name);
        let name = name.map_or("no image".into(), |name| name.to_string_lossy());
        if ui.small_button("…").on_hover_text("Choose an image, or drop an .hdr or .exr").clicked() {
            ui_state.requests.push(Request::Ask(Purpose::Sky));
        }
        ui.add(egui::Label::new(name).truncate());
    });
    ui.small("Light paths are traced anew when one of these changes.");
}

/// Offset and angles of a model; it turns about the middle of its box. `speed`: metres for each
/// point that the pointer moves.
fn place(ui: &mut Ui, session: &mut Session, index: usize, speed: f32) {
    let middle = session.model_corners(index).map(|corners| corners.iter().sum::<Vec3>() / 8.0);
    let middle = middle.map(|middle| middle.as_dvec3() + session.scene.origin);
    let model = &mut session.document.parts.models[index];
    row(ui, "Offset", |ui| numbers(ui, &mut model.translation, speed, 3));
    if model.matrix.is_some() {
        ui.small("The scene file states a matrix: its angles stay.");
        return;
    }
    let mut rotation = model.rotation;
    row(ui, "Turn", |ui| numbers(ui, &mut rotation, 0.5, 2));
    if rotation != model.rotation {
        model.turn_about(middle.unwrap_or(model.translation), rotation);
    }
}

fn numbers(ui: &mut Ui, vector: &mut DVec3, speed: f32, decimals: usize) {
    for number in vector.as_mut() {
        ui.add(DragValue::new(number).speed(speed).max_decimals(decimals).update_while_editing(false));
    }
}
