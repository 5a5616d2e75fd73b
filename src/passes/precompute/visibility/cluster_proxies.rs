//! Directional proxies: the parts of coarse clusters that are visible from the origins of gather
//! rays. [Yue §2, Figure 1] In: gather rays, clusters. Out: proxies, each a list of weighted
//! clusters, and the gather rays that read it.
//!
//! A *pair* is a coarse cluster and a direction bin from which gather rays read it. If other
//! surface in the cell hides a part of the cluster, the pair becomes a *proxy*: the mean over finer
//! clusters, each weighted by its visible fraction, its area and its cosine with the direction. If
//! nothing is hidden, or all of it equally, rays keep the cluster.

use super::occlusion::{Ask, Cells, Hiding, Readers, Seen};
use crate::error::Result;
use crate::passes::SceneBuffers;
use crate::passes::frame::cluster_proxies::ProxyTermPacking;
use crate::passes::gather_targets::{GatherTarget, GatherTargetPacking, GatherTargets, Reader};
use crate::passes::precompute::gather_rays::MIN_ENTRY_POINTS;
use crate::passes::precompute::gather_rays::{Hemisphere, RayDirections, RayTable};
use crate::passes::precompute::{Progress, rays::Rays};
use crate::scene::directions::Directions;
use crate::scene::{Material, hvds::Hvds};
use crate::types::{CachePoint, Surface};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Gather rays whose origins represent all readers of a pair.
const MAX_READERS: usize = 8;
/// Maximum number of clusters of a proxy.
const MAX_PARTS: usize = 64;
/// Minimum difference of the weights between a proxy and its cluster.
const MIN_CHANGE: f64 = 1.0 / 32.0;
/// Pairs in one measurement of a thread: one thread prepares rays while the device traces
/// those of another.
const CHUNK: usize = 1 << 11;
/// Maximum number of clusters in one chunk of the search for occluders: coarse clusters take long.
const FEW: usize = 64;
/// Pairs between two reports of progress.
const PAIRS_AT_A_TIME: usize = 1 << 15;

/// Inputs of the proxies.
#[derive(Clone, Copy)]
pub struct Sources<'a> {
    /// Hierarchy whose clusters may be hidden.
    pub hvds: &'a Hvds,
    /// Expected number of entry points in each cluster.
    pub in_clusters: &'a [f32],
    /// In BVH order.
    pub surfaces: &'a [Surface],
    /// As at load.
    pub materials: &'a [Material],
    /// Origins of the gather rays.
    pub cache_points: &'a [CachePoint],
    /// Stratification of the gather rays.
    pub hemisphere: Hemisphere,
    /// Seed of the gather rays.
    pub seed: u32,
    /// Direction bins of proxies.
    pub directions: Directions,
    /// Offset of ray origins from surfaces, metres.
    pub clear_distance: f32,
}

/// All proxies, in compressed lists.
#[derive(Debug)]
pub struct ProxyTables {
    /// CSR offsets of the entries of each proxy.
    pub term_offsets: Vec<u32>,
    /// Packed entries of the proxies.
    pub terms: Vec<u32>,
    /// How they are packed.
    pub packing: ProxyTermPacking,
    /// Cluster, direction bin and proxy of each pair that became a proxy, in this order.
    pub pairs: Vec<[u32; 3]>,
    /// Pairs that were measured with rays.
    pub measured: u64,
    /// Of these, pairs that stay clusters because their visible parts hold too few entry points.
    pub poor: u64,
    /// Gather rays that read proxies.
    pub readers: u64,
}

/// A candidate entry of a proxy: a finer cluster and its visibility.
#[derive(Clone, Copy)]
struct Node {
    cluster: u32,
    seen: Option<Seen>,
}

/// A pair during measurement.
struct Pair {
    readers: Readers,
    nodes: Vec<Node>,
}

/// The result of a pair.
enum Outcome {
    /// The cluster is accurate enough.
    Cluster,
    /// The cluster stays, because its visible parts hold too few entry points.
    Poor,
    /// Entries of a proxy: clusters and their weights in steps.
    Proxy(Vec<(u32, u32)>),
}

impl Sources<'_> {
    fn ray_directions(&self) -> RayDirections<'_> {
        RayDirections::new(self.cache_points, self.hemisphere, self.seed)
    }
}

