//! The live set: the part of the hierarchy that a frame computes. It is known before any light is.
//! A frame computes either the live set or the whole hierarchy.

use super::precompute::Precomputed;
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::frame::hvds::{ClusterLists, Pyramid};
use crate::passes::frame::near_field::{NearCluster, NearField};
use crate::passes::frame::needed_records::RecordList;
use crate::passes::gloss_tables::GlossTables;
use crate::passes::precompute::live_clusters::LiveClusters;
use crate::scene::directions::Directions;
use crate::scene::hvds::Hvds;
use crate::types::NO_CLUSTER;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

/// The part of the hierarchy that a frame computes.
pub(super) struct LiveSet {
    pub(super) clusters: ClusterLists,
    /// Small clusters and near-field patches; they take the irradiance of the records beside them.
    pub(super) near_field: NearField,
    /// The records beside these clusters. They are gathered before the others, from clusters
    /// without near-field light.
    pub(super) sources: RecordList,
    pub(super) source_count: u32,
    /// The records of `sources` in narrow cavities. They are gathered again.
    pub(super) gaps: RecordList,
    pub(super) gap_count: u32,
}

/// Inputs of a set.
struct Sources {
    levels: Vec<Range<u32>>,
    near_clusters: Vec<NearCluster>,
    near_patches: Vec<NearCluster>,
    /// Number of records, and number of records in one part of the merged rays.
    records: [u32; 2],
    /// Number of records in narrow cavities. They come first.
    narrow_count: u32,
}

impl Sources {
    fn set(&self, context: &Arc<Context>, reads: &LiveClusters) -> Result<LiveSet> {
        let is_read = |near: &&NearCluster| reads.irradiance[near.cluster as usize];
        let near: Vec<NearCluster> = self.near_clusters.iter().filter(is_read).copied().collect();
        let mut sources: Vec<u32> = near.iter().chain(&self.near_patches).map(|near| near.record).collect();
        sources.sort_unstable();
        sources.dedup();
        let gaps = &sources[..sources.partition_point(|&record| record < self.narrow_count)];
        let [point_count, rows] = self.records;
        Ok(LiveSet {
            clusters: ClusterLists::new(context, &self.levels, &reads.flux, &reads.irradiance)?,
            near_field: NearField::new(context, &near, &self.near_patches)?,
            sources: RecordList::fixed(context, point_count, rows, &sources)?,
            source_count: sources.len() as u32,
            gaps: RecordList::fixed(context, point_count, rows, gaps)?,
            gap_count: gaps.len() as u32,
        })
    }
}

/// The live set and, once it is requested, the whole hierarchy. The whole hierarchy takes memory
/// only from then on.
pub(super) struct LiveSets {
    context: Arc<Context>,
    sources: Sources,
    /// The live set.
    pub(super) read: LiveSet,
    whole: Option<LiveSet>,
    /// The live set with what own records of a view read, if there are any.
    extended: Option<LiveSet>,
}

impl LiveSets {
    pub(super) fn new(context: &Arc<Context>, made: &mut Precomputed, reads: &LiveClusters) -> Result<Self> {
        let sources = Sources {
            levels: made.hvds.levels.clone(),
            near_clusters: std::mem::take(&mut made.near_clusters),
            near_patches: std::mem::take(&mut made.near_patches),
            records: [made.point_count, made.merged_rays.records_per_chunk],
            narrow_count: made.narrow_count,
        };
        let read = sources.set(context, reads)?;
        Ok(Self { context: context.clone(), sources, read, whole: None, extended: None })
    }

