//! Checks whether the contents of a file are consistent and fit the scene. The file may be hostile
//! with correct checksums. So each index that the host or the device follows is compared with the
//! length of its list.

use super::contents::Contents;
use super::demand::{cuts, demand};
use super::gloss_checks;
use crate::cache_file::CacheMiss;
use crate::passes::frame::path_scan::{FROM_ENTRY, HEAD};
use crate::passes::precompute::cache_points::RADIUS_RANGE;
use crate::scene::hvds::Hvds;
use crate::scene::{Naming, Scene, split_planes};
use crate::types::{CachePoint, NO_CLUSTER, ROUNDED, Surface};
use glam::Vec3;

/// Checks the contents against themselves and the scene. `order` is the tree's order of the
/// triangles. Links the hierarchy.
pub(super) fn check(contents: &mut Contents, scene: &Scene, order: &[u32]) -> Result<(), CacheMiss> {
    demand(contents.order == order, "triangles stand in another order")?;
    demand(contents.sides.len() == order.len(), "sides of triangles")?;
    demand(contents.closed.len() == 2 * order.len(), "enclosures")?;
    hierarchy(&contents.hvds, &contents.shown_m2)?;
    let effective_entry_points = &contents.effective_entry_points;
    let are_counts = effective_entry_points.len() == contents.hvds.areas_m2.len()
        && effective_entry_points.iter().all(|count| *count >= 0.0);
    demand(are_counts, "entry points of clusters")?;
    contents.hvds.link_children();
    paths(contents, scene)?;
    records(contents, scene)?;
    merged_rays(contents, scene)?;
    gloss_checks::check(contents, scene)
}

/// Checks the codes of a triangle's sides against the code that its surface has.
pub(super) fn sides(surface: &Surface, sides: u32) -> Result<(), CacheMiss> {
    let sides = sides | surface.sides & ROUNDED;
    demand((surface.sides ^ sides) >> 12 <= 3 && (surface.sides ^ sides) & 0xfff == 0, "codes of sides")
}

fn hierarchy(hvds: &Hvds, shown_m2: &[f32]) -> Result<(), CacheMiss> {
    let count = hvds.areas_m2.len();
    demand(!hvds.levels.is_empty() && count <= 1 << 26, "levels")?;
    let mut end = 0;
    for level in &hvds.levels {
        demand(level.start == end && level.start <= level.end, "levels")?;
        end = level.end;
    }
    demand(end as usize == count, "levels")?;
    demand(shown_m2.len() == count && hvds.parents.len() == count, "clusters")?;
    demand(hvds.inconsistent.is_empty() || hvds.inconsistent.len() == count, "inconsistent clusters")?;
    let areas = hvds.areas_m2.iter().chain(shown_m2);
    demand(areas.into_iter().all(|area| area.is_finite() && *area >= 0.0), "areas")?;

    // The parent of a base cluster is on any level above, that of another on the next. Each of them
    // has a child.
    let mut has_child = vec![false; count];
    for (depth, level) in hvds.levels.iter().enumerate() {
        let up = match (depth, hvds.levels.get(depth + 1)) {
            (0, Some(next)) => next.start..count as u32,
            (_, Some(next)) => next.clone(),
            (_, None) => 0..0,
        };
        for &parent in &hvds.parents[level.start as usize..level.end as usize] {
            demand(if up.is_empty() { parent == NO_CLUSTER } else { up.contains(&parent) }, "parents")?;
            has_child.get_mut(parent as usize).into_iter().for_each(|has| *has = true);
        }
    }
    demand(has_child[hvds.levels[0].len()..].iter().all(|has| *has), "parents")?;

    let (base, own) = (hvds.levels[0].len(), hvds.unweighted.len());
    let is_unweighted =
        |&unweighted: &u32| unweighted == NO_CLUSTER || (own..base).contains(&(unweighted as usize));
    demand(own <= base && hvds.unweighted.iter().all(is_unweighted), "unweighted clusters")?;
    demand(hvds.octree.is_sound(&hvds.grid, hvds.cell_clusters.len()), "cells")?;
    let lists = hvds.octree.words[hvds.octree.first_cell()..].windows(2);
    let mut lists = lists.map(|ends| &hvds.cell_clusters[ends[0] as usize..ends[1] as usize]);
    demand(lists.all(|list| split_planes::is_list(list, own)), "clusters of cells")?;
    demand(hvds.cell_levels.len() == own && hvds.has_cell_levels(), "levels of cells")
}

