//! Frame pass of directional proxies, for cells whose surfaces hide each other. A scene without
//! such cells skips it.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Context, Recorder};
use crate::passes::frame::cluster_proxies::ClusterProxies;
use crate::passes::frame::gather::Gather;
use crate::passes::frame::hvds::Pyramid;
use crate::passes::gather_targets::{GatherTarget, GatherTargets};
use crate::passes::precompute::gather_rays::RayTable;
use crate::passes::precompute::visibility::cluster_proxies::ProxyTables;
use crate::scene::Quality;
use crate::scene::directions::Directions;
use crate::scene::hvds::Hvds;
use crate::types::CachePoint;
use std::sync::Arc;

/// Proxy tables with the pass that evaluates them. `None` if there are no proxies.
pub(super) struct Proxies(Option<(ProxyTables, ClusterProxies)>);

impl Proxies {
    /// Uploads the proxies and allocates their irradiance.
    pub(super) fn new(
        context: &Arc<Context>,
        tables: Option<ProxyTables>,
        hvds: &Hvds,
        pyramid: &mut Pyramid,
    ) -> Result<Self> {
        let Some(tables) = tables else { return Ok(Self(None)) };
        let clusters = (pyramid.irradiance.bytes() / 12) as u32;
        let pass =
            ClusterProxies::new(context, clusters, &tables.term_offsets, &tables.terms, tables.packing)?;
        pyramid.make_room(context, hvds, tables.count(), tables.pairs.iter().map(|pair| pair[0]))?;
        Ok(Self(Some((tables, pass))))
    }

    /// The proxy tables. `None` if there are no proxies.
    pub(super) fn tables(&self) -> Option<&ProxyTables> {
        self.0.as_ref().map(|(tables, _)| tables)
    }

    /// Bytes that the pass reads and writes.
    pub(super) fn bytes(&self) -> u64 {
        self.0.as_ref().map_or(0, |(_, pass)| pass.bytes())
    }

    /// Records the pass that computes the irradiance of all proxies from that of the clusters.
    pub(super) fn record(&self, rec: &mut Recorder, pyramid: &Pyramid) {
        if let Some((_, pass)) = &self.0 {
            pass.record(rec, &pyramid.irradiance);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Targets of gather rays of `points`: a proxy if one exists for the cluster and direction bin
    /// of a ray, else the cluster.
    pub(super) fn targets(
        &self,
        rays: &RayTable,
        points: &[CachePoint],
        gather: &Gather,
        quality: &Quality,
    ) -> Result<GatherTargets> {
        let targets = GatherTargets::of_hits(gather.packing);
        let Some((tables, _)) = &self.0 else { return Ok(targets) };
        let directions = (quality.seed, Directions::new(quality.directions));
        let readers = tables.readers(rays, &targets, points, gather.hemisphere, directions)?;
        Ok(targets.with(GatherTarget::Proxy, readers))
    }
}
