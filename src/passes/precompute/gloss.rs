//! Tables of glossy surfaces: entry points whose first reflection depends on the light, mirror
//! directions of path vertices, and the direction bins in which gather rays read clusters. [Yue
//! §2] In: paths, gather rays. Out: tables, and the gather rays that read gloss bins.

use super::gather_rays::{Hemisphere, RayDirections, RayTable};
use super::path_orders::LightPaths;
use crate::error::Result;
use crate::passes::frame::hvds::contribution_ranges;
use crate::passes::gather_targets::{GatherTarget, GatherTargets, Reader};
use crate::passes::gloss_tables::{GlossBin, GlossEntry, GlossTables, GlossVertex, UNWEIGHTED};
use crate::scene::directions::Directions;
use crate::scene::{Material, hvds::Hvds};
use crate::types::{CachePoint, ContributionRange, NO_CLUSTER, PathVertex, Surface};
use glam::{DVec3, UVec2, Vec3};
use rayon::prelude::*;
use std::collections::HashMap;

/// Inputs of the tables.
#[derive(Clone, Copy)]
pub struct Sources<'a> {
    /// Hierarchy that path vertices contribute to.
    pub hvds: &'a Hvds,
    /// In BVH order.
    pub surfaces: &'a [Surface],
    /// As at load.
    pub materials: &'a [Material],
    /// All light paths.
    pub paths: &'a LightPaths,
    /// Entry points of the paths.
    pub entry_points: &'a [PathVertex],
    /// Origins of the gather rays.
    pub cache_points: &'a [CachePoint],
    /// Stratification of their hemispheres.
    pub hemisphere: Hemisphere,
    /// Seed of their directions.
    pub seed: u32,
    /// Direction bins of outgoing light.
    pub directions: Directions,
}

/// Builds the tables, and lists the rays that read gloss bins. `None` if no material may be glossy.
///
/// # Errors
/// The device failed.
pub fn build(
    sources: Sources<'_>,
    rays: &RayTable,
    targets: &GatherTargets,
) -> Result<Option<(GlossTables, Vec<Reader>)>> {
    if !sources.materials.iter().any(Material::may_be_glossy) {
        return Ok(None);
    }
    let mut tables = GlossTables::default();
    tables.find_entries(&sources);
    tables.find_vertices(&sources);
    tables.base_ranges = base_ranges(sources.hvds);

    let may_be_glossy: Vec<bool> = sources.materials.iter().map(Material::may_be_glossy).collect();
    let wanted =
        wanted_directions((&may_be_glossy, sources.directions), &sources.ray_directions(), rays, targets)?;
    let bins = tables.find_bins(&sources, wanted.iter().map(|&(_, wanted)| wanted).collect());
    let reader = |(ray, wanted)| Reader { ray, index: bins[&wanted] };
    let readers: Vec<Reader> = wanted.into_iter().map(reader).collect();
    let directions = sources.ray_directions();
    tables.find_directions(readers.iter().map(|read| (read.index, directions.back(read.ray as usize))));
    Ok(Some((tables, readers)))
}

impl Sources<'_> {
    fn ray_directions(&self) -> RayDirections<'_> {
        RayDirections::new(self.cache_points, self.hemisphere, self.seed)
    }
}

/// Maximum number of vertices of a cluster that is evaluated from its vertices instead
/// of its children.
const LEAF_VERTICES: u32 = 512;

/// Rays that one task of the host looks at.
const CHUNK: usize = 1 << 11;

/// The gather rays that meet a glossy surface, in order; each with the cluster, and the bin of the
/// direction in which the surface reflects towards it.
///
/// # Errors
/// The device failed.
pub fn wanted_directions(
    (may_be_glossy, bins): (&[bool], Directions),
    directions: &RayDirections<'_>,
    rays: &RayTable,
    targets: &GatherTargets,
) -> Result<Vec<(u32, (u32, u32))>> {
    let mut wanted = Vec::new();
    rays.scan(usize::MAX, 1, |first, rays| {
        let met = rays.par_chunks(CHUNK).enumerate().flat_map_iter(|(chunk, rays)| {
            let first = first + chunk * CHUNK;
            (first..).zip(targets.of_rays(first, rays)).filter_map(|(ray, target)| match target {
                Some((GatherTarget::Cluster(cluster), met)) if may_be_glossy[met.material as usize] => {
                    Some((ray as u32, (cluster, bins.bin(directions.back(ray)))))
                }
                _ => None,
            })
        });
        wanted.par_extend(met);
    })?;
    Ok(wanted)
}

