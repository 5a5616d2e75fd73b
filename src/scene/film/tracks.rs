//! Tracks of the animated parts of a scene.

use super::curve::{Curve, Fades};
use super::material_state::MaterialState;
use crate::scene::save::PlacedModel;
use crate::scene::{Camera, LightKind};
use glam::{DVec3, Vec3};

/// The camera's track; properties without keys stay as in the scene.
#[derive(Clone, Debug)]
pub(super) struct CameraTrack {
    /// The scene's camera.
    pub(super) base: Camera,
    pub(super) position: Option<Curve>,
    pub(super) target: Option<Curve>,
    /// Vertical field of view, degrees, in every component.
    pub(super) fov_y: Option<Curve>,
}

impl CameraTrack {
    /// The camera at a time in seconds.
    pub(super) fn at(&self, time: f64, origin: DVec3) -> Camera {
        let base = &self.base;
        let place =
            |curve: &Option<Curve>, base| curve.as_ref().map_or(base, |curve| place(curve, time, origin));
        Camera {
            position: place(&self.position, base.position),
            target: place(&self.target, base.target),
            fov_y_degrees: self.fov_y.as_ref().map_or(base.fov_y_degrees, |curve| curve.at(time).x as f32),
            ..base.clone()
        }
    }
}

/// A light's track. Properties without keys stay as in the scene, or as in the key that
/// added the light.
#[derive(Clone, Debug)]
pub(super) struct LightTrack {
    /// Its index in the scene.
    pub(super) light: usize,
    /// The light in the scene, or in the key that added it.
    pub(super) base: LightKind,
    /// The position, or an area light's corner.
    pub(super) place: Option<Curve>,
    pub(super) direction: Option<Curve>,
    pub(super) edge_u: Option<Curve>,
    pub(super) edge_v: Option<Curve>,
    /// Emission, in the unit of its kind.
    pub(super) emission: Option<Curve>,
    /// Half-angle of a spot, degrees, in every component.
    pub(super) angle: Option<Curve>,
    pub(super) penumbra: Option<Curve>,
    /// Fraction that is switched on, 0..=1, in every component.
    pub(super) presence: Fades,
}

impl LightTrack {
    /// The light at a time in seconds, and whether it is on.
    pub(super) fn at(&self, time: f64, origin: DVec3) -> (LightKind, bool) {
        let mut kind = self.base;
        let set_place = |to: &mut Vec3| {
            if let Some(curve) = &self.place {
                *to = place(curve, time, origin);
            }
        };
        let set = |curve: &Option<Curve>, to: &mut Vec3| {
            if let Some(curve) = curve {
                *to = curve.at(time).as_vec3();
            }
        };
        let turn = |to: &mut Vec3| {
            let direction = self.direction.as_ref().map(|curve| curve.at(time).normalize_or_zero());
            // Half-way between opposite directions none is defined; the scene's direction is used.
            *to = direction.filter(|it| *it != DVec3::ZERO).map_or(*to, |direction| direction.as_vec3());
        };
        let number = |curve: &Option<Curve>| curve.as_ref().map(|curve| curve.at(time).x);
        match &mut kind {
            LightKind::Point { position, .. } => set_place(position),
            LightKind::Spot { position, direction, angle, penumbra, .. } => {
                set_place(position);
                turn(direction);
                *angle = number(&self.angle).map_or(*angle, |degrees| degrees.to_radians() as f32);
                *penumbra = number(&self.penumbra).map_or(*penumbra, |share| share as f32);
            }
            LightKind::Area { corner, edge_u, edge_v, .. } => {
                set_place(corner);
                set(&self.edge_u, edge_u);
                set(&self.edge_v, edge_v);
            }
            LightKind::Directional { direction, .. } => turn(direction),
            LightKind::Surface { .. } | LightKind::Sky { .. } => (),
        }
        let mut emission = self.base.emission();
        set(&self.emission, &mut emission);
        let presence = self.presence.at(time).x as f32;
        (kind.with_emission(presence * emission), presence > 0.0)
    }
}

/// The reflectance track of a material.
#[derive(Clone, Debug)]
pub(super) struct MaterialTrack {
    /// Its index in the scene.
    pub(super) material: usize,
    pub(super) diffuse: Fades,
    pub(super) specular: Fades,
    /// Natural logarithm of the exponent, in every component: sharpness is perceived in ratios.
    pub(super) ln_exponent: Fades,
}

impl MaterialTrack {
    /// The material at a time in seconds.
    pub(super) fn at(&self, time: f64) -> MaterialState {
        MaterialState {
            material: self.material,
            diffuse: self.diffuse.at(time).as_vec3(),
            specular: self.specular.at(time).as_vec3(),
            exponent: self.ln_exponent.at(time).x.exp() as f32,
        }
    }
}

/// A model's track; values without keys stay as in the scene.
#[derive(Clone, Debug)]
pub(super) struct ModelTrack {
    /// Its index in the scene file.
    pub(super) model: usize,
    /// The model in the scene.
    pub(super) base: PlacedModel,
    /// World space, metres.
    pub(super) translate: Option<Curve>,
    /// Angles about x, y and z, degrees.
    pub(super) rotate: Option<Curve>,
    /// 1 while it is hidden, else 0, in every component.
    pub(super) hidden: Fades,
}

impl ModelTrack {
    /// The model at a time in seconds, as `KEY=VALUE` changes of the scene file.
    pub(super) fn changes_at(&self, time: f64) -> Vec<String> {
        let at = |curve: &Option<Curve>, base| curve.as_ref().map_or(base, |curve| curve.at(time));
        let model = PlacedModel {
            translation: at(&self.translate, self.base.translation),
            rotation: at(&self.rotate, self.base.rotation),
            is_hidden: self.hidden.at(time).x > 0.5,
            ..self.base.clone()
        };
        model.changes(self.model, Some(&self.base))
    }
}

fn place(curve: &Curve, time: f64, origin: DVec3) -> Vec3 {
    (curve.at(time) - origin).as_vec3()
}
