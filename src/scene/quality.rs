//! The settings that trade time and memory for accuracy, and their presets.

use super::keys;
use super::measures::{Measure, Measures};
use super::value::{Section, unknown};
use crate::Result;

/// Settings of the precomputation. The `paper` preset holds the paper's numbers.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Quality {
    /// Preset of the numbers: `draft`, `paper` or `high`.
    pub preset: &'static str,
    /// Light paths, one from each entry point.
    pub entry_points: u32,
    /// Upper bound on cache points.
    pub cache_points: u32,
    /// Final gather rays per cache point: 4·k², the strata being k rings of 4k sectors.
    pub gather_rays: u32,
    /// Direction bins of outgoing radiance in glossy cells.
    pub directions: u32,
    /// Rays from a glossy pixel into its Phong lobe.
    pub gloss_rays: u32,
    /// Base cells of the volumetric hierarchy along the scene's longest axis: a power of two.
    pub cells: u32,
    /// Finds visibility-inconsistent clusters, and reads their children instead.
    pub occlusion: bool,
    /// Extra gather iterations of cache points in narrow cavities, where light is reflected back
    /// and forth. At 0, clusters are split only along walls without thickness, and near readers
    /// read no near-field patches. From 2 on, the first iteration gathers all cache points whose
    /// neighbouring clusters take their light from them. Clusters in shadows then take their light
    /// from cache points too.
    pub gap_rounds: u32,
    /// Samples of a light on each surface in a pixel that shows an edge; 0 disables antialiasing.
    pub edge_samples: u32,
    /// Relative difference of a pixel's records under random light from which on the pixel gathers
    /// for itself; 1: none does.
    pub record_error: f32,
    /// Seeds every sampled decision; the same seed gives the same bytes.
    pub seed: u32,
    /// Measures that an ablation leaves out. No scene file and no flag sets it.
    #[serde(skip)]
    pub left_out: Measures,
}

impl Quality {
    /// For a preview: a quarter of the paper's paths, less than half of its records.
    pub const DRAFT: Self = Self {
        preset: "draft",
        entry_points: 100_000,
        cache_points: 16_000,
        gather_rays: 144,
        directions: 144,
        gloss_rays: 32,
        cells: 32,
        occlusion: true,
        gap_rounds: 0,
        edge_samples: 16,
        record_error: 1.0,
        seed: 0,
        left_out: Measures::NONE,
    };
    /// The paper's settings: 400 000 entry points, 40 000 cache points, 256 gather rays.
    pub const PAPER: Self = Self {
        preset: "paper",
        entry_points: 400_000,
        cache_points: 40_000,
        gather_rays: 256,
        directions: 256,
        gloss_rays: 32,
        cells: 64,
        occlusion: true,
        gap_rounds: 0,
        edge_samples: 16,
        record_error: 0.14,
        seed: 0,
        left_out: Measures::NONE,
    };
    /// For accuracy before precomputation time.
    pub const HIGH: Self = Self {
        preset: "high",
        entry_points: 1_600_000,
        cache_points: 80_000,
        gather_rays: 784,
        directions: 256,
        gloss_rays: 64,
        cells: 128,
        occlusion: true,
        gap_rounds: 3,
        edge_samples: 64,
        record_error: 0.1,
        seed: 0,
        left_out: Measures::NONE,
    };

    /// Names of the presets, fastest first.
    pub const PRESETS: [&str; 3] = ["draft", "paper", "high"];

    /// The preset of that name. `None` if the name is unknown.
    pub fn preset(name: &str) -> Option<Self> {
        [Self::DRAFT, Self::PAPER, Self::HIGH].into_iter().find(|q| q.preset == name)
    }

    /// Whether the precomputation takes a measure.
    pub fn takes(&self, measure: Measure) -> bool {
        !self.left_out.has(measure)
    }

    /// Reads `[quality]`: a preset, with some of its numbers replaced.
    pub(super) fn read(section: &Section) -> Result<Self> {
        section.only(&keys::names("quality", None))?;
        let mut quality = Self::default();
        if let Some(name) = section.text("preset")? {
            quality = Self::preset(name)
                .ok_or_else(|| section.fault_at("preset", unknown("preset", &Self::PRESETS, name)))?;
        }
        let fields = [
            ("entry_points", 1..=1 << 24, &mut quality.entry_points),
            ("cache_points", 1..=1_000_000, &mut quality.cache_points),
            ("gather_rays", 4..=65_536, &mut quality.gather_rays),
            ("directions", 1..=65_536, &mut quality.directions),
            ("gloss_rays", 1..=4096, &mut quality.gloss_rays),
            ("cells", 8..=256, &mut quality.cells),
            ("gap_rounds", 0..=16, &mut quality.gap_rounds),
            ("edge_samples", 0..=256, &mut quality.edge_samples),
            ("seed", 0..=u32::MAX, &mut quality.seed),
        ];
        for (key, range, field) in fields {
            *field = section.integer(key, range)?.unwrap_or(*field);
        }
        if let Some(error) = section.number("record_error", 0.01..=1.0)? {
            quality.record_error = error as f32;
        }
        quality.occlusion = section.flag("occlusion")?.unwrap_or(quality.occlusion);
        let rings = (f64::from(quality.gather_rays) / 4.0).sqrt().round() as u32;
        if quality.gather_rays != 4 * rings * rings {
            let message =
                format!("{} is not 4·k²: the nearest is {}", quality.gather_rays, 4 * rings * rings);
            return Err(section.fault_at("gather_rays", message));
        }
        let side = f64::from(quality.directions).sqrt().round() as u32;
        if quality.directions != side * side {
            let message = format!("{} is not a square: the nearest is {}", quality.directions, side * side);
            return Err(section.fault_at("directions", message));
        }
        if !quality.cells.is_power_of_two() {
            let message = format!("{} is not a power of two: 8 to 256 expected", quality.cells);
            return Err(section.fault_at("cells", message));
        }
        Ok(quality)
    }
}

impl Default for Quality {
    fn default() -> Self {
        Self::PAPER
    }
}
