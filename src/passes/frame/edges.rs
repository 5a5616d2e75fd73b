//! What the parts of antialiasing have in common: structs that they share with shaders, thresholds,
//! and the buffers of a view's edge pixels.

use crate::gpu::Buffer;
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::{OneLight, SceneBuffers};
use crate::types::{LIGHT_AREA, View};

/// Relative difference of a light between neighbours that makes an edge, if points may see a part
/// of the light.
pub const CONTRAST: f32 = 0.1;

/// The same if they see all of the light or nothing: below it, only the shading differs, whose mean
/// over a pixel is close to that at the centre.
pub const SHADING: f32 = 0.5;

/// The difference that makes an edge of a light.
pub(super) fn contrast(light: OneLight<'_>) -> f32 {
    if light.kind == LIGHT_AREA || light.part_count > 1 { CONTRAST } else { SHADING }
}

/// Dissimilarity up to which two points show one surface; it is above this for another facet, and
/// for a plane as far from the point as a pixel is wide.
pub const ALIKE: f32 = 1.0;
/// A mixed fragment takes all its samples if the variance of the light among the first ones exceeds
/// this times their squared mean.
pub const SPREAD: f32 = 3.0;
// Byte offsets of dispatch sizes: for workgroups of 64 edge pixels, of values of light (pixels,
// then fragments), and of 64 fragments. In the list of a light, offset 0 is the size for workgroups
// of four averaged pixels.
pub(super) const EDGE_GROUPS: u64 = 32;
pub(super) const POINT_GROUPS: u64 = 48;
pub(super) const FRAGMENT_GROUPS: u64 = 64;

/// Samples of an edge pixel for each sample of a light in one of its fragments: more of them cost
/// only at a move of the camera. `glsl/include/antialias.glsl` has the same constant.
pub const COVERAGE: u32 = 4;
/// The number of samples of an edge pixel is a multiple of this.
pub const SAMPLE_STEP: u32 = 8;
/// Samples whose fragments share a texel: a mask of them for each fragment of the pixel.
pub const MASKED: u32 = 32;
/// Maximum number of samples of an edge pixel.
pub const MAX_SAMPLES: u32 = 256;
/// Maximum number of fragments of an edge pixel.
pub const MAX_FRAGMENTS: u32 = 4;
/// Words of the triangles of a tile; as in `glsl/include/antialias.glsl`.
pub const TILE_WORDS: u32 = 512;
/// Words of the triangles of an edge pixel; as in `glsl/include/antialias.glsl`.
pub const EDGE_WORDS: u32 = 64;

gpu_struct! {
    /// What an edge pixel shows of one surface: the samples that see it. Its point has the same
    /// index in the list of surfaces.
    pub struct Fragment {
        /// Index of its pixel in the list of edge pixels.
        pub edge: u32,
        /// Bits 0–3: position, among the nine pixels around, of the pixel whose indirect light it
        /// takes, row by row; 4: it needs an edge point; 5–13: which of the nine pixels are alike;
        /// 14–31: number of its samples.
        pub what: u32,
        /// Edge point whose indirect light it takes instead; `u32::MAX`: none.
        pub point: u32,
        /// Bit 4·n + k: fragment k of neighbour n is alike; the eight neighbours row by row.
        pub neighbours: u32,
    }
}

gpu_struct! {
    /// Capacity of the lists of edge pixels.
    pub struct EdgeCapacity {
        /// Maximum number of samples of a light in a fragment; zero turns antialiasing off.
        pub light_samples: u32,
        /// Total number of samples; with too many edges, each pixel gets fewer.
        pub samples: u32,
        /// Total number of fragments; likewise.
        pub fragments: u32,
        /// Total number of edge points; fragments without one take the indirect light of a pixel.
        pub points: u32,
        /// Tiles of 8×8 pixels; edge pixels of other tiles trace rays.
        pub tiles: u32,
    }
}

gpu_struct! {
    pub struct EdgeMarkPush {
        pub view: View,
        /// Edges of the mesh; zero: the invocations are pixels.
        pub edge_count: u32,
    }
}

gpu_struct! {
    /// Push constants of `edge_list` and `fragment_links`.
    pub struct EdgeListPush {
        /// Pixels of a row.
        pub width: u32,
        pub pixel_count: u32,
        pub capacity: EdgeCapacity,
    }
}

