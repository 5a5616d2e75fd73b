//! Checks whether the tables of glossy surfaces are consistent.

use super::contents::Contents;
use super::demand::{cuts, demand};
use crate::cache_file::CacheMiss;
use crate::passes::gloss_tables::NO_ENTRY;
use crate::scene::{Material, Scene};

pub(super) fn check(contents: &Contents, scene: &Scene) -> Result<(), CacheMiss> {
    let is_glossy = scene.materials.iter().any(Material::may_be_glossy);
    demand(is_glossy == contents.gloss.is_some(), "glossy surfaces")?;
    let Some(gloss) = &contents.gloss else { return Ok(()) };
    let is_material = |material: u32| (material as usize) < scene.materials.len();
    let (entries, vertices) = (gloss.entries.len(), gloss.vertices.len());
    let is_entry = |entry: u32| entry == NO_ENTRY || (entry as usize) < entries;
    for entry in &gloss.entries {
        let is_path = (entry.path as usize) < contents.entry_points.len();
        demand(is_path && is_material(entry.material), "glossy entry points")?;
    }
    let mut all = gloss.vertices.iter();
    demand(all.all(|vertex| is_material(vertex.material) && is_entry(vertex.entry)), "glossy vertices")?;
    // This number bounds the number of dispatches.
    demand(gloss.max_vertices as usize <= contents.paths.contributions.len(), "most glossy vertices")?;

    let hvds = &contents.hvds;
    let first = &contents.paths.contribution_offsets;
    demand(gloss.shifts.len() == hvds.levels[0].len(), "shifts")?;
    let holds = |shift: u32, cluster: usize| {
        let (start, end) = (first[2 * cluster], first[2 * cluster + 2]);
        let range = u64::from(start.wrapping_add(shift)) + u64::from(end - start);
        start == end || shift == NO_ENTRY || range <= vertices as u64
    };
    for (cluster, &shift) in gloss.shifts.iter().enumerate() {
        demand(holds(shift, cluster), "shifts")?;
    }
    // An unweighted cluster has the contributions of its cluster, and so its vertices.
    for (cluster, &unweighted) in hvds.unweighted.iter().enumerate() {
        if let Some(&shift) = gloss.shifts.get(unweighted as usize) {
            demand(shift == gloss.shifts[cluster], "shifts of unweighted clusters")?;
        }
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
