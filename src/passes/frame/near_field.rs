//! Near field: indirect light of small clusters, from the records beside them. [numerics:
//! near-field leaks] In: cluster flux (W), records. Out: irradiance of those clusters, W/m².

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::hvds::{ClusterFlux, Pyramid};
use crate::types::Record;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A cluster, or a part of it, and the record that speaks for it.
    pub struct NearCluster {
        pub cluster: u32,
        pub record: u32,
        /// From the record to the middle of the cluster, or of its part, metres.
        pub offset: Vec3,
        /// Whose irradiance it is: the cluster's, or behind all clusters and proxies a part's.
        pub target: u32,
    }
}

gpu_struct! {
    pub struct NearFieldPush {
        /// Clusters or parts in the list.
        pub near_count: u32,
        /// 0: there are no records yet, and parts are like their clusters.
        pub has_records: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[NearCluster::LAYOUT, NearFieldPush::LAYOUT];

/// The pipeline and the lists.
pub struct NearField {
    pipeline: Pipeline,
    clusters: (Buffer, u32),
    parts: (Buffer, u32),
}

impl NearField {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "near_field";

    /// Uploads the lists: near clusters, and parts of clusters that have targets of their own.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, clusters: &[NearCluster], parts: &[NearCluster]) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            clusters: (Buffer::from_slice(context, "near clusters", clusters)?, clusters.len() as u32),
            parts: (Buffer::from_slice(context, "near patches", parts)?, parts.len() as u32),
        })
    }

    /// Parts of clusters that have targets of their own.
    pub fn part_count(&self) -> u32 {
        self.parts.1
    }

    /// Bytes that a frame moves at the least, in all: parts before there are records, then clusters
    /// and that many parts round by round.
    pub fn bytes(&self, rounds: impl Iterator<Item = u32>) -> u64 {
        let listed = size_of::<NearCluster>() as u64;
        let light = size_of::<Vec3>() as u64;
        let from_record = listed + (size_of::<Record>() + size_of::<ClusterFlux>() + 4) as u64 + light;
        let from_cluster = listed + 2 * light;
        let taken: u64 = rounds.map(|parts| u64::from(self.clusters.1 + parts)).sum();
        from_cluster * u64::from(self.parts.1) + from_record * taken
    }

    /// Overwrites the irradiance of the clusters in the list.
    pub fn record(&self, rec: &mut Recorder, pyramid: &Pyramid, records: &Buffer) {
        let (clusters, count) = &self.clusters;
        self.record_list(rec, clusters, *count, pyramid, Some(records));
    }

    /// The irradiance of the first `count` parts; before there are records, that of their clusters.
    /// With a barrier behind.
    pub fn record_parts(&self, rec: &mut Recorder, pyramid: &Pyramid, records: Option<&Buffer>, count: u32) {
        if count > 0 {
            self.record_list(rec, &self.parts.0, count, pyramid, records);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    fn record_list(
        &self,
        rec: &mut Recorder,
        list: &Buffer,
        near_count: u32,
        pyramid: &Pyramid,
        records: Option<&Buffer>,
    ) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [near_count, 1, 1],
            &NearFieldPush { near_count, has_records: u32::from(records.is_some()) },
            &[
                ("NearClusters", list),
                ("InverseAreas", &pyramid.inverse_areas),
                ("ClusterFluxes", &pyramid.flux),
                // Without records nobody reads it.
                ("Records", records.unwrap_or(&pyramid.flux)),
                ("Irradiance", &pyramid.irradiance),
            ],
        );
    }
}
