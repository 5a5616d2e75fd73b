//! (Ir)radiance splatting: the records of each pixel with their weights, and its indirect
//! irradiance. [Yue §4, Tsplat] In: pixels, cache points, record tree, records. Out: weights (a
//! view's), irradiance (W/m²).
//!
//! The two halves are timed apart: weights change with the view, values with the light.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::record_tree::{RecordTree, TreeGrid};
use bytemuck::Zeroable;
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
        /// Pixels with relaxed records and no valid one.
        pub relaxed: u32,
        /// 1: some invocation had a truncated loop.
        pub is_truncated: u32,
        /// Records that pixels weighed, with and without weight.
        pub weighed: u32,
    }
}

gpu_struct! {
    /// Push constants of the first step.
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
    /// Push constants of the second step.
    pub struct SplatNearestPush {
        /// Nodes of the tree of nearest records.
        pub node_count: u32,
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
    SplatWeightsPush::LAYOUT,
    SplatNearestPush::LAYOUT,
    SplatApplyPush::LAYOUT,
];

/// The pipelines and all lists between records and pixels.
pub struct Splat {
    pub(super) context: Arc<Context>,
    nearest: Pipeline,
    apply: Pipeline,
    /// The records that can have weight at a point.
    pub tree: Arc<RecordTree>,
    pub(super) size: [u32; 2],
    pub(super) at_pixels: SplatPoints,
    pub(super) at_edges: SplatPoints,
    pub(super) weights: Buffer,
    pub(super) weight_capacity: u32,
    pub(super) tally: Buffer,
}

/// Where records are splatted to: the pixels, or the edge points.
pub(super) struct SplatPoints {
    weigh: Pipeline,
    /// Maximum number of points.
    pub(super) capacity: u32,
    /// `WeightRange` of each point.
    pub(super) weight_ranges: Buffer,
    /// Uncovered points without a relaxed record: dispatch size of workgroups of 64; their number;
    /// their indices, in any order.
    pub(super) uncovered: Buffer,
    /// Indirect irradiance of each point, W/m²; three floats.
    irradiance: Buffer,
}

impl SplatPoints {
    fn new(context: &Arc<Context>, capacity: u32, at_edges: bool) -> Result<Self> {
        // Workgroups of edge points are whole. Zero counts before the first view.
        let no_weights = vec![WeightRange::zeroed(); capacity.next_multiple_of(64) as usize];
        let named = |name| GrowsWith::Pixels.named(name);
        Ok(Self {
            weigh: Pipeline::new(context, "splat_weights", &[("AT_EDGES", u32::from(at_edges))])?,
            capacity,
            weight_ranges: Buffer::from_slice(context, named("weight ranges"), &no_weights)?,
            uncovered: Buffer::from_slice(
                context,
                named("uncovered pixels"),
                &vec![0_u32; 4 + capacity as usize],
            )?,
            irradiance: Buffer::storage(
                context,
                named("indirect irradiance"),
                12 * u64::from(capacity.max(1)),
            )?,
        })
    }
}

/// The surfaces of a view: pixels and edge points, with the dispatch size of the latter.
#[derive(Clone, Copy)]
pub struct SeenSurfaces<'a> {
    /// A `PixelSurface` for each pixel.
    pub pixels: &'a Buffer,
    /// A `PixelSurface` for each edge point.
    pub edge_points: &'a Buffer,
    /// Dispatch size for workgroups of 64 edge points; their number.
    pub point_groups: &'a Buffer,
}

impl Splat {
    /// Stem of shaders, reference and timing of the weights.
    pub const STEM: &str = "splat";
    /// Stem of shader, reference and timing of the values.
    pub const APPLY_STEM: &str = "splat_apply";

