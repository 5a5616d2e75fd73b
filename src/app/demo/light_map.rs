//! Illuminance and luminance of the picture: false colours with their legend, and values at the
//! position of the pointer.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Ui, pos2, vec2};

use super::gizmos::Projection;
use super::session::Contribution;
use crate::app::false_colours::{Quantity, Scale, values};
use crate::error::Result;
use crate::renderer::{Layer, Renderer};
use glam::Vec2;

/// Height of the legend's bar, points, and its number of colours.
const BAR: f32 = 14.0;
const COLOURS: usize = 64;
/// Largest number of lines for lights at the pointer.
const MAX_LINES: usize = 8;
/// Distance of the values from the pointer, points.
const BESIDE: egui::Vec2 = vec2(14.0, 10.0);

/// Values of a picture, row by row from the top.
pub(super) struct LightMap {
    version: u64,
    size: [u32; 2],
    lux: Vec<f64>,
    nits: Vec<f64>,
}

impl LightMap {
    /// Reads the values of the picture of that version.
    pub(super) fn new(renderer: &Renderer, version: u64) -> Result<Self> {
        let of = |layer| Ok(values(&renderer.layer(layer)?));
        Ok(Self { version, size: renderer.size(), lux: of(Layer::Irradiance)?, nits: of(Layer::Beauty)? })
    }

    /// Whether it is of that picture.
    pub(super) fn is_of(&self, renderer: &Renderer, version: u64) -> bool {
        (self.version, self.size) == (version, renderer.size())
    }

    pub(super) fn values(&self, quantity: Quantity) -> &[f64] {
        match quantity {
            Quantity::Lux => &self.lux,
            Quantity::Nits => &self.nits,
        }
    }

    /// Draws both values of the pixel under the pointer, and the lights that contribute most.
    pub(super) fn label(
        &self,
        painter: &Painter,
        projection: Projection,
        pointer: Pos2,
        contributions: &[Contribution],
    ) {
        if !painter.clip_rect().contains(pointer) {
            return;
        }
        let [x, y] = projection.pixel(Vec2::new(pointer.x, pointer.y), self.size);
        let Some(pixel) =
            self.lux.get((y * self.size[0] + x) as usize).map(|_| (y * self.size[0] + x) as usize)
        else {
            return;
        };
        let mut text = format!("{} lx\n{} cd/m²", short(self.lux[pixel]), short(self.nits[pixel]));
        let of_lights = contributions.iter().map(|one| (one.light.as_str(), one.lux[pixel]));
        for line in percentages(of_lights.collect()) {
            text += &format!("\n{line}");
        }
        let galley = painter.layout_no_wrap(text, FontId::proportional(13.0), Color32::WHITE);
        // Whole at the right and the lower edge.
        let last = painter.clip_rect().max - galley.size() - vec2(4.0, 4.0);
        let place = (pointer + BESIDE).min(last);
        let frame = Rect::from_min_size(place, galley.size()).expand(4.0);
        painter.rect_filled(frame, 3.0, Color32::from_black_alpha(200));
        painter.galley(place, galley, Color32::WHITE);
    }
}

/// Lines with the percentage of each light, the brightest first. The last of [`MAX_LINES`] lines
/// has all other lights together.
fn percentages(mut lights: Vec<(&str, f32)>) -> Vec<String> {
    let sum: f64 = lights.iter().map(|(_, lux)| f64::from(*lux)).sum();
    if sum <= 0.0 {
        return Vec::new();
    }
    lights.sort_by(|a, b| b.1.total_cmp(&a.1));
    let line = |lux: f64, name: &str| format!("{:.0} % {name}", 100.0 * lux / sum);
    let shown = if lights.len() > MAX_LINES { MAX_LINES - 1 } else { lights.len() };
    let (first, others) = lights.split_at(shown);
    let mut lines: Vec<String> = first.iter().map(|(name, lux)| line(f64::from(*lux), name)).collect();
    if !others.is_empty() {
        let lux: f64 = others.iter().map(|(_, lux)| f64::from(*lux)).sum();
        lines.push(line(lux, &format!("{} others", others.len())));
    }
    lines
}

/// A value with three digits.
pub(super) fn short(value: f64) -> String {
    match value {
        value if value >= 100.0 => format!("{value:.0}"),
        value if value >= 10.0 => format!("{value:.1}"),
        value => format!("{value:.2}"),
    }
}

/// Draws the legend: a bar of colours with the values at its ends and in its middle.
pub(super) fn legend(ui: &mut Ui, scale: Scale, quantity: Quantity) {
    let (bar, _) = ui.allocate_exact_size(vec2(ui.available_width(), BAR), Sense::hover());
    let painter = ui.painter();
    for number in 0..COLOURS {
        let [left, right] = [number, number + 1].map(|edge| edge as f32 / COLOURS as f32);
        let [r, g, b, _] = scale.colour(scale.value((number as f64 + 0.5) / COLOURS as f64));
        let low = pos2(bar.left() + left * bar.width(), bar.top());
        let high = pos2(bar.left() + right * bar.width(), bar.bottom());
        painter.rect_filled(Rect::from_min_max(low, high), 0.0, Color32::from_rgb(r, g, b));
    }
    let (row, _) = ui.allocate_exact_size(vec2(ui.available_width(), BAR), Sense::hover());
    let ends = [(0.0, Align2::LEFT_TOP), (0.5, Align2::CENTER_TOP), (1.0, Align2::RIGHT_TOP)];
    for (place, align) in ends {
        let text = format!("{} {}", short(scale.value(place)), quantity.unit());
        let at = pos2(row.left() + place as f32 * row.width(), row.top());
        ui.painter().text(at, align, text, FontId::proportional(11.0), ui.visuals().text_color());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_brightest_lights_come_first_and_the_rest_together() {
        assert_eq!(percentages(vec![("a", 1.0), ("b", 3.0)]), ["75 % b", "25 % a"]);
        assert!(percentages(vec![("a", 0.0)]).is_empty() && percentages(Vec::new()).is_empty());
        let lines = percentages(vec![("x", 1.0); 10]);
        assert_eq!((lines.len(), lines[0].as_str(), lines[7].as_str()), (8, "10 % x", "30 % 3 others"));
        assert_eq!(percentages(vec![("x", 1.0); 8]).len(), 8);
    }

    #[test]
    fn values_have_three_digits() {
        let shown = [0.0, 0.123, 9.876, 12.34, 123.4, 54_321.0].map(short);
        assert_eq!(shown, ["0.00", "0.12", "9.88", "12.3", "123", "54321"]);
    }
}
