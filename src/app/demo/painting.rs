//! Painting the region of a light meter on surfaces.

use glam::{Vec2, Vec3};

use super::gizmos::Projection;
use super::meters::{free_name, raised};
use super::placing::{scene_size, surface};
use super::session::Session;
use super::ui_state::{Place, UiState};
use crate::error::Result;
use crate::scene::meter::{Meter, MeterShape};

/// Radius of the brush, points of the window.
pub(super) const BRUSH: f32 = 18.0;
/// Distance between neighbours of a region, in scene sizes, and at most, metres.
const SPACING: f32 = 0.02;
const SPACING_M: f32 = 0.2;
/// Largest number of points of a region. Each has as many gather rays as several cache points.
const MAX_POINTS: usize = 512;
/// Largest number of places of the brush in one movement.
const MAX_PLACES: f32 = 32.0;

/// Paints the surface that the brush passes on its way in the picture's area, or erases it.
pub(super) fn brush(
    (from, to): (Vec2, Vec2),
    (area, projection): (egui::Rect, Projection),
    erases: bool,
    session: &mut Session,
    ui_state: &mut UiState,
) -> Result<()> {
    let mut places = Vec::new();
    for probe in probes(from, to).into_iter().filter(|probe| area.contains(egui::pos2(probe.x, probe.y))) {
        places.extend(surface(session, projection, probe)?);
    }
    paint(session, ui_state, &places, erases);
    Ok(())
}

/// Where the brush looks for surfaces while the pointer moves: in each of its places the middle and
/// six points around it.
fn probes(from: Vec2, to: Vec2) -> Vec<Vec2> {
    let count = (from.distance(to) / BRUSH).ceil().clamp(1.0, MAX_PLACES) as u32;
    let places = (1..=count).map(|number| from.lerp(to, number as f32 / count as f32));
    let around = |turn: u32| 0.9 * BRUSH * Vec2::from_angle(turn as f32 * std::f32::consts::FRAC_PI_3);
    places
        .flat_map(|place| std::iter::once(place).chain((0..6).map(move |turn| place + around(turn))))
        .collect()
}

/// Adds surface to the chosen region, or to a new one. With `erases`, removes it instead.
pub(super) fn paint(session: &mut Session, ui_state: &mut UiState, places: &[Place], erases: bool) {
    let size = scene_size(session);
    let spacing = (SPACING * size).min(SPACING_M);
    let meters = &mut session.document.meters;
    let is_region = |index: &usize| {
        meters.get(*index).is_some_and(|meter| matches!(meter.shape, MeterShape::Region { .. }))
    };
    let chosen = ui_state.meters.chosen.filter(is_region);
    let mut points = match chosen.map(|index| &meters[index].shape) {
        Some(MeterShape::Region { points }) => points.clone(),
        _ => Vec::new(),
    };
    for place in places {
        let point = raised((place.position, place.normal), size);
        let is_near = |other: Vec3| other.distance(point.0) < spacing;
        if erases {
            points.retain(|(at, _)| !is_near(*at));
        } else if points.len() < MAX_POINTS && !points.iter().any(|(at, _)| is_near(*at)) {
            points.push(point);
        }
    }
    match chosen {
        Some(index) if points.is_empty() => {
            meters.remove(index);
            ui_state.meters.chosen = None;
        }
        Some(index) => meters[index].shape = MeterShape::Region { points },
        None if points.is_empty() => (),
        None => {
            let name = free_name(meters);
            meters.push(Meter { name, shape: MeterShape::Region { points } });
            ui_state.meters.chosen = Some(meters.len() - 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_brush_leaves_no_gap_however_fast_it_moves() {
        for (from, to) in [(Vec2::ZERO, Vec2::ZERO), (Vec2::ZERO, Vec2::new(300.0, 40.0))] {
            let found = probes(from, to);
            assert_eq!(found[found.len() - 7], to);
            for step in 0..=100 {
                let way = from.lerp(to, step as f32 / 100.0);
                let nearest = found.iter().map(|probe| probe.distance(way)).fold(f32::MAX, f32::min);
                assert!(nearest < BRUSH, "{way}: {nearest}");
            }
        }
        assert_eq!(probes(Vec2::ZERO, Vec2::new(1e6, 0.0)).len(), 32 * 7);
    }
}
