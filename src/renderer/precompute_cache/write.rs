//! Writes the precomputation to a file, section by section.

use crate::cache_file::Writer;
use crate::error::Result;
use crate::passes::precompute::merged_rays::MergedRayLists;
use crate::renderer::precompute::Precomputed;
use crate::types::{CachePoint, ROUNDED};
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;
use std::ops::Range;

#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Numbers {
    /// Area that all entry points stand for, m².
    pub(super) all_area_m2: f64,
    /// Unit of gradients, metres.
    pub(super) min_distance: f32,
    pub(super) cluster_bits: u32,
    pub(super) narrow_count: u32,
    pub(super) narrow_patches: u32,
    pub(super) is_covering: u32,
    pub(super) has_gloss: u32,
    pub(super) gloss_leaf_count: u32,
    pub(super) gloss_most_vertices: u32,
    /// Median clearance of the surface, metres.
    pub(super) clearance: f64,
}

/// Lists that the device holds, or whose stored form differs from their form in memory.
pub(super) struct Tables {
    cache_points: Vec<CachePoint>,
    merged_rays: MergedRayLists,
    /// Sides of each triangle, as [`Surface`](crate::types::Surface) has them.
    sides: Vec<u32>,
    /// The fields of each contribution except its throughput, which the path scan computes.
    contributions: Vec<u32>,
    /// Counts and fractions of the statistics, as text.
    notes: Vec<u8>,
}

/// Start and end of each range.
fn ends(ranges: &[Range<u32>]) -> Vec<[u32; 2]> {
    ranges.iter().map(|range| [range.start, range.end]).collect()
}

impl Tables {
    pub(super) fn from_precomputed(made: &Precomputed) -> Result<Self> {
        let notes = serde_json::json!([made.statistics.counts, made.statistics.skipped]);
        Ok(Self {
            cache_points: made.cache_points.read()?,
            merged_rays: made.merged_rays.lists()?,
            sides: made.surfaces.iter().map(|surface| surface.sides & !ROUNDED).collect(),
            contributions: made.paths.contributions.iter().map(|contribution| contribution.what).collect(),
            notes: notes.to_string().into_bytes(),
        })
    }

    pub(super) fn sections<'a>(&'a self, made: &'a Precomputed) -> Writer<'a> {
        let mut writer = Writer::default();
        let gloss = made.gloss.as_ref();
        writer.add(
            "numbers",
            vec![Numbers {
                all_area_m2: made.all_area_m2,
                min_distance: made.packing.min_distance,
                cluster_bits: made.packing.cluster_bits,
                narrow_count: made.narrow_count,
                narrow_patches: made.narrow_patches,
                is_covering: made.is_covering.into(),
                has_gloss: gloss.is_some().into(),
                gloss_leaf_count: gloss.map_or(0, |gloss| gloss.leaf_count),
                gloss_most_vertices: gloss.map_or(0, |gloss| gloss.max_vertices),
                clearance: made.clearance,
            }],
        );
        writer.add("notes", &self.notes[..]);
        writer.add("order", &made.enclosures.order[..]);
        writer.add("sides", &self.sides[..]);
        writer.add("enclosures", made.enclosures.groups.numbers());

        let hvds = &made.hvds;
        writer.add("levels", ends(&hvds.levels));
        writer.add("octree", &hvds.octree.words[..]);
        writer.add("levels of cells", &hvds.cell_levels[..]);
        writer.add("cell clusters", &hvds.cell_clusters[..]);
        writer.add("areas", &hvds.areas_m2[..]);
        writer.add("shown areas", &made.shown_m2[..]);
        writer.add("unweighted clusters", &hvds.unweighted[..]);
        writer.add("parents", &hvds.parents[..]);
        writer.add(
            "inconsistent",
            hvds.inconsistent.iter().map(|&inconsistent| u8::from(inconsistent)).collect::<Vec<_>>(),
        );
        writer.add("effective entry points", &made.cluster_tables.entry_points[..]);

        writer.add("entry points", &made.entry_points[..]);
        let paths = &made.paths;
        writer.add("steps", &paths.steps[..]);
        writer.add("step colours", &paths.colours[..]);
        writer.add("lobes", &paths.arrivals.lobes[..]);
        writer.add("contributions", &self.contributions[..]);
        writer.add("contribution offsets", &paths.contribution_offsets[..]);
        let group = |group: &crate::passes::precompute::path_orders::PathRange| {
            [group.materials, group.steps.start, group.steps.end]
        };
        writer.add("path ranges", paths.ranges.iter().map(group).collect::<Vec<_>>());
        writer.add("path streams", &paths.streams[..]);

        writer.add("cache points", &self.cache_points[..]);
        writer.add("neighbour offsets", &made.neighbourhoods.first[..]);
        writer.add("neighbours", &made.neighbourhoods.list[..]);
        writer.add("gather targets", &self.merged_rays.targets[..]);
        writer.add("merged ray counts", &self.merged_rays.counts[..]);
        writer.add("merged rays", &self.merged_rays.merged_rays[..]);
        writer.add("merged ray colours", &self.merged_rays.colours[..]);
        writer.add("merged ray directions", &self.merged_rays.directions[..]);
        writer.add("near clusters", &made.near_clusters[..]);
        writer.add("near patches", &made.near_patches[..]);
        if let Some(gloss) = gloss {
            writer.add("gloss entries", &gloss.entries[..]);
            writer.add("gloss vertices", &gloss.vertices[..]);
            writer.add("gloss entry indices", &gloss.entry_indices[..]);
            writer.add("gloss mirrors", &gloss.mirrors[..]);
            writer.add("gloss vertex offsets", &gloss.vertex_offsets[..]);
            writer.add("gloss bins", &gloss.bins[..]);
            writer.add("gloss sums", ends(&gloss.sums));
            writer.add("gloss child offsets", &gloss.child_offsets[..]);
            writer.add("gloss children", Cow::Borrowed(&gloss.children[..]));
        }
        writer
    }
}
