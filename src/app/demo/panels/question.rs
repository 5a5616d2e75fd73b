//! The question that is open while a scene with unsaved edits has changed on disk.

use egui::{Align2, Area, Context, Frame, RichText};

use super::PALETTE;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Answer, Request, UiState};

/// The answers and their explanations.
const ANSWERS: [(&str, Answer, &str); 3] = [
    (
        "Reload (discard my edits)",
        Answer::Reload,
        "Loads the scene as it is on disk; Ctrl+Z brings your lights and materials back",
    ),
    ("Keep mine", Answer::KeepMine, "Goes on with your edits; what is on disk stays as it is"),
    ("Keep both", Answer::KeepBoth, "Saves your edits as another scene beside this one, then loads it again"),
];

/// Draws the question over the upper edge of the picture. The scene can still be viewed,
/// edited and saved.
pub(in crate::app::demo) fn question(context: &Context, session: &Session, ui_state: &mut UiState) {
    if !session.is_asked {
        return;
    }
    let place = Area::new("question".into()).anchor(Align2::LEFT_TOP, [8.0, 8.0]);
    place.show(context, |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(context.content_rect().width() - 32.0);
            let text = format!("{} has changed on disk. You have unsaved edits.", session.source.spec);
            ui.add(egui::Label::new(RichText::new(text).color(PALETTE[1])).truncate());
            ui.horizontal_wrapped(|ui| {
                for (name, answer, hint) in ANSWERS {
                    if ui.button(name).on_hover_text(hint).clicked() {
                        ui_state.requests.push(Request::Answer(answer));
                    }
                }
            });
        });
    });
}
