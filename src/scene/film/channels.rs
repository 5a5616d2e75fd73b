//! The properties of a camera or a light that a film can key: their text form and tolerance.

use glam::{DVec3, Vec3};

use super::curve::Curve;
use crate::scene::camera::FOV_Y;
use crate::scene::{LightKind, numbers};

/// Tolerance of positions, metres.
const PLACE_TOLERANCE_M: f64 = 1e-3;
/// Relative tolerance of emissions, angles and directions. Also of positions, relative to the
/// distance between camera and target, if that is less.
const TOLERANCE: f64 = 1e-3;
/// Largest half-angle of spots, degrees.
const MAX_ANGLE: f64 = 90.0;

/// Tolerance of positions, metres, for a camera at that distance from its target.
pub(super) fn place_tolerance_m(reach_m: f32) -> f64 {
    PLACE_TOLERANCE_M.min(TOLERANCE * f64::from(reach_m))
}

/// A keyed property: its text form and its comparison.
#[derive(Clone, Copy)]
pub(super) enum Form {
    Place(&'static str),
    Edge(&'static str),
    Emission(&'static str),
    Direction,
    Angle,
    Penumbra,
    FieldOfView,
}

impl Form {
    /// The value as the file has it; a scalar is repeated in all components.
    pub(super) fn number(self, value: Vec3, origin: DVec3) -> DVec3 {
        let each = |write: &dyn Fn(usize) -> f64| DVec3::from([0, 1, 2].map(write));
        match self {
            Self::Place(_) => each(&|axis| numbers::place(value[axis], origin[axis])),
            Self::Angle => DVec3::splat(numbers::degrees(value.x, MAX_ANGLE)),
            Self::FieldOfView => DVec3::splat(numbers::plain(value.x).clamp(*FOV_Y.start(), *FOV_Y.end())),
            _ => each(&|axis| numbers::plain(value[axis])),
        }
    }

    pub(super) fn curve(self) -> fn(&[(f64, DVec3)]) -> Curve {
        match self {
            Self::Place(_) | Self::Edge(_) | Self::Direction => Curve::path,
            _ => Curve::amounts,
        }
    }

    /// Deviation relative to the tolerance; at most 1 is acceptable.
    pub(super) fn excess(self, wanted: DVec3, found: DVec3, place_m: f64) -> f64 {
        let relative = || (wanted - found).abs().max_element() / (TOLERANCE * wanted.abs().max_element());
        let excess = match self {
            Self::Place(_) | Self::Edge(_) => wanted.distance(found) / place_m,
            Self::Direction => wanted.normalize_or_zero().distance(found.normalize_or_zero()) / TOLERANCE,
            Self::Penumbra => (wanted - found).abs().max_element() / TOLERANCE,
            _ => relative(),
        };
        // Both may be zero, which gives 0/0.
        if wanted == found { 0.0 } else { excess }
    }

    pub(super) fn line(self, value: DVec3) -> String {
        let scalar = |key: &str| format!("{key} = {}", numbers::text(value.x));
        match self {
            Self::Place(key) | Self::Edge(key) | Self::Emission(key) => vector_line(key, value),
            Self::Direction => vector_line("direction", value),
            Self::Angle => scalar("angle"),
            Self::Penumbra => scalar("penumbra"),
            Self::FieldOfView => scalar("fov_y"),
        }
    }
}

/// The properties of a light that can be keyed; they depend on its kind only. A light whose
/// intensities were measured has no cone.
pub(super) fn channels(kind: LightKind, is_measured: bool) -> Vec<(Form, Vec3)> {
    let mut channels = all_channels(kind);
    channels.retain(|(form, _)| !(is_measured && matches!(form, Form::Angle | Form::Penumbra)));
    channels
}

fn all_channels(kind: LightKind) -> Vec<(Form, Vec3)> {
    match kind {
        LightKind::Point { position, intensity } => {
            vec![(Form::Place("position"), position), (Form::Emission("intensity"), intensity)]
        }
        LightKind::Spot { position, direction, intensity, angle, penumbra } => vec![
            (Form::Place("position"), position),
            (Form::Emission("intensity"), intensity),
            (Form::Direction, direction),
            (Form::Angle, Vec3::splat(angle)),
            (Form::Penumbra, Vec3::splat(penumbra)),
        ],
        LightKind::Area { corner, edge_u, edge_v, radiance, .. } => vec![
            (Form::Place("corner"), corner),
            (Form::Edge("edge_u"), edge_u),
            (Form::Edge("edge_v"), edge_v),
            (Form::Emission("radiance"), radiance),
        ],
        LightKind::Directional { direction, irradiance } => {
            vec![(Form::Direction, direction), (Form::Emission("irradiance"), irradiance)]
        }
        LightKind::Surface { radiance, .. } | LightKind::Sky { radiance, .. } => {
            vec![(Form::Emission("radiance"), radiance)]
        }
    }
}

/// A key line with three numbers.
pub(super) fn vector_line(key: &str, value: DVec3) -> String {
    format!("{key} = [{}]", value.to_array().map(numbers::text).join(", "))
}
