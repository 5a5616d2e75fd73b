//! The lines in which a scene on disk and the edited scene differ.

use egui::{Context, RichText, ScrollArea, Window};

use super::PALETTE;
use crate::app::demo::differences::{Differences, Side};

/// Draws the lines in a window of their own. Returns whether the user has closed it.
pub(super) fn differences(context: &Context, differences: &Differences) -> bool {
    let mut is_open = true;
    let window = Window::new("What differs").open(&mut is_open).default_pos([8.0, 96.0]);
    window.default_size([380.0, 260.0]).show(context, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new("− only on disk").color(PALETTE[0]));
            ui.label(RichText::new("+ only in your edits").color(PALETTE[1]));
        });
        ui.separator();
        if differences.lines.is_empty() {
            ui.label("The scene on disk is what your edits give.");
        }
        ScrollArea::both().auto_shrink([false, true]).show(ui, |ui| {
            for (side, line) in &differences.lines {
                let text = |sign: &str| RichText::new(format!("{sign} {line}")).monospace();
                let text = match side {
                    Side::Heading => RichText::new(line).strong(),
                    Side::Both => text(" ").weak(),
                    Side::OnDisk => text("−").color(PALETTE[0]),
                    Side::Mine => text("+").color(PALETTE[1]),
                };
                ui.add(egui::Label::new(text).extend());
            }
        });
    });
    !is_open
}
