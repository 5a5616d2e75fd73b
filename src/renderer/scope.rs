//! How much of the hierarchy a frame works out: all of it, or what something reads. Known before any light is.

use super::precompute::Precomputed;
use super::views::Views;
use crate::error::Result;
use crate::gpu::Context;
use crate::passes::frame::gloss::NO_ENTRY;
use crate::passes::frame::hvds::{ClusterLists, Pyramid};
use crate::passes::frame::near_field::{NearCluster, NearField};
use crate::passes::frame::needed_records::RecordList;
use crate::passes::precompute::gloss::GlossTables;
use crate::passes::precompute::ray_bundles::rows_per_part;
use crate::passes::precompute::reads::Reads;
use crate::scene::directions::Directions;
use crate::scene::hvds::Hvds;
use crate::types::NO_CLUSTER;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What a frame works out.
pub(super) struct Scope {
    /// Clusters.
    pub(super) clusters: ClusterLists,
    /// Small clusters, and parts of clusters, that take light from the records beside them.
    pub(super) near_field: NearField,
    /// These records: they are gathered ahead of the others, from clusters that do not have it yet.
    pub(super) sources: RecordList,
    /// How many.
    pub(super) source_count: u32,
    /// Those of them that stand in narrow gaps, and are gathered again.
    pub(super) gaps: RecordList,
    /// How many.
    pub(super) gap_count: u32,
}

impl Scope {
    /// All of it, and what something reads.
    pub(super) fn both(context: &Arc<Context>, made: &Precomputed, reads: &Reads) -> Result<[Self; 2]> {
        let rows = rows_per_part(context, &made.rays, made.hemisphere);
        let scope = |reads: &Reads| {
            let is_read = |near: &&NearCluster| reads.irradiance[near.cluster as usize];
            let near: Vec<NearCluster> = made.near_clusters.iter().filter(is_read).copied().collect();
            let mut sources: Vec<u32> = near.iter().chain(&made.near_parts).map(|near| near.record).collect();
            sources.sort_unstable();
            sources.dedup();
            let gaps = &sources[..sources.partition_point(|&record| record < made.tight_count)];
            Ok(Self {
                clusters: ClusterLists::new(context, &made.hvds.levels, &reads.flux, &reads.irradiance)?,
                near_field: NearField::new(context, &near, &made.near_parts)?,
                sources: RecordList::fixed(context, made.point_count, rows, &sources)?,
                source_count: sources.len() as u32,
                gaps: RecordList::fixed(context, made.point_count, rows, gaps)?,
                gap_count: gaps.len() as u32,
            })
        };
        Ok([scope(&Reads::all(&made.hvds))?, scope(reads)?])
    }
}

/// What something reads. Where pixels may shine, their rays may read any cluster.
pub(super) fn reads(made: &Precomputed, views: &Views, pyramid: &Pyramid) -> Result<Reads> {
    if made.gloss.is_some() {
        return Ok(Reads::all(&made.hvds));
    }
    let sources = pyramid.indirect_sources.read::<u32>()?;
    Reads::find(&made.hvds, &made.rays, made.code, views.tables(), &made.near_parts, &sources)
}

/// Shares of the hierarchy that nothing reads, 0..=1.
pub(super) fn unread(made: &Precomputed, reads: &Reads, directions: Directions) -> BTreeMap<String, f64> {
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
    let is_read =
        |level: &&std::ops::Range<u32>| reads.flux[level.start as usize..level.end as usize].contains(&true);
    note("levels whose flux nothing takes", levels.iter().filter(is_read).count(), levels.len());
    let near = made.near_clusters.iter().filter(|near| reads.irradiance[near.cluster as usize]).count();
    note("small clusters beside records that nothing reads", near, made.near_clusters.len());
    let first = &made.paths.first_deposits;
    let vertices = |cluster: usize| (first[2 * cluster + 2] - first[2 * cluster]) as usize;
    let wholes = &made.hvds.wholes;
    let is_taken = |&cluster: &usize| {
        reads.flux[cluster] || reads.flux.get(wholes[cluster] as usize).is_some_and(|is_taken| *is_taken)
    };
    let taken = (0..wholes.len()).filter(is_taken).map(vertices).sum();
    note("path vertices whose flux nothing takes", taken, (0..wholes.len()).map(vertices).sum());
    if let Some(gloss) = &made.gloss {
        let all = shining_clusters(gloss, &made.hvds) * directions.count() as usize;
        note("outgoing directions of shining clusters that nothing reads", gloss.slots.len().min(all), all);
    }
    unread
}

/// Clusters of all levels that hold what may shine.
fn shining_clusters(gloss: &GlossTables, hvds: &Hvds) -> usize {
    let mut shines = vec![false; hvds.cluster_count() as usize];
    for (shines, &shift) in shines.iter_mut().zip(&gloss.shifts) {
        *shines = shift != NO_ENTRY;
    }
    for cluster in 0..shines.len() {
        let parent = hvds.parents[cluster];
        if parent != NO_CLUSTER {
            shines[parent as usize] |= shines[cluster];
        }
    }
    shines.into_iter().filter(|shines| *shines).count()
}
