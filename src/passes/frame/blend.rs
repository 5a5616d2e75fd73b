//! Blends each record with its neighbours' extrapolations, which averages out the gather's sampling
//! noise. In: records, neighbour lists. Out: blended records.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::precompute::neighbours::Neighbourhoods;
use crate::types::Record;
use bytemuck::Zeroable;
use std::sync::Arc;

gpu_struct! {
    pub struct BlendPush {
        pub record_count: u32,
        /// 0: only records that the view sees.
        pub takes_all: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[BlendPush::LAYOUT];

/// The pipeline, the lists and the result.
pub struct Blend {
    pipeline: Pipeline,
    record_count: u32,
    neighbour_offsets: Buffer,
    neighbours: Buffer,
    /// Blended `Record` of each cache point.
    pub records: Buffer,
}

impl Blend {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "blend";

    /// Uploads the lists.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, neighbourhoods: &Neighbourhoods) -> Result<Self> {
        let record_count = neighbourhoods.first.len() as u32 - 1;
        // Records that no view has needed yet are never written.
        let none = vec![Record::zeroed(); record_count as usize];
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            record_count,
            neighbour_offsets: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("neighbour offsets"),
                &neighbourhoods.first,
            )?,
            neighbours: Buffer::from_slice(
                context,
                GrowsWith::GatherRays.named("neighbours"),
                &neighbourhoods.list,
            )?,
            records: Buffer::from_slice(context, GrowsWith::GatherRays.named("blended records"), &none)?,
        })
    }

    /// Bytes of the neighbour lists.
    pub fn list_bytes(&self) -> u64 {
        self.neighbours.bytes()
    }

    /// CSR offsets of the neighbours of each record, and the list of `Neighbour`s.
    pub fn lists(&self) -> [&Buffer; 2] {
        [&self.neighbour_offsets, &self.neighbours]
    }

    /// Blends all records, or those with a one in `seen`.
    pub fn record(&self, rec: &mut Recorder, cache_points: &Buffer, records: &Buffer, seen: Option<&Buffer>) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [self.record_count, 1, 1],
            &BlendPush { record_count: self.record_count, takes_all: u32::from(seen.is_none()) },
            &[
                ("CachePoints", cache_points),
                ("NeighbourOffsets", &self.neighbour_offsets),
                ("Neighbours", &self.neighbours),
                ("Records", records),
                ("Blended", &self.records),
                // An unused binding if all records are blended.
                ("IsSeen", seen.unwrap_or(&self.neighbour_offsets)),
            ],
        );
    }
}
