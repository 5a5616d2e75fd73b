//! Light-path energy scan: a segmented inclusive product over the vertex array, one segment a path. [Yue §3, Tlpe]
//! In: steps in path order, reflectances. Out: throughput of every vertex, in cluster order. Reduce, then scan; deterministic.
//!
//! With fixed materials the products are constants: the scan runs once, and again only when a material changes.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::has_textures;
use crate::types::Deposit;
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// How the energy of one vertex follows from that of the vertex before.
    pub struct PathStep {
        /// Material that reflected the path towards this vertex; [`HEAD`] where the path starts, [`FROM_ENTRY`] where an entry
        /// point that may shine did: what it reflects depends on the light.
        pub material: u32,
        /// cosθ/(π·pdf) over the survival probability.
        pub weight: f32,
        /// Where the vertex stands in its cluster's list.
        pub slot: u32,
    }
}

gpu_struct! {
    /// Product of steps since the last path start among them.
    pub struct Segment {
        /// The product.
        pub product: Vec3,
        /// One if a path starts among them.
        pub has_head: u32,
    }
}

gpu_struct! {
    /// Push constants of the first kernel.
    pub struct PathScanPush {
        /// Vertices.
        pub step_count: u32,
        /// First block of the dispatch.
        pub first_block: u32,
        /// Its end.
        pub end_block: u32,
    }
}

gpu_struct! {
    /// Push constants of the second kernel.
    pub struct PathScanCarryPush {
        /// Blocks of the first kernel.
        pub block_count: u32,
    }
}

gpu_struct! {
    /// Push constants of the third kernel.
    pub struct PathScanApplyPush {
        /// Vertices.
        pub step_count: u32,
        /// First block of the dispatch.
        pub first_block: u32,
        /// Its end.
        pub end_block: u32,
    }
}

/// What this pass shares with its shaders.
pub const LAYOUTS: &[Layout] = &[
    PathStep::LAYOUT,
    Segment::LAYOUT,
    PathScanPush::LAYOUT,
    PathScanCarryPush::LAYOUT,
    PathScanApplyPush::LAYOUT,
];

/// Material of the first vertex of a path.
pub const HEAD: u32 = u32::MAX;
/// Stands for the material of an entry point that may shine: its factor comes with the path's flux.
pub const FROM_ENTRY: u32 = u32::MAX - 1;
/// Vertices of one block: 256 invocations of four each (`glsl/include/path_scan.glsl`).
const BLOCK_STEPS: u32 = 1024;

/// The pipelines, the steps and their result.
pub struct PathScan {
    blocks: Pipeline,
    carry: Pipeline,
    apply: Pipeline,
    steps: Buffer,
    /// Of each step 1 − cosα off the mirror direction; where nothing shines, there are none.
    lobes: Option<Buffer>,
    step_count: u32,
    colours: Buffer,
    block_products: Buffer,
    /// Product that enters each block from the left; three floats.
    entering: Buffer,
    /// `Deposit` of every vertex in cluster order, and one that nobody reads.
    pub deposits: Buffer,
}

impl PathScan {
    /// The name that shaders, twin and timing share.
    pub const STEM: &str = "path_scan";

    /// Uploads the paths. `colours`: packed, of the image where the step before ended; none at all in scenes without images. `lobes` is
    /// empty where no material may shine.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        steps: &[PathStep],
        colours: &[u32],
        lobes: &[f32],
        deposits: &[Deposit],
    ) -> Result<Self> {
        let constants = [("SHINES", u32::from(!lobes.is_empty())), has_textures(!colours.is_empty())];
        let lobes =
            (!lobes.is_empty()).then(|| Buffer::from_slice(context, "path lobes", lobes)).transpose()?;
        let step_count = steps.len() as u32;
        let block_count = u64::from(step_count.div_ceil(BLOCK_STEPS));
        Ok(Self {
            blocks: Pipeline::new(context, "path_scan_blocks", &constants)?,
            carry: Pipeline::new(context, "path_scan_carry", &[])?,
            apply: Pipeline::new(context, "path_scan_apply", &[])?,
            steps: Buffer::from_slice(context, "path steps", steps)?,
            lobes,
            step_count,
            colours: Buffer::from_slice(
                context,
                "step colours",
                if colours.is_empty() { &[0] } else { colours },
            )?,
            block_products: Buffer::storage(
                context,
                "block products",
                block_count * size_of::<Segment>() as u64,
            )?,
            entering: Buffer::storage(context, "entering products", 12 * block_count)?,
            deposits: Buffer::from_slice(context, "deposits", deposits)?,
        })
    }

    /// Bytes of the stored steps, and of their lobes and colours, which are read once.
    pub fn step_bytes(&self) -> [u64; 2] {
        [self.steps.bytes(), self.lobes.as_ref().map_or(0, Buffer::bytes) + self.colours.bytes()]
    }

    /// Scans all paths again, or those parts of the vertex array only. A part that was not asked for keeps what it has: the same bits.
    pub fn record(&self, rec: &mut Recorder, materials: &Buffer, parts: Option<&[Range<u32>]>) {
        let step_count = self.step_count;
        let block_count = step_count.div_ceil(BLOCK_STEPS);
        let all = 0..step_count;
        let ranges = blocks_of(parts.unwrap_or(std::slice::from_ref(&all)));
        let mut pass = rec.pass(Self::STEM);
        for (index, blocks) in ranges.iter().enumerate() {
            if index > 0 {
                // The ranges write different deposits, but the hazard check counts in buffers.
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.blocks,
                [blocks.len() as u32 * (BLOCK_STEPS / 4), 1, 1],
                &PathScanPush { step_count, first_block: blocks.start, end_block: blocks.end },
                &[
                    ("Materials", materials),
                    ("Steps", &self.steps),
                    // Where nothing shines nobody reads it.
                    ("Lobes", self.lobes.as_ref().unwrap_or(&self.steps)),
                    ("Deposits", &self.deposits),
                    ("Blocks", &self.block_products),
                    ("StepColours", &self.colours),
                ],
            );
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.carry,
            [block_count.min(1), 1, 1],
            &PathScanCarryPush { block_count },
            &[("Blocks", &self.block_products), ("Entering", &self.entering)],
        );
        for blocks in &ranges {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.apply,
                [blocks.len() as u32, 1, 1],
                &PathScanApplyPush { step_count, first_block: blocks.start, end_block: blocks.end },
                &[("Steps", &self.steps), ("Entering", &self.entering), ("Deposits", &self.deposits)],
            );
        }
    }
}

/// The blocks that hold those steps, in as few runs as can be. Parts come in order.
fn blocks_of(parts: &[Range<u32>]) -> Vec<Range<u32>> {
    let mut runs: Vec<Range<u32>> = Vec::new();
    for part in parts.iter().filter(|part| !part.is_empty()) {
        let blocks = part.start / BLOCK_STEPS..part.end.div_ceil(BLOCK_STEPS);
        match runs.last_mut() {
            Some(last) if blocks.start <= last.end => last.end = last.end.max(blocks.end),
            _ => runs.push(blocks),
        }
    }
    runs
}
