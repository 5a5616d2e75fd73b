//! The editor of the chosen light.

use egui::{Color32, DragValue, TextEdit, Ui};
use glam::Vec3;

use super::{derived, luminaire, row};
use crate::app::demo::document::LightEntry;
use crate::app::demo::light_edit::{LightEdit, may_be_grouped, unit};
use crate::scene::photometry::KELVIN;
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
            let slider =
                egui::Slider::new(&mut degrees, ANGLES).clamping(egui::SliderClamping::Edits).suffix("°");
            if row(ui, "Half-angle", |ui| ui.add(slider).changed()) {
                edits.push(LightEdit::Angle(degrees.to_radians()));
            }
            let slider = egui::Slider::new(&mut fraction, 0.0..=1.0).clamping(egui::SliderClamping::Edits);
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
            row(ui, "Samples", |ui| {
                ui.add(
                    DragValue::new(samples)
                        .range(1..=4096)
                        .clamp_existing_to_range(false)
                        .update_while_editing(false),
                )
            });
        }
        LightKind::Directional { direction, .. } => aim(ui, direction),
        LightKind::Surface { .. } => (),
        LightKind::Sky { turn, .. } => {
            let mut degrees = turn.to_degrees();
            let slider = egui::Slider::new(&mut degrees, -180.0..=180.0)
                .clamping(egui::SliderClamping::Edits)
                .suffix("°");
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
    let unit = unit(kind);
    let (recoloured, requested) = row(ui, "Light", |ui| {
        let recoloured = ui.color_edit_button_rgb(&mut colour).changed();
        let speed = (0.01 * strength).max(1e-3);
        let suffix = format!(" {unit}");
        (recoloured, derived(ui, strength, |value| value.speed(speed).range(0.0..=1e9).suffix(suffix), ""))
    });
    let (colour, is_changed) = (Vec3::from(colour), recoloured || requested.is_some());
    let strength = requested.unwrap_or(strength);
    is_changed.then(|| LightEdit::Emission(colour / colour.max_element().max(1e-6) * strength, unit))
}

/// Power in photometric units, and colour temperature.
fn power(ui: &mut Ui, light: &Light) -> Option<LightEdit> {
    let (amount, unit) = light.power()?;
    row(ui, "Power", |ui| {
        let (speed, decimals) = ((0.01 * amount).max(0.1), usize::from(amount < 100.0));
        let suffix = format!(" {unit}");
        let amount = derived(
            ui,
            amount,
            |value| value.speed(speed).range(0.0..=1e12).max_decimals(decimals).suffix(suffix),
            "",
        );
        let kelvin = derived(
            ui,
            light.kind.kelvin(),
            |value| value.speed(20.0).range(KELVIN).max_decimals(0).suffix(" K"),
            "Colour of a black body of that temperature",
        );
        kelvin.map(LightEdit::Kelvin).or_else(|| Some(LightEdit::Power(amount?, unit)))
    })
}

/// A point or an edge; points are in the coordinates of the scene's file.
pub(super) fn place(ui: &mut Ui, name: &str, point: &mut Vec3, origin: Vec3) {
    row(ui, name, |ui| {
        for (axis, colour) in AXES.into_iter().enumerate() {
            ui.visuals_mut().override_text_color = Some(colour);
            let number = point[axis] + origin[axis];
            if let Some(value) = derived(ui, number, |value| value.speed(0.01).max_decimals(3), "") {
                point[axis] = value - origin[axis];
            }
        }
        ui.visuals_mut().override_text_color = None;
    });
}

/// A unit direction as two angles.
fn aim(ui: &mut Ui, direction: &mut Vec3) {
    let height = direction.y.clamp(-1.0, 1.0).asin().to_degrees();
    let heading = direction.x.atan2(direction.z).to_degrees();
    // One row per angle: wider panels take width from the picture.
    let mut angle = |name: &str, degrees: f32, range: std::ops::RangeInclusive<f32>| {
        row(ui, name, |ui| derived(ui, degrees, |value| value.speed(1.0).range(range).suffix("°"), ""))
    };
    let turned = angle("Heading", heading, f32::NEG_INFINITY..=f32::INFINITY);
    let raised = angle("Height", height, -90.0..=90.0);
    if turned.is_some() || raised.is_some() {
        let (sin, cos) = raised.unwrap_or(height).to_radians().sin_cos();
        let heading = turned.unwrap_or(heading).to_radians();
        *direction = Vec3::new(cos * heading.sin(), sin, cos * heading.cos()).normalize();
    }
}

/// Colours of the axes x, y and z.
pub(in crate::app::demo) const AXES: [Color32; 3] = [
    Color32::from_rgb(0xe8, 0x7d, 0x3e),
    Color32::from_rgb(0xf0, 0xe4, 0x42),
    Color32::from_rgb(0x56, 0xb4, 0xe9),
];
