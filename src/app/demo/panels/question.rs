//! Questions about unsaved edits: the scene has changed on disk, the window is about to close, or
//! an earlier window has left some.

use egui::{Align2, Area, Context, Frame, Key, RichText};

use super::PALETTE;
use super::differences::differences;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Answer, Request, UiState};

/// An answer: button, request and explanation.
type Choice = (&'static str, Request, &'static str);

/// What to do with a scene that has changed on disk.
const CHANGED: [Choice; 4] = [
    (
        "Reload (discard my edits)",
        Request::Answer(Answer::Reload),
        "Loads the scene as it is on disk; Ctrl+Z brings your lights and materials back",
    ),
    (
        "Keep mine",
        Request::Answer(Answer::KeepMine),
        "Goes on with your edits; what is on disk stays as it is",
    ),
    (
        "Keep both",
        Request::Answer(Answer::KeepBoth),
        "Saves your edits as another scene beside this one, then loads it again",
    ),
    ("What differs", Request::Compare, "Lists the lines in which the scene on disk and yours differ"),
];

/// What to do with edits that an earlier window has left.
const LEFT: [Choice; 2] = [
    ("Bring them back", Request::Restore, "Ctrl+Z takes them out again"),
    ("Delete them", Request::Discard, "The scene stays as its file is"),
];

/// What to do before the window closes.
const CLOSE: [Choice; 2] = [
    ("Save and close", Request::SaveAndQuit, "Saves the scene to the file of the panel `Scene and film`"),
    ("Close without saving", Request::QuitAnyway, "Your edits are lost (Ctrl+Shift+Q)"),
];

/// What to do before another scene is opened.
const OPEN: [Choice; 2] = [
    ("Save and open", Request::SaveAndOpen, "Saves the scene to the file of the panel `Scene and film`"),
    ("Open without saving", Request::OpenAnyway, "Your edits are lost"),
];

/// Draws the question that is open over the upper edge of the picture. The scene can still be
/// viewed, edited and saved.
pub(in crate::app::demo) fn questions(context: &Context, session: &Session, ui_state: &mut UiState) {
    ui_state.asks_to_close &= session.has_unsaved_edits();
    ui_state.asks_to_open &= session.has_unsaved_edits();
    let shown = ui_state.differences.take_if(|_| session.is_asked);
    ui_state.differences = shown.filter(|shown| !differences(context, shown));
    if ui_state.asks_to_close {
        let text = format!("{} has unsaved edits.", session.scene.name);
        let goes_on = ask(context, &text, &CLOSE, Some("Do not close"), ui_state);
        ui_state.asks_to_close = !goes_on && !context.input(|input| input.key_pressed(Key::Escape));
    } else if ui_state.asks_to_open {
        let text = format!("{} has unsaved edits.", session.scene.name);
        let stays = ask(context, &text, &OPEN, Some("Do not open"), ui_state);
        ui_state.asks_to_open = !stays && !context.input(|input| input.key_pressed(Key::Escape));
    } else if ui_state.asks_to_restore {
        let text = format!("{} has edits of the last time that were not saved.", session.source.spec);
        ask(context, &text, &LEFT, None, ui_state);
    } else if session.is_asked {
        let text = format!("{} has changed on disk. You have unsaved edits.", session.source.spec);
        ask(context, &text, &CHANGED, None, ui_state);
    }
}

/// Draws a question with a button for each choice, and one that goes on without any. Returns
/// whether the user has pressed that one.
fn ask(
    context: &Context,
    text: &str,
    choices: &[Choice],
    goes_on: Option<&str>,
    ui_state: &mut UiState,
) -> bool {
    let place = Area::new("question".into()).anchor(Align2::LEFT_TOP, [8.0, 8.0]);
    let shown = place.show(context, |ui| {
        Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(context.content_rect().width() - 32.0);
            ui.add(egui::Label::new(RichText::new(text).color(PALETTE[1])).truncate());
            ui.horizontal_wrapped(|ui| {
                for &(name, request, hint) in choices {
                    if ui.button(name).on_hover_text(hint).clicked() {
                        ui_state.requests.push(request);
                    }
                }
                goes_on.is_some_and(|name| ui.button(name).on_hover_text("Esc").clicked())
            })
        })
    });
    shown.inner.inner.inner
}
