//! The picture, and what the pointer does on it.

use std::time::Instant;

use egui::{CentralPanel, Color32, Frame, Rect, Sense, Ui, pos2};

use super::desk::{Chosen, Desk, Request, View};
use super::panels;
use super::session::Session;
use super::shortcuts::Action;

/// How long the window must keep its size before the picture takes it, seconds: another size is another picture from scratch.
const PATIENCE_S: f64 = 0.15;
/// Pixels of a picture along either side, at most and at least.
const SIDES: [u32; 2] = [16, 8192];

pub(super) struct Viewport {
    /// The size that the picture should take, and since when.
    size: ([u32; 2], Instant),
}

impl Viewport {
    pub(super) fn new() -> Self {
        Self { size: ([0, 0], Instant::now()) }
    }

    /// Does what a key asks for.
    pub(super) fn act(&mut self, action: Action, session: &mut Session, desk: &mut Desk) {
        match action {
            Action::Help => desk.shows_help = !desk.shows_help,
            Action::Panels => desk.shows_panels = !desk.shows_panels,
            Action::Undo => drop(session.history.undo(&mut session.document)),
            Action::Redo => drop(session.history.redo(&mut session.document)),
            Action::Quit => desk.requests.push(Request::Quit),
            Action::Memory => desk.requests.push(Request::Memory),
            Action::Direct => desk.view = View::Direct,
            _ => (),
        }
        let _ = (Chosen::Nothing, panels::WIDTH);
    }

    /// The picture fills what the panels leave.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        session: &mut Session,
        desk: &mut Desk,
        texture: egui::TextureId,
    ) {
        CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
            let area = ui.max_rect();
            self.fit(ui, session, desk, area);
            let response = ui.allocate_rect(area, Sense::click_and_drag());
            let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
            ui.painter().image(texture, area, whole, Color32::WHITE);
            let _ = response;
        });
    }

    /// The picture takes the size of its area, once that stands still.
    fn fit(&mut self, ui: &Ui, session: &mut Session, desk: &Desk, area: Rect) {
        let pixels = ui.ctx().pixels_per_point() * desk.scale;
        let side = |points: f32| ((points * pixels).round() as u32).clamp(SIDES[0], SIDES[1]);
        let size = [side(area.width()), side(area.height())];
        if self.size.0 != size {
            let is_first = self.size.0 == [0, 0];
            self.size = (size, Instant::now());
            if is_first {
                session.camera.size = size;
            }
        }
        if session.camera.size != size {
            let waited = self.size.1.elapsed().as_secs_f64();
            if waited >= PATIENCE_S {
                session.camera.size = size;
            } else {
                ui.ctx().request_repaint_after_secs((PATIENCE_S - waited) as f32);
            }
        }
    }
}
