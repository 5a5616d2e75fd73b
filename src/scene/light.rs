//! Light sources and their units.

use glam::{DVec3, Vec3};

use super::builtin::Files;
use super::keys;
use super::luminaire::Luminaire;
use super::photometry::{self, Extent};
use super::value::{COORDINATE, Section, unknown};
use crate::Result;

/// A named light.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// Name in the scene file; unique.
    pub name: String,
    /// Kind and position of the light.
    pub kind: LightKind,
    /// Whether it is on. A light that is off keeps its index and can be switched on.
    pub is_on: bool,
    /// Measured intensities. A light that has them is a spot without an edge.
    pub luminaire: Option<Luminaire>,
    /// Lights of one group are switched, dimmed and coloured together in the window.
    pub group: Option<String>,
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
        /// Fraction of the half-angle over which the intensity falls to zero, linearly in
        /// the angle, 0..=1.
        penumbra: f32,
    },
    /// One-sided parallelogram that emits towards `edge_u × edge_v`.
    Area {
        /// Corner that both edges start from, metres.
        corner: Vec3,
        /// First edge from the corner.
        edge_u: Vec3,
        /// Second edge from the corner.
        edge_v: Vec3,
        /// Emitted radiance, W/m²/sr.
        radiance: Vec3,
        /// Number of point samples that represent it.
        samples: u32,
    },
    /// Parallel light from infinitely far away.
    Directional {
        /// Unit direction in which the light travels.
        direction: Vec3,
        /// Irradiance on a surface that faces it, W/m².
        irradiance: Vec3,
    },
    /// All surface of an emitting material.
    Surface {
        /// Index of the material.
        material: u32,
        /// Emitted radiance, W/m²/sr.
        radiance: Vec3,
    },
    /// The scene's environment, or one colour channel of it.
    Sky {
        /// Factor of the environment's radiance, W/m²/sr.
        radiance: Vec3,
        /// Rotation about +Y, radians.
        turn: f32,
        /// The channel that it shows. `None`: the environment is grey and shows all.
        channel: Option<u8>,
    },
}

impl LightKind {
    /// The light's position; the middle of an area light. `None` if the light is at infinity or
    /// part of the model.
    pub fn position(&self) -> Option<Vec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Area { corner, edge_u, edge_v, .. } => Some(corner + 0.5 * (edge_u + edge_v)),
            Self::Directional { .. } | Self::Surface { .. } | Self::Sky { .. } => None,
        }
    }

    /// The light with its middle at `to`. Lights at infinity and surfaces do not change.
    #[must_use]
    pub fn moved_to(self, to: Vec3) -> Self {
        match self {
            Self::Point { intensity, .. } => Self::Point { position: to, intensity },
            Self::Spot { direction, intensity, angle, penumbra, .. } => {
                Self::Spot { position: to, direction, intensity, angle, penumbra }
            }
            Self::Area { edge_u, edge_v, radiance, samples, .. } => {
                Self::Area { corner: to - 0.5 * (edge_u + edge_v), edge_u, edge_v, radiance, samples }
            }
            Self::Directional { .. } | Self::Surface { .. } | Self::Sky { .. } => self,
        }
    }

    /// Intensity, radiance or irradiance, in the unit of its kind.
    pub fn emission(&self) -> Vec3 {
        match *self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Area { radiance, .. } | Self::Surface { radiance, .. } | Self::Sky { radiance, .. } => {
                radiance
            }
            Self::Directional { irradiance, .. } => irradiance,
        }
    }

    /// The light with another intensity, radiance or irradiance, in the unit of its kind.
    #[must_use]
    pub fn with_emission(mut self, emission: Vec3) -> Self {
        if let Self::Sky { radiance, channel: Some(channel), .. } = &mut self {
            *radiance = Vec3::ZERO;
            radiance[usize::from(*channel)] = emission[usize::from(*channel)];
            return self;
        }
        *match &mut self {
            Self::Point { intensity, .. } | Self::Spot { intensity, .. } => intensity,
            Self::Area { radiance, .. } | Self::Surface { radiance, .. } | Self::Sky { radiance, .. } => {
                radiance
            }
            Self::Directional { irradiance, .. } => irradiance,
        } = emission;
        self
    }

    /// Whether it is part of the model or the scene: it cannot be moved, added or removed.
    pub fn is_fixed(&self) -> bool {
        matches!(self, Self::Surface { .. } | Self::Sky { .. })
    }

    /// The word of this kind in a scene file.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Area { .. } => "area",
            Self::Directional { .. } => "directional",
            Self::Surface { .. } => "surface",
            Self::Sky { .. } => "sky",
        }
    }
}

impl Light {
    /// Whether it is on and not black.
    pub fn is_active(&self) -> bool {
        self.is_on && self.kind.emission() != Vec3::ZERO
    }

    /// Default name of a light, by its number in the file.
    pub(super) fn unnamed(number: usize) -> String {
        format!("light{number}")
    }

