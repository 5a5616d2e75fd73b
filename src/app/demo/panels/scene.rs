//! The panel of files: the scene, its pictures, films.

use egui::{TextEdit, Ui};

use super::row;
use crate::app::demo::dialogs::Purpose;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Request, UiState};
use crate::scene::builtin;

pub(super) fn scene(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    row(ui, "Scene", |ui| {
        if ui.button("Open…").on_hover_text("A scene or a model (Ctrl+O)").clicked() {
            ui_state.requests.push(Request::Ask(Purpose::Open));
        }
        ui.menu_button("Recent", |ui| {
            let recent = ui_state.recent.scenes.iter().map(|path| path.display().to_string());
            let built_in = builtin::NAMES.map(str::to_owned);
            for spec in recent.chain(built_in) {
                if ui.button(&spec).clicked() {
                    ui_state.to_open = Some(spec);
                    ui_state.requests.push(Request::Open);
                    ui.close();
                }
            }
        });
    });
    let cameras = &session.scene.cameras;
    if cameras.len() > 1 {
        row(ui, "Camera", |ui| {
            for camera in cameras {
                if ui.button(&camera.name).clicked() {
                    session.camera = crate::scene::Camera { size: session.camera.size, ..camera.clone() };
                }
            }
        });
    }
    let current = session.scene.quality.preset;
    row(ui, "Preset", |ui| {
        for preset in ["draft", "paper", "high"] {
            if ui.selectable_label(current == preset, preset).clicked() && current != preset {
                ui_state.requests.push(Request::Preset(preset));
            }
        }
    });
    row(ui, "File", |ui| ui.add(TextEdit::singleline(&mut ui_state.save_to).desired_width(180.0)));
    ui.horizontal_wrapped(|ui| {
        let recording = if ui_state.is_recording { "End recording" } else { "Record film" };
        let playing = if ui_state.is_playing { "Stop film" } else { "Play film" };
        for (name, request, hint) in [
            ("Save scene", Request::Save, "With its edited lights, materials and camera (Ctrl+S)"),
            ("Save as…", Request::Ask(Purpose::Save), "To a file that you choose (Ctrl+Shift+S)"),
            ("Save picture", Request::Screenshot, "As PNG and EXR beside the scene (Ctrl+P)"),
            ("Save layers", Request::Layers, "Direct and indirect light of each light, as one EXR (Ctrl+L)"),
            (recording, Request::Record, "Every edit until it ends, as a film file (Ctrl+R)"),
            (playing, Request::Play, "The film that was recorded last, or the scene's own (Space)"),
        ] {
            if ui.button(name).on_hover_text(hint).clicked() {
                ui_state.requests.push(request);
            }
        }
    });
    let scene = &session.scene;
    ui.small(format!("{} triangles, {} materials", scene.triangles.len(), scene.materials.len()));
}
