//! (Ir)radiance splatting: the records of each pixel with their weights, and its indirect
//! irradiance. [Yue §4, Tsplat] In: pixels, cache points, record tree, records. Out: weights (a
//! view's), irradiance (W/m²).
//!
//! The two halves are timed apart: weights change with the view, values with the light.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT};
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::record_tree::{RecordTree, TreeGrid};
use bytemuck::Zeroable;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A record and its weight at a pixel. The weights of a pixel sum to 1, or to -1 if no valid
    /// record covers it.
    pub struct SplatWeight {
        pub record: u32,
        pub weight: f32,
    }
}

gpu_struct! {
    /// The segment of weights that belongs to a pixel.
    pub struct WeightRange {
        pub first: u32,
        /// One past the last, which may exceed the capacity.
        pub end: u32,
    }
}

gpu_struct! {
    /// Counts of a view.
    pub struct SplatTally {
        /// Weights of all pixels.
        pub weights: u32,
        /// Pixels with relaxed records.
        pub relaxed: u32,
        /// 1: some invocation had a truncated loop.
        pub is_truncated: u32,
    }
}

gpu_struct! {
    /// The box around a block of records.
    pub struct RecordBox {
        /// Lowest corner, metres.
        pub low: Vec3,
        pub high: Vec3,
    }
}

gpu_struct! {
    /// Push constants of the first step.
    pub struct SplatBlocksPush {
        pub record_count: u32,
    }
}

gpu_struct! {
    /// Push constants of the second step.
    pub struct SplatWeightsPush {
        pub grid: TreeGrid,
        pub width: u32,
        pub height: u32,
        pub record_count: u32,
        /// Capacity of the list of weights.
        pub weight_capacity: u32,
    }
}

gpu_struct! {
    /// Push constants of the third step.
    pub struct SplatNearestPush {
        pub record_count: u32,
        /// Capacity of the list of weights.
        pub weight_capacity: u32,
    }
}

