//! Measures against light leaks and hidden surface. An ablation leaves single ones out, to see what
//! each buys: `tests/stress/measures.rs` measures it, and `docs/visibility.md` holds the table.

/// A measure. The page named above states which fault it prevents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// The inside of watertight solids takes no part.
    Solids,
    /// Sides that no camera and no active side sees take no part.
    Enclosures,
    /// Surface that other surface covers has no area.
    CoveredSurface,
    /// Stacked surfaces in one base cell are different clusters.
    StackedSurfaces,
    /// Planes of walls divide base clusters: of walls without thickness, and with
    /// `quality.gap_rounds` of all.
    SplitPlanes,
    /// Clusters with surface inside and outside a narrow cavity stand for none of their children.
    NarrowCavities,
    /// Clusters whose children do not see each other stand for none of them.
    InconsistentClusters,
    /// Entry points are denser where surfaces are close.
    DenserEntryPoints,
    /// Vertices count by their ambient accessibility, and nearby readers read unweighted clusters.
    Accessibility,
    /// Small clusters at contacts take their indirect light from a record.
    NearClusters,
    /// Cache points beside near clusters read patches of them; only with `quality.gap_rounds`.
    NearFieldPatches,
    /// A record covers nothing behind its nearest occluder plane, nor far off its own plane.
    OccluderPlanes,
    /// The clearances of neighbours bound that of a record.
    ClearanceBounds,
    /// Rays from a point or spot light find what it lights between entry points.
    NearLights,
    /// Records sample bright clusters by rays of their own.
    BrightClusters,
}

impl Measure {
    /// All measures, in the order of the precomputation.
    pub const ALL: [Self; 15] = [
        Self::Solids,
        Self::Enclosures,
        Self::CoveredSurface,
        Self::StackedSurfaces,
        Self::SplitPlanes,
        Self::NarrowCavities,
        Self::InconsistentClusters,
        Self::DenserEntryPoints,
        Self::Accessibility,
        Self::NearClusters,
        Self::NearFieldPatches,
        Self::OccluderPlanes,
        Self::ClearanceBounds,
        Self::NearLights,
        Self::BrightClusters,
    ];
}

/// A set of measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Measures(u32);

impl Measures {
    /// The empty set, which presets leave out.
    pub const NONE: Self = Self(0);

    /// A single measure.
    pub const fn only(measure: Measure) -> Self {
        Self(1 << measure as u32)
    }

    /// The measures of either set.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether the set has this measure.
    pub const fn has(self, measure: Measure) -> bool {
        self.0 & 1 << measure as u32 != 0
    }
}
