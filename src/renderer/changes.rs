//! Changes since the last frame, and the frame plan derived from them. [`Lights`] stores which
//! cached contributions of which light are stale.

use super::lights::Lights;

/// Work that a caller can request without a change, to measure its cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// All work of a frame.
    Everything,
    /// The work after the light with this index has moved.
    Light(usize),
    /// The work after a light's colour has changed.
    Colour,
    /// The work after the camera has moved.
    View,
    /// The work after a material has changed.
    Material,
}

/// The edited materials, as far as light paths depend on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edited {
    /// Editable materials, by their bits.
    Some(u32),
    All,
}

impl Default for Edited {
    fn default() -> Self {
        Self::Some(0)
    }
}

/// Changes since the last frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Changes {
    pub(super) view: bool,
    /// The size of the picture: its buffers are empty, even if no light is active.
    pub(super) size: bool,
    /// Emission of lights: their colours, or the set of active lights.
    pub(super) emission: bool,
    /// Emission of the only active light.
    pub(super) emission_scale: bool,
    pub(super) materials: bool,
    /// The edited materials. If one of them is not editable, all paths are scanned again.
    pub(super) edited: Edited,
    /// The set of glossy materials, or the exponent of one.
    pub(super) lobes: bool,
    /// The exposure of the displayed picture.
    pub(super) exposure: bool,
}

impl Changes {
    pub(super) const ALL: Self = Self {
        view: true,
        size: true,
        emission: true,
        emission_scale: true,
        materials: true,
        edited: Edited::All,
        lobes: true,
        exposure: true,
    };
}

/// The frame plan: stages that the changes make due. Cached contributions are traced for each light
/// that has stale ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stages {
    /// Primary visibility, edges and splat weights.
    pub(super) view: bool,
    /// The sum of the per-light irradiance buffers of pixels.
    pub(super) direct: bool,
    /// The energy scan of the light paths.
    pub(super) scan: bool,
    /// Hierarchy, gather and blending.
    pub(super) energy: bool,
    /// Rays into the lobes of pixels.
    pub(super) lobes: bool,
    /// Glossy radiance of pixels.
    pub(super) gloss: bool,
    pub(super) splat: bool,
    pub(super) compose: bool,
    /// The displayed picture.
    pub(super) display: bool,
}

impl Stages {
    pub(super) fn new(changes: Changes, lights: &Lights) -> Self {
        let direct = changes.emission || changes.size || !lights.stale_irradiance().is_empty();
        let energy = changes.emission || !lights.stale_factors().is_empty() || changes.materials;
        let splat = energy || changes.view;
        let lobes = changes.view || changes.lobes;
        let gloss = splat || direct || lobes;
        let compose = gloss || changes.emission_scale;
        Self {
            view: changes.view,
            direct,
            scan: changes.materials,
            energy,
            lobes,
            gloss,
            splat,
            compose,
            display: compose || changes.exposure,
        }
    }

    /// Whether no stage is due.
    pub(super) fn is_idle(&self) -> bool {
        // A scan comes with energy; everything else ends in the displayed picture.
        !self.display && !self.energy
    }
}
