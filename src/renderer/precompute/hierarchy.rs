//! Second step: the cells of the volumetric hierarchy, and how entry points are spread over it.

use super::surfaces::Reachable;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::passes::precompute::cache_points::SizeField;
use crate::passes::precompute::entry_points::{self, Strata};
use crate::passes::precompute::gather_rays::{Hemisphere, MIN_ENTRY_POINTS};
use crate::passes::precompute::geometry::Geometry;
use crate::passes::precompute::kept::Kept;
use crate::passes::precompute::visibility::near_clusters::{self, Extent, Patch};
use crate::passes::precompute::visibility::{Visibility, exposed_fractions, inconsistent, narrow_cavities};
use crate::passes::precompute::{Progress, begin_stage};
use crate::passes::{ClusterBuffers, ClusterTables};
use crate::renderer::quality_warnings::{typical_clearance, undersampled, wide_cells};
use crate::scene::fragment::Fragment;
use crate::scene::split_planes::{Splits, Walls};
use crate::scene::{Measure, Quality, Scene, grid, hvds::Hvds, surfaces, unweighted::NEARBY};
use std::borrow::Cow;
use std::sync::Arc;

/// Entry points that each cluster at a split plane must hold before a gather ray reads it. The
/// coarser cluster around it also holds the other side of the plane.
const MIN_APART: f32 = 3.0;

/// Whether only direct light is rendered: no pass reads clusters then.
pub(super) fn is_direct(scene: &Scene) -> bool {
    scene.quality.entry_points == 0 && scene.quality.cache_points == 0
}

/// Surface in cells, without interior surface.
pub(super) struct Cells {
    /// Cells of the requested size.
    pub(super) requested: Hvds,
    /// Cells of the finest level.
    pub(super) finest: Hvds,
    /// Width of the narrow cavity around each light, metres.
    pub(super) gaps: Vec<f32>,
}

impl Cells {
    pub(super) fn new(
        scene: &Scene,
        reachable: &Reachable,
        kept: Option<&Kept>,
        progress: &mut dyn Progress,
    ) -> Result<Self> {
        begin_stage(progress, "cells", 1)?;
        let (low, high) = scene.bounds();
        let is_direct = is_direct(scene);
        // Clusters take most of the time of a picture with direct light alone, and none is read.
        let surfaces = &reachable.surfaces;
        let clustered =
            if is_direct { surfaces::one_side(surfaces).into() } else { Cow::Borrowed(&surfaces[..]) };
        let build = |cells| {
            let cells = grid::Cells::new(low, high, cells, &scene.cell_sizes);
            let hvds = Hvds::build_with(&scene.triangles, &clustered, &cells, splits(&scene.quality));
            if is_direct {
                return Ok(hvds);
            }
            let geometry = reachable.geometry(scene, &hvds);
            let exposed =
                exposed_fractions::exposed_fractions(&geometry, reachable.tracer(), &scene.quality, kept)?;
            Ok::<_, Error>(hvds.without_interior(&exposed))
        };
        // Neither needs the other, and parts of each run on one core.
        let (requested, finest) = std::thread::scope(|threads| {
            let requested = threads.spawn(|| build(scene.quality.cells));
            let finest = build(grid::finest_cells(scene.quality.cells));
            (requested.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), finest)
        });
        let (requested, finest) = (requested?, finest?);
        let gaps = narrow_cavities::find(&reachable.rays, &reachable.buffers, &scene.lights)?;
        Ok(Self { requested, finest, gaps })
    }
}

/// What splits base clusters at these settings.
fn splits(quality: &Quality) -> Splits {
    let walls = match quality.takes(Measure::SplitPlanes) {
        true if quality.gap_rounds > 0 => Walls::All,
        true => Walls::Sheets,
        false => Walls::None,
    };
    Splits { walls, are_stacked: quality.takes(Measure::StackedSurfaces) }
}

