//! The frame plan: what a frame will do. A pure value; [`Dirty`](super::dirty::Dirty) makes it.
//! [`Renderer::record`](super::Renderer) records it and decides nothing.

use crate::passes::frame::needed_records::RecordRequest;
use std::fmt;

/// What a frame will do. Two edits cost the same if their plans are equal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FramePlan {
    /// Edited tables that reach the device with the frame's commands.
    pub uploads: Uploads,
    /// Primary visibility, edges and splat weights.
    pub view: bool,
    /// Rays from glossy pixels into their lobes.
    pub lobe_rays: bool,
    /// Boxes around tiles of pixels, from which shadow rays start.
    pub pixel_batches: bool,
    /// What is traced or summed anew of each light of the scene.
    pub lights: Vec<LightResults>,
    /// The sum of the lights' irradiance at pixels.
    pub direct_sum: bool,
    /// The energy scan of the light paths.
    pub scan: Scan,
    /// Hierarchy and near field.
    pub hierarchy: bool,
    /// The whole hierarchy is computed, not only the live set.
    pub is_whole: bool,
    /// The records that are gathered and blended.
    pub gather: Gathering,
    /// Records to pixels, by the weights of the view.
    pub splat: bool,
    /// Glossy radiance of pixels.
    pub gloss: bool,
    /// Composition of the picture from direct and indirect light.
    pub compose: bool,
    /// The displayed picture.
    pub display: bool,
}

/// Tables of the host that frames read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Uploads {
    /// The table of lights.
    pub lights: bool,
    /// Radiance of surfaces and of the sky, as a viewer sees them.
    pub emission: bool,
    /// The table of materials.
    pub materials: bool,
}

/// Results that are cached for each light: a flag for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LightResults {
    /// The buffers are new: sums over clusters start from zero.
    pub cleared: bool,
    /// Form factors of entry points, with beams at glossy ones.
    pub factors: bool,
    /// Irradiance at pixels and edge samples.
    pub irradiance: bool,
    /// Flux of base clusters, and the first reflection and gloss bins of glossy scenes.
    pub clusters: bool,
    /// Radiance that rays of glossy pixels see on glossy surfaces.
    pub hits: bool,
    /// Highlights at samples of glossy pixels.
    pub highlights: bool,
}

impl LightResults {
    /// All results of a new light.
    pub(super) const ALL: Self =
        Self { cleared: true, factors: true, irradiance: true, clusters: true, hits: true, highlights: true };

    /// The stale results of a light that the frame computes.
    pub(super) fn of(self, is_traced: bool, is_glossy: bool) -> Self {
        if !is_traced {
            return Self::default();
        }
        Self {
            cleared: self.cleared && self.clusters,
            hits: self.hits && is_glossy,
            highlights: self.highlights && is_glossy,
            ..self
        }
    }
}

/// Light paths that the energy scan goes through.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scan {
    /// No path: their flux is current.
    #[default]
    None,
    /// Paths that some of these editable materials reflect; a bit for each.
    Materials(u32),
    /// Every light path.
    All,
}

/// The records that a frame gathers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gathering {
    /// No record: each record that the view uses is current.
    Nothing,
    /// Every record, whether the view needs it or not.
    All,
    /// The last list again: it holds the records that this view uses.
    Listed,
    /// A new list, built by the frame.
    List(RecordRequest),
}

impl FramePlan {
    /// Whether shadow rays go from pixels or entry points to some light.
    pub fn traces_shadows(&self) -> bool {
        self.lights.iter().any(|light| light.irradiance || light.factors)
    }

    /// Whether nothing changed.
    pub fn is_idle(&self) -> bool {
        // A scan comes with the hierarchy; everything else ends in the displayed picture.
        !self.display && !self.hierarchy
    }
}

impl fmt::Display for FramePlan {
    /// A line for each part of the frame that runs, in the order of the frame.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut line = |runs: bool, text: &str| if runs { writeln!(f, "{text}") } else { Ok(()) };
        line(self.is_idle() && self.gather == Gathering::Nothing, "nothing")?;
        line(self.uploads.lights, "upload the lights")?;
        line(self.uploads.emission, "upload what the lights show")?;
        line(self.uploads.materials, "upload the materials")?;
        line(self.view, "view: surfaces at pixels, edges, splat weights")?;
        line(self.lobe_rays, "rays of glossy pixels")?;
        for (index, light) in self.lights.iter().enumerate() {
            let parts = [
                (light.irradiance, "irradiance at pixels"),
                (light.factors, "form factors"),
                (light.clusters, "flux of clusters"),
                (light.hits, "glossy hits"),
                (light.highlights, "highlights"),
            ];
            let parts: Vec<&str> = parts.into_iter().filter(|part| part.0).map(|part| part.1).collect();
            line(!parts.is_empty(), &format!("light {index}: {}", parts.join(", ")))?;
        }
        line(self.direct_sum, "sum of direct light")?;
        match self.scan {
            Scan::None => {}
            Scan::Materials(bits) => {
                line(true, &format!("energy scan: paths of {} editable materials", bits.count_ones()))?;
            }
            Scan::All => line(true, "energy scan: all paths")?,
        }
        let scope = if self.is_whole { "whole" } else { "live set" };
        line(self.hierarchy, &format!("hierarchy: {scope}, near field"))?;
        let gather = match self.gather {
            Gathering::Nothing => None,
            Gathering::All => Some("all records"),
            Gathering::Listed => Some("the records of the view, listed before"),
            Gathering::List(RecordRequest { all: true, .. }) => {
                Some("the records that the view does not use")
            }
            Gathering::List(RecordRequest { none_is_current: true, .. }) => {
                Some("the records of the view, listed anew")
            }
            Gathering::List(_) => Some("the stale records of the view"),
        };
        line(gather.is_some(), &format!("gather and blend: {}", gather.unwrap_or_default()))?;
        line(self.splat, "indirect light of pixels: records by their splat weights")?;
        line(self.gloss, "glossy radiance of pixels")?;
        line(self.compose, "compose")?;
        line(self.display, "tone map")
    }
}
