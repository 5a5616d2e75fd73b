//! What of a camera or a light a film can key, how that is written, and how near is near enough.

use glam::{DVec3, Vec3};

use super::curve::Curve;
use crate::scene::camera::FOV_Y;
use crate::scene::{LightKind, numbers};

/// Places are met within this, metres.
const PLACE_TOLERANCE_M: f64 = 1e-3;
/// The same as a share of the way from the camera to its target, where that is less; and emissions,
/// angles and directions as a share of themselves.
const TOLERANCE: f64 = 1e-3;
/// Half-angles of spots, degrees.
const MAX_ANGLE: f64 = 90.0;

/// What places may be off in a scene whose camera is so far from its target, metres.
pub(super) fn place_tolerance_m(reach_m: f32) -> f64 {
    PLACE_TOLERANCE_M.min(TOLERANCE * f64::from(reach_m))
}

/// What is keyed, and how it is written and compared.
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
    /// As the file has it; what is one number is in all components.
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

    /// How far off it is, 1 at most.
    pub(super) fn excess(self, wanted: DVec3, found: DVec3, place_m: f64) -> f64 {
        let relative = || (wanted - found).abs().max_element() / (TOLERANCE * wanted.abs().max_element());
        let excess = match self {
            Self::Place(_) | Self::Edge(_) => wanted.distance(found) / place_m,
            Self::Direction => wanted.normalize_or_zero().distance(found.normalize_or_zero()) / TOLERANCE,
            Self::Penumbra => (wanted - found).abs().max_element() / TOLERANCE,
            _ => relative(),
        };
        // Nothing wanted and nothing found.
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

/// What of a light can be keyed; always the same for lights of one kind.
pub(super) fn channels(kind: LightKind) -> Vec<(Form, Vec3)> {
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
    }
}

/// A key with three numbers.
pub(super) fn vector_line(key: &str, value: DVec3) -> String {
    format!("{key} = [{}]", value.to_array().map(numbers::text).join(", "))
}
