//! Reference of the volumetric hierarchy of a frame.

use crate::scene::hvds::Hvds;
use crate::types::{Contribution, ContributionRange, NO_CLUSTER, OPEN};
use glam::{DVec3, Vec3};

/// Weighted throughput of a contribution to its cluster.
fn weighted(contribution: &Contribution, range: &ContributionRange) -> DVec3 {
    let counts = if range.is_unweighted == 1 {
        1.0
    } else {
        f64::from(contribution.accessibility()) / f64::from(OPEN)
    };
    counts * contribution.throughput.as_dvec3()
}

/// Sums of a range over entry points and over other vertices; `light` of a path at its entry point
/// and behind it.
fn sums(
    of_cluster: &ContributionRange,
    contributions: &[Contribution],
    light: [&dyn Fn(usize) -> DVec3; 2],
) -> [DVec3; 2] {
    let sum = |range: std::ops::Range<u32>, light: &dyn Fn(usize) -> DVec3| -> DVec3 {
        let contributions = &contributions[range.start as usize..range.end as usize];
        contributions
            .iter()
            .map(|contribution| weighted(contribution, of_cluster) * light(contribution.path() as usize))
            .sum()
    };
    [
        sum(of_cluster.first..of_cluster.first_other, light[0]),
        sum(of_cluster.first_other..of_cluster.end, light[1]),
    ]
}

/// Flux of every cluster, W, direct and indirect: a base cluster sums its contributions, a coarser
/// one sums all base clusters below it. `path_flux` of each path at its entry point, and behind it.
pub fn cluster_flux(
    hvds: &Hvds,
    path_flux: [&[Vec3]; 2],
    ranges: &[ContributionRange],
    contributions: &[Contribution],
) -> Vec<[DVec3; 2]> {
    let mut flux = vec![[DVec3::ZERO; 2]; hvds.cluster_count() as usize];
    let [at_entry, behind] = path_flux.map(|flux| move |path: usize| flux[path].as_dvec3());
    for (base, range) in ranges.iter().enumerate() {
        let own = sums(range, contributions, [&at_entry, &behind]);
        let mut cluster = base;
        while let Some(sum) = flux.get_mut(cluster) {
            *sum = [sum[0] + own[0], sum[1] + own[1]];
            cluster = hvds.parents[cluster] as usize;
        }
    }
    flux
}

/// Flux that each base cluster receives from one light, per unit of its emission and of the mean
/// area of an entry point: at entry points, and at other vertices. `factors`: form factor of each
/// path's entry point; `first_bounce`: outgoing flux after the first bounce.
pub fn light_flux(
    factors: &[f32],
    first_bounce: &[Vec3],
    ranges: &[ContributionRange],
    contributions: &[Contribution],
) -> Vec<[DVec3; 2]> {
    let direct = |path: usize| DVec3::splat(f64::from(factors[path]));
    let behind = |path: usize| first_bounce[path].as_dvec3();
    ranges.iter().map(|range| sums(range, contributions, [&direct, &behind])).collect()
}

/// For each cluster, the smallest enclosing one, itself included, that reaches the minimum count
/// `least` of vertices that are no entry points; the root if none does. The expected count is the
/// area fraction of the smallest enclosing cluster with `around` times the minimum. The actual
/// count must also reach 1/`share` of the minimum.
pub fn indirect_sources(
    hvds: &Hvds,
    ranges: &[ContributionRange],
    least: u32,
    [around, fraction]: [u32; 2],
) -> Vec<u32> {
    let mut vertices = vec![0; hvds.cluster_count() as usize];
    for (base, range) in ranges.iter().enumerate() {
        let mut cluster = base;
        while let Some(sum) = vertices.get_mut(cluster) {
            *sum += range.end - range.first_other;
            cluster = hvds.parents[cluster] as usize;
        }
    }
    let has_min_count = |cluster: u32| {
        let mut wide = cluster as usize;
        while vertices[wide] < around * least && hvds.parents[wide] != NO_CLUSTER {
            wide = hvds.parents[wide] as usize;
        }
        let area = |cluster: usize| f64::from(hvds.areas_m2[cluster]);
        let is_expected = f64::from(vertices[wide]) * area(cluster as usize) >= f64::from(least) * area(wide);
        is_expected && fraction * vertices[cluster as usize] >= least
    };
    let source = |cluster: u32| {
        let mut source = cluster;
        while !has_min_count(source) && hvds.coarser(source) != NO_CLUSTER {
            source = hvds.coarser(source);
        }
        source
    };
    (0..hvds.cluster_count()).map(source).collect()
}

/// Factor from flux to irradiance of a cluster, 1/m²: its inverse shown area; the area of a root is
/// at least `min_area_m2`. Zero for a cluster without area.
pub fn inverse_area(hvds: &Hvds, shown_m2: &[f32], cluster: usize, min_area_m2: f32) -> f64 {
    let is_root = hvds.parents[cluster] == NO_CLUSTER;
    let area_m2 = f64::from(shown_m2[cluster].max(if is_root { min_area_m2 } else { 0.0 }));
    if area_m2 > 0.0 { 1.0 / area_m2 } else { 0.0 }
}

/// Irradiance of every cluster, W/m²: its own direct flux and the indirect flux of its source,
/// each over its area.
pub fn irradiance(
    hvds: &Hvds,
    shown_m2: &[f32],
    flux: &[[DVec3; 2]],
    sources: &[u32],
    min_area_m2: f32,
) -> Vec<DVec3> {
    let inverse = |cluster: usize| inverse_area(hvds, shown_m2, cluster, min_area_m2);
    let of_cluster = |(cluster, &source): (usize, &u32)| {
        let source = source as usize;
        inverse(cluster) * flux[cluster][0] + inverse(source) * flux[source][1]
    };
    sources.iter().enumerate().map(of_cluster).collect()
}
