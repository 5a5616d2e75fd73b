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
use std::sync::Arc;

gpu_struct! {
    /// How the energy of one vertex follows from that of the vertex before.
    pub struct PathStep {
        /// Material that reflected the path towards this vertex; [`HEAD`] where the path starts.
        pub material: u32,
        /// 1 / survival probability.
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
        /// Blocks of the first kernel.
        pub block_count: u32,
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
/// Vertices of one block: 256 invocations of four each (`glsl/include/path_scan.glsl`).
const BLOCK_STEPS: u32 = 1024;

/// The pipelines, the steps and their result.
pub struct PathScan {
    blocks: Pipeline,
    carry: Pipeline,
    apply: Pipeline,
    steps: Buffer,
    step_count: u32,
    colours: Buffer,
    block_products: Buffer,
    /// `Deposit` of every vertex in cluster order, and one that nobody reads.
    pub deposits: Buffer,
}

impl PathScan {
    /// The name that shaders, twin and timing share.
    pub const STEM: &str = "path_scan";

    /// Uploads the paths. `colours`: packed, of the image where the step before ended; none at all in scenes without images.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        steps: &[PathStep],
        colours: &[u32],
        deposits: &[Deposit],
    ) -> Result<Self> {
        let step_count = steps.len() as u32;
        let block_bytes = u64::from(step_count.div_ceil(BLOCK_STEPS)) * size_of::<Segment>() as u64;
        Ok(Self {
            blocks: Pipeline::new(context, "path_scan_blocks", &[has_textures(!colours.is_empty())])?,
            carry: Pipeline::new(context, "path_scan_carry", &[])?,
            apply: Pipeline::new(context, "path_scan_apply", &[])?,
            steps: Buffer::from_slice(context, "path steps", steps)?,
            step_count,
            colours: Buffer::from_slice(
                context,
                "step colours",
                if colours.is_empty() { &[0] } else { colours },
            )?,
            block_products: Buffer::storage(context, "block products", block_bytes)?,
            deposits: Buffer::from_slice(context, "deposits", deposits)?,
        })
    }

    /// Bytes of the stored steps, and of their colours, which are read once.
    pub fn step_bytes(&self) -> [u64; 2] {
        [self.steps.bytes(), self.colours.bytes()]
    }

    /// Scans all paths.
    pub fn record(&self, rec: &mut Recorder, materials: &Buffer) {
        let block_count = self.step_count.div_ceil(BLOCK_STEPS);
        let mut pass = rec.pass(Self::STEM);
        pass.dispatch(
            &self.blocks,
            [block_count * (BLOCK_STEPS / 4), 1, 1],
            &PathScanPush { step_count: self.step_count },
            &[
                ("Materials", materials),
                ("Steps", &self.steps),
                ("Deposits", &self.deposits),
                ("Blocks", &self.block_products),
                ("StepColours", &self.colours),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.carry,
            [block_count.min(1), 1, 1],
            &PathScanCarryPush { block_count },
            &[("Blocks", &self.block_products)],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.apply,
            [block_count, 1, 1],
            &PathScanApplyPush { step_count: self.step_count, block_count },
            &[("Steps", &self.steps), ("Blocks", &self.block_products), ("Deposits", &self.deposits)],
        );
    }
}