gpu_struct! {
    /// Push constants of `edge_triangles`, `edge_samples`, `edge_rays`, `edge_groups` and
    /// `fragments`, in which a pixel may be small beside the cells of the hierarchy.
    pub struct EdgeSamplesPush {
        pub view: View,
        pub capacity: EdgeCapacity,
        /// Area of a pixel up to which indirect light is smooth over it and its neighbours, m².
        pub smooth_m2: f32,
    }
}

gpu_struct! {
    /// Push constants of `fragment_direct`, `fragment_samples` and `shadow_edges`.
    pub struct EdgeLightPush {
        pub view: View,
        pub capacity: EdgeCapacity,
        /// Row of the part of the light.
        pub light: u32,
        /// First sample of the light.
        pub first_sample: u32,
        /// One past the last.
        pub end_sample: u32,
        /// Step of the lattice of the samples of all image points of a pixel.
        pub sample_step: u32,
        /// Sum of `TRACES_ALL`, `ADDS` and `MARKS_PENUMBRA`.
        pub flags: u32,
    }
}

gpu_struct! {
    pub struct FragmentMarkPush {
        pub width: u32,
        pub height: u32,
        /// Maximum number of samples of a mixed fragment.
        pub light_samples: u32,
        /// Relative difference of a light on one surface that makes an edge.
        pub contrast: f32,
    }
}

gpu_struct! {
    pub struct ShadowMarkPush {
        pub width: u32,
        pub height: u32,
        /// Relative difference between neighbours that makes an edge.
        pub contrast: f32,
    }
}

gpu_struct! {
    pub struct TileTrianglesPush {
        pub view: View,
        pub capacity: EdgeCapacity,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    Fragment::LAYOUT,
    EdgeCapacity::LAYOUT,
    EdgeMarkPush::LAYOUT,
    EdgeListPush::LAYOUT,
    EdgeSamplesPush::LAYOUT,
    EdgeLightPush::LAYOUT,
    FragmentMarkPush::LAYOUT,
    ShadowMarkPush::LAYOUT,
    TileTrianglesPush::LAYOUT,
];

/// What kernels read of a view's edge pixels.
pub(super) struct EdgeView<'a> {
    pub(super) scene: &'a SceneBuffers,
    pub(super) view: &'a View,
    pub(super) pixels: &'a Buffer,
    pub(super) numbers: &'a Buffer,
    pub(super) edge_pixels: &'a Buffer,
    pub(super) samples: &'a Buffer,
    pub(super) groups: &'a Buffer,
    pub(super) capacity: EdgeCapacity,
    pub(super) smooth_m: f32,
}

impl EdgeView<'_> {
    pub(super) fn places(&self) -> u32 {
        places([self.view.width, self.view.height])
    }

    pub(super) fn samples_push(&self) -> EdgeSamplesPush {
        EdgeSamplesPush {
            view: *self.view,
            capacity: self.capacity,
            smooth_m2: self.smooth_m * self.smooth_m,
        }
    }

    /// What kernels that trace rays to a light read of the scene, and what each reads besides.
    pub(super) fn traced<'b>(
        &'b self,
        light: OneLight<'b>,
        others: &[(&'static str, &'b Buffer)],
    ) -> Vec<(&'static str, &'b Buffer)> {
        let of_scene = [
            ("Nodes", &self.scene.nodes),
            ("Triangles", &self.scene.triangles),
            ("Surfaces", &self.scene.surfaces),
            ("Lights", light.table),
        ];
        [&of_scene, others].concat()
    }

    /// For samples of a light from the first to one past the last.
    pub(super) fn light_push(
        &self,
        light: OneLight<'_>,
        (first_sample, end_sample): (u32, u32),
    ) -> EdgeLightPush {
        EdgeLightPush {
            view: *self.view,
            capacity: self.capacity,
            light: light.row,
            first_sample,
            end_sample,
            sample_step: light.point_step(),
            flags: light.flags(),
        }
    }
}

/// Positions in tile order of an image of that size, including those of pixels beyond its edges.
pub(super) fn places([width, height]: [u32; 2]) -> u32 {
    64 * width.div_ceil(8) * height.div_ceil(8)
}
