//! Lookup of slots by cluster and direction: rays of glossy pixels reuse the outgoing flux that
//! gather rays read. In: slots. Out: a list of direction bins for each cluster.

use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::passes::precompute::gloss::GlossTables;
use crate::scene::directions::{Directions, resolved_exponent};
use glam::{UVec2, Vec3};
use std::sync::Arc;

/// Slots by cluster and direction bin.
pub struct SlotReads {
    /// CSR offsets into `reads`: one for each cluster, and the end.
    pub first: Buffer,
    /// (Direction bin, slot), sorted for each cluster.
    pub reads: Buffer,
    /// The direction bins.
    pub directions: Directions,
    /// Exponent of the sharpest lobe whose slots rays of pixels read: the bins would blur
    /// a sharper one.
    pub max_exponent: f32,
}

impl SlotReads {
    /// Lists the slots; `directions` are the bins for which they were made.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, tables: &GlossTables, directions: Directions) -> Result<Self> {
        let clusters = tables.base_ranges.len();
        let mut reads = Vec::with_capacity(tables.slots.len());
        for (index, slot) in (0..).zip(&tables.slots) {
            // A slot without readers has no direction.
            if slot.direction != Vec3::ZERO {
                reads.push((slot.cluster, directions.bin(slot.direction.as_dvec3()), index));
            }
        }
        reads.sort_unstable();
        let first = |cluster: usize| reads.partition_point(|read| (read.0 as usize) < cluster) as u32;
        let first: Vec<u32> = (0..=clusters).map(first).collect();
        let reads: Vec<UVec2> = reads.iter().map(|&(_, bin, slot)| UVec2::new(bin, slot)).collect();
        Ok(Self {
            first: Buffer::from_slice(context, "first slot reads", &first)?,
            reads: Buffer::from_slice(context, "slot reads", &reads)?,
            directions,
            max_exponent: resolved_exponent(directions.count()),
        })
    }

    /// No slots: rays of pixels use the vertices of all glossy surfaces.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn none(context: &Arc<Context>) -> Result<Self> {
        Ok(Self {
            first: Buffer::from_slice(context, "first slot reads", &[0_u32])?,
            reads: Buffer::from_slice(context, "slot reads", &[UVec2::ZERO])?,
            directions: Directions::new(1),
            max_exponent: 0.0,
        })
    }
}