/// Measures the pairs of all rays that read a cluster without a glossy material, and builds the
/// proxies. Returns them with their readers. The tables are empty if nothing is hidden.
///
/// # Errors
/// The device lacks memory or failed.
pub fn build(
    (rays, scene): (&Rays, &SceneBuffers),
    sources: Sources<'_>,
    table: &RayTable,
    targets: &GatherTargets,
    progress: &mut dyn Progress,
) -> Result<(ProxyTables, Vec<Reader>)> {
    let mut tables = ProxyTables::new(sources.hvds.cluster_count());
    let cells = Cells::new(sources.hvds, sources.surfaces, sources.clear_distance);
    let readers = readers(&sources, &cells, table, targets)?;
    let ranges: Vec<&[(u64, u32)]> = readers.chunk_by(|a, b| a.0 == b.0).collect();

    progress.stage("occlusion", ranges.len() as u64);
    let capacity = GatherTargetPacking::max_clusters(sources.materials.len())
        .saturating_sub(u64::from(sources.hvds.cluster_count()));
    let mut known: HashMap<Vec<(u32, u32)>, u32> = HashMap::new();
    let mut redirected = Vec::new();
    let mut done = 0;
    for ranges in ranges.chunks(PAIRS_AT_A_TIME) {
        let chunks = ranges.par_chunks(CHUNK).with_max_len(1);
        let outcomes = chunks.map(|ranges| measure(&sources, &cells, (rays, scene), ranges));
        // The first error in the order of the chunks.
        let outcomes: Vec<_> = outcomes.collect();
        let outcomes = outcomes.into_iter().collect::<Result<Vec<_>>>()?;
        for (outcome, range) in outcomes.into_iter().flatten().zip(ranges) {
            let weights = match outcome {
                Outcome::Proxy(weights) => weights,
                Outcome::Poor => {
                    tables.poor += 1;
                    continue;
                }
                Outcome::Cluster => continue,
            };
            let next = known.len() as u32;
            if u64::from(next) == capacity && !known.contains_key(&weights) {
                continue;
            }
            let proxy = *known.entry(weights.clone()).or_insert(next);
            if proxy == next {
                let packed = tables.packing;
                let term = |&(cluster, steps): &(u32, u32)| packed.pack(cluster, steps);
                tables.terms.extend(weights.iter().map(term));
                tables.term_offsets.push(tables.terms.len() as u32);
            }
            let (cluster, bin) = of_pair(range);
            tables.pairs.push([cluster, bin, proxy]);
            redirected.extend(range.iter().map(|&(_, ray)| Reader { ray, index: proxy }));
        }
        done += ranges.len() as u64;
        progress.advance(done);
    }
    tables.measured = ranges.len() as u64;
    tables.readers = redirected.len() as u64;
    redirected.sort_unstable();
    Ok((tables, redirected))
}

/// Pairs that other surface in their cell may hide, as cluster and direction bin in one word,
/// with their rays.
fn readers(
    sources: &Sources<'_>,
    cells: &Cells<'_>,
    table: &RayTable,
    targets: &GatherTargets,
) -> Result<Vec<(u64, u32)>> {
    let base = sources.hvds.levels[0].end;
    let directions = sources.ray_directions();
    let cluster_of = |target: &Option<(GatherTarget, u32)>| match *target {
        Some((GatherTarget::Cluster(cluster), material)) => {
            let is_coarse = cluster >= base;
            (is_coarse && !sources.materials[material as usize].may_be_glossy()).then_some(cluster)
        }
        _ => None,
    };
    let mut is_read = vec![false; sources.hvds.cluster_count() as usize];
    table.scan(1, |first, rays| {
        targets
            .of_rays(first, rays)
            .iter()
            .filter_map(cluster_of)
            .for_each(|cluster| is_read[cluster as usize] = true);
    })?;
    let hiding = |(cluster, &is_read): (usize, &bool)| match is_read {
        true => cells.hiding(cluster as u32),
        false => Hiding::Nothing,
    };
    let hidings: Vec<_> = is_read.par_iter().enumerate().with_max_len(FEW).map(hiding).collect();
    let mut readers = Vec::new();
    table.scan(1, |first, rays| {
        let read = rays.par_chunks(CHUNK).enumerate().flat_map_iter(|(chunk, rays)| {
            let first = first + chunk * CHUNK;
            (first..).zip(targets.of_rays(first, rays)).filter_map(|(ray, target)| {
                let cluster = cluster_of(&target)?;
                let hiding = &hidings[cluster as usize];
                if matches!(hiding, Hiding::Nothing) {
                    return None;
                }
                let back = directions.back(ray);
                let pair = u64::from(cluster) << 32 | u64::from(sources.directions.bin(back));
                hiding.is_possible_along(back).then_some((pair, ray as u32))
            })
        });
        readers.par_extend(read);
    })?;
    readers.par_sort_unstable();
    Ok(readers)
}

