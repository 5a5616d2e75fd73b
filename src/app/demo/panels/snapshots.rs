//! The panel of snapshots: a sheet of small pictures.

use egui::{CollapsingHeader, RichText, TextEdit, Ui, vec2};

use super::wipe;
use crate::app::demo::session::Session;
use crate::app::demo::snapshots::Snapshot;
use crate::app::demo::ui_state::{Beside, Difference, Request, UiState};

/// Width of a small picture, points.
const WIDTH: f32 = 130.0;

/// Draws the panel.
pub(super) fn section(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let opens = std::mem::take(&mut ui_state.opens_snapshots);
    CollapsingHeader::new(RichText::new("Snapshots").strong())
        .default_open(false)
        .open(opens.then_some(true))
        .show(ui, |ui| snapshots(ui, session, ui_state));
}

fn snapshots(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    ui.horizontal(|ui| {
        if ui.button("Keep (N)").on_hover_text("The picture with its edits").clicked() {
            ui_state.requests.push(Request::Snapshot);
        }
        let has_some = session.snapshots.newest().is_some();
        let sheet = ui.add_enabled(has_some, egui::Button::new("Contact sheet (J)"));
        if sheet.on_hover_text("All of them as one PNG beside the scene").clicked() {
            ui_state.requests.push(Request::ContactSheet);
        }
    });
    let mut removed = None;
    egui::Grid::new("snapshots").num_columns(2).spacing([8.0, 8.0]).show(ui, |ui| {
        for (index, snapshot) in session.snapshots.list.iter_mut().enumerate() {
            ui.vertical(|ui| {
                if one(ui, snapshot, ui_state) {
                    removed = Some(snapshot.id);
                }
            });
            if index % 2 == 1 {
                ui.end_row();
            }
        }
    });
    if let Some(id) = removed {
        session.snapshots.list.retain(|snapshot| snapshot.id != id);
        if ui_state.snapshot_beside() == Some(id) {
            ui_state.split = None;
        }
    }
    if ui_state.snapshot_beside().is_some() {
        wipe(ui, ui_state);
        match ui_state.difference {
            Some(Difference { relmse, brighter, .. }) => {
                ui.label(format!("live against it: relMSE {relmse:.1e}, mean {:+.2} %", 100.0 * brighter))
            }
            None => ui.small("Of another size: no figures."),
        };
    }
}

/// Draws a snapshot: a click on its picture restores its edits. Returns whether it is removed.
fn one(ui: &mut Ui, snapshot: &mut Snapshot, ui_state: &mut UiState) -> bool {
    let texture = snapshot.texture(ui.ctx());
    let [width, height] = snapshot.size.map(|side| side as f32);
    let size = vec2(WIDTH, WIDTH * height / width.max(1.0));
    let picture = ui.add(egui::Image::new((texture, size)).sense(egui::Sense::click()));
    if picture.on_hover_text("Restore its edits; Ctrl+Z takes them back").clicked() {
        ui_state.requests.push(Request::RestoreSnapshot(snapshot.id));
    }
    ui.add(TextEdit::singleline(&mut snapshot.name).desired_width(WIDTH - 8.0));
    ui.horizontal(|ui| {
        let is_beside = ui_state.snapshot_beside() == Some(snapshot.id);
        if ui.selectable_label(is_beside, "A/B").on_hover_text("Ours beside it (B: the newest)").clicked() {
            ui_state.toggle_beside(Beside::Snapshot(snapshot.id));
        }
        ui.small_button("Remove").clicked()
    })
    .inner
}
