//! Exposure, white balance and tone curve, and the levels that they give.

use egui::{Align2, Color32, ComboBox, DragValue, FontId, Rect, Sense, Slider, Ui, pos2, vec2};

use super::row;
use crate::app::demo::levels::{BARS, Levels, STOPS};
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::UiState;
use crate::scene::{ToneCurve, WhiteBalance};

const EXPOSURE: std::ops::RangeInclusive<f32> = -10.0..=10.0;
/// Height of the histogram, and of the row of numbers below it, points.
const HEIGHT: f32 = 64.0;
const NUMBERS: f32 = 14.0;
/// Colours of the channels.
const CHANNELS: [Color32; 3] = [
    Color32::from_rgb(0xff, 0x70, 0x60),
    Color32::from_rgb(0x70, 0xd0, 0x70),
    Color32::from_rgb(0x70, 0xa0, 0xff),
];

pub(super) fn exposure(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let mut stops = session.display.exposure_stops;
    let slider = Slider::new(&mut stops, EXPOSURE)
        .clamping(egui::SliderClamping::Edits)
        .step_by(0.25)
        .suffix(" stops");
    if row(ui, "Exposure", |ui| ui.add(slider).changed()) {
        session.expose(stops);
    }
    let mut follows = session.follows_exposure();
    let is_changed = row(ui, "", |ui| {
        let locks = ui.selectable_value(&mut follows, false, "locked");
        let auto = ui.selectable_value(&mut follows, true, "auto (K)");
        let auto = auto.on_hover_text("The mean of every picture becomes middle grey");
        locks.changed() || auto.changed()
    });
    if is_changed {
        session.follow_exposure(follows);
    }
    white_balance(ui, &mut session.display.white_balance);
    let tone = &mut session.display.tone;
    row(ui, "Tone (T)", |ui| {
        ComboBox::from_id_salt("tone").selected_text(tone.name()).show_ui(ui, |ui| {
            for curve in ToneCurve::ALL {
                ui.selectable_value(tone, curve, curve.name());
            }
        });
    });
    ui.horizontal(|ui| {
        ui.checkbox(&mut ui_state.shows_histogram, "Histogram (G)");
        ui.checkbox(&mut ui_state.shows_zebra, "Zebra (Z)")
            .on_hover_text("Red stripes where a code is 254 or 255, blue ones where all are 0 or 1");
    });
    match &ui_state.levels {
        Some(levels) if ui_state.shows_histogram => histogram(ui, levels),
        _ => (),
    }
}

/// Draws the colour that is shown as white.
fn white_balance(ui: &mut Ui, white: &mut WhiteBalance) {
    row(ui, "White", |ui| {
        let WhiteBalance { kelvin, tint } = white;
        let value = DragValue::new(kelvin)
            .speed(20.0)
            .range(WhiteBalance::KELVIN)
            .clamp_existing_to_range(false)
            .update_while_editing(false)
            .suffix(" K");
        ui.add(value.max_decimals(0)).on_hover_text("Light of this colour temperature is shown as white");
        let value = DragValue::new(tint)
            .speed(0.2)
            .range(WhiteBalance::TINT)
            .clamp_existing_to_range(false)
            .update_while_editing(false)
            .prefix("tint ");
        ui.add(value.max_decimals(1))
            .on_hover_text("Positive: the light is green, the picture becomes magenta");
        let is_neutral = *white == WhiteBalance::default();
        if ui.add_enabled(!is_neutral, egui::Button::new("D65")).on_hover_text("Neutral").clicked() {
            *white = WhiteBalance::default();
        }
    });
}

/// Draws the histogram of luminance: a bar for each quarter of a stop, and a line at middle grey.
fn histogram(ui: &mut Ui, levels: &Levels) {
    let width = ui.available_width();
    let (area, _) = ui.allocate_exact_size(vec2(width, HEIGHT), Sense::hover());
    let painter = ui.painter_at(area);
    painter.rect_filled(area, 2.0, ui.visuals().extreme_bg_color);
    let text = ui.visuals().text_color();
    let most = levels.bars.iter().copied().fold(1e-9, f64::max);
    let x = |bar: f64| area.left() + (bar / BARS as f64) as f32 * area.width();
    for (bar, fraction) in (0..).zip(&levels.bars) {
        // The root shows small fractions.
        let height = (fraction / most).sqrt() as f32 * (area.height() - 2.0);
        let low = pos2(x(f64::from(bar)), area.bottom() - height);
        let high = pos2(x(f64::from(bar) + 1.0), area.bottom());
        painter.rect_filled(Rect::from_min_max(low, high), 0.0, text.gamma_multiply(0.8));
    }
    let of_stops = |stops: f64| x(BARS as f64 * (stops - STOPS[0]) / (STOPS[1] - STOPS[0]));
    painter.vline(of_stops(0.0), area.y_range(), egui::Stroke::new(1.0, Color32::from_gray(0x90)));
    let (numbers, _) = ui.allocate_exact_size(vec2(width, NUMBERS), Sense::hover());
    for stops in [-8.0, -4.0, 0.0, 4.0] {
        let (at, label) = (pos2(of_stops(stops), numbers.top()), format!("{stops:+.0}"));
        let label = if stops == 0.0 { "middle grey".to_owned() } else { label };
        ui.painter().text(at, Align2::CENTER_TOP, label, FontId::proportional(10.0), text);
    }
    let percent = |fraction: f64| format!("{:.1} %", 100.0 * fraction);
    ui.horizontal(|ui| {
        ui.small("Clipped");
        for ((name, fraction), colour) in ["R", "G", "B"].into_iter().zip(levels.clipped).zip(CHANNELS) {
            ui.small(egui::RichText::new(format!("{name} {}", percent(fraction))).color(colour));
        }
        ui.small(format!("black {}", percent(levels.black)));
    });
    if levels.outside[1] > 0.0 || levels.outside[0] > 0.0 {
        let [below, above] = levels.outside.map(percent);
        ui.small(format!("Darker than the bars {below}, brighter {above}"));
    }
}