/// Cluster and direction bin of a pair.
fn of_pair(range: &[(u64, u32)]) -> (u32, u32) {
    ((range[0].0 >> 32) as u32, range[0].0 as u32)
}

/// Creates a pair before its measurement.
fn pair(sources: &Sources<'_>, cells: &Cells<'_>, range: &[(u64, u32)]) -> Pair {
    let (cluster, _) = of_pair(range);
    let count = range.len().min(MAX_READERS);
    let directions = sources.ray_directions();
    let chosen = (0..count).map(|index| range[index * range.len() / count].1);
    let direction: DVec3 = chosen.clone().map(|ray| directions.back(ray as usize)).sum();
    let origin = |ray: u32| {
        let point = &sources.cache_points[(ray / sources.hemisphere.rays()) as usize];
        point.position + sources.clear_distance * cells.normal(point.side)
    };
    let readers = Readers { points: chosen.map(origin).collect(), direction: direction.normalize_or_zero() };
    Pair { readers, nodes: vec![Node { cluster, seen: None }] }
}

/// Measures the cluster of each pair, and the children of partly visible clusters,
/// up to [`MAX_PARTS`].
fn measure(
    sources: &Sources<'_>,
    cells: &Cells<'_>,
    (rays, scene): (&Rays, &SceneBuffers),
    ranges: &[&[(u64, u32)]],
) -> Result<Vec<Outcome>> {
    let mut pairs: Vec<Pair> = ranges.iter().map(|range| pair(sources, cells, range)).collect();
    loop {
        let asked = pairs.iter().flat_map(|pair| {
            let new = pair.nodes.iter().filter(|node| node.seen.is_none());
            new.map(|node| Ask { cluster: node.cluster, readers: &pair.readers })
        });
        let asked: Vec<_> = asked.collect();
        if asked.is_empty() {
            return Ok(pairs.iter().map(|pair| outcome(sources, pair)).collect());
        }
        let mut seen = cells.seen(rays, scene, &asked)?.into_iter();
        for pair in &mut pairs {
            let mut divides = false;
            for node in pair.nodes.iter_mut().filter(|node| node.seen.is_none()) {
                node.seen = seen.next();
                divides |= node.is_partly_open();
            }
            if divides {
                pair.divide(cells);
            }
        }
    }
}

impl Node {
    fn is_partly_open(&self) -> bool {
        self.seen.is_some_and(|seen| seen.open > 0.0 && seen.open < 1.0)
    }
}

impl Pair {
    /// Replaces partly visible clusters by their children.
    fn divide(&mut self, cells: &Cells<'_>) {
        let mut count = self.nodes.len();
        let mut nodes = Vec::with_capacity(count);
        for &node in &self.nodes {
            let children = cells.children(node.cluster);
            if node.is_partly_open() && !children.is_empty() && count - 1 + children.len() <= MAX_PARTS {
                count = count - 1 + children.len();
                nodes.extend(children.map(|cluster| Node { cluster, seen: None }));
            } else {
                nodes.push(node);
            }
        }
        self.nodes = nodes;
    }
}

