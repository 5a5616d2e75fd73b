//! A camera and lights for models without them, chosen by rays on the host.
//!
//! [`choose`] finds which way is up (`up.rs`), whether the model is a room (`room.rs`), a camera
//! outside of it (`outside.rs`) or inside (`inside.rs`), and the lights of its view (`lights.rs`).

mod inside;
mod lights;
mod nodes;
mod outside;
mod probe;
mod room;
mod up;
mod wish;

use glam::{DVec3, Vec3};

use super::{Camera, Light, LightKind, Triangle};
use crate::Result;
use lights::Lights;
use outside::Outside;
use probe::Probe;
pub(super) use probe::sphere;
use room::Room;

pub(super) use nodes::{camera_node, file_camera_node, file_light_node, light_node, list, sky_node};
pub use up::Up;
pub use wish::Place;
pub(super) use wish::Wish;

/// A camera and lights, recentred, with a line about each choice.
pub(super) struct Chosen {
    pub(super) camera: Camera,
    pub(super) lights: Vec<Light>,
    /// Radiance of the sky, W/m²/sr. `None` if the view is that of a room.
    pub(super) sky: Option<Vec3>,
    /// Emitting surfaces light the model, so that it needs no other light.
    pub(super) is_lit: bool,
    pub(super) said: [String; 2],
}

/// A look into a room through what is missing of its walls shows hardly any back.
const OPEN_FRONTS: f32 = 0.95;
/// Least fraction of directions that leave a room that is looked into from outside.
const OPEN: f32 = 0.07;

/// Chooses a camera and lights for recentred triangles. Lights suit the `own` camera, if any.
/// `emits`: whether a material emits.
///
/// # Errors
/// The tree of the triangles is too deep, as for [`Bvh::build`](super::bvh::Bvh::build).
pub(super) fn choose(
    triangles: &[Triangle],
    origin: DVec3,
    wish: Wish,
    own: Option<&Camera>,
    emits: impl Fn(u32) -> bool,
) -> Result<Chosen> {
    let mut probe = Probe::new(triangles)?;
    let room = Room::new(&probe);
    let up = wish.up.unwrap_or_else(|| Up::guess(&probe, &room));
    probe.is_inverted = room.is_inverted(&probe, up.vector());
    let (place, camera) = match own {
        Some(camera) => (None, camera.clone()),
        None => {
            let (place, camera) = camera(&probe, up, &room, wish.place);
            let recentred = |point| (world(&probe, point, origin) - origin).as_vec3();
            let [position, target] = [camera.position, camera.target].map(recentred);
            (Some(place), Camera { position, target, ..camera })
        }
    };
    let [position, target] = [camera.position, camera.target].map(|point| probe.unit_from_scene(point));
    let Lights { lights, sky } =
        lights::choose(&probe, up, &room, &Camera { position, target, ..camera.clone() });
    let lights: Vec<Light> = lights.into_iter().map(|light| round(light, origin, probe.radius_m)).collect();
    let side = if place == Some(Place::Inside) { "inside" } else { "outside" };
    let [position, target] = [camera.position, camera.target].map(|point| point.as_dvec3() + origin);
    let said = [
        format!(
            "one was placed {side} at {position:.3}, looking at {target:.3}, with +{up:?} up \
             (--inside, --outside and --up change that)"
        ),
        lights
            .iter()
            .map(|light| describe(light, origin))
            .chain(sky.map(|sky| format!("the sky has {sky} W/m²/sr")))
            .collect::<Vec<_>>()
            .join(", "),
    ];
    let is_lit = lights::is_lit_by_emission(&probe, emits);
    Ok(Chosen { camera, lights, sky, is_lit, said })
}

/// World coordinates of a scaled point, with few digits.
fn world(probe: &Probe, point: Vec3, origin: DVec3) -> DVec3 {
    rounded(probe.scene_from_unit(point) + origin, probe.radius_m)
}

/// Inside of a room, unless the best camera outside looks into it.
fn camera(probe: &Probe, up: Up, room: &Room, wish: Option<Place>) -> (Place, Camera) {
    let is_room = room.is_room(probe, up.vector());
    if wish == Some(Place::Inside) || wish.is_none() && is_room && room.open_fraction() < OPEN {
        return (Place::Inside, inside::best(probe, up, room));
    }
    let outside = Outside::best(probe, up);
    if wish.is_none() && is_room && outside.front_fraction < OPEN_FRONTS {
        return (Place::Inside, inside::best(probe, up, room));
    }
    (Place::Outside, outside.camera)
}

/// A world position with few digits: to a thousandth of the model's radius or finer.
fn rounded(place: DVec3, radius_m: f64) -> DVec3 {
    let step = 10.0_f64.powf((1e-3 * radius_m).log10().floor());
    // Division by a power of ten, because a product with 0.001 has a long tail of digits.
    let inverse = (1.0 / step).round();
    if inverse >= 1.0 { (place * inverse).round() / inverse } else { (place / step).round() * step }
}

/// A light with few digits.
fn round(light: Light, origin: DVec3, radius_m: f64) -> Light {
    let kind = match light.kind {
        LightKind::Point { position, intensity } => {
            let place = rounded(position.as_dvec3() + origin, radius_m);
            let digits = |value: f32| format!("{value:.2e}").parse().unwrap_or(value);
            let intensity = Vec3::from_array(intensity.to_array().map(digits));
            LightKind::Point { position: (place - origin).as_vec3(), intensity }
        }
        LightKind::Directional { direction, irradiance } => {
            LightKind::Directional { direction: (100.0 * direction).round() / 100.0, irradiance }
        }
        kind => kind,
    };
    Light { kind, ..light }
}

fn describe(light: &Light, origin: DVec3) -> String {
    let (name, emission) = (&light.name, light.kind.emission().x);
    match light.kind {
        LightKind::Directional { direction, .. } => {
            format!("a {name} of {emission} W/m² comes along {direction:.2}")
        }
        _ => {
            let position = light.kind.position().unwrap_or_default().as_dvec3() + origin;
            format!("a {name} of {emission} W/sr was placed at {position:.3}")
        }
    }
}
