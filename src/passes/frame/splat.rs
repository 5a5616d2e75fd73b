//! (Ir)radiance splatting: the records of each pixel with their weights, and its indirect
//! irradiance. [Yue §4, Tsplat] In: pixels, cache points, records. Out: weights (a
//! view's), irradiance (W/m²).
//!
//! The two halves are timed apart: weights change with the view, values with the light.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT};
use crate::gpu::{Buffer, Context, PassScope, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::prefix_sum::PrefixSum;
use crate::passes::frame::tile_sort::TileSort;
use crate::types::View;
use bytemuck::Zeroable;
use glam::{UVec2, Vec3};
use std::sync::Arc;

gpu_struct! {
    /// Pixels that a record may touch.
    pub struct PixelRectangle {
        /// First column | first row << 16.
        pub low: u32,
        /// One past the last column and row, packed alike.
        pub high: u32,
    }
}

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
    /// The box around the surfaces of a tile of pixels, or around a block of records.
    pub struct TileBox {
        /// Lowest corner, metres.
        pub low: Vec3,
        pub high: Vec3,
    }
}

gpu_struct! {
    /// Push constants of the step before the first one.
    pub struct SplatBoxesPush {
        /// Size of the image, pixels.
        pub size: UVec2,
    }
}

gpu_struct! {
    /// Push constants of the first step.
    pub struct SplatBoundsPush {
        pub view: View,
        pub record_count: u32,
    }
}

gpu_struct! {
    /// Push constants of the second step.
    pub struct SplatEmitPush {
        pub record_count: u32,
        /// Tiles in a row.
        pub tile_columns: u32,
        /// Capacity of the list of pairs.
        pub capacity: u32,
    }
}

gpu_struct! {
    /// Push constants of the third step.
    pub struct SplatTilesPush {
        pub width: u32,
        pub height: u32,
        pub record_count: u32,
        /// Capacity of the list of pairs.
        pub pair_capacity: u32,
        /// Capacity of the list of weights.
        pub weight_capacity: u32,
    }
}

gpu_struct! {
    /// Push constants of the step before the fourth one.
    pub struct SplatBlocksPush {
        pub record_count: u32,
    }
}

gpu_struct! {
    /// Push constants of the fourth step.
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
    PixelRectangle::LAYOUT,
    SplatWeight::LAYOUT,
    WeightRange::LAYOUT,
    SplatTally::LAYOUT,
    TileBox::LAYOUT,
    SplatBoxesPush::LAYOUT,
    SplatBoundsPush::LAYOUT,
    SplatEmitPush::LAYOUT,
    SplatTilesPush::LAYOUT,
    SplatBlocksPush::LAYOUT,
    SplatNearestPush::LAYOUT,
    SplatApplyPush::LAYOUT,
];

/// Edge of a tile in pixels: the workgroup of `splat_tiles`.
pub(super) const TILE: u32 = 16;
/// Consecutive records that share a box.
const RECORD_BLOCK: u32 = 64;

/// The pipelines and all lists between records and pixels.
pub struct Splat {
    pub(super) context: Arc<Context>,
    boxes: Pipeline,
    bounds: Pipeline,
    emit: Pipeline,
    all_tiles: Pipeline,
    crowded_tiles: Pipeline,
    blocks: Pipeline,
    nearest: Pipeline,
    apply: Pipeline,
    record_sums: PrefixSum,
    pub(super) sort: TileSort,
    pub(super) record_count: u32,
    pub(super) size: [u32; 2],
    tile_boxes: Buffer,
    block_boxes: Buffer,
    rectangles: Buffer,
    pub(super) pair_offsets: Buffer,
    pub(super) weight_ranges: Buffer,
    pub(super) weights: Buffer,
    pub(super) weight_capacity: u32,
    pub(super) tally: Buffer,
    /// Uncovered pixels without a relaxed record: dispatch size of one workgroup each; their
    /// number; their indices, in any order.
    pub(super) uncovered: Buffer,
    /// Tiles that have pixels with more weights than registers hold, likewise.
    crowded: Buffer,
    /// Indirect irradiance of each pixel, W/m²; three floats.
    pub irradiance: Buffer,
}

impl Splat {
    /// Stem of shaders, reference and timing of the weights.
    pub const STEM: &str = "splat";
    /// Stem of shader, reference and timing of the values.
    pub const APPLY_STEM: &str = "splat_apply";

