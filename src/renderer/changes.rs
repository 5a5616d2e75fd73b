//! What has changed since the last frame, and so what the next one must redo. Which rows of which
//! lights are out of date, the lights know themselves.

use super::lights::Lights;

/// Work that can be asked for although nothing has changed: to measure what it takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Work {
    /// All of it.
    Everything,
    /// What the movement of the light of that index makes necessary.
    Light(usize),
    /// What a change of a light's colour makes necessary.
    Colour,
    /// What a movement of the camera makes necessary.
    View,
    /// What a change of a material makes necessary.
    Material,
}

/// Which materials were edited, as far as light paths are concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edited {
    /// Editable ones, by their bits.
    Some(u32),
    All,
}

impl Default for Edited {
    fn default() -> Self {
        Self::Some(0)
    }
}

/// What has changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Changes {
    pub(super) view: bool,
    /// The room for the picture: it holds nothing yet, not even where no light is active.
    pub(super) size: bool,
    /// What lights emit: their colours, or which of them there are.
    pub(super) emission: bool,
    /// What the only light emits.
    pub(super) emission_scale: bool,
    pub(super) materials: bool,
    /// Of these, editable ones by their bits; all paths are scanned again where others changed.
    pub(super) edited: Edited,
    /// Which surfaces are glossy, or how sharply.
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

/// Stages of a frame that changes make necessary. Rows and layers of lights are traced where a
/// light has none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stages {
    /// Primary visibility, edges and splat weights.
    pub(super) view: bool,
    /// The sum of the lights' layers.
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
        let direct = changes.emission || changes.size || !lights.without_layer().is_empty();
        let energy = changes.emission || !lights.without_factors().is_empty() || changes.materials;
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

    /// Nothing is to be done.
    pub(super) fn is_idle(&self) -> bool {
        // A scan comes with energy; everything else ends in the displayed picture.
        !self.display && !self.energy
    }
}