    /// Builds the scope of the whole hierarchy.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn make_whole(&self) -> Result<LiveSet> {
        let clusters = self.sources.levels.last().map_or(0, |level| level.end);
        self.sources.set(&self.context, &LiveClusters::all(clusters))
    }

    /// From now on, frames compute this live set, which includes the first one.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn extend(&mut self, reads: &LiveClusters) -> Result<()> {
        self.extended = Some(self.sources.set(&self.context, reads)?);
        Ok(())
    }

    /// Near-field patches of single cache points.
    pub(super) fn near_patches(&self) -> &[NearCluster] {
        &self.sources.near_patches
    }

    /// Builds the scope of the whole hierarchy if `is_whole` and the set does not exist.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub(super) fn prepare(&mut self, is_whole: bool) -> Result<()> {
        if is_whole && self.whole.is_none() {
            self.whole = Some(self.make_whole()?);
        }
        Ok(())
    }

    /// The whole hierarchy if `is_whole` and [`Self::prepare`] has built it; else the live set.
    pub(super) fn of(&self, is_whole: bool) -> &LiveSet {
        self.whole.as_ref().filter(|_| is_whole).or(self.extended.as_ref()).unwrap_or(&self.read)
    }
}

/// Computes the live set. If a material may be glossy, rays of glossy pixels may read any cluster.
pub(super) fn reads(made: &Precomputed, pyramid: &Pyramid) -> Result<LiveClusters> {
    if made.gloss.is_some() {
        return Ok(LiveClusters::all(made.hvds.cluster_count()));
    }
    let sources = pyramid.indirect_sources.read::<u32>()?;
    let targets = made.merged_rays.targets.read::<u32>()?;
    Ok(LiveClusters::from_targets(&made.hvds, targets, &made.packing, &made.near_patches, &sources))
}

/// Fractions of the hierarchy outside the live set, 0..=1.
pub(super) fn unread(
    made: &Precomputed,
    reads: &LiveClusters,
    directions: Directions,
) -> BTreeMap<String, f64> {
    let mut unread = BTreeMap::new();
    let mut note = |what: &str, read: usize, all: usize| {
        if all > 0 {
            unread.insert(what.to_owned(), 1.0 - read as f64 / all as f64);
        }
    };
    let count = |is_read: &[bool]| is_read.iter().filter(|is_read| **is_read).count();
    note("clusters that nothing reads", count(&reads.irradiance), reads.irradiance.len());
    note("clusters whose flux nothing takes", count(&reads.flux), reads.flux.len());
    let levels = &made.hvds.levels;
    let is_read = |level: &&Range<u32>| reads.flux[level.start as usize..level.end as usize].contains(&true);
    note("levels whose flux nothing takes", levels.iter().filter(is_read).count(), levels.len());
    let near = made.near_clusters.iter().filter(|near| reads.irradiance[near.cluster as usize]).count();
    note("small clusters beside records that nothing reads", near, made.near_clusters.len());
    let first = &made.paths.contribution_offsets;
    let vertices = |cluster: usize| (first[2 * cluster + 2] - first[2 * cluster]) as usize;
    let unweighted = &made.hvds.unweighted;
    let is_taken = |&cluster: &usize| {
        reads.flux[cluster] || reads.flux.get(unweighted[cluster] as usize).is_some_and(|is_taken| *is_taken)
    };
    let taken = (0..unweighted.len()).filter(is_taken).map(vertices).sum();
    note("path vertices whose flux nothing takes", taken, (0..unweighted.len()).map(vertices).sum());
    if let Some(gloss) = &made.gloss {
        let all = glossy_clusters(gloss, &made.hvds) * directions.count() as usize;
        note("outgoing directions of glossy clusters that nothing reads", gloss.bins.len().min(all), all);
    }
    unread
}

/// Number of clusters, of all levels, that hold a path vertex that may be glossy.
fn glossy_clusters(gloss: &GlossTables, hvds: &Hvds) -> usize {
    let mut is_glossy = vec![false; hvds.cluster_count() as usize];
    for (is_glossy, ends) in is_glossy.iter_mut().zip(gloss.vertex_offsets.windows(2)) {
        *is_glossy = ends[0] != ends[1];
    }
    for cluster in 0..is_glossy.len() {
        let parent = hvds.parents[cluster];
        if parent != NO_CLUSTER {
            is_glossy[parent as usize] |= is_glossy[cluster];
        }
    }
    is_glossy.into_iter().filter(|is_glossy| *is_glossy).count()
}
