//! Lookup of gloss bins by cluster and direction: rays of glossy pixels reuse the outgoing flux
//! that gather rays read. In: gloss bins. Out: a list of direction bins for each cluster.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::GrowsWith;
use crate::passes::gloss_tables::GlossTables;
use crate::scene::directions::{Directions, resolved_exponent};
use glam::{UVec2, Vec3};
use std::sync::Arc;

/// Gloss bins by cluster and direction bin.
pub struct BinReads {
    /// CSR offsets into `reads`: one for each cluster, and the end.
    pub first: Buffer,
    /// (Direction bin, gloss bin), sorted for each cluster.
    pub reads: Buffer,
    /// The direction bins.
    pub directions: Directions,
    /// Exponent of the sharpest lobe whose gloss bins rays of pixels read: the bins would blur
    /// a sharper one.
    pub max_exponent: f32,
}

impl BinReads {
    /// Lists the gloss bins; `directions` are the bins for which they were made.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, tables: &GlossTables, directions: Directions) -> Result<Self> {
        let clusters = tables.base_ranges.len();
        let mut reads = Vec::with_capacity(tables.bins.len());
        for (index, gloss_bin) in (0..).zip(&tables.bins) {
            // A gloss bin without readers has no direction.
            if gloss_bin.direction != Vec3::ZERO {
                reads.push((gloss_bin.cluster, directions.bin(gloss_bin.direction.as_dvec3()), index));
            }
        }
        reads.sort_unstable();
        let first = |cluster: usize| reads.partition_point(|read| (read.0 as usize) < cluster) as u32;
        let first: Vec<u32> = (0..=clusters).map(first).collect();
        let reads: Vec<UVec2> = reads.iter().map(|&(_, bin, gloss_bin)| UVec2::new(bin, gloss_bin)).collect();
        Ok(Self {
            first: Buffer::from_slice(context, GrowsWith::Cells.named("first gloss bin reads"), &first)?,
            reads: Buffer::from_slice(context, GrowsWith::Cells.named("gloss bin reads"), &reads)?,
            directions,
            max_exponent: resolved_exponent(directions.count()),
        })
    }

    /// No gloss bins: rays of pixels use the vertices of all glossy surfaces.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn none(context: &Arc<Context>) -> Result<Self> {
        Ok(Self {
            first: Buffer::from_slice(context, GrowsWith::Cells.named("first gloss bin reads"), &[0_u32])?,
            reads: Buffer::from_slice(context, GrowsWith::Cells.named("gloss bin reads"), &[UVec2::ZERO])?,
            directions: Directions::new(1),
            max_exponent: 0.0,
        })
    }
}
