//! Reports of frames and of the precomputation.

use super::passes::{self, Column};
use crate::error::{Error, Result};
use crate::gpu::{Context, PassTiming};
use crate::scene::words::unknown;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// A layer of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layer {
    /// Radiance, direct and indirect, W/m²/sr.
    Beauty,
    /// Radiance by direct light only.
    Direct,
    /// Radiance by indirect light only.
    Indirect,
    /// Irradiance of the surface that each pixel's central ray meets, W/m²; zero beside the scene.
    Irradiance,
    /// Diffuse albedo of each pixel.
    Albedo,
    /// World-space unit shading normal.
    Normal,
    /// Place of the surface, recentred world space, metres; zero where there is none.
    Position,
    /// Distance along the viewing axis, metres, three times; infinite where the ray left the scene.
    Depth,
}

impl Layer {
    /// All layers with their names.
    pub const NAMED: [(&'static str, Self); 8] = [
        ("beauty", Self::Beauty),
        ("direct", Self::Direct),
        ("indirect", Self::Indirect),
        ("irradiance", Self::Irradiance),
        ("albedo", Self::Albedo),
        ("normal", Self::Normal),
        ("position", Self::Position),
        ("depth", Self::Depth),
    ];
}

impl std::str::FromStr for Layer {
    type Err = Error;

    /// The layer with this name.
    fn from_str(name: &str) -> Result<Self> {
        let found = Self::NAMED.iter().find(|(known, _)| *known == name);
        let refusal = || Error::Usage(unknown("layer", &Self::NAMED.map(|(known, _)| known), name));
        found.map(|(_, layer)| *layer).ok_or_else(refusal)
    }
}

/// The paper's timing columns, as milliseconds of device time. [Yue, Table 2]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[expect(non_snake_case, reason = "the paper's names, which scripts rely on")]
pub struct Columns {
    /// Direct illumination at the pixels, primary visibility and edges included.
    pub Tdi: f64,
    /// Energies of the light paths: form factors, scan.
    pub Tlpe: f64,
    /// Construction of the volumetric hierarchy.
    pub Thvds: f64,
    /// Final gathering, blending included.
    pub Tfg: f64,
    /// Splatting, composition and tone map included.
    pub Tsplat: f64,
}

impl Columns {
    /// Sums passes by the column they belong to.
    pub fn from_passes(passes: &[PassTiming]) -> Self {
        let mut columns = Self::default();
        for pass in passes {
            *match passes::named(pass.name).column {
                Column::Tdi => &mut columns.Tdi,
                Column::Tlpe => &mut columns.Tlpe,
                Column::Thvds => &mut columns.Thvds,
                Column::Tfg => &mut columns.Tfg,
                Column::Tsplat => &mut columns.Tsplat,
            } += pass.ms;
        }
        columns
    }
}

/// Wall-clock time of a frame and of the pipelines that are compiled in it.
pub(super) struct FrameWatch {
    start: Instant,
    compiled: Duration,
}

impl FrameWatch {
    pub(super) fn start(context: &Context) -> Self {
        Self { start: Instant::now(), compiled: context.compile_time() }
    }

    /// Milliseconds without compilation, and milliseconds of compilation.
    pub(super) fn stop(self, context: &Context) -> [f64; 2] {
        let compiling = context.compile_time() - self.compiled;
        [self.start.elapsed().saturating_sub(compiling), compiling].map(|time| 1e3 * time.as_secs_f64())
    }
}

/// Numbers of items that a frame goes through. They do not depend on the machine's load.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct FrameCounts {
    /// Edge pixels of the view.
    pub edge_pixels: u64,
    /// Fragments of the view.
    pub fragments: u64,
    /// Fragments of the view that have records of their own.
    pub edge_points: u64,
    /// Mixed fragments, summed over the lights that the frame traces to pixels.
    pub mixed_fragments: u64,
    /// Pixels at shadow edges, summed over the same lights.
    pub shadow_edges: u64,
    /// Shadow rays from points that take a neighbour's instead, because no silhouette is between
    /// both and the light. Zero unless the device looks for such points.
    pub spared_rays: u64,
    /// Records that the pixels of the view weighed.
    pub weighed_records: u64,
    /// Splat weights of the view: pairs of a pixel and a record.
    pub splat_weights: u64,
}

/// One frame's cost.
#[derive(Clone, Debug)]
pub struct FrameReport {
    /// Device time of each pass that ran. Empty if passes do not wait for each other.
    pub passes: Vec<PassTiming>,
    /// Wall-clock time of recording, device and wait, milliseconds, except `pipelines_ms`.
    pub frame_ms: f64,
    /// Wall-clock time of compiling new pipelines, milliseconds.
    pub pipelines_ms: f64,
    /// The passes by the paper's columns.
    pub columns: Columns,
    /// Bytes that each pass moves at least: every input once, every output once.
    pub bytes: BTreeMap<&'static str, u64>,
    /// Rays of each pass that traces.
    pub rays: BTreeMap<&'static str, u64>,
    /// Numbers of items; zero if the caller has submitted the frame.
    pub counts: FrameCounts,
    /// Records gathered for the picture, without the records gathered ahead of them.
    pub gathered: u32,
    /// Fraction of the active lights with current form factors, and fraction with a current
    /// irradiance buffer of pixels, 0..=1.
    pub lights_unchanged: [f64; 2],
    /// Device time of all passes together, milliseconds.
    pub device_ms: f64,
    /// An enclosure holds both the camera and a light. It has no indirect light until
    /// [`super::Renderer::open_enclosures`] has precomputed the scene again.
    pub needs_precompute: bool,
}

/// Sizes and costs of the precomputation.
#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct Statistics {
    /// Wall-clock seconds of the whole precomputation.
    pub precompute_s: f64,
    /// The same by stage, in order.
    pub precompute_stages: Vec<(String, f64)>,
    /// Device memory in use.
    pub memory_bytes: u64,
    /// Most device memory in use at any time.
    pub peak_memory_bytes: u64,
    /// Size of the largest buffer, bytes.
    pub largest_binding_bytes: u64,
    /// Numbers of items, by name.
    pub counts: BTreeMap<String, u64>,
    /// Numbers of results of the precomputation before that were kept, and of all, by their kind.
    pub kept: BTreeMap<String, [u64; 2]>,
    /// Fractions of work that frames skip, 0..=1.
    pub skipped: BTreeMap<String, f64>,
    /// Fractions of energy that clamping removes, 0..=1.
    pub removed: BTreeMap<String, f64>,
}

impl Statistics {
    /// Adds the last stage of the precomputation; `whole` is the total time.
    pub(super) fn end_precomputation(&mut self, stage: &str, whole: Duration) {
        let before = std::mem::replace(&mut self.precompute_s, whole.as_secs_f64());
        self.precompute_stages.push((stage.into(), self.precompute_s - before));
    }
}
