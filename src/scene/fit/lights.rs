//! Lights that suit a view: lamps under a room's ceiling, or a sun beside the camera and the sky.

use std::f64::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::probe::{Hit, OFFSET, Probe, sphere};
use super::room::Room;
use super::up::Up;
use crate::scene::{Camera, Light, LightKind, Triangle};

/// Mean direct irradiance of a lamp, W/m².
const LAMP_IRRADIANCE: f64 = 1.0;
/// Irradiance of the sun, W/m², and radiance of the sky, W/m²/sr: as bright as on a hazy day.
const SUN: f32 = 3.0;
const SKY: Vec3 = Vec3::new(0.25, 0.28, 0.32);
/// Emitting triangles, and rays from each, that decide whether they light the model.
const EMITTERS: usize = 64;
const EMITTER_RAYS: usize = 32;
/// Points that decide how much of the other surfaces they light, the form factor from which one is
/// lit, and the least fraction.
const LIT_POINTS: f64 = 256.0;
const LEAST_FACTOR: f64 = 0.01;
const LIT: f64 = 0.4;
/// Rays along a side of the picture that the light is chosen for.
const SIDE: usize = 20;
/// Height of a lamp, as a fraction of the room's.
const LAMP_HEIGHT: f32 = 0.8;

/// Most lamps of a room, and the least part of the light that a further one adds.
const LAMPS: usize = 4;
const GAIN: f32 = 0.25;

/// Lights and how well they light what the camera sees, 0 to 1.
struct Candidate<T> {
    light: T,
    score: f32,
}

/// Lights for a view.
pub(super) struct Lights {
    pub(super) lights: Vec<Light>,
    /// Radiance of the sky. `None` in a room.
    pub(super) sky: Option<Vec3>,
}

/// The lights for a camera's view.
pub(super) fn choose(probe: &Probe, up: Up, room: &Room, camera: &Camera) -> Lights {
    let seen: Vec<Hit> = probe.picture(camera, SIDE).into_iter().flatten().collect();
    let sun = sun(probe, up, camera, &seen);
    if room.is_room(probe, up.vector()) {
        let lamps = lamps(probe, up, room, &seen);
        // A file's camera may look at a house from outside.
        if lamps.score > 0.0 && lamps.score >= 0.5 * sun.score {
            return Lights { lights: point_lights(probe, &lamps.light), sky: None };
        }
    }
    let direction = -sun.light;
    let sun = named("sun", LightKind::Directional { direction, irradiance: Vec3::splat(SUN) });
    Lights { lights: vec![sun], sky: Some(SKY) }
}

/// Whether emitting surfaces light others, as lamps do. Signs and displays of a thing do not.
pub(super) fn is_lit_by_emission(probe: &Probe, emits: impl Fn(u32) -> bool) -> bool {
    let (own, other): (Vec<&Triangle>, Vec<&Triangle>) =
        probe.triangles.iter().partition(|triangle| emits(triangle.material));
    if own.is_empty() || other.is_empty() {
        return !own.is_empty();
    }
    let step = own.len().div_ceil(EMITTERS);
    let (mut rays, mut hits) = (0, 0);
    for triangle in own.iter().step_by(step) {
        let normal = triangle.geometric_normal();
        let middle = triangle.positions.iter().sum::<Vec3>() / 3.0;
        for (direction, side) in
            sphere(EMITTER_RAYS).map(|direction| (direction, normal * direction.dot(normal).signum()))
        {
            let found = probe.cast(middle + OFFSET * side, direction);
            rays += 1;
            hits += usize::from(found.is_some_and(|hit| hit.is_front && !emits(hit.material)));
        }
    }
    // One side of a lamp may face the ceiling.
    10 * hits > 3 * rays || lit_fraction(probe, &own, &other) > LIT
}

/// Fraction of the area of other surfaces, from their fronts, on which emitters cast light.
fn lit_fraction(probe: &Probe, own: &[&Triangle], other: &[&Triangle]) -> f64 {
    let step = own.len().div_ceil(EMITTERS);
    let middle = |triangle: &Triangle| triangle.positions.iter().sum::<Vec3>() / 3.0;
    let is_lit = |place: Vec3, normal: Vec3| {
        let hit = Hit { point: place, distance: 0.0, normal, is_front: true, cosine: 1.0, material: 0 };
        let of_emitter = |emitter: &&Triangle| {
            let to_emitter = middle(emitter) - place;
            let direction = to_emitter.normalize_or_zero();
            let cosines = normal.dot(direction).max(0.0) * emitter.geometric_normal().dot(direction).abs();
            let factor = step as f64 * emitter.area_m2() * f64::from(cosines / to_emitter.length_squared());
            if factor > 0.0 && probe.sees(&hit, middle(emitter)) { factor / PI } else { 0.0 }
        };
        own.iter().step_by(step).map(of_emitter).sum::<f64>() > LEAST_FACTOR
    };
    let area: f64 = other.iter().map(|triangle| triangle.area_m2()).sum();
    let (mut before, mut lit) = (0.0, 0);
    for triangle in other {
        let end = before + triangle.area_m2() / area * LIT_POINTS;
        for number in before.ceil() as u32..end.ceil() as u32 {
            let turn = (number as f32 * 0.618_034).fract();
            let spread = (number as f32 * 0.754_878).fract().sqrt();
            let [a, b, c] = triangle.positions;
            let place = a.lerp(b.lerp(c, turn), spread);
            lit += u32::from(is_lit(place, triangle.geometric_normal()));
        }
        before = end;
    }
    f64::from(lit) / LIT_POINTS
}