/// The hierarchy, with the budget of entry points in it. No later step changes it.
pub(super) struct Hierarchy {
    pub(super) hvds: Hvds,
    pub(super) strata: Strata,
    pub(super) tables: ClusterTables,
    pub(super) clusters: ClusterBuffers,
    pub(super) hemisphere: Hemisphere,
    /// Positions and orientations of clusters of the finest levels.
    pub(super) patches: Vec<Patch>,
    /// Which small clusters take the irradiance of the record beside them.
    pub(super) extent: Extent,
    /// Size of a requested cell, metres.
    pub(super) cell_size: f32,
    /// Median clearance of the surface, metres.
    pub(super) clearance: f64,
    /// Area that each entry point stands for.
    pub(super) area_m2: f32,
}

impl Hierarchy {
    /// Distributes entry points over `cells`, and tests clusters for inconsistent visibility. Also
    /// returns warnings about settings that do not resolve the scene.
    pub(super) fn new(
        context: &Arc<Context>,
        scene: &Scene,
        reachable: &Reachable,
        (cells, gaps): (Hvds, &[f32]),
        (size_field, geometry): (&SizeField<'_>, &Geometry<'_>),
    ) -> Result<(Self, Vec<String>)> {
        let quality = &scene.quality;
        let cell_size = geometry.hvds.grid.cell_size() as f32;
        let clearances = size_field.clearances_of(geometry, &cells);
        let has_unweighted = has_unweighted(quality, &cells, &clearances);
        let cells = cells.with_unweighted(&has_unweighted);
        let is_even = !quality.takes(Measure::DenserEntryPoints);
        let nominal = |fragment: &Fragment| scene.cell_sizes.nominal_weight(fragment.middle());
        let density = |fragment: &Fragment, clearance: f32| {
            let close = match is_even {
                true => 1.0,
                false => entry_points::density(clearance, cell_size * cells.scale_of(fragment.cluster)),
            };
            close / nominal(fragment) as f32
        };
        // Paths from a side that sees the sky alone reach no surface.
        let reflects = |fragment: &&Fragment| reachable.reflects(fragment.side);
        let is_any = cells.fragments.iter().any(|fragment| reflects(&fragment));
        let of_fragment = |(fragment, &clearance): (&Fragment, &f32)| match reflects(&fragment) || !is_any {
            true => density(fragment, clearance),
            false => 0.0,
        };
        let densities: Vec<f32> = cells.fragments.iter().zip(&clearances).map(of_fragment).collect();
        let strata =
            Strata::new(&cells, &densities, nominal, quality.entry_points, (quality.seed, scene.naming()));
        let hemisphere = Hemisphere::new(quality.gather_rays);
        let finest_size = cells.grid.cell_size() as f32;
        let [resolved, parted] = narrow_cavities::resolved(scene.span_m(), finest_size, hemisphere);
        let clearance = typical_clearance(&cells.fragments, &clearances);
        let mut warnings = Vec::new();
        if !is_direct(scene) {
            warnings.extend(undersampled(scene, gaps, resolved, strata.area_m2, cell_size));
            warnings.extend(wide_cells(clearance, &cells.grid, quality.cells));
        }
        let parted = quality.occlusion.then_some(parted);
        let Visibility { patches, inconsistent } =
            visibility(quality, reachable, &cells, &clearances, &strata, parted)?;
        let hvds = cells.with_inconsistent(inconsistent);
        let tables = ClusterTables::new(&hvds, &effective_entry_points(&hvds, &strata.in_clusters));
        let hierarchy = Self {
            clusters: tables.upload(context)?,
            tables,
            hemisphere,
            patches,
            extent: if quality.gap_rounds > 1 { Extent::SHADOWS } else { Extent::CONTACTS },
            cell_size,
            clearance,
            area_m2: (strata.area_m2 / f64::from(quality.entry_points.max(1))) as f32,
            strata,
            hvds,
        };
        Ok((hierarchy, warnings))
    }
}

/// Whether each base cluster has an unweighted one: those with close surfaces do.
fn has_unweighted(quality: &Quality, hvds: &Hvds, clearances: &[f32]) -> Vec<bool> {
    let mut has_unweighted = vec![false; hvds.levels[0].len()];
    if !quality.takes(Measure::Accessibility) {
        return has_unweighted;
    }
    for (fragment, &clearance) in hvds.fragments.iter().zip(clearances) {
        has_unweighted[fragment.cluster as usize] |= clearance < NEARBY * hvds.cell_size_of(fragment.cluster);
    }
    has_unweighted
}

