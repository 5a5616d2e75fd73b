//! Panels beside the picture.

mod differences;
mod exposure;
mod help;
mod light;
mod lights;
mod luminaire;
mod materials;
mod meters;
mod models;
mod question;
mod scene;
mod snapshots;
mod timing;
mod views;

use egui::{Align, CollapsingHeader, Color32, DragValue, Layout, RichText, Ui};

use super::session::Session;
use super::stage::Progressed;
use super::ui_state::UiState;

pub(super) use help::help;
pub(super) use light::AXES;
pub(super) use lights::{fresh as fresh_light, middle_of_view};
pub(super) use question::questions;

/// Width of the panels when the window opens, points.
pub(super) const WIDTH: f32 = 310.0;

/// Colours that also differ in lightness, for readers with impaired colour vision. [Okabe
/// & Ito 2008]
pub(super) const PALETTE: [Color32; 7] = [
    Color32::from_rgb(0x56, 0xb4, 0xe9),
    Color32::from_rgb(0xe6, 0x9f, 0x00),
    Color32::from_rgb(0x00, 0x9e, 0x73),
    Color32::from_rgb(0xf0, 0xe4, 0x42),
    Color32::from_rgb(0x00, 0x72, 0xb2),
    Color32::from_rgb(0xd5, 0x5e, 0x00),
    Color32::from_rgb(0xcc, 0x79, 0xa7),
];

/// Draws all panels, one below the other.
pub(super) fn panels(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.heading(&session.scene.name);
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.button("?").on_hover_text("Keys and pointer (F1)").clicked() {
                ui_state.shows_help = !ui_state.shows_help;
            }
            let [past, future] = session.history.depths();
            let redo = egui::Button::new("⟳");
            if ui.add_enabled(future > 0, redo).on_hover_text("Do again (Ctrl+Shift+Z)").clicked() {
                session.history.redo(&mut session.document);
            }
            let undo = egui::Button::new("⟲");
            if ui.add_enabled(past > 0, undo).on_hover_text("Take back (Ctrl+Z)").clicked() {
                session.history.undo(&mut session.document);
            }
        });
    });
    progress(ui, session);
    ui.separator();
    egui::ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        let section = |ui: &mut Ui, name: &str, is_open: bool, add: &mut dyn FnMut(&mut Ui)| {
            CollapsingHeader::new(RichText::new(name).strong()).default_open(is_open).show(ui, |ui| add(ui));
        };
        section(ui, "Lights", true, &mut |ui| lights::lights(ui, session, ui_state));
        section(ui, "Material", true, &mut |ui| materials::materials(ui, session, ui_state));
        let has_several = session.document.parts.models.len() > 1;
        section(ui, "Models", has_several, &mut |ui| models::models(ui, session, ui_state));
        section(ui, "View", true, &mut |ui| views::views(ui, session, ui_state));
        meters::section(ui, session, ui_state);
        snapshots::section(ui, session, ui_state);
        section(ui, "Time", true, &mut |ui| timing::timing(ui, session, ui_state));
        section(ui, "Scene and film", false, &mut |ui| scene::scene(ui, session, ui_state));
        said(ui, session);
    });
}

/// Draws the progress of the precomputation.
fn progress(ui: &mut Ui, session: &Session) {
    let Some(Progressed { estimate, is_draft }) = session.progress() else { return };
    let left = match estimate.left() {
        left if left.is_empty() => format!("{:.0} s", estimate.elapsed_s()),
        left => left,
    };
    let text = format!("{} · {left}", estimate.words());
    ui.add(egui::ProgressBar::new(estimate.fraction() as f32).text(text).animate(false));
    ui.small(match (session.renderer(), is_draft) {
        (Some(_), _) => "A draft until the light paths of the scene's own settings are traced.",
        (None, true) => "Direct light only until the light paths of a draft are traced.",
        (None, false) => "Direct light only until the light paths are traced.",
    });
}

/// Draws the notes.
fn said(ui: &mut Ui, session: &mut Session) {
    if session.said.is_empty() {
        return;
    }
    ui.separator();
    ui.horizontal(|ui| {
        ui.strong("Notes");
        if ui.small_button("Clear").clicked() {
            session.said.clear();
        }
    });
    for line in session.said.iter().rev().take(8) {
        ui.label(RichText::new(line).small());
    }
}

/// Time that an alarm stays over the picture, seconds.
const ALARM_S: f32 = 15.0;

/// Draws the alarm over the picture's lower edge.
pub(super) fn alarm(ctx: &egui::Context, session: &mut Session) {
    let Some((line, since)) = &session.alarm else { return };
    let left = ALARM_S - since.elapsed().as_secs_f32();
    if left <= 0.0 {
        session.alarm = None;
        return;
    }
    let place = egui::Area::new("alarm".into()).anchor(egui::Align2::LEFT_BOTTOM, [8.0, -8.0]);
    place.show(ctx, |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(ui.ctx().content_rect().width() - 32.0);
            ui.add(egui::Label::new(RichText::new(line).color(PALETTE[1])).truncate());
        });
    });
    ctx.request_repaint_after_secs(left);
}

/// Draws the position of the split.
pub(super) fn wipe(ui: &mut Ui, ui_state: &mut UiState) {
    if let Some(wipe) = &mut ui_state.split {
        row(ui, "Wipe", |ui| {
            ui.add(egui::Slider::new(wipe, 0.0..=1.0).clamping(egui::SliderClamping::Edits).show_value(false))
        });
    }
}

/// Adds a field for a number that follows from others. Returns the new number if the user has
/// changed it. Typed text counts when the edit ends: a number that is computed anew after every key
/// would replace the text.
pub(super) fn derived<N: egui::emath::Numeric>(
    ui: &mut Ui,
    number: N,
    field: impl FnOnce(DragValue<'_>) -> DragValue<'_>,
    hint: &str,
) -> Option<N> {
    let mut edited = number;
    let value = field(DragValue::new(&mut edited)).clamp_existing_to_range(false).update_while_editing(false);
    let response = ui.add(value);
    if !hint.is_empty() {
        response.on_hover_text(hint);
    }
    (edited != number).then_some(edited)
}

/// A row with a name before a widget.
pub(super) fn row<T>(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui) -> T) -> T {
    ui.horizontal(|ui| {
        ui.add_sized([76.0, 18.0], egui::Label::new(name).halign(Align::Min));
        add(ui)
    })
    .inner
}
