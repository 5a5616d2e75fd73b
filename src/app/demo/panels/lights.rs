//! The list of lights and the editor of the chosen one.

use egui::{Color32, DragValue, Ui};
use glam::Vec3;

use super::{luminaire, row};
use crate::app::demo::document::LightEntry;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Chosen, UiState};
use crate::scene::{Light, LightKind};

/// Half-angles of spots, degrees.
const ANGLES: std::ops::RangeInclusive<f32> = 0.01..=90.0;

/// Draws the list, and below it the chosen light.
pub(super) fn lights(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let (mut removed, mut alone) = (None, None);
    for entry in &mut session.document.lights {
        ui.horizontal(|ui| {
            ui.checkbox(&mut entry.light.is_on, "").on_hover_text("On or off (O)");
            let is_chosen = ui_state.chosen == Chosen::Light(entry.id);
            let name = format!("{} ({})", entry.light.name, word(&entry.light));
            if ui.selectable_label(is_chosen, name).clicked() {
                ui_state.chosen = Chosen::Light(entry.id);
            }
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                if ui.small_button("✖").on_hover_text("Remove (Del)").clicked() {
                    removed = Some(entry.id);
                }
                let mut percent = ui_state.mixer.percent(entry);
                let value = DragValue::new(&mut percent).range(0.0..=1e4).suffix(" %").max_decimals(0);
                if ui.add(value).on_hover_text("Dim: percent of its power at first").changed() {
                    ui_state.mixer.dim(entry, percent);
                }
                let is_alone = ui_state.mixer.is_alone(entry.id);
                if ui.selectable_label(is_alone, "S").on_hover_text("This light alone (solo)").clicked() {
                    alone = Some(entry.id);
                }
            });
        });
    }
    if let Some(id) = alone {
        ui_state.mixer.toggle_alone(&mut session.document, id);
    }
    if let Some(id) = removed {
        session.document.lights.retain(|entry| entry.id != id);
    }
    ui.horizontal(|ui| {
        ui.label("Add");
        for kind in ["point", "spot", "area", "sun"] {
            if ui.small_button(kind).clicked() {
                let light = fresh(session, kind);
                let place = session.document.add(light);
                ui_state.chosen = Chosen::Light(session.document.lights[place].id);
            }
        }
    });
    luminaire::adding(ui, ui_state);
    if let Chosen::Light(id) = ui_state.chosen
        && let Some(entry) = session.document.lights.iter_mut().find(|entry| entry.id == id)
    {
        ui.separator();
        chosen(ui, entry, session.scene.origin.as_vec3());
    }
}

/// What the list calls a light.
fn word(light: &Light) -> &'static str {
    if light.luminaire.is_some() { "luminaire" } else { light.kind.word() }
}

/// A place in the middle of the view, inside the scene.
pub(in crate::app::demo) fn middle_of_view(session: &Session) -> Vec3 {
    let (camera, (low, high)) = (&session.camera, session.scene.bounds());
    let raised = 0.02 * (high - low).length() * Vec3::Y;
    (camera.position + 0.5 * (camera.target - camera.position)).clamp(low, high) + raised
}

/// A new light in the middle of the view, as bright as the scene's first.
pub(in crate::app::demo) fn fresh(session: &Session, kind: &str) -> Light {
    let [_, _, forward] = session.camera.frame();
    let (low, high) = session.scene.bounds();
    let size = (high - low).length();
    let position = middle_of_view(session);
    let luminous = session.document.lights.first().map(|entry| entry.light.kind);
    let intensity = match luminous {
        Some(LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. }) => intensity,
        // A typical intensity for a room of that size.
        _ => Vec3::splat(0.1 * size * size),
    };
    let side = 0.1 * size;
    let kind = match kind {
        "spot" => LightKind::Spot {
            position,
            direction: forward,
            intensity,
            angle: 30_f32.to_radians(),
            penumbra: 0.3,
        },
        "area" => LightKind::Area {
            corner: position - Vec3::new(0.5 * side, 0.0, 0.5 * side),
            edge_u: Vec3::X * side,
            edge_v: Vec3::Z * side,
            // As bright as the point light, seen face on; `edge_u × edge_v` points down.
            radiance: intensity / (side * side),
            samples: 10,
        },
        "sun" => LightKind::Directional {
            direction: Vec3::new(-0.4, -0.8, -0.45).normalize(),
            irradiance: intensity / (0.25 * size * size),
        },
        _ => LightKind::Point { position, intensity },
    };
    Light::new(kind.word(), kind)
}

