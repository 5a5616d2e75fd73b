//! Live set of the hierarchy, independent of lights. In: gather targets, near-field patches. Out:
//! clusters whose irradiance is read; clusters whose flux that needs.

use crate::passes::frame::near_field::NearCluster;
use crate::passes::gather_targets::{GatherTarget, GatherTargetPacking};
use crate::scene::hvds::Hvds;
use crate::types::NO_CLUSTER;

/// The live set, by cluster.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LiveClusters {
    /// Whether its irradiance is read.
    pub irradiance: Vec<bool>,
    /// Whether the irradiance of a live cluster needs its flux or that of an ancestor.
    pub flux: Vec<bool>,
}

impl LiveClusters {
    /// The live set of all clusters.
    pub fn all(cluster_count: u32) -> Self {
        let all = vec![true; cluster_count as usize];
        Self { irradiance: all.clone(), flux: all }
    }

    /// The live set of packed gather targets, with their near-field patches; none is a gloss bin.
    /// `indirect_sources`: the cluster from which each takes its indirect light.
    pub fn from_targets(
        hvds: &Hvds,
        targets: impl IntoIterator<Item = u32>,
        packing: &GatherTargetPacking,
        near_patches: &[NearCluster],
        indirect_sources: &[u32],
    ) -> Self {
        let count = hvds.cluster_count() as usize;
        let mut irradiance = vec![false; count];
        for (target, _) in targets.into_iter().filter_map(|word| packing.unpack(word)) {
            match target {
                GatherTarget::Cluster(cluster) => irradiance[cluster as usize] = true,
                // Every patch has a ray that reads it.
                GatherTarget::Patch(_) | GatherTarget::GlossBin(_) | GatherTarget::Sky(_) => {}
            }
        }
        near_patches.iter().for_each(|patch| irradiance[patch.cluster as usize] = true);
        let mut flux = vec![false; count];
        for cluster in (0..count).filter(|&cluster| irradiance[cluster]) {
            flux[cluster] = true;
            flux[indirect_sources[cluster] as usize] = true;
        }
        // From the root down, because a sum needs all its children.
        for cluster in (0..count).rev() {
            let parent = hvds.parents[cluster];
            flux[cluster] |= parent != NO_CLUSTER && flux[parent as usize];
        }
        Self { irradiance, flux }
    }
}
