//! Placing the chosen lights: copies, aims at a point, and positions on a surface.

use glam::{Vec2, Vec3};

use super::document::Document;
use super::gizmos::{Projection, turn_area};
use super::session::Session;
use super::ui_state::{Chosen, Place, UiState};
use crate::error::Result;
use crate::scene::LightKind;

/// Offset of a copy from its light, in scene sizes.
const BESIDE: f32 = 0.05;
/// Distance of a light from the surface that it is put on, in scene sizes.
const OFF: f32 = 0.01;

/// The scene's diagonal, metres.
pub(super) fn scene_size(session: &Session) -> f32 {
    let (low, high) = session.scene.bounds();
    (high - low).length()
}

/// Adds a copy of each of these lights beside it, and chooses the copies.
pub(super) fn duplicate(session: &mut Session, ui_state: &mut UiState, lights: &[u64]) {
    if lights.is_empty() {
        return session.alarm(missing(lights, "copy it with Ctrl+D"));
    }
    let [right, ..] = session.camera.frame();
    let offset = BESIDE * scene_size(session) * right.normalize_or_zero();
    let mut copies = Vec::new();
    for id in lights {
        let Some(entry) = session.document.lights.iter().find(|entry| entry.id == *id) else { continue };
        let mut light = entry.light.clone();
        if light.kind.is_fixed() {
            let line = format!("not copied: `{}` is part of the model or the sky", light.name);
            session.alarm(line);
            continue;
        }
        if let Some(position) = light.kind.position() {
            light.kind = light.kind.moved_to(position + offset);
        }
        let place = session.document.add(light);
        let copy = session.document.lights[place].id;
        ui_state.mixer.copy(*id, copy);
        copies.push(copy);
    }
    if !copies.is_empty() {
        ui_state.choose_lights(&copies);
    }
}

/// Removes lights. Other chosen lights stay chosen.
pub(super) fn remove(session: &mut Session, ui_state: &mut UiState, lights: &[u64]) {
    session.document.lights.retain(|entry| !lights.contains(&entry.id));
    if let Chosen::Light(_) = ui_state.chosen {
        let chosen = ui_state.chosen_lights();
        let left: Vec<u64> = chosen.into_iter().filter(|id| !lights.contains(id)).collect();
        ui_state.choose_lights(&left);
    }
}

/// Takes the dragged light, and moves the other chosen ones by the same offset from their places.
pub(super) fn drag(
    document: &mut Document,
    (dragged, kind): (u64, LightKind),
    others: &[(u64, LightKind)],
    offset: Option<Vec3>,
) {
    for entry in &mut document.lights {
        if entry.id == dragged {
            entry.light.kind = kind;
        }
        let before = others.iter().find(|(id, _)| *id == entry.id);
        let place = before.and_then(|(_, before)| Some((before, before.position()?)));
        if let (Some((before, place)), Some(offset)) = (place, offset) {
            // Without an offset, the light is what it was, bit for bit.
            let is_moved = offset != Vec3::ZERO;
            entry.light.kind = if is_moved { before.moved_to(place + offset) } else { *before };
        }
    }
}

/// Aims the chosen lights at a point of a surface. `anchor`: where the window shows lights that are
/// infinitely far away.
pub(super) fn aim(session: &mut Session, ui_state: &UiState, place: Option<Place>, anchor: Vec3) {
    let chosen = ui_state.chosen_lights();
    let Some(place) = place.filter(|_| !chosen.is_empty()) else {
        return session.alarm(missing(&chosen, "aim a light with Ctrl+Shift and a click"));
    };
    let mut is_aimed = false;
    for entry in session.document.lights.iter_mut().filter(|entry| chosen.contains(&entry.id)) {
        if let Some(kind) = aimed(entry.light.kind, place.position, anchor) {
            (entry.light.kind, is_aimed) = (kind, true);
        }
    }
    if !is_aimed {
        let line = "not aimed: only spots, luminaires, area lights and suns have a direction";
        session.alarm(line.to_owned());
    }
}

/// Puts the primary light on a surface.
pub(super) fn snap(session: &mut Session, ui_state: &UiState, place: Option<Place>) {
    let Chosen::Light(primary) = ui_state.chosen else {
        return session.alarm(missing(&[], "put it on a surface with U"));
    };
    let Some(place) = place else {
        return session.alarm(missing(&[primary], "put a light on it with U"));
    };
    let off = OFF * scene_size(session);
    let Some(entry) = session.document.lights.iter_mut().find(|entry| entry.id == primary) else { return };
    match snapped(entry.light.kind, place, off) {
        Some(kind) => entry.light.kind = kind,
        None => {
            let name = &entry.light.name;
            let line = format!("not moved: `{name}` has no position; point, spot and area lights have one");
            session.alarm(line);
        }
    }
}

