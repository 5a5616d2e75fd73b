//! Near field: indirect light of small clusters, from the records beside them. [numerics: near-field leaks]
//! In: cluster flux (W), records. Out: irradiance of those clusters, W/m².

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::hvds::Pyramid;
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// A cluster and the record that speaks for it.
    pub struct NearCluster {
        /// The cluster.
        pub cluster: u32,
        /// The record.
        pub record: u32,
        /// From the record to the cluster's middle, metres.
        pub offset: Vec3,
    }
}

gpu_struct! {
    /// Push constants.
    pub struct NearFieldPush {
        /// Clusters in the list.
        pub near_count: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[NearCluster::LAYOUT, NearFieldPush::LAYOUT];

/// The pipeline and the list.
pub struct NearField {
    pipeline: Pipeline,
    near_clusters: Buffer,
    near_count: u32,
}

impl NearField {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "near_field";

    /// Uploads the list.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, near_clusters: &[NearCluster]) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            near_clusters: Buffer::from_slice(context, "near clusters", near_clusters)?,
            near_count: near_clusters.len() as u32,
        })
    }

    /// Overwrites the irradiance of the listed clusters.
    pub fn record(&self, rec: &mut Recorder, pyramid: &Pyramid, records: &Buffer) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [self.near_count, 1, 1],
            &NearFieldPush { near_count: self.near_count },
            &[
                ("NearClusters", &self.near_clusters),
                ("InverseAreas", &pyramid.inverse_areas),
                ("ClusterFluxes", &pyramid.flux),
                ("Records", records),
                ("Irradiance", &pyramid.irradiance),
            ],
        );
    }
}