    /// Reads a light in world space and recentres it on `origin`. The first light
    /// is number 0.
    pub(super) fn read(section: &Section, number: usize, origin: DVec3, files: &Files) -> Result<Self> {
        let name = section.text("name")?.map_or_else(|| Self::unnamed(number), str::to_owned);
        let is_on = section.flag("on")?.unwrap_or(true);
        let luminaire = Luminaire::read(section, files)?;
        let group = Self::read_group(section)?;
        let kind = LightKind::read(section, origin, luminaire.as_ref())?;
        Ok(Self { name, kind, is_on, luminaire, group })
    }

    /// Reads the name of the group.
    pub(super) fn read_group(section: &Section) -> Result<Option<String>> {
        Ok(section.text("group")?.map(str::to_owned))
    }

    /// A light that is on and points down, as it was measured, in white.
    pub fn measured(name: impl Into<String>, luminaire: Luminaire, position: Vec3) -> Self {
        let kind = LightKind::Spot {
            position,
            direction: Vec3::NEG_Y,
            intensity: Vec3::splat((luminaire.profile.peak_candela / photometry::LUMENS_A_WATT) as f32),
            angle: luminaire.profile.widest,
            penumbra: 0.0,
        };
        Self { luminaire: Some(luminaire), ..Self::new(name, kind) }
    }

    /// A light that is on, without measured intensities and without a group.
    pub fn new(name: impl Into<String>, kind: LightKind) -> Self {
        Self { name: name.into(), kind, is_on: true, luminaire: None, group: None }
    }
}

impl LightKind {
    /// Default number of point samples of an area light.
    pub(super) const SAMPLES: u32 = 10;

    /// Keys of a scene file that change its position and emission.
    pub(super) fn keys(&self) -> &'static [&'static str] {
        match self {
            Self::Point { .. } => &["position", "intensity"],
            Self::Spot { .. } => &["position", "intensity", "direction", "angle", "penumbra"],
            Self::Area { .. } => &["corner", "edge_u", "edge_v", "radiance"],
            Self::Directional { .. } => &["direction", "irradiance"],
            Self::Surface { .. } | Self::Sky { .. } => &["radiance"],
        }
    }

    /// Reads a light without its name, as [`Light::read`] does, with its measured intensities.
    pub(super) fn read(section: &Section, origin: DVec3, luminaire: Option<&Luminaire>) -> Result<Self> {
        const KINDS: [&str; 4] = ["point", "spot", "area", "directional"];
        let vector = |key, range, expected| section.need(section.vector(key, range)?, key, expected);
        let place = |key| Ok((vector(key, COORDINATE, "three numbers, metres")? - origin).as_vec3());
        let edge = |key| Ok(vector(key, COORDINATE, "three numbers, metres")?.as_vec3());
        let power = |key, unit, extent| photometry::emission(section, key, unit, extent);
        let direction = || {
            let stated = section.direction("direction")?.or(luminaire.map(|_| DVec3::NEG_Y));
            Ok(section.need(stated, "direction", "three numbers")?.as_vec3())
        };
        let kind = section.need(section.text("kind")?, "kind", "point, spot, area or directional")?;
        if !KINDS.contains(&kind) {
            return Err(section.fault_at("kind", unknown("kind of light", &KINDS, kind)));
        }
        section.only(&keys::names("light", Some(kind)))?;
        if let Some(Luminaire { profile, .. }) = luminaire {
            let flux = Extent::SolidAngle(profile.steradians());
            return Ok(Self::Spot {
                position: place("position")?,
                direction: direction()?,
                intensity: photometry::measured(section, flux, profile.peak_candela)?,
                angle: profile.widest,
                penumbra: 0.0,
            });
        }
        match kind {
            "point" => Ok(Self::Point {
                position: place("position")?,
                intensity: power("intensity", "W/sr", Extent::SPHERE)?,
            }),
            "spot" => {
                let angle = section.number("angle", 0.01..=90.0)?;
                let angle = section.need(angle, "angle", "half-angle in degrees")?.to_radians();
                let penumbra = section.number("penumbra", 0.0..=1.0)?.unwrap_or(0.0);
                Ok(Self::Spot {
                    position: place("position")?,
                    direction: direction()?,
                    intensity: power("intensity", "W/sr", Extent::cone(angle, penumbra))?,
                    angle: angle as f32,
                    penumbra: penumbra as f32,
                })
            }
            "area" => {
                let (edge_u, edge_v): (Vec3, Vec3) = (edge("edge_u")?, edge("edge_v")?);
                let [u, v] = [edge_u, edge_v].map(Vec3::as_dvec3);
                if u.cross(v).length() <= 1e-6 * u.length() * v.length() {
                    return Err(section.fault_at("edge_v", "must be neither zero nor parallel to edge_u"));
                }
                Ok(Self::Area {
                    corner: place("corner")?,
                    edge_u,
                    edge_v,
                    radiance: power("radiance", "W/m²/sr", Extent::Surface(u.cross(v).length()))?,
                    samples: section.integer("samples", 1..=4096)?.unwrap_or(Self::SAMPLES),
                })
            }
            _ => Ok(Self::Directional {
                direction: direction()?,
                irradiance: power("irradiance", "W/m²", Extent::Infinity)?,
            }),
        }
    }
}