fn chosen(ui: &mut Ui, entry: &mut LightEntry, origin: Vec3) {
    row(ui, "Name", |ui| ui.text_edit_singleline(&mut entry.light.name));
    let kind = &mut entry.light.kind;
    emission(ui, kind);
    power(ui, &mut entry.light);
    let kind = &mut entry.light.kind;
    match kind {
        LightKind::Point { position, .. } => place(ui, "Position", position, origin),
        LightKind::Spot { position, direction, angle, penumbra, .. } => {
            place(ui, "Position", position, origin);
            aim(ui, direction);
            if let Some(measured) = &mut entry.light.luminaire {
                luminaire::luminaire(ui, measured);
                return;
            }
            let mut degrees = angle.to_degrees();
            let changed = row(ui, "Half-angle", |ui| {
                ui.add(egui::Slider::new(&mut degrees, ANGLES).suffix("°")).changed()
            });
            if changed {
                *angle = degrees.to_radians();
            }
            row(ui, "Penumbra", |ui| ui.add(egui::Slider::new(penumbra, 0.0..=1.0)));
        }
        LightKind::Area { corner, edge_u, edge_v, samples, .. } => {
            place(ui, "Corner", corner, origin);
            let before = (*edge_u, *edge_v);
            place(ui, "Edge u", edge_u, Vec3::ZERO);
            place(ui, "Edge v", edge_v, Vec3::ZERO);
            if edge_u.cross(*edge_v).length() <= 1e-5 * edge_u.length() * edge_v.length() {
                // Parallel edges span no area.
                (*edge_u, *edge_v) = before;
            }
            row(ui, "Samples", |ui| ui.add(DragValue::new(samples).range(1..=4096)));
        }
        LightKind::Directional { direction, .. } => aim(ui, direction),
        LightKind::Surface { .. } => (),
        LightKind::Sky { turn, .. } => {
            let mut degrees = turn.to_degrees();
            let slider = egui::Slider::new(&mut degrees, -180.0..=180.0).suffix("°");
            if row(ui, "Rotation", |ui| ui.add(slider).changed()) {
                *turn = degrees.to_radians();
            }
        }
    }
}

/// Colour with a brightest channel of 1, and the strength of that channel.
fn emission(ui: &mut Ui, kind: &mut LightKind) {
    let before = kind.emission();
    let strength = before.max_element();
    let mut colour = if strength > 0.0 { (before / strength).to_array() } else { [1.0; 3] };
    let mut requested = strength;
    let unit = match kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => "W/sr",
        LightKind::Area { .. } | LightKind::Surface { .. } | LightKind::Sky { .. } => "W/m²/sr",
        LightKind::Directional { .. } => "W/m²",
    };
    let changed = row(ui, "Light", |ui| {
        let recoloured = ui.color_edit_button_rgb(&mut colour).changed();
        let speed = (0.01 * strength).max(1e-3);
        let value = DragValue::new(&mut requested).speed(speed).range(0.0..=1e9).suffix(format!(" {unit}"));
        ui.add(value).changed() || recoloured
    });
    if changed {
        let colour = Vec3::from(colour);
        *kind = kind.with_emission(colour / colour.max_element().max(1e-6) * requested);
    }
}

/// Power in photometric units, and colour temperature.
fn power(ui: &mut Ui, light: &mut Light) {
    let Some((mut amount, unit)) = light.power() else { return };
    let mut kelvin = light.kind.kelvin();
    row(ui, "Power", |ui| {
        let (speed, decimals) = ((0.01 * amount).max(0.1), usize::from(amount < 100.0));
        let value = DragValue::new(&mut amount).speed(speed).range(0.0..=1e12).suffix(format!(" {unit}"));
        if ui.add(value.max_decimals(decimals)).changed() {
            light.set_power(amount);
        }
        let value = DragValue::new(&mut kelvin).speed(20.0).range(1667.0..=25_000.0).suffix(" K");
        let hint = "Colour of a black body of that temperature";
        if ui.add(value.max_decimals(0)).on_hover_text(hint).changed() {
            light.kind = light.kind.with_kelvin(kelvin);
        }
    });
}

/// A point or an edge; points are in the coordinates of the scene's file.
fn place(ui: &mut Ui, name: &str, point: &mut Vec3, origin: Vec3) {
    row(ui, name, |ui| {
        for (axis, colour) in AXES.into_iter().enumerate() {
            let mut value = point[axis] + origin[axis];
            ui.visuals_mut().override_text_color = Some(colour);
            if ui.add(DragValue::new(&mut value).speed(0.01).max_decimals(3)).changed() {
                point[axis] = value - origin[axis];
            }
        }
        ui.visuals_mut().override_text_color = None;
    });
}

/// A unit direction as two angles.
fn aim(ui: &mut Ui, direction: &mut Vec3) {
    let mut height = direction.y.clamp(-1.0, 1.0).asin().to_degrees();
    let mut heading = direction.x.atan2(direction.z).to_degrees();
    // One row per angle: wider panels take width from the picture.
    let mut angle = |name: &str, value: &mut f32, range| {
        row(ui, name, |ui| ui.add(DragValue::new(value).speed(1.0).range(range).suffix("°")).changed())
    };
    let turned = angle("Heading", &mut heading, f32::NEG_INFINITY..=f32::INFINITY);
    if angle("Height", &mut height, -90.0..=90.0) || turned {
        let (sin, cos) = height.to_radians().sin_cos();
        let heading = heading.to_radians();
        *direction = Vec3::new(cos * heading.sin(), sin, cos * heading.cos()).normalize();
    }
}

/// Colours of the axes x, y and z.
pub(in crate::app::demo) const AXES: [Color32; 3] = [
    Color32::from_rgb(0xe8, 0x7d, 0x3e),
    Color32::from_rgb(0xf0, 0xe4, 0x42),
    Color32::from_rgb(0x56, 0xb4, 0xe9),
];
