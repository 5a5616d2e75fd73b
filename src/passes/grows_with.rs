//! What the sizes of buffers follow from: the setting to lower if the device lacks memory.

use crate::gpu::BufferName;

/// What a buffer's size follows from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GrowsWith {
    /// Entry points, their paths and contributions.
    EntryPoints,
    /// Cache points and their gather rays.
    GatherRays,
    /// Pixels and edge samples of the picture.
    Pixels,
    /// Clusters and their direction bins.
    Cells,
    /// Triangles of the model, and their tree.
    Triangles,
}

impl GrowsWith {
    /// A name with the hint to lower this.
    pub const fn named(self, name: &str) -> BufferName<'_> {
        let hint = match self {
            Self::EntryPoints => "lower quality.entry_points",
            Self::GatherRays => "lower quality.cache_points or quality.gather_rays",
            Self::Pixels => "make the image smaller with --size, or lower quality.edge_samples",
            Self::Cells => "lower quality.cells or quality.directions",
            Self::Triangles => "take a model of fewer triangles",
        };
        BufferName { name, hint }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn buffers_have_the_hint_that_they_were_named_with() {
        let named = GrowsWith::EntryPoints.named("entry points");
        assert_eq!((named.name, named.hint), ("entry points", "lower quality.entry_points"));
        assert!(
            GrowsWith::GatherRays.named("").hint.ends_with("quality.cache_points or quality.gather_rays")
        );
        assert!(GrowsWith::Pixels.named("").hint.contains("--size"));
        assert!(GrowsWith::Triangles.named("").hint.ends_with("fewer triangles"));
        assert_eq!(BufferName::from("zero").hint, Error::SMALLER);
    }
}
