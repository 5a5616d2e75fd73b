//! The panel of the chosen material.

use std::path::Path;

use egui::{DragValue, Ui};
use glam::Vec3;

use super::row;
use crate::app::demo::dialogs::Purpose;
use crate::app::demo::document::ChosenImage;
use crate::app::demo::images::remove_image;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Chosen, Request, UiState};

/// Draws the choice of the material and its reflectance.
pub(super) fn materials(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let mut chosen = match ui_state.chosen {
        Chosen::Material(index) if index < session.scene.materials.len() => Some(index),
        _ => None,
    };
    let name = chosen.map_or("none: click a surface", |index| &session.scene.materials[index].name);
    egui::ComboBox::from_id_salt("material").selected_text(name).width(200.0).show_ui(ui, |ui| {
        for (index, material) in session.scene.materials.iter().enumerate() {
            ui.selectable_value(&mut chosen, Some(index), &material.name);
        }
    });
    let Some(index) = chosen else { return };
    let is_tracing = session.progress().is_some();
    ui_state.choose(Chosen::Material(index));
    let (material, edit) = (&session.scene.materials[index], &mut session.document.materials[index]);
    albedo(ui, "Diffuse", &mut edit.diffuse);
    albedo(ui, "Specular", &mut edit.specular);
    row(ui, "Exponent", |ui| {
        ui.add(
            egui::Slider::new(&mut edit.exponent, 1.0..=1000.0)
                .clamping(egui::SliderClamping::Edits)
                .logarithmic(true),
        )
    });
    if !material.may_be_glossy() {
        edit.editable |= edit.specular != Vec3::ZERO;
        ui.small(match edit.editable {
            true => "Glossy as soon as light paths are traced again.",
            false => "Diffuse. A specular albedo starts the tracing of light paths again.",
        });
    } else if edit.editable && is_tracing {
        ui.small("Light paths are traced again, so that it may be glossy.");
    }
    image(ui, session, ui_state, index);
    let edit = &mut session.document.materials[index];
    // The renderer scales down an albedo above 1; the panel shows the scaled value.
    let most = (edit.diffuse + edit.specular).max_element();
    if most > 1.0 {
        edit.diffuse /= most * (1.0 + f32::EPSILON);
        edit.specular /= most * (1.0 + f32::EPSILON);
    }
}

/// The image that multiplies the diffuse albedo. Light paths are traced anew when it changes.
fn image(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState, index: usize) {
    let has_image = session.scene.materials[index].texture.is_some();
    row(ui, "Image", |ui| {
        let hint = "Choose an image, or drop it here; light paths are traced anew";
        if ui.small_button("…").on_hover_text(hint).clicked() {
            ui_state.requests.push(Request::Ask(Purpose::Image));
        }
        let removes = ui.add_enabled(has_image, egui::Button::new("✖").small());
        if removes.on_hover_text("Its mean colour instead").clicked() {
            remove_image(session, index);
        }
        let name = match &session.document.parts.images[index] {
            Some(ChosenImage::File(path, _)) => {
                Path::new(path).file_name().unwrap_or_default().to_string_lossy()
            }
            Some(ChosenImage::Colour(_)) => "none".into(),
            None if has_image => "the model's".into(),
            None => "none".into(),
        };
        ui.add(egui::Label::new(name).truncate());
    });
}

/// A colour as linear numbers, with a button that picks one.
fn albedo(ui: &mut Ui, name: &str, albedo: &mut Vec3) {
    row(ui, name, |ui| {
        let mut colour = albedo.to_array();
        if ui.color_edit_button_rgb(&mut colour).changed() {
            *albedo = colour.into();
        }
        for channel in 0..3 {
            ui.add(
                DragValue::new(&mut albedo[channel])
                    .speed(0.005)
                    .range(0.0..=1.0)
                    .clamp_existing_to_range(false)
                    .update_while_editing(false)
                    .max_decimals(3),
            );
        }
    });
}