gpu_struct! {
    /// Push constants of the last step.
    pub struct SplatApplyPush {
        pub pixel_count: u32,
        /// Capacity of the list of weights.
        pub weight_capacity: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    SplatWeight::LAYOUT,
    WeightRange::LAYOUT,
    SplatTally::LAYOUT,
    RecordBox::LAYOUT,
    SplatBlocksPush::LAYOUT,
    SplatWeightsPush::LAYOUT,
    SplatNearestPush::LAYOUT,
    SplatApplyPush::LAYOUT,
];

/// Consecutive records that share a box.
const RECORD_BLOCK: u32 = 64;

/// The pipelines and all lists between records and pixels.
pub struct Splat {
    pub(super) context: Arc<Context>,
    blocks: Pipeline,
    weigh: Pipeline,
    nearest: Pipeline,
    apply: Pipeline,
    /// The records that can have weight at a point.
    pub tree: Arc<RecordTree>,
    pub(super) size: [u32; 2],
    block_boxes: Buffer,
    pub(super) weight_ranges: Buffer,
    pub(super) weights: Buffer,
    pub(super) weight_capacity: u32,
    pub(super) tally: Buffer,
    /// Uncovered pixels without a relaxed record: dispatch size of one workgroup each; their
    /// number; their indices, in any order.
    pub(super) uncovered: Buffer,
    /// Indirect irradiance of each pixel, W/m²; three floats.
    pub irradiance: Buffer,
}

impl Splat {
    /// Stem of shaders, reference and timing of the weights.
    pub const STEM: &str = "splat";
    /// Stem of shader, reference and timing of the values.
    pub const APPLY_STEM: &str = "splat_apply";

    /// Allocates buffers for the records of a tree and an image of that size.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, tree: Arc<RecordTree>, size: [u32; 2]) -> Result<Self> {
        let pixel_count = size[0] * size[1];
        // Images of the built-in scenes need at most four weights a pixel. If a view needs more,
        // the list grows and the frame is repeated.
        let weight_capacity = 5 * pixel_count;
        // Zero counts before the first view.
        let no_weights = vec![WeightRange::zeroed(); pixel_count as usize];
        let block_count = u64::from(tree.record_count.div_ceil(RECORD_BLOCK));
        let of_pixels = |name, bytes: u64| Buffer::storage(context, GrowsWith::Pixels.named(name), bytes);
        let filled = |name| GrowsWith::Pixels.named(name);
        Ok(Self {
            context: context.clone(),
            blocks: Pipeline::new(context, "splat_blocks", &[])?,
            weigh: Pipeline::new(context, "splat_weights", &[])?,
            nearest: Pipeline::new(context, "splat_nearest", &[])?,
            apply: Pipeline::new(context, Self::APPLY_STEM, &[])?,
            tree,
            size,
            block_boxes: Buffer::storage(context, "record blocks", block_count * size_of::<RecordBox>() as u64)?,
            weight_ranges: Buffer::from_slice(context, filled("weight ranges"), &no_weights)?,
            weights: of_pixels("splat weights", 8 * u64::from(weight_capacity))?,
            weight_capacity,
            tally: Buffer::from_slice(context, filled("splat tally"), &[SplatTally::zeroed()])?,
            uncovered: Buffer::from_slice(
                context,
                filled("uncovered pixels"),
                &vec![0_u32; 4 + pixel_count as usize],
            )?,
            irradiance: of_pixels("indirect irradiance", 12 * u64::from(pixel_count))?,
        })
    }

    /// Finds the records of every pixel of a view. Pixels without any take the nearest.
    pub fn record(&self, rec: &mut Recorder, surfaces: &Buffer, cache_points: &Buffer, pixels: &Buffer) {
        let [width, height] = self.size;
        let RecordTree { grid, record_count, nodes, lists } = &*self.tree;
        let (record_count, weight_capacity) = (*record_count, self.weight_capacity);
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(
            &self.blocks,
            [record_count.div_ceil(RECORD_BLOCK).max(1), 1, 1],
            &SplatBlocksPush { record_count },
            &[
                ("CachePoints", cache_points),
                ("BlockBoxes", &self.block_boxes),
                ("Tally", &self.tally),
                ("UncoveredPixels", &self.uncovered),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.weigh,
            [64 * width.div_ceil(8) * height.div_ceil(8), 1, 1],
            &SplatWeightsPush { grid: *grid, width, height, record_count, weight_capacity },
            &[
                ("Surfaces", surfaces),
                ("Pixels", pixels),
                ("CachePoints", cache_points),
                ("TreeNodes", nodes),
                ("RecordLists", lists),
                ("WeightRanges", &self.weight_ranges),
                ("Weights", &self.weights),
                ("Tally", &self.tally),
                ("UncoveredPixels", &self.uncovered),
            ],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch_indirect(
            &self.nearest,
            (&self.uncovered, 0),
            &SplatNearestPush { record_count, weight_capacity },
            &[
                ("Pixels", pixels),
                ("CachePoints", cache_points),
                ("BlockBoxes", &self.block_boxes),
                ("WeightRanges", &self.weight_ranges),
                ("UncoveredPixels", &self.uncovered),
                ("Weights", &self.weights),
            ],
        );
    }

    /// Extrapolates the records to the pixels.
    pub fn record_apply(&self, rec: &mut Recorder, pixels: &Buffer, records: &Buffer) {
        let pixel_count = self.size[0] * self.size[1];
        rec.pass(Self::APPLY_STEM).dispatch(
            &self.apply,
            [pixel_count, 1, 1],
            &SplatApplyPush { pixel_count, weight_capacity: self.weight_capacity },
            &[
                ("Pixels", pixels),
                ("WeightRanges", &self.weight_ranges),
                ("Weights", &self.weights),
                ("Records", records),
                ("IndirectIrradiance", &self.irradiance),
            ],
        );
    }
}
