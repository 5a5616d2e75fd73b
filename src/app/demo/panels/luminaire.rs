//! Luminaires with measured intensities: adding one from its file, and the candela curve.

use egui::epaint::PathStroke;
use egui::{Align2, FontId, Pos2, Sense, Stroke, TextEdit, Ui, pos2, vec2};

use super::{PALETTE, row};
use crate::app::demo::dialogs::Purpose;
use crate::app::demo::light_map::short;
use crate::app::demo::ui_state::{Request, UiState};
use crate::scene::luminaire::{Luminaire, Profile};

/// Height of the curve, points, and its number of segments on each side.
const HEIGHT: f32 = 150.0;
const SEGMENTS: u32 = 90;
/// Circles of equal intensity.
const CIRCLES: u32 = 4;

/// Draws the field that adds a luminaire.
pub(super) fn adding(ui: &mut Ui, ui_state: &mut UiState) {
    row(ui, "Luminaire", |ui| {
        let path = TextEdit::singleline(&mut ui_state.luminaire_to_add).desired_width(118.0);
        ui.add(path.hint_text(".ies or .ldt, or drop it"));
        let is_named = !ui_state.luminaire_to_add.trim().is_empty();
        if ui.add_enabled(is_named, egui::Button::new("Add").small()).clicked() {
            ui_state.requests.push(Request::AddLuminaire);
        }
        if ui.small_button("…").on_hover_text("Choose a luminaire or a model").clicked() {
            ui_state.requests.push(Request::Ask(Purpose::Add));
        }
    });
}

/// Draws the editor of a luminaire.
pub(super) fn luminaire(ui: &mut Ui, luminaire: &mut Luminaire) {
    let mut degrees = luminaire.turn.to_degrees();
    let slider =
        egui::Slider::new(&mut degrees, -180.0..=180.0).clamping(egui::SliderClamping::Edits).suffix("°");
    if row(ui, "Turn", |ui| ui.add(slider).changed()) {
        luminaire.turn = degrees.to_radians();
    }
    let name = luminaire.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    row(ui, "Measured", |ui| ui.add(egui::Label::new(name).truncate()));
    curve(ui, &luminaire.profile);
}

/// Draws the candela curve: intensity as the distance from the middle, downwards along the axis.
/// One line is the planes C0 and C180, the other C90 and C270.
fn curve(ui: &mut Ui, profile: &Profile) {
    let (area, _) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    let painter = ui.painter_at(area);
    let is_downward = profile.widest <= 0.51 * std::f32::consts::PI;
    let radius = if is_downward { HEIGHT - 20.0 } else { 0.5 * HEIGHT - 8.0 };
    let middle = pos2(area.center().x, if is_downward { area.top() + 8.0 } else { area.center().y });
    let faint = Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.5));
    for circle in 1..=CIRCLES {
        let fraction = circle as f32 / CIRCLES as f32;
        painter.circle_stroke(middle, fraction * radius, faint);
        let value = short(f64::from(fraction) * profile.peak_candela);
        let place = middle + vec2(2.0, fraction * radius);
        painter.text(place, Align2::LEFT_BOTTOM, value, FontId::proportional(10.0), faint.color);
    }
    let at = |axial: f32, side: f32, around: f64| -> Pos2 {
        let length = radius * profile.fraction(axial.into(), around) as f32;
        middle + length * vec2(side * axial.sin(), axial.cos())
    };
    for (planes, colour) in [([0.0, 180.0], PALETTE[1]), ([90.0, 270.0], PALETTE[0])] {
        let half = |side: f32, plane: f64| {
            (0..=SEGMENTS).map(move |step| (profile.widest * step as f32 / SEGMENTS as f32, side, plane))
        };
        let left: Vec<_> = half(-1.0, planes[1]).collect();
        let points = left.into_iter().rev().chain(half(1.0, planes[0]));
        let points = points.map(|(axial, side, plane): (f32, f32, f64)| at(axial, side, plane.to_radians()));
        painter.line(points.collect(), PathStroke::new(1.5, colour));
    }
    ui.small(format!(
        "{} cd at most; {} lm. Orange: C0 and C180; blue: C90 and C270.",
        short(profile.peak_candela),
        short(profile.peak_candela * profile.steradians())
    ));
}
