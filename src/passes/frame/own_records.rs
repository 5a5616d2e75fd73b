//! Own records: records of single pixels and edge points whose other records disagree. They are
//! gathered in each frame, as all records are, and replace what the others bring. In: merged rays
//! of the own records. Out: irradiance of their places, W/m².

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::gather::{Gather, GatherSources};
use crate::passes::frame::needed_records::RecordList;
use crate::passes::frame::splat::Splat;
use std::sync::Arc;

gpu_struct! {
    pub struct OwnRecordsPush {
        pub record_count: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[OwnRecordsPush::LAYOUT];

/// A pixel or an edge point, by its index. All pixels come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Place {
    /// Of all pixels.
    Pixel(u32),
    /// Of all edge points.
    EdgePoint(u32),
}

impl Place {
    fn word(self) -> u32 {
        match self {
            Self::Pixel(index) => 2 * index,
            Self::EdgePoint(index) => 2 * index + 1,
        }
    }
}

/// The pipeline, the records and their places.
pub struct OwnRecords {
    pipeline: Pipeline,
    gather: Gather,
    list: RecordList,
    places: Buffer,
    record_count: u32,
}

impl OwnRecords {
    /// Stem of shader and timing.
    pub const STEM: &str = "own_records";

    /// Takes over the records of these places, one each.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, gather: Gather, places: &[Place]) -> Result<Self> {
        let record_count = gather.point_count();
        debug_assert_eq!(record_count as usize, places.len());
        let words: Vec<u32> = places.iter().map(|place| place.word()).collect();
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            list: RecordList::all(context, record_count, gather.merged_rays.records_per_chunk)?,
            places: Buffer::from_slice(context, GrowsWith::Pixels.named("places of own records"), &words)?,
            gather: gather.labelled(Self::STEM),
            record_count,
        })
    }

    /// Number of own records.
    pub fn record_count(&self) -> u32 {
        self.record_count
    }

    /// Packed gather targets of their rays.
    ///
    /// # Errors
    /// The device failed.
    pub fn targets(&self) -> Result<Vec<u32>> {
        self.gather.merged_rays.targets.read()
    }

    /// Gathers all own records. Their irradiance replaces what
    /// [`Splat::record_apply`] has found at their places.
    pub fn record(&self, rec: &mut Recorder, sources: GatherSources<'_>, splat: &Splat) {
        self.gather.record(rec, sources, &self.list);
        rec.barrier(COMPUTE_TO_COMPUTE);
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [self.record_count, 1, 1],
            &OwnRecordsPush { record_count: self.record_count },
            &[
                ("Records", &self.gather.records),
                ("OwnPlaces", &self.places),
                ("IndirectIrradiance", splat.irradiance()),
                ("EdgeIrradiance", splat.edge_irradiance()),
            ],
        );
    }
}