/// Number of entry points by which gather rays choose clusters, from the expected ones.
fn effective_entry_points(hvds: &Hvds, in_clusters: &[f32]) -> Vec<f32> {
    let mut counts = in_clusters.to_vec();
    for half in hvds.split_clusters() {
        for cluster in [half, hvds.unweighted[half as usize]] {
            if let Some(count) = counts.get_mut(cluster as usize).filter(|count| **count >= MIN_APART) {
                *count = count.max(MIN_ENTRY_POINTS);
            }
        }
    }
    counts
}

/// Positions of small clusters, and clusters whose parts see different surroundings: in cavities
/// narrower than `parted` metres, and by rays. `None`: no cluster is tested.
fn visibility(
    quality: &Quality,
    reachable: &Reachable,
    hvds: &Hvds,
    clearances: &[f32],
    strata: &Strata,
    parted: Option<f32>,
) -> Result<Visibility> {
    let normal = |side: u32| reachable.surfaces[side as usize / 2].normal_of(side % 2 == 1);
    let patches = near_clusters::patches(hvds, clearances, normal, 1 + inconsistent::levels(hvds));
    let Some(parted) = parted else { return Ok(Visibility { patches, inconsistent: Vec::new() }) };
    let (rays, in_clusters) = (reachable.tracer(), &strata.in_clusters);
    let (surfaces, clear_distance) = (&reachable.surfaces, reachable.clear_distance);
    let mut inconsistent = match quality.takes(Measure::NarrowCavities) {
        true => narrow_cavities::inconsistent(
            rays,
            hvds,
            &patches,
            surfaces,
            in_clusters,
            parted,
            clear_distance,
        )?,
        false => Vec::new(),
    };
    let by_rays = match quality.takes(Measure::InconsistentClusters) {
        true => inconsistent::inconsistent(rays, hvds, &patches, in_clusters)?,
        false => Vec::new(),
    };
    inconsistent.resize(inconsistent.len().max(by_rays.len()), false);
    inconsistent.iter_mut().zip(by_rays).for_each(|(any, by_rays)| *any |= by_rays);
    Ok(Visibility { patches, inconsistent })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Triangle, grid, surfaces};
    use crate::types::NO_CLUSTER;
    use glam::Vec3;

    /// Two squares of 2 m, the upper one 3 cm above the floor, in cells of 2/15 m.
    fn stacked() -> Hvds {
        let square = |y: f32| {
            let p = [[0.0, 0.0], [0.0, 2.0], [2.0, 2.0], [2.0, 0.0]].map(|[x, z]| Vec3::new(x, y, z));
            [[p[0], p[1], p[2]], [p[0], p[2], p[3]]].map(|positions| Triangle {
                positions,
                normals: [Vec3::Y; 3],
                material: 0,
                object: 0,
            })
        };
        let triangles = [square(0.0), square(0.03)].concat();
        let surfaces: Vec<_> = triangles.iter().map(|t| surfaces::surface(t, [true, true])).collect();
        let grid = grid::grid(Vec3::ZERO, Vec3::new(2.0, 1.0, 2.0), 16);
        Hvds::build(&triangles, &surfaces, grid)
    }

    /// Near readers read unweighted clusters. Above the base, these hold both halves, too.
    #[test]
    fn halves_of_split_clusters_are_read_weighted_or_not() {
        let hvds = stacked();
        let hvds = hvds.clone().with_unweighted(&vec![true; hvds.levels[0].len()]);
        let halves: Vec<u32> = hvds.split_clusters().collect();
        let unweighted: Vec<u32> = halves.iter().map(|&half| hvds.unweighted[half as usize]).collect();
        assert!(halves.len() > 100 && !unweighted.contains(&NO_CLUSTER));
        let count = hvds.cluster_count() as usize;
        let effective = effective_entry_points(&hvds, &vec![MIN_APART; count]);
        for cluster in 0..count as u32 {
            let is_half = halves.contains(&cluster) || unweighted.contains(&cluster);
            let expected = if is_half { MIN_ENTRY_POINTS } else { MIN_APART };
            assert_eq!(effective[cluster as usize], expected, "{cluster}");
        }
        let too_few = 0.9 * MIN_APART;
        assert!(effective_entry_points(&hvds, &vec![too_few; count]).iter().all(|&count| count == too_few));
    }
}
