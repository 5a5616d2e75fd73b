//! Checks whether the tables of glossy surfaces are consistent.

use super::contents::Contents;
use super::demand::{cuts, demand};
use crate::cache_file::CacheMiss;
use crate::passes::gloss_tables::{GlossVertex, UNWEIGHTED};
use crate::scene::{Material, Scene};

pub(super) fn check(contents: &Contents, scene: &Scene) -> Result<(), CacheMiss> {
    let is_glossy = scene.materials.iter().any(Material::may_be_glossy);
    demand(is_glossy == contents.gloss.is_some(), "glossy surfaces")?;
    let Some(gloss) = &contents.gloss else { return Ok(()) };
    let is_material = |material: u32| (material as usize) < scene.materials.len();
    for entry in &gloss.entries {
        let is_path = (entry.path as usize) < contents.entry_points.len();
        demand(is_path && is_material(entry.material), "glossy entry points")?;
    }
    let contributions = contents.paths.contributions.len();
    let is_vertex = |vertex: &GlossVertex| {
        is_material(vertex.material) && ((vertex.contribution & !UNWEIGHTED) as usize) < contributions
    };
    demand(gloss.vertices.iter().all(is_vertex), "glossy vertices")?;
    let halves = [gloss.entry_indices.len(), gloss.mirrors.len()];
    demand(halves.iter().sum::<usize>() == gloss.vertices.len(), "glossy vertices")?;
    let is_entry = |&entry: &u32| (entry as usize) < gloss.entries.len();
    demand(gloss.entry_indices.iter().all(is_entry), "glossy entry points of clusters")?;
    // This number bounds the number of dispatches.
    demand(gloss.max_vertices as usize <= gloss.vertices.len(), "most glossy vertices")?;

    let hvds = &contents.hvds;
    for (half, length) in halves.into_iter().enumerate() {
        let offsets: Vec<u32> = gloss.vertex_offsets.iter().map(|first| first[half]).collect();
        demand(cuts(&offsets, hvds.levels[0].len(), length), "glossy vertices of clusters")?;
    }

    let (bins, leaves) = (gloss.bins.len(), gloss.leaf_count as usize);
    let clusters = hvds.areas_m2.len();
    demand(
        gloss.bins.iter().all(|gloss_bin| (gloss_bin.cluster as usize) < clusters),
        "outgoing directions",
    )?;
    demand(leaves <= bins, "outgoing directions that are no sums")?;
    let sums = bins - leaves;
    demand(cuts(&gloss.child_offsets, sums, gloss.children.len()), "parts of sums")?;
    let mut end = leaves;
    for level in &gloss.sums {
        let range = level.start as usize..level.end as usize;
        demand(range.start == end && range.start <= range.end && range.end <= bins, "levels of sums")?;
        let ranges = gloss.child_offsets[range.start - leaves]..gloss.child_offsets[range.end - leaves];
        let children = &gloss.children[ranges.start as usize..ranges.end as usize];
        // A level sums only gloss bins of earlier levels.
        demand(children.iter().all(|&child| (child as usize) < range.start), "parts of sums")?;
        end = range.end;
    }
    demand(end == bins, "levels of sums")
}
