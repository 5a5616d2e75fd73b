//! The list of keys and pointer actions.

use egui::Context;

use crate::app::demo::shortcuts::{BINDINGS, POINTER, name};

/// Draws the list over the picture.
pub(in crate::app::demo) fn help(context: &Context, is_open: &mut bool) {
    egui::Window::new("Keys and pointer").open(is_open).collapsible(false).resizable(true).show(
        context,
        |ui| {
            egui::ScrollArea::vertical().show(ui, |ui| {
                egui::Grid::new("pointer").num_columns(2).striped(true).show(ui, |ui| {
                    for (what, text) in POINTER {
                        ui.strong(what);
                        ui.label(text);
                        ui.end_row();
                    }
                    for binding in &BINDINGS {
                        ui.strong(name(&binding.keys));
                        ui.label(binding.text);
                        ui.end_row();
                    }
                });
            });
        },
    );
}
