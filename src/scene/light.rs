//! Light sources and their units.

use glam::Vec3;

/// A named light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name in the scene file; unique.
    pub name: String,
    /// What and where it is.
    pub kind: LightKind,
}

/// The kinds of light that a scene file can hold. Positions are recentred world space, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Isotropic point light.
    Point {
        /// Where it is.
        position: Vec3,
        /// Radiant intensity, W/sr.
        intensity: Vec3,
    },
    /// Point light limited to a cone.
    Spot {
        /// Where it is.
        position: Vec3,
        /// Unit axis of the cone, pointing away from the light.
        direction: Vec3,
        /// Radiant intensity on the axis, W/sr.
        intensity: Vec3,
        /// Half-angle of the cone, radians.
        angle: f32,
        /// Share of the half-angle over which the intensity falls to zero, 0..=1.
        penumbra: f32,
    },
    /// One-sided parallelogram that emits towards `edge_u × edge_v`.
    Area {
        /// One corner.
        corner: Vec3,
        /// First edge from the corner.
        edge_u: Vec3,
        /// Second edge from the corner.
        edge_v: Vec3,
        /// Emitted radiance, W/m²/sr.
        radiance: Vec3,
        /// How many point samples stand for it.
        samples: u32,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it, W/m².
        irradiance: Vec3,
    },
}

impl LightKind {
    /// Where it is; none for a light at infinity. An area light is at its middle.
    pub fn position(&self) -> Option<Vec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Area { corner, edge_u, edge_v, .. } => Some(corner + 0.5 * (edge_u + edge_v)),
            Self::Directional { .. } => None,
        }
    }

    /// The word for it in a scene file.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Area { .. } => "area",
            Self::Directional { .. } => "directional",
        }
    }
}
