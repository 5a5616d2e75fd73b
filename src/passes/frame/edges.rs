//! Structs that antialiasing shares with its shaders.

use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::types::View;

gpu_struct! {
    /// The surface at a sample of an edge pixel. Its position follows from its index and the side.
    pub struct EdgeSample {
        /// As in `PixelSurface`; `NO_SIDE` if none of its image points met a surface.
        pub side: u32,
        /// Bits 0-2: the image point that it shows; 3-6: eighths of its image points that met a
        /// surface; 7-10: position, among the nine pixels around, of the pixel whose indirect light
        /// it takes, row by row; 11-12: its slot; 13: no pixel around serves it.
        pub what: u32,
    }
}

gpu_struct! {
    /// The data that samples of one slot share.
    pub struct EdgeSlot {
        /// Side of its first sample; `NO_SIDE`: this slot and all later ones of the
        /// pixel are empty.
        pub side: u32,
        /// Bits 0-3: position of the pixel whose indirect light the samples take; 4-30: the
        /// sum of their eighths; 31: they need an edge point.
        pub what: u32,
        /// Edge point whose indirect light they take instead; `u32::MAX`: none.
        pub point: u32,
    }
}

gpu_struct! {
    /// Capacity of the lists of edge pixels.
    pub struct EdgeCapacity {
        /// Maximum number of samples of a pixel; zero turns antialiasing off.
        pub max_samples: u32,
        /// Total number of samples; with too many edges, each pixel gets fewer.
        pub samples: u32,
        /// Total number of slots; likewise.
        pub slots: u32,
        /// Total number of edge points; slots without one take the indirect light of a pixel.
        pub points: u32,
    }
}

gpu_struct! {
    /// Push constants of `edge_mark` and `shadow_mark`.
    pub struct EdgeMarkPush {
        pub width: u32,
        pub height: u32,
    }
}

gpu_struct! {
    /// Push constants of `edge_list`, `edge_slots` and `edge_sums`.
    pub struct EdgeListPush {
        /// Pixels of a row.
        pub width: u32,
        pub pixel_count: u32,
        pub capacity: EdgeCapacity,
    }
}

gpu_struct! {
    /// Push constants of `edge_samples`, `edge_slots`, `edge_points`, `edge_batches` and of
    /// `pixel_frusta`, the frusta of pixels.
    pub struct EdgeSamplesPush {
        pub view: View,
        pub capacity: EdgeCapacity,
        /// Area of a pixel up to which indirect light is smooth over it and its neighbours, m².
        pub smooth_m2: f32,
    }
}

gpu_struct! {
    /// Push constants of `edge_direct` and `shadow_edges`.
    pub struct EdgeLightPush {
        pub view: View,
        pub capacity: EdgeCapacity,
        /// Row of the part of the light.
        pub light: u32,
        /// First sample of an image point.
        pub first_sample: u32,
        /// One past the last.
        pub end_sample: u32,
        /// Step of the lattice of the samples of all image points of a pixel.
        pub sample_step: u32,
        /// Sum of `TRACES_ALL` and `ADDS`.
        pub flags: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    EdgeSample::LAYOUT,
    EdgeSlot::LAYOUT,
    EdgeCapacity::LAYOUT,
    EdgeMarkPush::LAYOUT,
    EdgeListPush::LAYOUT,
    EdgeSamplesPush::LAYOUT,
    EdgeLightPush::LAYOUT,
];
