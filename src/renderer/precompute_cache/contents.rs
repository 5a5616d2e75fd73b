//! Contents of a file of light paths, before they are checked.

use super::write::Numbers;
use crate::cache_file::{CacheMiss, File};
use crate::passes::frame::near_field::NearCluster;
use crate::passes::gather_targets::{GatherTargetPacking, TargetCounts};
use crate::passes::gloss_tables::GlossTables;
use crate::passes::precompute::merged_rays::MergedRayLists;
use crate::passes::precompute::neighbours::Neighbourhoods;
use crate::passes::precompute::path_orders::{Arrivals, LightPaths, PathRange};
use crate::scene::Scene;
use crate::scene::grid::CellGrid;
use crate::scene::hvds::Hvds;
use crate::scene::octree::Octree;
use crate::types::{CachePoint, Contribution, PathVertex};
use std::collections::BTreeMap;
use std::ops::Range;

/// All stored sections. Children of the hierarchy are linked later, and `base_ranges` of
/// glossy surfaces are computed later.
pub(super) struct Contents {
    pub(super) numbers: Numbers,
    pub(super) counts: BTreeMap<String, u64>,
    pub(super) skipped: BTreeMap<String, f64>,
    pub(super) order: Vec<u32>,
    pub(super) sides: Vec<u32>,
    pub(super) closed: Vec<u32>,
    pub(super) hvds: Hvds,
    pub(super) shown_m2: Vec<f32>,
    pub(super) effective_entry_points: Vec<f32>,
    pub(super) entry_points: Vec<PathVertex>,
    pub(super) paths: LightPaths,
    pub(super) cache_points: Vec<CachePoint>,
    pub(super) neighbourhoods: Neighbourhoods,
    pub(super) merged_rays: MergedRayLists,
    pub(super) near_clusters: Vec<NearCluster>,
    pub(super) near_patches: Vec<NearCluster>,
    pub(super) gloss: Option<GlossTables>,
}

fn ranges(ends: Vec<[u32; 2]>) -> Vec<Range<u32>> {
    ends.into_iter().map(|[start, end]| start..end).collect()
}

impl Contents {
    /// Reads all sections; `grid` is the grid of the finest cells.
    pub(super) fn read(file: &File<'_>, grid: CellGrid) -> Result<Self, CacheMiss> {
        let numbers: Numbers = file.one("numbers")?;
        let notes = serde_json::from_slice(&file.list::<u8>("notes")?);
        let (counts, skipped): (BTreeMap<String, u64>, BTreeMap<String, Option<f64>>) =
            notes.map_err(|_| CacheMiss::damaged("its notes are none"))?;
        let hvds = Hvds {
            grid,
            levels: ranges(file.list("levels")?),
            octree: Octree { words: file.list("octree")? },
            cell_levels: file.list("levels of cells")?,
            cell_clusters: file.list("cell clusters")?,
            areas_m2: file.list("areas")?,
            unweighted: file.list("unweighted clusters")?,
            parents: file.list("parents")?,
            child_offsets: Vec::new(),
            children: Vec::new(),
            fragments: Vec::new(),
            inconsistent: file
                .list::<u8>("inconsistent")?
                .into_iter()
                .map(|inconsistent| inconsistent != 0)
                .collect(),
        };
        let contribution = |what: u32| Contribution { what, ..Contribution::new(0, 0) };
        let group = |[materials, start, end]: [u32; 3]| PathRange { materials, steps: start..end };
        let paths = LightPaths {
            steps: file.list("steps")?,
            colours: file.list("step colours")?,
            contributions: file.list("contributions")?.into_iter().map(contribution).collect(),
            contribution_offsets: file.list("contribution offsets")?,
            ranges: file.list("path ranges")?.into_iter().map(group).collect(),
            streams: file.list("path streams")?,
            arrivals: Arrivals { lobes: file.list("lobes")?, ..Arrivals::default() },
            lost: 0,
        };
        let gloss = || -> Result<GlossTables, CacheMiss> {
            Ok(GlossTables {
                entries: file.list("gloss entries")?,
                vertices: file.list("gloss vertices")?,
                max_vertices: numbers.gloss_most_vertices,
                entry_indices: file.list("gloss entry indices")?,
                mirrors: file.list("gloss mirrors")?,
                vertex_offsets: file.list("gloss vertex offsets")?,
                base_ranges: Vec::new(),
                bins: file.list("gloss bins")?,
                leaf_count: numbers.gloss_leaf_count,
                sums: ranges(file.list("gloss sums")?),
                child_offsets: file.list("gloss child offsets")?,
                children: file.list("gloss children")?,
                readers: 0,
            })
        };
        let gloss = if numbers.has_gloss == 0 { None } else { Some(gloss()?) };
        Ok(Self {
            numbers,
            counts,
            skipped: skipped.into_iter().filter_map(|(name, fraction)| Some((name, fraction?))).collect(),
            order: file.list("order")?,
            sides: file.list("sides")?,
            closed: file.list("enclosures")?,
            shown_m2: file.list("shown areas")?,
            effective_entry_points: file.list("effective entry points")?,
            entry_points: file.list("entry points")?,
            paths,
            cache_points: file.list("cache points")?,
            neighbourhoods: Neighbourhoods {
                first: file.list("neighbour offsets")?,
                list: file.list("neighbours")?,
            },
            merged_rays: MergedRayLists {
                targets: file.list("gather targets")?,
                counts: file.list("merged ray counts")?,
                merged_rays: file.list("merged rays")?,
                colours: file.list("merged ray colours")?,
                directions: file.list("merged ray directions")?,
            },
            near_clusters: file.list("near clusters")?,
            near_patches: file.list("near patches")?,
            gloss,
            hvds,
        })
    }

    /// Packing of the gather targets.
    ///
    /// # Errors
    /// They do not fit one word with the materials.
    pub(super) fn packing(&self, scene: &Scene) -> crate::error::Result<GatherTargetPacking> {
        let counts = TargetCounts {
            clusters: self.hvds.cluster_count(),
            patches: self.near_patches.len() as u32,
            gloss_bins: self.gloss.as_ref().map_or(0, |gloss| gloss.bins.len() as u32),
            sky_side: scene.emission.sky_side(),
        };
        GatherTargetPacking::of_counts(counts, scene.materials.len(), self.numbers.min_distance)
    }
}