/// Range of base clusters below each cluster.
pub fn base_ranges(hvds: &Hvds) -> Vec<UVec2> {
    let base = hvds.levels[0].end;
    let mut ranges: Vec<UVec2> = (0..base).map(|cluster| UVec2::new(cluster, cluster + 1)).collect();
    for cluster in base as usize..hvds.cluster_count() as usize {
        let children = hvds.children_of(cluster as u32).iter().map(|&child| ranges[child as usize]);
        let around = children.reduce(|a, b| UVec2::new(a.x.min(b.x), a.y.max(b.y)));
        ranges.push(around.unwrap_or_default());
    }
    ranges
}

impl GlossTables {
    /// Counts for the report.
    pub fn counts(&self) -> [(String, u64); 3] {
        [
            ("outgoing directions of clusters", self.bins.len() as u64),
            ("outgoing directions that are sums", self.bins.len() as u64 - u64::from(self.leaf_count)),
            ("gather rays that read outgoing directions", self.readers),
        ]
        .map(|(name, value)| (name.to_owned(), value))
    }

    fn find_entries(&mut self, sources: &Sources<'_>) {
        let arrivals = &sources.paths.arrivals;
        let leaving = arrivals.departures.iter().zip(&arrivals.entry_colours);
        for ((path, entry), (&departure, &colour)) in (0..).zip(sources.entry_points).zip(leaving) {
            let surface = &sources.surfaces[entry.side as usize / 2];
            if sources.materials[surface.material as usize].may_be_glossy() {
                let normal = if entry.side % 2 == 1 { -surface.normal } else { surface.normal };
                self.entries.push(GlossEntry {
                    position: entry.position,
                    path,
                    normal,
                    weight: entry.weight,
                    departure,
                    material: surface.material,
                    colour,
                });
            }
        }
    }

    /// Lists the path vertices that may be glossy, by base cluster.
    fn find_vertices(&mut self, sources: &Sources<'_>) {
        let arrivals = &sources.paths.arrivals;
        let mut entry_of_path = vec![None; sources.entry_points.len()];
        for (index, entry) in (0_u32..).zip(&self.entries) {
            entry_of_path[entry.path as usize] = Some(index);
        }
        let vertex = |contribution: u32, run: &ContributionRange| {
            let side = arrivals.sides[contribution as usize];
            let surface = &sources.surfaces[side as usize / 2];
            let flag = if run.is_unweighted != 0 { UNWEIGHTED } else { 0 };
            let vertex = GlossVertex { material: surface.material, contribution: contribution | flag };
            sources.materials[surface.material as usize].may_be_glossy().then_some((vertex, surface))
        };
        let mut others = Vec::new();
        for run in contribution_ranges(sources.hvds, &sources.paths.contribution_offsets) {
            self.vertex_offsets.push(UVec2::new(self.vertices.len() as u32, others.len() as u32));
            for contribution in run.first..run.first_other {
                let path = sources.paths.contributions[contribution as usize].path();
                if let (Some(entry), Some((vertex, _))) =
                    (entry_of_path[path as usize], vertex(contribution, &run))
                {
                    self.entry_indices.push(entry);
                    self.vertices.push(vertex);
                }
            }
            for contribution in run.first_other..run.end {
                let Some((vertex, surface)) = vertex(contribution, &run) else { continue };
                let incoming = arrivals.incoming[contribution as usize];
                self.mirrors.push(incoming.reflect(surface.normal).extend(0.0));
                others.push(vertex);
            }
        }
        self.vertex_offsets.push(UVec2::new(self.vertices.len() as u32, others.len() as u32));
        self.vertices.append(&mut others);
    }

