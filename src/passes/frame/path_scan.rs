//! Light-path energy scan: a segmented inclusive product over the vertex array, one segment a path.
//! [Yue §3, Tlpe] In: steps in path order, reflectances. Out: throughput of every vertex, in
//! cluster order. Reduce, then scan; deterministic.
//!
//! With fixed materials the products are constants: the scan runs once, and again only when
//! a material changes.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Chunk, Context, Pipeline, Recorder, SplitBuffer};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::has_textures;
use crate::types::Contribution;
use glam::Vec3;
use std::ops::Range;
use std::sync::Arc;

gpu_struct! {
    /// Factor from the energy of the vertex before to that of this one.
    pub struct PathStep {
        /// Material that reflected the path towards this vertex; [`HEAD`] if the path starts here;
        /// [`FROM_ENTRY`] if the reflection was at an entry point that may be glossy, because it
        /// depends on the light.
        pub material: u32,
        /// cosθ/(π·pdf) over the survival probability.
        pub weight: f32,
        /// Index of the vertex's contribution.
        pub contribution: u32,
    }
}

gpu_struct! {
    /// Product of steps since the last path start among them.
    pub struct Segment {
        pub product: Vec3,
        /// One if a path starts among them.
        pub has_head: u32,
    }
}

gpu_struct! {
    /// Push constants of the first kernel.
    pub struct PathScanPush {
        pub step_count: u32,
        /// First index of the bound buffer of the steps.
        pub first_step: u32,
        /// First block of the dispatch.
        pub first_block: u32,
        pub end_block: u32,
        /// First index of the bound buffer of the contributions.
        pub first_contribution: u32,
        pub end_contribution: u32,
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
        pub step_count: u32,
        /// First index of the bound buffer of the steps.
        pub first_step: u32,
        /// First block of the dispatch.
        pub first_block: u32,
        pub end_block: u32,
        /// First index of the bound buffer of the contributions.
        pub first_contribution: u32,
        pub end_contribution: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    PathStep::LAYOUT,
    Segment::LAYOUT,
    PathScanPush::LAYOUT,
    PathScanCarryPush::LAYOUT,
    PathScanApplyPush::LAYOUT,
];

/// Material of the first vertex of a path.
pub const HEAD: u32 = u32::MAX;
/// Marks a reflection at an entry point that may be glossy: the flux of the path
/// includes its factor.
pub const FROM_ENTRY: u32 = u32::MAX - 1;
/// Vertices of one block, which a workgroup shares (`glsl/include/path_scan.glsl`).
const BLOCK_STEPS: u32 = 1024;
/// Steps that the host reads at a time in search of a path.
const STEPS_AT_A_TIME: usize = 1 << 18;

/// The pipelines, the steps and their result.
pub struct PathScan {
    blocks: Pipeline,
    carry: Pipeline,
    apply: Pipeline,
    steps: SplitBuffer,
    /// 1 − cosα off the mirror direction, for each step; split like the steps. `None` if
    /// nothing is glossy.
    lobes: Option<SplitBuffer>,
    step_count: u32,
    /// Invocations that share a block.
    scan_group: u32,
    /// Packed colour of each step, split like the steps. `None` in scenes without images.
    colours: Option<SplitBuffer>,
    block_products: Buffer,
    /// Product that enters each block from the left; three floats.
    entering: Buffer,
    /// `Contribution` of every vertex in cluster order, and one unused element.
    pub contributions: SplitBuffer,
}

impl PathScan {
    /// Stem of shaders, reference and timing.
    pub const STEM: &str = "path_scan";

    /// Uploads the paths. `colours`: packed colour of the image at the start of each step; empty in
    /// scenes without images. `lobes` is empty if no material may be glossy; otherwise the
    /// contributions stay in one buffer, because kernels look them up by index.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        steps: &[PathStep],
        colours: &[u32],
        lobes: &[f32],
        contributions: &[Contribution],
    ) -> Result<Self> {
        let max_contributions =
            if lobes.is_empty() { SplitBuffer::longest::<Contribution>(context) } else { u32::MAX };
        let max_blocks = SplitBuffer::longest::<PathStep>(context) / BLOCK_STEPS;
        Self::in_chunks(context, steps, colours, lobes, contributions, [max_blocks, max_contributions])
    }

    /// As [`Self::new`], with at most that many blocks of steps, and contributions, in each buffer.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn in_chunks(
        context: &Arc<Context>,
        steps: &[PathStep],
        colours: &[u32],
        lobes: &[f32],
        contributions: &[Contribution],
        [max_blocks, max_contributions]: [u32; 2],
    ) -> Result<Self> {
        let most = max_blocks.max(1).saturating_mul(BLOCK_STEPS);
        let scan_group = context.tuning().scan_group;
        let group = ("local_size_x", scan_group);
        let constants =
            [group, ("IS_GLOSSY", u32::from(!lobes.is_empty())), has_textures(!colours.is_empty())];
        let lobes = (!lobes.is_empty())
            .then(|| SplitBuffer::cut(context, GrowsWith::EntryPoints.named("path lobes"), lobes, most))
            .transpose()?;
        let colours = (!colours.is_empty())
            .then(|| SplitBuffer::cut(context, GrowsWith::EntryPoints.named("step colours"), colours, most))
            .transpose()?;
        let step_count = steps.len() as u32;
        let block_count = u64::from(step_count.div_ceil(BLOCK_STEPS));
        Ok(Self {
            blocks: Pipeline::new(context, "path_scan_blocks", &constants)?,
            carry: Pipeline::new(context, "path_scan_carry", &[group])?,
            apply: Pipeline::new(context, "path_scan_apply", &[])?,
            steps: SplitBuffer::cut(context, GrowsWith::EntryPoints.named("path steps"), steps, most)?,
            lobes,
            step_count,
            scan_group,
            colours,
            block_products: Buffer::storage(
                context,
                GrowsWith::EntryPoints.named("block products"),
                block_count * size_of::<Segment>() as u64,
            )?,
            entering: Buffer::storage(
                context,
                GrowsWith::EntryPoints.named("entering products"),
                12 * block_count,
            )?,
            contributions: SplitBuffer::cut(
                context,
                GrowsWith::EntryPoints.named("contributions"),
                contributions,
                max_contributions,
            )?,
        })
    }

    /// Bytes of the steps, and of their lobes and colours together; a scan reads the latter once.
    pub fn step_bytes(&self) -> [u64; 2] {
        let bytes = |list: &Option<SplitBuffer>| list.as_ref().map_or(0, SplitBuffer::bytes);
        [self.steps.bytes(), bytes(&self.lobes) + bytes(&self.colours)]
    }

    /// Reads the steps of a path. Empty if there is no such path.
    ///
    /// # Errors
    /// The device failed.
    pub fn steps_of(&self, path: u32) -> Result<Vec<PathStep>> {
        let (mut heads, mut found) = (0, Vec::new());
        for chunk in self.steps.iter() {
            let count = chunk.items.len();
            for first in (0..count).step_by(STEPS_AT_A_TIME) {
                for step in chunk.buffer.read_range::<PathStep>(first, STEPS_AT_A_TIME.min(count - first))? {
                    heads += u64::from(step.material == HEAD);
                    if heads > u64::from(path) + 1 {
                        return Ok(found);
                    }
                    if heads == u64::from(path) + 1 {
                        found.push(step);
                    }
                }
            }
        }
        Ok(found)
    }

    /// Scans all paths again, or the given ranges of the vertex array. The other ranges
    /// keep their bits.
    pub fn record(&self, rec: &mut Recorder, materials: &Buffer, stale: Option<&[Range<u32>]>) {
        let step_count = self.step_count;
        let block_count = step_count.div_ceil(BLOCK_STEPS);
        let all = 0..step_count;
        let ranges = blocks_of(stale.unwrap_or(std::slice::from_ref(&all)));
        let bound = self.bound(&ranges);
        let mut pass = rec.pass(Self::STEM);
        for (index, Bound { blocks, steps, lobes, colours, contributions }) in bound.iter().enumerate() {
            if index > 0 {
                // The dispatches write disjoint contributions, but the hazard check
                // works by buffer.
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            pass.dispatch(
                &self.blocks,
                [blocks.len() as u32 * self.scan_group, 1, 1],
                &PathScanPush {
                    step_count,
                    first_step: steps.items.start,
                    first_block: blocks.start,
                    end_block: blocks.end,
                    first_contribution: contributions.items.start,
                    end_contribution: contributions.items.end,
                },
                &[
                    ("Materials", materials),
                    ("Steps", &steps.buffer),
                    ("Lobes", lobes),
                    ("Contributions", &contributions.buffer),
                    ("Blocks", &self.block_products),
                    ("StepColours", colours),
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
        for Bound { blocks, steps, contributions, .. } in &bound {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.apply,
                [blocks.len() as u32, 1, 1],
                &PathScanApplyPush {
                    step_count,
                    first_step: steps.items.start,
                    first_block: blocks.start,
                    end_block: blocks.end,
                    first_contribution: contributions.items.start,
                    end_contribution: contributions.items.end,
                },
                &[
                    ("Steps", &steps.buffer),
                    ("Entering", &self.entering),
                    ("Contributions", &contributions.buffer),
                ],
            );
        }
    }

    /// Bindings of the dispatches for these blocks: each buffer of the steps with each buffer of
    /// the contributions, because a step's contribution may be in any.
    fn bound<'a>(&'a self, ranges: &[Range<u32>]) -> Vec<Bound<'a>> {
        let mut bound = Vec::new();
        for range in ranges {
            for (index, steps) in self.steps.iter().enumerate() {
                let own = steps.items.start / BLOCK_STEPS..steps.items.end.div_ceil(BLOCK_STEPS);
                let blocks = range.start.max(own.start)..range.end.min(own.end);
                if blocks.is_empty() {
                    continue;
                }
                let beside =
                    |list: &'a Option<SplitBuffer>| list.iter().flat_map(SplitBuffer::iter).nth(index);
                let [lobes, colours] = [&self.lobes, &self.colours].map(|list| beside(list).unwrap_or(steps));
                bound.extend(self.contributions.iter().map(|contributions| Bound {
                    blocks: blocks.clone(),
                    steps,
                    lobes: &lobes.buffer,
                    colours: &colours.buffer,
                    contributions,
                }));
            }
        }
        bound
    }
}

/// Bindings of a dispatch.
struct Bound<'a> {
    blocks: Range<u32>,
    steps: &'a Chunk,
    /// Unused if nothing is glossy.
    lobes: &'a Buffer,
    /// Unused in scenes without images.
    colours: &'a Buffer,
    contributions: &'a Chunk,
}

/// The blocks of these steps, in as few ranges as possible. The ranges are in ascending order.
fn blocks_of(ranges: &[Range<u32>]) -> Vec<Range<u32>> {
    let mut found: Vec<Range<u32>> = Vec::new();
    for range in ranges.iter().filter(|range| !range.is_empty()) {
        let blocks = range.start / BLOCK_STEPS..range.end.div_ceil(BLOCK_STEPS);
        match found.last_mut() {
            Some(last) if blocks.start <= last.end => last.end = last.end.max(blocks.end),
            _ => found.push(blocks),
        }
    }
    found
}
