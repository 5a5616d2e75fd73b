//! Near field: indirect light of small clusters and near-field patches, from the records beside
//! them. [numerics: near-field leaks] In: cluster flux (W), records. Out: their irradiance, W/m².

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::GrowsWith;
use crate::passes::frame::hvds::{ClusterFlux, Pyramid};
use crate::types::Record;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A cluster or near-field patch, and the record beside it.
    pub struct NearCluster {
        pub cluster: u32,
        pub record: u32,
        /// From the record to the middle of the cluster or patch, metres.
        pub offset: Vec3,
        /// Index of the result: the cluster, or the patch behind all clusters.
        pub target: u32,
    }
}

gpu_struct! {
    pub struct NearFieldPush {
        /// Clusters or patches in the list.
        pub near_count: u32,
        /// 0: there are no records yet, and patches copy their clusters.
        pub has_records: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[NearCluster::LAYOUT, NearFieldPush::LAYOUT];

/// The pipeline and the lists.
pub struct NearField {
    pipeline: Pipeline,
    clusters: (Buffer, u32),
    patches: (Buffer, u32),
}

impl NearField {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "near_field";

    /// Uploads the lists of near clusters and of near-field patches.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, clusters: &[NearCluster], patches: &[NearCluster]) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            clusters: (
                Buffer::from_slice(context, GrowsWith::GatherRays.named("near clusters"), clusters)?,
                clusters.len() as u32,
            ),
            patches: (
                Buffer::from_slice(context, GrowsWith::GatherRays.named("near patches"), patches)?,
                patches.len() as u32,
            ),
        })
    }

    /// Number of near-field patches.
    pub fn patch_count(&self) -> u32 {
        self.patches.1
    }

    /// Minimum number of bytes that a frame moves: the patches before there are records, then in
    /// each iteration the clusters and that many patches.
    pub fn bytes(&self, rounds: impl Iterator<Item = u32>) -> u64 {
        let listed = size_of::<NearCluster>() as u64;
        let light = size_of::<Vec3>() as u64;
        let from_record = listed + (size_of::<Record>() + size_of::<ClusterFlux>() + 4) as u64 + light;
        let from_cluster = listed + 2 * light;
        let taken: u64 = rounds.map(|patches| u64::from(self.clusters.1 + patches)).sum();
        from_cluster * u64::from(self.patches.1) + from_record * taken
    }

    /// Overwrites the irradiance of the clusters in the list.
    pub fn record(&self, rec: &mut Recorder, pyramid: &Pyramid, records: &Buffer) {
        let (clusters, count) = &self.clusters;
        self.record_list(rec, clusters, *count, pyramid, Some(records));
    }

    /// Writes the irradiance of the first `count` patches; that of their clusters if `records` is
    /// `None`. A barrier follows.
    pub fn record_patches(
        &self,
        rec: &mut Recorder,
        pyramid: &Pyramid,
        records: Option<&Buffer>,
        count: u32,
    ) {
        if count > 0 {
            self.record_list(rec, &self.patches.0, count, pyramid, records);
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
                // An unused binding without records.
                ("Records", records.unwrap_or(&pyramid.flux)),
                ("Irradiance", &pyramid.irradiance),
            ],
        );
    }
}
