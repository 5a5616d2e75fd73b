//! The paper's columns, live. [Yue, Table 2]

use egui::{Color32, Pos2, Rect, Sense, Ui, Vec2, pos2, vec2};

use super::PALETTE;
use crate::app::demo::session::{Cost, FRAMES, Session};
use crate::app::demo::ui_state::UiState;
use crate::renderer::Columns;

/// Height of the chart, points.
const HEIGHT: f32 = 84.0;

/// Name and value of each column.
fn columns(columns: &Columns) -> [(&'static str, f64); 5] {
    let Columns { Tdi, Tlpe, Thvds, Tfg, Tsplat } = *columns;
    [("Tdi", Tdi), ("Tlpe", Tlpe), ("Thvds", Thvds), ("Tfg", Tfg), ("Tsplat", Tsplat)]
}

/// Draws the numbers of the last frame, recent frames as bars, and the work that the
/// last frame skipped.
pub(super) fn timing(ui: &mut Ui, session: &Session, ui_state: &mut UiState) {
    ui.checkbox(&mut ui_state.times_passes, "Time each pass")
        .on_hover_text("Passes then wait for each other, and frames take longer");
    ui.checkbox(&mut ui_state.coarsens, "Coarser while moving")
        .on_hover_text("A half or a quarter of the width and height while frames take over 50 ms");
    let Some(last) = session.costs.back() else {
        ui.small("No frame yet.");
        return;
    };
    chart(ui, session);
    egui::Grid::new("columns").num_columns(2).spacing([12.0, 2.0]).show(ui, |ui| {
        for ((name, ms), colour) in
            columns(&last.columns).into_iter().zip(PALETTE).filter(|_| has_passes(last))
        {
            ui.colored_label(colour, format!("■ {name}"));
            ui.monospace(format!("{ms:9.3} ms"));
            ui.end_row();
        }
        ui.strong("Ttot");
        ui.monospace(format!("{:9.3} ms", last.device_ms));
        ui.end_row();
        ui.label("frame");
        ui.monospace(format!("{:9.3} ms ({:.1} /s)", last.frame_ms, 1e3 / last.frame_ms.max(1e-3)));
        ui.end_row();
    });
    let Some(report) = &session.last else { return };
    let [factors, irradiances] = report.lights_unchanged.map(|fraction| 100.0 * fraction);
    ui.small(format!(
        "Lights whose paths stood: {factors:.0} %, whose pixels stood: {irradiances:.0} %; records gathered: {}",
        report.gathered
    ));
    if report.passes.is_empty() {
        return;
    }
    let idle: Vec<&str> =
        columns(&report.columns).into_iter().filter_map(|(name, ms)| (ms == 0.0).then_some(name)).collect();
    let skipped = if idle.is_empty() { "nothing".to_owned() } else { idle.join(", ") };
    ui.small(format!("Left out as a whole: {skipped}"));
    ui.collapsing("Passes", |ui| {
        egui::Grid::new("passes").num_columns(2).spacing([12.0, 1.0]).show(ui, |ui| {
            for pass in &report.passes {
                ui.label(pass.name);
                ui.monospace(format!("{:9.3} ms", pass.ms));
                ui.end_row();
            }
        });
    });
}

/// Whether the passes of a frame were timed one by one.
fn has_passes(cost: &Cost) -> bool {
    columns(&cost.columns).iter().any(|column| column.1 > 0.0)
}

/// Draws a bar per frame, the newest at the right.
fn chart(ui: &mut Ui, session: &Session) {
    let (area, _) = ui.allocate_exact_size(vec2(ui.available_width().max(60.0), HEIGHT), Sense::hover());
    let painter = ui.painter_at(area);
    painter.rect_filled(area, 2.0, ui.visuals().extreme_bg_color);
    let most = session.costs.iter().map(|cost| cost.device_ms).fold(0.1, f64::max);
    let width = area.width() / FRAMES as f32;
    let unused = FRAMES - session.costs.len();
    for (index, cost) in session.costs.iter().enumerate() {
        let left = area.left() + (unused + index) as f32 * width;
        let mut bottom = area.bottom();
        let whole = [(cost.device_ms, ui.visuals().weak_text_color())];
        let by_column = columns(&cost.columns).map(|column| column.1).into_iter().zip(PALETTE);
        let parts: Vec<(f64, Color32)> = if has_passes(cost) { by_column.collect() } else { whole.to_vec() };
        for (ms, colour) in parts {
            let height = (ms / most) as f32 * (area.height() - 12.0);
            bar(&painter, pos2(left, bottom - height), vec2(width.max(1.0), height), colour);
            bottom -= height;
        }
    }
    let text = ui.visuals().text_color();
    let font = egui::FontId::proportional(10.0);
    painter.text(
        area.left_top() + vec2(3.0, 1.0),
        egui::Align2::LEFT_TOP,
        format!("{most:.1} ms"),
        font,
        text,
    );
}

fn bar(painter: &egui::Painter, corner: Pos2, size: Vec2, colour: Color32) {
    painter.rect_filled(Rect::from_min_size(corner, size), 0.0, colour);
}
