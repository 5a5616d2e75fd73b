//! The list of models: shown or hidden, moved, added.

use std::path::Path;

use egui::{DragValue, TextEdit, Ui};

use super::row;
use crate::app::demo::actions;
use crate::app::demo::dialogs::Purpose;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Request, UiState};
use crate::scene::save::SceneText;

/// Draws a row for each model. Light paths are traced anew once an edit ends.
pub(super) fn models(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let (low, high) = session.scene.bounds();
    let speed = 0.002 * (high - low).length();
    for model in &mut session.document.parts.models {
        ui.horizontal(|ui| {
            let mut is_shown = !model.is_hidden;
            ui.checkbox(&mut is_shown, model.short_name()).on_hover_text("Shown or hidden");
            model.is_hidden = !is_shown;
        });
        row(ui, "Offset", |ui| {
            for number in model.translation.as_mut() {
                ui.add(DragValue::new(number).speed(speed).max_decimals(3).update_while_editing(false));
            }
        });
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
