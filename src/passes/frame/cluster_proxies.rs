//! Directional proxies: a coarse cluster that is partly hidden from a direction gets the weighted
//! mean of its visible finer clusters there. [Yue §2, Figure 1] In: irradiance of clusters (W/m²).
//! Out: irradiance of proxies, behind the clusters in the same buffer.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use std::sync::Arc;

/// Packing of an entry of a proxy: `cluster << weight_bits | (steps - 1)`. The steps of a proxy's
/// entries sum to its weight of 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProxyTermPacking {
    /// Bits of a weight.
    pub weight_bits: u32,
}

/// Maximum number of bits of a weight: proxies that differ by rounding alone should be equal.
const MAX_WEIGHT_BITS: u32 = 12;

impl ProxyTermPacking {
    /// Gives the weights the bits that the cluster indices leave.
    pub fn new(clusters: u32) -> Self {
        Self { weight_bits: clusters.leading_zeros().min(MAX_WEIGHT_BITS) }
    }

    /// Steps in a weight of 1.
    pub fn steps(self) -> u32 {
        1 << self.weight_bits
    }

    /// Packs a cluster and its weight in steps, at least one.
    pub fn pack(self, cluster: u32, steps: u32) -> u32 {
        cluster << self.weight_bits | (steps - 1)
    }

    /// The cluster of an entry.
    pub fn cluster(self, term: u32) -> u32 {
        term >> self.weight_bits
    }

    /// The weight of an entry, 0..=1.
    pub fn weight(self, term: u32) -> f32 {
        ((term & (self.steps() - 1)) + 1) as f32 / self.steps() as f32
    }
}

gpu_struct! {
    pub struct ClusterProxiesPush {
        /// Clusters of all levels.
        pub cluster_count: u32,
        pub proxy_count: u32,
        /// Bits of a weight in an entry.
        pub weight_bits: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[ClusterProxiesPush::LAYOUT];

/// The pipeline and the lists.
pub struct ClusterProxies {
    pipeline: Pipeline,
    cluster_count: u32,
    proxy_count: u32,
    packing: ProxyTermPacking,
    term_offsets: Buffer,
    terms: Buffer,
}

impl ClusterProxies {
    /// Stem of shader, reference and timing.
    pub const STEM: &str = "cluster_proxies";

    /// Uploads the lists: `term_offsets` are the CSR offsets of each proxy, `terms`
    /// its packed entries.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(
        context: &Arc<Context>,
        cluster_count: u32,
        term_offsets: &[u32],
        terms: &[u32],
        packing: ProxyTermPacking,
    ) -> Result<Self> {
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            cluster_count,
            proxy_count: term_offsets.len() as u32 - 1,
            packing,
            term_offsets: Buffer::from_slice(context, "proxy term offsets", term_offsets)?,
            terms: Buffer::from_slice(context, "proxy terms", terms)?,
        })
    }

    /// Bytes that the pass reads and writes.
    pub fn bytes(&self) -> u64 {
        // An entry: itself and an irradiance. A proxy: its offset and the result.
        let terms = self.terms.bytes() / 4;
        self.term_offsets.bytes() + self.terms.bytes() + 12 * (terms + u64::from(self.proxy_count))
    }

    /// Writes the irradiance of all proxies behind that of the clusters.
    pub fn record(&self, rec: &mut Recorder, irradiance: &Buffer) {
        rec.pass(Self::STEM).dispatch(
            &self.pipeline,
            [self.proxy_count, 1, 1],
            &ClusterProxiesPush {
                cluster_count: self.cluster_count,
                proxy_count: self.proxy_count,
                weight_bits: self.packing.weight_bits,
            },
            &[("TermOffsets", &self.term_offsets), ("ProxyTerms", &self.terms), ("Irradiance", irradiance)],
        );
    }
}
