//! A camera inside of a room.

use glam::Vec3;
use rayon::prelude::*;

use super::probe::{Hit, Probe};
use super::room::Room;
use super::up::Up;
use crate::scene::Camera;

/// Vertical field of view, degrees.
const FOV_Y: f32 = 60.0;
/// Elevation of the view, degrees.
const ELEVATION: f32 = -4.0;
const AZIMUTH_STEP: usize = 15;
/// Places along each side of the room.
const PLACES: usize = 12;
/// Rays along a side of a candidate's picture.
const SIDE: usize = 12;
/// Rays that judge a place.
const RAYS: usize = 40;
/// Height of the eyes of a standing person, metres.
const EYE_M: f64 = 1.7;

/// The camera that stands free, at eye height, and looks along the longest free distance.
pub(super) fn best(probe: &Probe, up: Up, room: &Room) -> Camera {
    let (floor, height) = storey(probe, up, room);
    // A person's, unless the room is low or its unit is not the metre.
    let eye = (0.6 * height).min((EYE_M / probe.radius_m) as f32);
    let eye = if f64::from(height) * probe.radius_m > 50.0 { 0.6 * height } else { eye };
    let [right, above, front] = up.frame();
    let (middle, half) = (0.5 * (probe.low + probe.high), 0.5 * probe.size());
    let place = |index: usize| 2.0 * (index as f32 + 0.53) / PLACES as f32 - 1.0;
    let level = floor + eye - middle.dot(above);
    let at = |x: usize, z: usize| middle + half * (place(x) * right + place(z) * front) + level * above;
    let places = (0..PLACES * PLACES).map(|index| at(index % PLACES, index / PLACES));
    let free: Vec<Vec3> =
        places.collect::<Vec<_>>().into_par_iter().filter(|&p| is_free(probe, up, p, height, eye)).collect();
    let free = if free.is_empty() { vec![roomiest(room, middle)] } else { free };
    let cameras: Vec<Camera> = free
        .into_iter()
        .flat_map(|place| {
            let directions =
                (0..360).step_by(AZIMUTH_STEP).map(|azimuth| up.direction(azimuth as f32, ELEVATION));
            directions.map(move |direction| up.camera(place, place + direction, FOV_Y))
        })
        .collect();
    let length = 2.0 * (half * (Vec3::ONE - above.abs())).length();
    let scored = cameras.into_par_iter().map(|camera| {
        let picture = probe.picture(&camera, SIDE);
        let sum: f32 = picture.iter().map(|hit| worth(hit.as_ref(), length, height)).sum();
        (sum, camera)
    });
    let scored: Vec<_> = scored.collect();
    let best = scored.into_iter().reduce(|best, other| if other.0 > best.0 { other } else { best });
    best.expect("there is a place").1
}

/// The floor's level and the height of the ceiling above it, medians over the room.
fn storey(probe: &Probe, up: Up, room: &Room) -> (f32, f32) {
    let (axis, tilt) = (up.vector(), 0.01 * Vec3::new(0.7, 0.4, 0.5));
    let level = |way: Vec3, default: f32| {
        let hits = room.points.iter().filter_map(|(point, _)| probe.cast(*point, (way + tilt).normalize()));
        let mut levels: Vec<f32> = hits.filter(|hit| hit.is_front).map(|hit| hit.point.dot(axis)).collect();
        levels.sort_by(f32::total_cmp);
        levels.get(levels.len() / 2).copied().unwrap_or(default)
    };
    let (floor, ceiling) = (level(-axis, probe.low.dot(axis)), level(axis, probe.high.dot(axis)));
    (floor, (ceiling - floor).max(1e-3))
}

/// Whether a place has fronts around, no surface close by, and the floor at its feet.
fn is_free(probe: &Probe, up: Up, place: Vec3, height: f32, eye: f32) -> bool {
    let around = probe.surroundings(place, RAYS);
    let below = (0.01 * Vec3::new(0.7, 0.4, 0.5) - up.vector()).normalize();
    let stands = probe.cast(place, below).is_none_or(|hit| hit.distance > 0.8 * eye);
    let clearance = (0.12 * height).min(0.3 * eye);
    around.fronts > 0.6 && around.backs < 0.15 && around.nearest > clearance && stands
}

/// The enclosed point farthest from all surfaces.
fn roomiest(room: &Room, middle: Vec3) -> Vec3 {
    let farthest = room.points.iter().max_by(|(_, a), (_, b)| a.nearest.total_cmp(&b.nearest));
    farthest.map_or(middle, |(point, _)| *point)
}

/// What a pixel adds to a camera's score: fronts count by their distance, and close ones as well
/// as backs and openings count against it.
fn worth(hit: Option<&Hit>, length: f32, height: f32) -> f32 {
    let close = 0.5 * height;
    match hit {
        None => -0.3,
        Some(hit) if !hit.is_front => -1.0,
        Some(hit) if hit.distance < close => -0.5 * (1.0 - hit.distance / close),
        Some(hit) => (hit.distance / length).min(1.0).sqrt(),
    }
}