fn paths(contents: &Contents, scene: &Scene) -> Result<(), CacheMiss> {
    let Contents { paths, entry_points, hvds, .. } = contents;
    let sides = 2 * scene.triangles.len();
    let base = hvds.levels[0].len();
    demand(contents.numbers.all_area_m2.is_finite() && contents.numbers.all_area_m2 >= 0.0, "area")?;
    demand(contents.numbers.clearance > 0.0, "clearance before the surface")?;
    let has_holes = !scene.opacity.is_empty();
    let wanted = scene.quality.entry_points as usize;
    let is_count = match scene.naming() {
        // None stands in a hole.
        Naming::Number => entry_points.len() == wanted || has_holes && entry_points.len() < wanted,
        // Sums are rounded by a 64th, and a block of clusters has at most one point more than it
        // asks for.
        Naming::Place => entry_points.len() <= wanted + wanted / 60 + base,
    };
    demand(is_count, "number of entry points")?;
    for point in entry_points {
        let is_held = point.cluster == NO_CLUSTER || (point.cluster as usize) < base;
        let is_finite = point.position.is_finite() && point.weight.is_finite() && point.weight >= 0.0;
        demand((point.side as usize) < sides && is_held && is_finite, "entry points")?;
    }
    let (steps, contributions) = (&paths.steps, &paths.contributions);
    let is_glossy = !paths.arrivals.lobes.is_empty();
    demand(is_glossy == (contents.numbers.has_gloss != 0) || steps.is_empty(), "lobes")?;
    demand(!is_glossy || paths.arrivals.lobes.len() == steps.len(), "lobes")?;
    demand(paths.colours.len() == if has_images(scene) { steps.len() } else { 0 }, "colours of steps")?;
    for step in steps {
        let is_known = (step.material as usize) < scene.materials.len()
            || step.material == HEAD
            || (is_glossy && step.material == FROM_ENTRY);
        demand(is_known && (step.contribution as usize) < contributions.len(), "steps")?;
    }
    let heads = steps.iter().filter(|step| step.material == HEAD).count();
    let starts = steps.first().is_none_or(|step| step.material == HEAD);
    demand(starts && heads == entry_points.len(), "starts of paths")?;
    let is_path = |path: u32| (path as usize) < entry_points.len();
    // The last contribution belongs to no cluster.
    let held = contributions.len().checked_sub(1).ok_or_else(|| CacheMiss::damaged("contributions"))?;
    demand(contributions[..held].iter().all(|contribution| is_path(contribution.path())), "contributions")?;
    demand(cuts(&paths.contribution_offsets, 2 * base, held), "contributions of clusters")?;
    let mut end = 0;
    for group in &paths.ranges {
        demand(group.steps.start >= end && group.steps.start <= group.steps.end, "groups of paths")?;
        end = group.steps.end;
    }
    demand(end as usize <= steps.len(), "groups of paths")?;
    demand(paths.streams.len() == entry_points.len(), "streams of paths")
}

/// Whether the scene has images: steps and gather rays then have colours.
pub(super) fn has_images(scene: &Scene) -> bool {
    !scene.texture_coordinates.is_empty() || !scene.panes.is_empty()
}

/// Checks the radii of cache points: they determine how many records a pixel reads and how many
/// tiles list a record.
fn radii(points: &[CachePoint], scene: &Scene) -> Result<(), CacheMiss> {
    let (low, high) = scene.bounds();
    // The range of placement, with a margin for rounding.
    let [least, most] = RADIUS_RANGE.map(|bound| bound as f32);
    let longest = 1.001 * most * (high - low).length();
    let smallest = points.iter().fold(f32::INFINITY, |smallest, point| smallest.min(point.radius));
    let is_radius = |point: &CachePoint| {
        let largest = scene.cell_sizes.stretched(point.position, (most / least * smallest).into()) as f32;
        point.radius > 0.0 && point.radius <= longest.min(1.001 * largest)
    };
    demand(points.iter().all(is_radius), "radii of cache points")
}