/// Returns the weights of a pair, if they differ from the cluster's and rest on
/// enough entry points.
fn outcome(sources: &Sources<'_>, pair: &Pair) -> Outcome {
    let weights = |open: fn(&Seen) -> f64| {
        let fraction = |node: &Node| {
            let seen = node.seen.expect("all nodes were looked at");
            open(&seen) * seen.facing * f64::from(sources.hvds.areas_m2[node.cluster as usize])
        };
        let fractions: Vec<f64> = pair.nodes.iter().map(fraction).collect();
        let sum: f64 = fractions.iter().sum();
        (sum > 0.0).then(|| fractions.into_iter().map(|fraction| fraction / sum).collect::<Vec<f64>>())
    };
    let (Some(seen), Some(all)) = (weights(|seen| seen.open), weights(|_| 1.0)) else {
        return Outcome::Cluster;
    };
    let change = 0.5 * seen.iter().zip(&all).map(|(a, b)| (a - b).abs()).sum::<f64>();
    if change < MIN_CHANGE {
        return Outcome::Cluster;
    }
    // Effective number of entry points: with equal weights as many would give the same noise.
    let spread = |(node, weight): (&Node, &f64)| {
        weight * weight / f64::from(sources.in_clusters[node.cluster as usize]).max(1e-9)
    };
    let trust = 1.0 / pair.nodes.iter().zip(&seen).map(spread).sum::<f64>();
    if trust < f64::from(MIN_ENTRY_POINTS) {
        return Outcome::Poor;
    }
    let all = ProxyTermPacking::new(sources.hvds.cluster_count()).steps();
    let in_steps = |(node, weight): (&Node, &f64)| (node.cluster, (weight * f64::from(all)).round() as u32);
    let steps = pair.nodes.iter().zip(&seen).map(in_steps);
    let mut steps: Vec<(u32, u32)> = steps.filter(|&(_, steps)| steps > 0).collect();
    // The largest entry takes the rounding error.
    let sum: u32 = steps.iter().map(|term| term.1).sum();
    let Some(largest) = steps.iter_mut().max_by_key(|term| term.1) else { return Outcome::Cluster };
    largest.1 = (largest.1 + all) - sum;
    Outcome::Proxy(steps)
}

impl ProxyTables {
    /// Empty tables for `clusters` clusters.
    pub fn new(clusters: u32) -> Self {
        Self {
            term_offsets: vec![0],
            terms: Vec::new(),
            packing: ProxyTermPacking::new(clusters),
            pairs: Vec::new(),
            measured: 0,
            poor: 0,
            readers: 0,
        }
    }

    /// Number of proxies.
    pub fn count(&self) -> u32 {
        self.term_offsets.len() as u32 - 1
    }

    /// Counts for the report.
    pub fn counts(&self) -> [(String, u64); 6] {
        [
            ("occlusion pairs measured", self.measured),
            ("occlusion pairs that read proxies", self.pairs.len() as u64),
            ("occlusion pairs left alone for want of entry points", self.poor),
            ("cluster proxies", u64::from(self.count())),
            ("cluster proxy terms", self.terms.len() as u64),
            ("gather rays that read proxies", self.readers),
        ]
        .map(|(name, value)| (name.to_owned(), value))
    }

    /// Whether there is no proxy.
    pub fn is_empty(&self) -> bool {
        self.terms.is_empty()
    }

    /// Returns the proxy of a pair. `None` if the pair has none.
    pub fn proxy_of(&self, cluster: u32, bin: u32) -> Option<u32> {
        let found = self.pairs.binary_search_by_key(&[cluster, bin], |pair| [pair[0], pair[1]]).ok()?;
        Some(self.pairs[found][2])
    }

    /// The rays of a table that read a pair with a proxy. The rays start at `points`.
    ///
    /// # Errors
    /// The device failed.
    pub fn readers(
        &self,
        table: &RayTable,
        targets: &GatherTargets,
        points: &[CachePoint],
        hemisphere: Hemisphere,
        (seed, directions): (u32, Directions),
    ) -> Result<Vec<Reader>> {
        let rays = RayDirections::new(points, hemisphere, seed);
        let mut readers = Vec::new();
        table.scan(1, |first, row| {
            for (ray, target) in (first..).zip(targets.of_rays(first, row)) {
                let Some((GatherTarget::Cluster(cluster), _)) = target else { continue };
                let first = self.pairs.partition_point(|pair| pair[0] < cluster);
                if self.pairs.get(first).is_none_or(|pair| pair[0] != cluster) {
                    continue;
                }
                if let Some(index) = self.proxy_of(cluster, directions.bin(rays.back(ray))) {
                    readers.push(Reader { ray: ray as u32, index });
                }
            }
        })?;
        Ok(readers)
    }
}
