//! The editor of the chosen light.

use egui::{Color32, DragValue, TextEdit, Ui};
use glam::Vec3;

use super::{luminaire, row};
use crate::app::demo::document::LightEntry;
use crate::app::demo::light_edit::{LightEdit, may_be_grouped, unit};
use crate::scene::{Light, LightKind};

/// Half-angles of spots, degrees.
const ANGLES: std::ops::RangeInclusive<f32> = 0.01..=90.0;

/// Draws the editor of the primary light. Returns the edits that apply to all chosen lights.
pub(super) fn light(
    ui: &mut Ui,
    entry: &mut LightEntry,
    origin: Vec3,
    group_typed: &mut Option<(u64, String)>,
) -> Vec<LightEdit> {
    row(ui, "Name", |ui| ui.text_edit_singleline(&mut entry.light.name));
    let mut edits = Vec::new();
    if may_be_grouped(&entry.light.kind) {
        edits.extend(group(ui, entry, group_typed));
    }
    edits.extend(emission(ui, &entry.light.kind));
    edits.extend(power(ui, &entry.light));
    match &mut entry.light.kind {
        LightKind::Point { position, .. } => place(ui, "Position", position, origin),
        LightKind::Spot { position, direction, angle, penumbra, .. } => {
            place(ui, "Position", position, origin);
            aim(ui, direction);
            if let Some(measured) = &mut entry.light.luminaire {
                luminaire::luminaire(ui, measured);
                return edits;
            }
            let (mut degrees, mut fraction) = (angle.to_degrees(), *penumbra);
            let slider = egui::Slider::new(&mut degrees, ANGLES).suffix("°");
            if row(ui, "Half-angle", |ui| ui.add(slider).changed()) {
                edits.push(LightEdit::Angle(degrees.to_radians()));
            }
            let slider = egui::Slider::new(&mut fraction, 0.0..=1.0);
            if row(ui, "Penumbra", |ui| ui.add(slider).changed()) {
                edits.push(LightEdit::Penumbra(fraction));
            }
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
    edits
}

/// The group's name. It takes effect when the user has typed it.
fn group(ui: &mut Ui, entry: &LightEntry, typed: &mut Option<(u64, String)>) -> Option<LightEdit> {
    let own = entry.light.group.clone().unwrap_or_default();
    let mut text = typed.take().map_or_else(|| own.clone(), |(_, text)| text);
    let field = TextEdit::singleline(&mut text).hint_text("none").desired_width(200.0);
    let response = row(ui, "Group", |ui| ui.add(field));
    if response.has_focus() {
        *typed = Some((entry.id, text));
        return None;
    }
    (text != own).then(|| LightEdit::group(&text))
}

/// Colour with a brightest channel of 1, and the strength of that channel.
fn emission(ui: &mut Ui, kind: &LightKind) -> Option<LightEdit> {
    let before = kind.emission();
    let strength = before.max_element();
    let mut colour = if strength > 0.0 { (before / strength).to_array() } else { [1.0; 3] };
    let mut requested = strength;
    let unit = unit(kind);
    let changed = row(ui, "Light", |ui| {
        let recoloured = ui.color_edit_button_rgb(&mut colour).changed();
        let speed = (0.01 * strength).max(1e-3);
        let value = DragValue::new(&mut requested).speed(speed).range(0.0..=1e9).suffix(format!(" {unit}"));
        ui.add(value).changed() || recoloured
    });
    let colour = Vec3::from(colour);
    changed.then(|| LightEdit::Emission(colour / colour.max_element().max(1e-6) * requested, unit))
}

/// Power in photometric units, and colour temperature.
fn power(ui: &mut Ui, light: &Light) -> Option<LightEdit> {
    let (mut amount, unit) = light.power()?;
    let mut kelvin = light.kind.kelvin();
    row(ui, "Power", |ui| {
        let (speed, decimals) = ((0.01 * amount).max(0.1), usize::from(amount < 100.0));
        let value = DragValue::new(&mut amount).speed(speed).range(0.0..=1e12).suffix(format!(" {unit}"));
        let is_changed = ui.add(value.max_decimals(decimals)).changed();
        let value = DragValue::new(&mut kelvin).speed(20.0).range(1667.0..=25_000.0).suffix(" K");
        let hint = "Colour of a black body of that temperature";
        if ui.add(value.max_decimals(0)).on_hover_text(hint).changed() {
            return Some(LightEdit::Kelvin(kelvin));
        }
        is_changed.then_some(LightEdit::Power(amount, unit))
    })
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