/// The surface under the pointer. `None` until the light paths are traced.
pub(super) fn surface(session: &Session, projection: Projection, pointer: Vec2) -> Result<Option<Place>> {
    let Some(renderer) = session.renderer() else { return Ok(None) };
    let size = renderer.size();
    let pixel = projection.pixel(pointer, size);
    let found = renderer.surface_at(pixel)?;
    Ok(found.map(|found| Place { position: found.position, normal: found.normal, material: found.material }))
}

/// What the user must do first to place a light.
fn missing(chosen: &[u64], next: &str) -> String {
    match chosen {
        [] => format!("no light is chosen: click one first, then {next}"),
        _ => format!("no traced surface is under the pointer: point at one, then {next}"),
    }
}

/// The light with its front towards `target`; `anchor` as for [`aim`]. `None` if it has no
/// direction, or is there.
fn aimed(mut kind: LightKind, target: Vec3, anchor: Vec3) -> Option<LightKind> {
    let way = (target - kind.position().unwrap_or(anchor)).as_dvec3().try_normalize()?;
    match &mut kind {
        LightKind::Spot { direction, .. } | LightKind::Directional { direction, .. } => {
            *direction = way.as_vec3();
        }
        LightKind::Area { corner, edge_u, edge_v, .. } => turn_area([corner, edge_u, edge_v], way),
        LightKind::Point { .. } | LightKind::Surface { .. } | LightKind::Sky { .. } => return None,
    }
    Some(kind)
}

/// The light `off` metres above a surface; an area light lies flat and faces away from it. `None`
/// if it has no position.
fn snapped(kind: LightKind, place: Place, off: f32) -> Option<LightKind> {
    kind.position()?;
    let mut kind = kind.moved_to(place.position + off * place.normal);
    if let LightKind::Area { corner, edge_u, edge_v, .. } = &mut kind {
        turn_area([corner, edge_u, edge_v], place.normal.as_dvec3());
    }
    Some(kind)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds() -> [LightKind; 4] {
        let (position, direction) = (Vec3::new(0.5, 2.0, -0.5), Vec3::NEG_Y);
        let (intensity, radiance) = (Vec3::ONE, Vec3::ONE);
        let corner = position - Vec3::new(0.2, 0.0, 0.1);
        let (edge_u, edge_v) = (0.4 * Vec3::X, 0.2 * Vec3::Z);
        [
            LightKind::Spot { position, direction, intensity, angle: 0.5, penumbra: 0.0 },
            LightKind::Area { corner, edge_u, edge_v, radiance, samples: 4 },
            LightKind::Directional { direction, irradiance: Vec3::ONE },
            LightKind::Point { position, intensity },
        ]
    }

    #[test]
    fn lights_are_aimed_from_where_they_are_shown() {
        let (target, anchor) = (Vec3::new(1.0, 0.0, 0.25), Vec3::new(-3.0, 1.0, 0.0));
        let [spot, area, sun, point] = kinds().map(|kind| aimed(kind, target, anchor));
        let way = |from: Vec3| (target - from).normalize();
        let place = kinds()[0].position().unwrap();
        let Some(LightKind::Spot { position, direction, .. }) = spot else { panic!() };
        assert_eq!(position, place);
        assert!(direction.distance(way(place)) < 1e-6);
        let Some(LightKind::Area { corner, edge_u, edge_v, .. }) = area else { panic!() };
        assert!((corner + 0.5 * (edge_u + edge_v)).distance(place) < 1e-6, "it turns about its middle");
        assert!(edge_u.cross(edge_v).normalize().distance(way(place)) < 1e-6);
        let lengths = [edge_u.length(), edge_v.length()];
        assert!((lengths[0] - 0.4).abs() < 1e-6 && (lengths[1] - 0.2).abs() < 1e-6, "{lengths:?}");
        let Some(LightKind::Directional { direction, .. }) = sun else { panic!() };
        assert!(direction.distance(way(anchor)) < 1e-6);
        assert_eq!(point, None);
        assert_eq!(aimed(kinds()[0], place, anchor), None, "a light cannot aim at itself");
    }

    #[test]
    fn lights_are_put_on_surfaces_and_areas_lie_flat() {
        let normal = Vec3::new(1.0, 0.0, 0.0);
        let place = Place { position: Vec3::new(-1.0, 0.5, 0.25), normal, material: 0 };
        let [spot, area, sun, point] = kinds().map(|kind| snapped(kind, place, 0.125));
        let wanted = Vec3::new(-0.875, 0.5, 0.25);
        let Some(LightKind::Spot { position, direction, .. }) = spot else { panic!() };
        assert_eq!((position, direction), (wanted, Vec3::NEG_Y), "its direction stays");
        assert_eq!(point.unwrap().position(), Some(wanted));
        let Some(LightKind::Area { corner, edge_u, edge_v, .. }) = area else { panic!() };
        assert!((corner + 0.5 * (edge_u + edge_v)).distance(wanted) < 1e-6);
        assert!(edge_u.cross(edge_v).normalize().distance(normal) < 1e-6, "it faces away from the wall");
        assert_eq!(sun, None);
    }
}
