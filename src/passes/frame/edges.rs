//! What antialiasing shares with its shaders.

use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::types::View;

gpu_struct! {
    /// What a sample of an edge pixel sees. Where, follows from its number and the side.
    pub struct EdgeSample {
        /// As in `PixelSurface`; `NO_SIDE` where none of its points met a surface.
        pub side: u32,
        /// Bits 0-2: which of its points it shows; 3-6: eighths of them that met a surface; 7-10:
        /// place of the pixel whose indirect light it takes among the nine around, row by row;
        /// 11-12: its slot.
        pub what: u32,
    }
}

gpu_struct! {
    /// What some samples of an edge pixel have in common.
    pub struct EdgeSlot {
        /// Side of the first of them; `NO_SIDE`: nobody's, as all slots of the pixel behind it.
        pub side: u32,
        /// Bits 0-3: place of the pixel whose indirect light they take; from bit 4:
        /// their eighths, summed.
        pub what: u32,
    }
}

gpu_struct! {
    /// How much room there is.
    pub struct EdgeCapacity {
        /// Samples of a pixel at most; zero turns antialiasing off.
        pub max_samples: u32,
        /// Samples in all; with more edges than that, each gets fewer.
        pub samples: u32,
        /// Slots in all; likewise.
        pub slots: u32,
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
        /// Of a row of pixels.
        pub width: u32,
        pub pixel_count: u32,
        pub capacity: EdgeCapacity,
    }
}

gpu_struct! {
    /// Push constants of `edge_samples`, `edge_batches` and `pixel_frusta`.
    pub struct EdgeSamplesPush {
        pub view: View,
        pub capacity: EdgeCapacity,
    }
}

gpu_struct! {
    /// Push constants of `edge_direct` and `shadow_edges`.
    pub struct EdgeLightPush {
        pub view: View,
        pub capacity: EdgeCapacity,
        /// Index of the light.
        pub light: u32,
        /// First point sample of the light.
        pub first_sample: u32,
        /// Behind the last.
        pub end_sample: u32,
        /// 1: rays are traced although they cannot bring light.
        pub traces_all: u32,
    }
}

/// What this pass shares with its shaders.
pub const LAYOUTS: &[Layout] = &[
    EdgeSample::LAYOUT,
    EdgeSlot::LAYOUT,
    EdgeCapacity::LAYOUT,
    EdgeMarkPush::LAYOUT,
    EdgeListPush::LAYOUT,
    EdgeSamplesPush::LAYOUT,
    EdgeLightPush::LAYOUT,
];