fn records(contents: &Contents, scene: &Scene) -> Result<(), CacheMiss> {
    let points = &contents.cache_points;
    let is_point = |record: u32| (record as usize) < points.len();
    let Some(first_meter) = points.len().checked_sub(scene.measuring_points().iter().product()) else {
        return demand(false, "measuring points");
    };
    radii(&points[..first_meter], scene)?;
    demand(points[first_meter..].iter().all(|point| point.radius >= 0.0), "measuring points")?;
    for point in points {
        let vectors = [point.position, point.normal, point.occluder, point.facet];
        let is_finite = vectors.into_iter().all(Vec3::is_finite) && point.radius.is_finite();
        demand(is_finite && (point.side as usize) < 2 * scene.triangles.len(), "cache points")?;
    }
    let neighbours = &contents.neighbourhoods;
    demand(cuts(&neighbours.first, points.len(), neighbours.list.len()), "neighbours")?;
    let is_fraction = |weight: f32| (0.0..=1.001).contains(&weight);
    let mut all = neighbours.list.iter();
    demand(all.all(|neighbour| is_point(neighbour.record) && is_fraction(neighbour.weight)), "neighbours")?;
    let clusters = contents.hvds.areas_m2.len();
    let mut near = contents.near_clusters.iter().chain(&contents.near_patches);
    let is_near = near
        .all(|near| (near.cluster as usize) < clusters && is_point(near.record) && near.offset.is_finite());
    demand(is_near, "near clusters")?;
    let mut own = contents.near_clusters.iter();
    demand(own.all(|near| (near.target as usize) < clusters), "targets of near clusters")?;
    let mut patches = (clusters..).zip(&contents.near_patches);
    demand(patches.all(|(target, patch)| patch.target as usize == target), "targets of near patches")?;
    let numbers = &contents.numbers;
    let is_narrow = numbers.narrow_count as usize <= points.len()
        && numbers.narrow_patches as usize <= contents.near_patches.len();
    demand(is_narrow, "records in narrow cavities")
}

fn merged_rays(contents: &Contents, scene: &Scene) -> Result<(), CacheMiss> {
    let lists = &contents.merged_rays;
    let materials = scene.materials.len();
    let packing = contents.packing(scene).map_err(|_| CacheMiss::damaged("bits of a material"))?;
    demand(packing.cluster_bits == contents.numbers.cluster_bits, "bits of a cluster")?;
    demand(contents.numbers.min_distance.is_finite(), "unit of gradients")?;
    let is_target =
        |&word: &u32| packing.unpack(word).is_some_and(|(_, met)| (met.material as usize) < materials);
    demand(
        lists.targets.is_sorted_by(|a, b| a < b) && lists.targets.iter().all(is_target),
        "gather targets",
    )?;
    let total: u64 = lists.counts.iter().map(|&count| u64::from(count)).sum();
    let are_all =
        lists.counts.len() == contents.cache_points.len() && total == lists.merged_rays.len() as u64;
    demand(are_all && total <= u64::from(u32::MAX), "merged_rays of cache points")?;
    let colours = if has_images(scene) { lists.merged_rays.len() } else { 0 };
    demand(lists.colours.len() == colours, "colours of merged_rays")?;
    let directions = if contents.gloss.is_some() { lists.merged_rays.len() } else { 0 };
    demand(lists.directions.len() == directions, "directions of merged rays")?;
    let target_bits = u32::BITS - (lists.targets.len() as u32).saturating_sub(1).leading_zeros();
    let mask = 1_u32.checked_shl(target_bits).map_or(u32::MAX, |end| end - 1);
    let is_merged_ray = |target_index: u32| ((target_index & mask) as usize) < lists.targets.len();
    demand(lists.merged_rays.iter().all(|merged_ray| is_merged_ray(merged_ray.target_index)), "merged rays")
}