    /// Numbers the gloss bins of rays and of sums. A cluster of many vertices is the sum of its
    /// children, so that its vertices are not evaluated at each level. A smaller cluster is
    /// evaluated from its vertices, so that its children need no gloss bins. Returns the gloss bin
    /// of each cluster and bin.
    fn find_bins(&mut self, sources: &Sources<'_>, mut wanted: Vec<(u32, u32)>) -> HashMap<(u32, u32), u32> {
        let hvds = sources.hvds;
        let mut vertices = vec![0; hvds.cluster_count() as usize];
        for (vertices, ends) in vertices.iter_mut().zip(self.vertex_offsets.windows(2)) {
            *vertices = (ends[1] - ends[0]).element_sum();
        }
        for cluster in 0..vertices.len() {
            if hvds.parents[cluster] != NO_CLUSTER {
                vertices[hvds.parents[cluster] as usize] += vertices[cluster];
            }
        }
        let is_sum =
            |cluster: u32| cluster >= hvds.levels[0].end && vertices[cluster as usize] > LEAF_VERTICES;
        let children = |cluster: u32| {
            let children = hvds.children_of(cluster).iter().copied();
            children.filter(|&child| vertices[child as usize] > 0)
        };
        // From the coarsest level down, because the terms of a sum need gloss bins, too.
        wanted.sort_unstable();
        wanted.dedup();
        for level in hvds.levels[1..].iter().rev() {
            let sums = wanted.iter().filter(|(cluster, _)| level.contains(cluster) && is_sum(*cluster));
            let parts: Vec<_> =
                sums.flat_map(|&(cluster, bin)| children(cluster).map(move |child| (child, bin))).collect();
            if !parts.is_empty() {
                wanted.extend(parts);
                wanted.sort_unstable();
                wanted.dedup();
            }
        }
        // Clusters are numbered from the base up, and so are their sums.
        wanted.sort_by_key(|&(cluster, _)| is_sum(cluster));
        self.leaf_count = wanted.partition_point(|&(cluster, _)| !is_sum(cluster)) as u32;
        let leaves = wanted[..self.leaf_count as usize].iter();
        self.max_vertices = leaves.map(|&(cluster, _)| vertices[cluster as usize]).max().unwrap_or(0);
        let gloss_bin = |&(cluster, _): &(u32, u32)| GlossBin { cluster, direction: Vec3::ZERO };
        self.bins = wanted.iter().map(gloss_bin).collect();
        let places: HashMap<_, _> = wanted.iter().copied().zip(0..).collect();
        let sums = &wanted[self.leaf_count as usize..];
        for level in &hvds.levels {
            let place = |cluster| self.leaf_count + sums.partition_point(|sum| sum.0 < cluster) as u32;
            let range = place(level.start)..place(level.end);
            if !range.is_empty() {
                self.sums.push(range);
            }
        }
        for &(cluster, bin) in sums {
            self.child_offsets.push(self.children.len() as u32);
            self.children.extend(children(cluster).map(|child| places[&(child, bin)]));
        }
        self.child_offsets.push(self.children.len() as u32);
        places
    }

    /// Gives each gloss bin the mean direction of its readers, direct or through sums. The middle
    /// of a bin would be wrong for rays at its rim. It would also be biased, because the number of
    /// readers follows the projected area.
    fn find_directions(&mut self, read: impl Iterator<Item = (u32, DVec3)>) {
        let mut sums = vec![DVec3::ZERO; self.bins.len()];
        for (gloss_bin, direction) in read {
            sums[gloss_bin as usize] += direction;
            self.readers += 1;
        }
        // The gloss bin of a sum follows those of its terms.
        for sum in (0..self.child_offsets.len() - 1).rev() {
            let range = self.child_offsets[sum] as usize..self.child_offsets[sum + 1] as usize;
            for &child in &self.children[range] {
                let own = sums[self.leaf_count as usize + sum];
                sums[child as usize] += own;
            }
        }
        for (gloss_bin, sum) in self.bins.iter_mut().zip(sums) {
            gloss_bin.direction = sum.normalize_or_zero().as_vec3();
        }
    }
}