fn named(name: &str, kind: LightKind) -> Light {
    Light::new(name, kind)
}

fn point_lights(probe: &Probe, places: &[Vec3]) -> Vec<Light> {
    let area: f64 = probe.triangles.iter().map(Triangle::area_m2).sum();
    let power = LAMP_IRRADIANCE * area * probe.radius_m.powi(2) / places.len() as f64;
    let intensity = Vec3::splat((power / (4.0 * PI)) as f32);
    let light = |(number, &place): (usize, &Vec3)| {
        let name = if number == 1 { "lamp".to_owned() } else { format!("lamp {number}") };
        let position = probe.scene_from_unit(place).as_vec3();
        named(&name, LightKind::Point { position, intensity })
    };
    (1..).zip(places).map(light).collect()
}

/// The places under the ceiling that light most of what is seen; several in a long room.
fn lamps(probe: &Probe, up: Up, room: &Room, seen: &[Hit]) -> Candidate<Vec<Vec3>> {
    let tilt = 0.01 * Vec3::new(0.7, 0.4, 0.5);
    let places = room.points.par_iter().filter_map(|(point, _)| {
        let ceiling = probe.cast(*point, (up.vector() + tilt).normalize()).filter(|hit| hit.is_front)?;
        let below = probe.cast(*point, (tilt - up.vector()).normalize()).map_or(0.0, |hit| hit.distance);
        let height = ceiling.distance + below;
        let place = *point + (ceiling.distance - (1.0 - LAMP_HEIGHT) * height) * up.vector();
        let around = probe.surroundings(place, 32);
        let is_free = around.backs < 0.2 && around.nearest > 0.1 * height;
        is_free.then(|| (place, irradiances(probe, seen, place, height)))
    });
    let places: Vec<_> = places.collect();
    let mut chosen = Candidate { light: Vec::new(), score: 0.0 };
    let mut sum = vec![0.0; seen.len()];
    while chosen.light.len() < LAMPS {
        let added = |(place, own): &(Vec3, Vec<f32>)| {
            let sum: Vec<f32> = sum.iter().zip(own).map(|(sum, own)| sum + own).collect();
            Candidate { score: evenness(&sum), light: (*place, sum) }
        };
        let Some(next) = best(places.iter().map(added).collect()) else { break };
        if next.score <= (1.0 + GAIN) * chosen.score {
            break;
        }
        chosen.light.push(next.light.0);
        (chosen.score, sum) = (next.score, next.light.1);
    }
    chosen
}

/// Irradiance of what is seen from a lamp, in relation to that of the floor below it.
fn irradiances(probe: &Probe, seen: &[Hit], place: Vec3, height: f32) -> Vec<f32> {
    let irradiance = |hit: &Hit| {
        let to_lamp = place - hit.point;
        let cosine = hit.normal.dot(to_lamp.normalize_or_zero());
        let is_lit = cosine > 0.0 && probe.sees(hit, place);
        if is_lit { cosine * height * height / to_lamp.length_squared() } else { 0.0 }
    };
    seen.iter().map(irradiance).collect()
}

/// Mean of `E / (E + E₀)`: a bright spot does not replace light everywhere.
fn evenness(irradiances: &[f32]) -> f32 {
    const HALF: f32 = 0.2;
    let limited = irradiances.iter().map(|irradiance| irradiance / (irradiance + HALF));
    limited.sum::<f32>() / irradiances.len().max(1) as f32
}

/// Directions of the sun: beside the camera and above it, and as the last resort the camera's.
fn around_camera(up: Up, camera: &Camera) -> Vec<(Vec3, f32)> {
    let back = (camera.position - camera.target).normalize();
    let [right, above, front] = up.frame();
    let azimuth = back.dot(right).atan2(back.dot(front)).to_degrees();
    let elevation = back.dot(above).clamp(-1.0, 1.0).asin().to_degrees();
    let beside =
        [(-50.0, 1.0), (-30.0, 0.97), (-70.0, 0.9), (50.0, 0.98), (30.0, 0.95), (70.0, 0.88), (0.0, 0.8)];
    let heights = [(40.0, 1.0), (55.0, 0.97), (25.0, 0.9), (70.0, 0.8), (elevation, 0.7)];
    let both = beside.iter().flat_map(|&(turn, worth)| {
        heights.map(|(height, factor)| (up.direction(azimuth + turn, height), worth * factor))
    });
    both.chain([(back, 0.5)]).collect()
}

fn sun(probe: &Probe, up: Up, camera: &Camera, seen: &[Hit]) -> Candidate<Vec3> {
    let candidates = around_camera(up, camera).into_par_iter().map(|(towards, worth)| {
        let lit: f32 = seen.iter().map(|hit| lit_by_sun(probe, hit, towards)).sum();
        Candidate { light: towards, score: worth * lit / seen.len().max(1) as f32 }
    });
    best(candidates.collect()).expect("there are candidates")
}

/// The square root of a parallel light's irradiance: an even light is better than a bright spot.
fn lit_by_sun(probe: &Probe, hit: &Hit, towards: Vec3) -> f32 {
    let cosine = hit.normal.dot(towards);
    if cosine > 0.0 && probe.leaves(hit.point, hit.normal, towards) { cosine.sqrt() } else { 0.0 }
}

fn best<T>(candidates: Vec<Candidate<T>>) -> Option<Candidate<T>> {
    candidates.into_iter().reduce(|best, other| if other.score > best.score { other } else { best })
}