    /// Allocates buffers for `record_count` records and an image of that size.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, record_count: u32, size: [u32; 2]) -> Result<Self> {
        let pixel_count = size[0] * size[1];
        // Images of the built-in scenes need at most four weights a pixel. If a view needs more,
        // the list grows and the frame is repeated.
        let weight_capacity = 5 * pixel_count;
        let tile_count = size.map(|pixels| u64::from(pixels.div_ceil(TILE))).iter().product::<u64>();
        // Zero counts before the first view.
        let no_pairs = vec![0_u32; record_count as usize + 1];
        let no_weights = vec![WeightRange::zeroed(); pixel_count as usize];
        let list = |name, items: u64| Buffer::from_slice(context, name, &vec![0_u32; 4 + items as usize]);
        let boxes = |name, count: u64| Buffer::storage(context, name, count * size_of::<TileBox>() as u64);
        let tiles = |crowded: u32| Pipeline::new(context, "splat_tiles", &[("CROWDED", crowded)]);
        Ok(Self {
            context: context.clone(),
            boxes: Pipeline::new(context, "splat_boxes", &[])?,
            bounds: Pipeline::new(context, "splat_bounds", &[])?,
            emit: Pipeline::new(context, "splat_emit", &[])?,
            all_tiles: tiles(0)?,
            crowded_tiles: tiles(1)?,
            blocks: Pipeline::new(context, "splat_blocks", &[])?,
            nearest: Pipeline::new(context, "splat_nearest", &[])?,
            apply: Pipeline::new(context, Self::APPLY_STEM, &[])?,
            record_sums: PrefixSum::new(context, record_count)?,
            sort: TileSort::new(context, 6 * record_count)?,
            record_count,
            size,
            tile_boxes: boxes("tile boxes", tile_count)?,
            block_boxes: boxes("record blocks", u64::from(record_count.div_ceil(RECORD_BLOCK)))?,
            rectangles: Buffer::storage(
                context,
                GrowsWith::Pixels.named("pixel rectangles"),
                8 * u64::from(record_count),
            )?,
            pair_offsets: Buffer::from_slice(context, GrowsWith::Pixels.named("pair offsets"), &no_pairs)?,
            weight_ranges: Buffer::from_slice(
                context,
                GrowsWith::Pixels.named("weight ranges"),
                &no_weights,
            )?,
            weights: Buffer::storage(
                context,
                GrowsWith::Pixels.named("splat weights"),
                8 * u64::from(weight_capacity),
            )?,
            weight_capacity,
            tally: Buffer::from_slice(
                context,
                GrowsWith::Pixels.named("splat tally"),
                &[SplatTally::zeroed()],
            )?,
            uncovered: list("uncovered pixels", u64::from(pixel_count))?,
            crowded: list("crowded tiles", tile_count)?,
            irradiance: Buffer::storage(
                context,
                GrowsWith::Pixels.named("indirect irradiance"),
                12 * u64::from(pixel_count),
            )?,
        })
    }

    /// Finds the records of every pixel of a view.
    pub fn record(
        &self,
        rec: &mut Recorder,
        surfaces: &Buffer,
        cache_points: &Buffer,
        pixels: &Buffer,
        view: &View,
    ) {
        let mut pass = rec.pass(Self::STEM);
        let sorted = self.record_lists(&mut pass, cache_points, pixels, view);
        self.record_weights(&mut pass, sorted, (surfaces, cache_points, pixels));
    }

    /// Lists the records of each tile. Returns the pairs of tile and record, in order.
    fn record_lists(
        &self,
        pass: &mut PassScope<'_>,
        cache_points: &Buffer,
        pixels: &Buffer,
        view: &View,
    ) -> &Buffer {
        let tiles = self.size.map(|pixels| pixels.div_ceil(TILE));
        let records = [self.record_count, 1, 1];
        pass.dispatch(
            &self.boxes,
            [self.size[0], self.size[1], 1],
            &SplatBoxesPush { size: self.size.into() },
            &[("Pixels", pixels), ("TileBoxes", &self.tile_boxes)],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.bounds,
            [self.record_count.max(1), 1, 1],
            &SplatBoundsPush { view: *view, record_count: self.record_count },
            &[
                ("CachePoints", cache_points),
                ("Rectangles", &self.rectangles),
                ("TileCounts", &self.pair_offsets),
                ("Tally", &self.tally),
                ("TileBoxes", &self.tile_boxes),
                ("UncoveredPixels", &self.uncovered),
                ("CrowdedTiles", &self.crowded),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.record_sums.record(pass, &self.pair_offsets, self.record_count);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.emit,
            records,
            &SplatEmitPush {
                record_count: self.record_count,
                tile_columns: tiles[0],
                capacity: self.sort.capacity(),
            },
            &[
                ("Rectangles", &self.rectangles),
                ("PairOffsets", &self.pair_offsets),
                ("Pairs", self.sort.input()),
                ("CachePoints", cache_points),
                ("TileBoxes", &self.tile_boxes),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        let sorted = self.sort.record(pass, &self.pair_offsets, self.record_count, tiles[0] * tiles[1]);
        pass.barrier(COMPUTE_TO_COMPUTE);
        sorted
    }

    /// Weighs the listed records at each pixel; pixels without any take the nearest.
    fn record_weights(
        &self,
        pass: &mut PassScope<'_>,
        sorted: &Buffer,
        (surfaces, cache_points, pixels): (&Buffer, &Buffer, &Buffer),
    ) {
        let tiles = self.size.map(|pixels| pixels.div_ceil(TILE));
        let [width, height] = self.size;
        let push = SplatTilesPush {
            width,
            height,
            record_count: self.record_count,
            pair_capacity: self.sort.capacity(),
            weight_capacity: self.weight_capacity,
        };
        let bindings = [
            ("Surfaces", surfaces),
            ("Pixels", pixels),
            ("CachePoints", cache_points),
            ("Rectangles", &self.rectangles),
            ("PairOffsets", &self.pair_offsets),
            ("SortedPairs", sorted),
            ("WeightRanges", &self.weight_ranges),
            ("Weights", &self.weights),
            ("Tally", &self.tally),
            ("UncoveredPixels", &self.uncovered),
            ("CrowdedTiles", &self.crowded),
        ];
        pass.dispatch(&self.all_tiles, [TILE * TILE * tiles[0] * tiles[1], 1, 1], &push, &bindings);
        pass.dispatch(
            &self.blocks,
            [self.record_count.div_ceil(RECORD_BLOCK).max(1), 1, 1],
            &SplatBlocksPush { record_count: self.record_count },
            &[("CachePoints", cache_points), ("BlockBoxes", &self.block_boxes)],
        );
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch_indirect(&self.crowded_tiles, (&self.crowded, 0), &push, &bindings);
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch_indirect(
            &self.nearest,
            (&self.uncovered, 0),
            &SplatNearestPush { record_count: self.record_count, weight_capacity: self.weight_capacity },
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
