//! Light meters over the picture.

use egui::{Color32, Painter, Shape, Stroke, pos2};
use glam::Vec3;

use super::gizmos::Projection;
use super::overlays::caption;
use super::panels::PALETTE;
use super::session::Session;
use crate::scene::meter::MeterShape;

/// Draws the outline, the points and the mean of each meter.
pub(super) fn paint(painter: &Painter, projection: Projection, session: &Session, chosen: Option<usize>) {
    let seen = |point: Vec3| projection.project(point).map(|(seen, _)| pos2(seen.x, seen.y));
    for (index, meter) in session.document.meters.iter().enumerate() {
        let colour = if chosen == Some(index) { PALETTE[1] } else { PALETTE[0] };
        if let MeterShape::Plane { corner, edge_u, edge_v, .. } = meter.shape {
            let corners = [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v].map(seen);
            if let [Some(a), Some(b), Some(c), Some(d)] = corners {
                for (width, colour) in [(3.5, Color32::BLACK), (1.5, colour)] {
                    painter.add(Shape::closed_line(vec![a, b, c, d], Stroke::new(width, colour)));
                }
            }
        }
        let points = meter.points();
        for at in points.iter().filter_map(|(at, _)| seen(*at)) {
            painter.circle_filled(at, 2.5, Color32::BLACK);
            painter.circle_filled(at, 1.5, colour);
        }
        let middle = points.iter().map(|(at, _)| *at).sum::<Vec3>() / points.len().max(1) as f32;
        if let Some((at, _)) = projection.project(middle) {
            let text = match session.readings().get(index) {
                Some(reading) => format!("{}: {:.0} lx", meter.name, reading.mean),
                None => meter.name.clone(),
            };
            caption(painter, at, &text);
        }
    }
}
