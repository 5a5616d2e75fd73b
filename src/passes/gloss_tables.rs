//! Tables of glossy surfaces, which the precomputation makes and frames read.

use crate::layout::{GpuStruct, Layout, gpu_struct};
use glam::{UVec2, Vec3, Vec4};
use std::ops::Range;

gpu_struct! {
    /// An entry point that may be glossy.
    pub struct GlossEntry {
        /// Position on the surface, metres.
        pub position: Vec3,
        pub path: u32,
        /// Unit geometric normal of its side.
        pub normal: Vec3,
        /// Its area over the mean of all.
        pub weight: f32,
        /// Unit direction in which its path leaves; zero if the path ends at once.
        pub departure: Vec3,
        pub material: u32,
        /// Packed colour of the image there; white if there is none.
        pub colour: u32,
    }
}

gpu_struct! {
    /// A path vertex in a cluster that may be glossy.
    pub struct GlossVertex {
        pub material: u32,
        /// Index of its contribution; [`UNWEIGHTED`]: accessibility does not weight it.
        pub contribution: u32,
    }
}

gpu_struct! {
    /// One outgoing direction of one cluster.
    pub struct GlossBin {
        pub cluster: u32,
        /// Unit direction: the mean direction of its readers.
        pub direction: Vec3,
    }
}

/// Layouts of the structs shared with the shaders.
pub(super) const LAYOUTS: &[Layout] = &[GlossEntry::LAYOUT, GlossVertex::LAYOUT, GlossBin::LAYOUT];

/// Marks a vertex of an unweighted cluster.
pub const UNWEIGHTED: u32 = 1 << 31;

/// The tables. A *gloss bin* is one outgoing direction of one cluster.
#[derive(Debug, Default)]
pub struct GlossTables {
    /// Entry points that may be glossy.
    pub entries: Vec<GlossEntry>,
    /// Path vertices that may be glossy: the entry points among them, then the others. Each
    /// half has one base cluster after the other, in the order of their contributions.
    pub vertices: Vec<GlossVertex>,
    /// For each of these entry points its index in `entries`.
    pub entry_indices: Vec<u32>,
    /// For each of the other vertices the unit mirror direction of the incoming light, and a
    /// spare number, which makes a texel.
    pub mirrors: Vec<Vec4>,
    /// For each base cluster its first vertex in each half, and the end of both.
    pub vertex_offsets: Vec<UVec2>,
    /// Maximum number of vertices below a gloss bin that is no sum.
    pub max_vertices: u32,
    /// Range of base clusters below each cluster.
    pub base_ranges: Vec<UVec2>,
    /// Gloss bins: first those computed from vertices, then the sums, level by level.
    pub bins: Vec<GlossBin>,
    /// Number of gloss bins that are no sums.
    pub leaf_count: u32,
    /// Range of the sums of each level that has any.
    pub sums: Vec<Range<u32>>,
    /// CSR offsets into `children`: one for each sum, and the end.
    pub child_offsets: Vec<u32>,
    /// The gloss bins one level down that each sum adds.
    pub children: Vec<u32>,
    /// Gather rays that read gloss bins.
    pub readers: u64,
}
