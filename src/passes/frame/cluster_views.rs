//! Views of clusters: what a coarse cluster shows in directions from which part of it is hidden. [Yue §2, Figure 1]
//! In: irradiance of clusters (W/m²). Out: irradiance of views, behind them in the same buffer.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use std::sync::Arc;

gpu_struct! {
    /// What a view shows of one cluster.
    pub struct ViewPart {
        /// The cluster.
        pub cluster: u32,
        /// Its share; all of a view's sum to 1.
        pub weight: f32,
    }
}

gpu_struct! {
    /// Push constants.
    pub struct ClusterViewsPush {
        /// Clusters of all levels.
        pub cluster_count: u32,
        /// Views.
        pub view_count: u32,
    }
}

/// What this pass shares with its shader.
pub const LAYOUTS: &[Layout] = &[ViewPart::LAYOUT, ClusterViewsPush::LAYOUT];

/// The pipeline and the lists.
pub struct ClusterViews {
    pipeline: Pipeline,
    cluster_count: u32,
    view_count: u32,
    first_parts: Buffer,
    parts: Buffer,
}

impl ClusterViews {
    /// The name that shader, twin and timing share.
    pub const STEM: &str = "cluster_views";

    /// Uploads the lists: `first_parts` has the first part of each view, and the end.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        cluster_count: u32,
        first_parts: &[u32],
        parts: &[ViewPart],
    ) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            cluster_count,
            view_count: first_parts.len() as u32 - 1,
            first_parts: Buffer::from_slice(context, "first view parts", first_parts)?,
            parts: Buffer::from_slice(context, "view parts", parts)?,
        })
    }

    /// Bytes that it reads and writes.
    pub fn bytes(&self) -> u64 {
        // Of each part itself and an irradiance; of each view the first part and the result.
        let parts = self.parts.bytes() / size_of::<ViewPart>() as u64;
        self.first_parts.bytes() + self.parts.bytes() + 12 * (parts + u64::from(self.view_count))
    }

    /// Writes the irradiance of all views behind that of the clusters.
    pub fn record(&self, rec: &mut Recorder, irradiance: &Buffer) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [self.view_count, 1, 1],
            &ClusterViewsPush { cluster_count: self.cluster_count, view_count: self.view_count },
            &[("FirstParts", &self.first_parts), ("ViewParts", &self.parts), ("Irradiance", irradiance)],
        );
    }
}
