//! The picture on the screen: its place, and the pictures over it and beside it.

use egui::{Color32, Rect, Ui, pos2};

/// Points by which the shape of a coarse picture may differ from that of its area.
const ROUNDED: f32 = 4.0;

/// The textures of the picture.
#[derive(Clone, Copy)]
pub(super) struct Textures {
    pub(super) picture: egui::TextureId,
    /// Colours of cells or of light, drawn over it.
    pub(super) over: Option<egui::TextureId>,
    /// Stripes on pixels without detail, drawn over it if no colours are.
    pub(super) zebra: Option<egui::TextureId>,
    /// Monte Carlo or a snapshot, drawn beside it.
    pub(super) beside: Option<egui::TextureId>,
}

/// Where a picture of this size stands in its area. One that waits for another shape is not
/// stretched; the size of a coarse one is rounded.
pub(super) fn framed(area: Rect, [width, height]: [u32; 2]) -> Rect {
    let scale = (area.width() / width as f32).min(area.height() / height as f32);
    let size = scale * egui::vec2(width as f32, height as f32);
    match (area.size() - size).max_elem() <= ROUNDED {
        true => area,
        false => Rect::from_center_size(area.center(), size),
    }
}

/// Draws the picture, the colours or stripes over it, and another picture right of the split.
pub(super) fn draw(ui: &Ui, area: Rect, textures: Textures, wipe: Option<f32>) {
    let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
    let painter = ui.painter();
    painter.image(textures.picture, area, whole, Color32::WHITE);
    if let Some(over) = textures.over.or(textures.zebra) {
        painter.image(over, area, whole, Color32::WHITE);
    }
    if let (Some(beside), Some(wipe)) = (textures.beside, wipe) {
        let border = area.left() + wipe * area.width();
        let (area, part) = (
            Rect::from_min_max(pos2(border, area.top()), area.max),
            Rect::from_min_max(pos2(wipe, 0.0), pos2(1.0, 1.0)),
        );
        painter.image(beside, area, part, Color32::WHITE);
    }
    if let Some(wipe) = wipe {
        let border = area.left() + wipe * area.width();
        painter.vline(border, area.y_range(), egui::Stroke::new(2.0, Color32::WHITE));
        painter.vline(border + 2.0, area.y_range(), egui::Stroke::new(1.0, Color32::BLACK));
    }
}
