//! Sizes of the inputs of passes, and what a pass costs.

/// Cost of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cost {
    /// Each stored input and output counts once, whatever the caches do. Scene data that traced
    /// rays read do not count: rays per second measure such a pass.
    pub(super) bytes: u64,
    /// `None` if the pass traces no ray.
    pub(super) rays: Option<u64>,
}

impl Cost {
    pub(super) fn of(bytes: u64) -> Self {
        Self { bytes, rays: None }
    }

    pub(super) fn of_rays(bytes: u64, rays: u64) -> Self {
        Self { bytes, rays: Some(rays) }
    }
}

/// Sizes from which costs follow. Lists and images are in bytes, counts say so.
pub(super) struct Sizes {
    /// Number of pixels.
    pub(super) pixels: u64,
    /// Number of values of direct light: pixels and fragments.
    pub(super) points: u64,
    /// Number of lights in sums.
    pub(super) lights: u64,
    /// Number of light paths.
    pub(super) paths: u64,
    /// Number of records, one at least.
    pub(super) record_count: u64,
    /// Number of records that a gather pass takes, on average.
    pub(super) gathered: u64,
    /// Number of rays to bright clusters; `None` if nothing is bright.
    pub(super) bright_rays: Option<u64>,
    /// Number of lights whose irradiance at pixels is traced, and of shadow rays from pixels.
    pub(super) planned_irradiances: u64,
    pub(super) pixel_rays: u64,
    /// Number of lights whose form factors are traced, and of shadow rays from entry points.
    pub(super) planned_factors: u64,
    pub(super) factor_rays: u64,
    /// Edges and maps of silhouettes.
    pub(super) silhouettes: u64,
    /// Number of lights whose flux of clusters is summed.
    pub(super) planned_clusters: u64,
    /// Number of fragments, and of shadow rays from these and from shadow edges.
    pub(super) fragment_count: u64,
    pub(super) edge_rays: u64,
    pub(super) edge_samples: u64,
    pub(super) fragments: u64,
    /// Surfaces at pixels.
    pub(super) surface: u64,
    /// Three floats a pixel.
    pub(super) image: u64,
    pub(super) pixel_colours: u64,
    pub(super) edge_colours: u64,
    pub(super) steps: u64,
    /// Part of the steps that is read once.
    pub(super) steps_once: u64,
    pub(super) contributions: u64,
    /// Bytes of a path's flux at its entry point and after the first bounce.
    pub(super) first_bounce: u64,
    /// Flux of base clusters from one light.
    pub(super) light_flux: u64,
    pub(super) clusters: u64,
    /// What the pass reads that selects bright clusters.
    pub(super) watched: u64,
    pub(super) near_field: u64,
    pub(super) records: u64,
    pub(super) cache_points: u64,
    pub(super) merged_rays: u64,
    pub(super) neighbours: u64,
    /// Record tree, and splat weights.
    pub(super) record_tree: u64,
    pub(super) weights: u64,
    /// Splat weights that the list of records was made from; zero if the view is not new.
    pub(super) marked_weights: u64,
}