    /// Allocates buffers for the records of a tree, an image of that size and at most `edge_points`
    /// points of its edge pixels.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        tree: Arc<RecordTree>,
        size: [u32; 2],
        edge_points: u32,
    ) -> Result<Self> {
        let pixel_count = size[0] * size[1];
        // Images of the built-in scenes need at most four weights a pixel. If a view needs more,
        // the list grows and the frame is repeated.
        let weight_capacity = 5 * pixel_count;
        let of_pixels = |name, bytes: u64| Buffer::storage(context, GrowsWith::Pixels.named(name), bytes);
        let filled = |name| GrowsWith::Pixels.named(name);
        Ok(Self {
            context: context.clone(),
            nearest: Pipeline::new(context, "splat_nearest", &[])?,
            apply: Pipeline::new(context, Self::APPLY_STEM, &[])?,
            tree,
            size,
            at_pixels: SplatPoints::new(context, pixel_count, false)?,
            at_edges: SplatPoints::new(context, edge_points, true)?,
            weights: of_pixels("splat weights", 8 * u64::from(weight_capacity))?,
            weight_capacity,
            tally: Buffer::from_slice(context, filled("splat tally"), &[SplatTally::zeroed()])?,
        })
    }

    /// Indirect irradiance of each pixel, W/m²; three floats.
    pub fn irradiance(&self) -> &Buffer {
        &self.at_pixels.irradiance
    }

    /// Indirect irradiance of each edge point, likewise.
    pub fn edge_irradiance(&self) -> &Buffer {
        &self.at_edges.irradiance
    }

    /// Finds the records of every pixel and edge point of a view. Without any, a point takes the
    /// nearest of all.
    pub fn record(
        &self,
        rec: &mut Recorder,
        surfaces: &Buffer,
        cache_points: &Buffer,
        seen: SeenSurfaces<'_>,
    ) {
        let [width, height] = self.size;
        let RecordTree { grid, record_count, cells, lists, nearest } = &*self.tree;
        let (record_count, weight_capacity) = (*record_count, self.weight_capacity);
        let mut pass = rec.pass(Self::STEM);
        pass.fill_zero(&self.tally);
        for points in [&self.at_pixels, &self.at_edges] {
            pass.upload(&points.uncovered, &[0_u32; 4]);
        }
        pass.barrier(TRANSFER_TO_COMPUTE);
        let both = [(&self.at_pixels, seen.pixels), (&self.at_edges, seen.edge_points)];
        for (points, shown) in both {
            let push = SplatWeightsPush { grid: *grid, width, height, record_count, weight_capacity };
            let bindings = [
                ("Surfaces", surfaces),
                ("Pixels", shown),
                ("CachePoints", cache_points),
                ("TreeCells", cells),
                ("RecordLists", lists),
                ("WeightRanges", &points.weight_ranges),
                ("Weights", &self.weights),
                ("Tally", &self.tally),
                ("UncoveredPixels", &points.uncovered),
                ("PointGroups", seen.point_groups),
            ];
            if std::ptr::eq(points, &self.at_pixels) {
                let tiles = width.div_ceil(8) * height.div_ceil(8);
                pass.dispatch(&points.weigh, [64 * tiles, 1, 1], &push, &bindings);
                // Both append to one list.
                pass.barrier(COMPUTE_TO_COMPUTE);
            } else {
                pass.dispatch_indirect(&points.weigh, (seen.point_groups, 0), &push, &bindings);
            }
        }
        pass.barrier(COMPUTE_TO_INDIRECT);
        for (points, shown) in both {
            if std::ptr::eq(points, &self.at_edges) {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch_indirect(
                &self.nearest,
                (&points.uncovered, 0),
                &SplatNearestPush { node_count: nearest.node_count, weight_capacity },
                &[
                    ("Pixels", shown),
                    ("CachePoints", cache_points),
                    ("NearestNodes", &nearest.nodes),
                    ("NearestOrder", &nearest.order),
                    ("WeightRanges", &points.weight_ranges),
                    ("UncoveredPixels", &points.uncovered),
                    ("Weights", &self.weights),
                    ("Tally", &self.tally),
                ],
            );
        }
    }

    /// Extrapolates the records to the pixels and the edge points.
    pub fn record_apply(&self, rec: &mut Recorder, seen: SeenSurfaces<'_>, records: &Buffer) {
        let mut pass = rec.pass(Self::APPLY_STEM);
        for (points, shown) in [(&self.at_pixels, seen.pixels), (&self.at_edges, seen.edge_points)] {
            let push = SplatApplyPush { pixel_count: points.capacity, weight_capacity: self.weight_capacity };
            let bindings = [
                ("Pixels", shown),
                ("WeightRanges", &points.weight_ranges),
                ("Weights", &self.weights),
                ("Records", records),
                ("IndirectIrradiance", &points.irradiance),
            ];
            if std::ptr::eq(points, &self.at_pixels) {
                pass.dispatch(&self.apply, [points.capacity, 1, 1], &push, &bindings);
            } else {
                pass.dispatch_indirect(&self.apply, (seen.point_groups, 0), &push, &bindings);
            }
        }
    }
}
