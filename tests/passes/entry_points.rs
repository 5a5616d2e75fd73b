//! Entry points sample the surface: at any density, their areas add up to it.

use crate::common::assert_silent;
use crate::world::World;
use glam::{DVec3, Vec3};
use lightpaths::passes::precompute::entry_points::{self, DENSEST, Strata, density, place};
use lightpaths::scene::naming::{HALF_STEP, Naming};

const SEED: u32 = 11;
const NAMINGS: [Naming; 2] = [Naming::Number, Naming::Place];

/// A smooth density over the fragments, over the whole range.
fn smooth_densities(world: &World) -> Vec<f32> {
    let density = |corners: &Vec<Vec3>| {
        let middle = corners.iter().sum::<Vec3>() / corners.len() as f32;
        1.0 + (DENSEST - 1.0) * (0.5 + 0.5 * (3.0 * middle.x + 2.0 * middle.y).sin())
    };
    world.hvds.fragments.iter().map(|fragment| density(&fragment.corners)).collect()
}

#[test]
fn density_is_bounded_and_grows_as_the_clearance_shrinks() {
    let cell = 0.1;
    assert_eq!([1.0, 0.1, 0.2].map(|clearance| density(clearance, cell)), [1.0; 3]);
    assert!((density(0.05, cell) - 4.0).abs() < 1e-5);
    assert_eq!([1e-3, 0.0, f32::MIN_POSITIVE].map(|clearance| density(clearance, cell)), [DENSEST; 3]);
    assert_eq!(density(f32::INFINITY, cell), 1.0);
}

#[test]
fn runs_are_as_long_as_area_and_density_say() {
    let world = World::room();
    let smooth = smooth_densities(&world);
    for (densities, naming) in [&world.densities, &smooth].into_iter().flat_map(|d| NAMINGS.map(|n| (d, n))) {
        for count in [1, 997, 20_000] {
            let strata = Strata::new(&world.hvds, densities, |_| 1.0, count, (SEED, naming));
            assert_eq!(strata.point_offsets.len(), strata.patches.len() + 1);
            assert!(strata.point_offsets[0] == 0 && strata.point_offsets.is_sorted());
            // Named by place, sums over the scene are rounded.
            let off = |value: f64, of: f64| (value / of - 1.0).abs();
            let rounding = if naming == Naming::Place { 1.01 * HALF_STEP } else { 1e-5 };
            let area: f64 = world.hvds.fragments.iter().map(|fragment| fragment.area_m2).sum();
            assert!(off(strata.area_m2, area) <= rounding);
            let expected: f32 = strata.in_clusters[..world.hvds.unweighted.len()].iter().sum();
            assert!(off(f64::from(count), expected.into()) <= rounding, "{expected} of {count}");
            if naming == Naming::Number {
                assert_eq!(strata.point_offsets[strata.patches.len()], count);
            }

            // The points of a cluster are contiguous: each end is right to half a point. Named by
            // place, that holds for each block.
            let mut blocks = vec![1_u32; world.hvds.cluster_count() as usize];
            for level in 4..if naming == Naming::Place { world.hvds.levels.len() } else { 0 } {
                for cluster in world.hvds.levels[level].clone() {
                    let children = world.hvds.children_of(cluster).iter();
                    blocks[cluster as usize] = children.map(|&child| blocks[child as usize]).sum();
                }
            }
            let mut held = vec![0_u32; world.hvds.cluster_count() as usize];
            let mut order: Vec<_> = world.hvds.fragments.iter().collect();
            order.sort_by_key(|fragment| fragment.cluster);
            let fans = order.iter().flat_map(|fragment| vec![fragment.cluster; fragment.corners.len() - 2]);
            for (cluster, run) in fans.zip(strata.point_offsets.windows(2)) {
                let mut cluster = cluster as usize;
                while let Some(sum) = held.get_mut(cluster) {
                    *sum += run[1] - run[0];
                    cluster = world.hvds.parents[cluster] as usize;
                }
            }
            for (cluster, (&held, &expected)) in held.iter().zip(&strata.in_clusters).enumerate() {
                if !holds_fragments(&world, cluster) {
                    continue;
                }
                // Areas of fragments are f64; areas of their fans come from f32 corners.
                let off = (held as f32 - expected).abs();
                let bound = 1.01 * blocks[cluster] as f32 + 1e-4 * count as f32;
                assert!(off <= bound, "cluster {cluster}: {held} for {expected}");
            }
        }
    }
}

#[test]
fn placed_points_fall_into_the_clusters_that_they_were_dealt_to() {
    let world = World::room();
    for naming in NAMINGS {
        let strata = Strata::new(&world.hvds, &world.densities, |_| 1.0, 20_011, (SEED, naming));
        let points = place(&world.context, &world.buffers, &world.clusters, &strata, SEED).unwrap();
        let mut held = vec![0_u32; world.hvds.cluster_count() as usize];
        for point in &points {
            let mut cluster = point.cluster as usize;
            while let Some(sum) = held.get_mut(cluster) {
                *sum += 1;
                cluster = world.hvds.parents[cluster] as usize;
            }
        }
        // A point that is moved slightly off an edge may cross into the next cell.
        let is_off = |cluster: &usize| (held[*cluster] as f32 - strata.in_clusters[*cluster]).abs() > 2.0;
        // Named by place, wider clusters consist of blocks with points of their own.
        let end = if naming == Naming::Place { world.hvds.levels[3].end as usize } else { held.len() };
        let off = (0..end).filter(|&cluster| holds_fragments(&world, cluster)).filter(is_off).count();
        assert!(off * 100 <= held.len(), "{off} of {} clusters hold two points more or less", held.len());
    }
    assert_silent(&world.context);
}

/// Unweighted clusters have the fragments of their clusters.
fn holds_fragments(world: &World, cluster: usize) -> bool {
    let mut base = cluster as u32;
    while let Some(&child) = world.hvds.children_of(base).first() {
        base = child;
    }
    (base as usize) < world.hvds.unweighted.len()
}

/// ∫ f dA over all fragments, each cut into small triangles.
fn integral(world: &World, f: impl Fn(DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for fragment in &world.hvds.fragments {
        let corners: Vec<DVec3> = fragment.corners.iter().map(|corner| corner.as_dvec3()).collect();
        for fan in corners.windows(2).skip(1) {
            let [a, b, c] = [corners[0], fan[0], fan[1]];
            let area = 0.5 * (b - a).cross(c - a).length();
            // Exact for quadratic functions.
            sum += area / 3.0 * (f(0.5 * (a + b)) + f(0.5 * (b + c)) + f(0.5 * (c + a)));
        }
    }
    sum
}

#[test]
fn weighted_points_integrate_over_the_area() {
    let world = World::room();
    let count = 30_011;
    let densities =
        [vec![1.0; world.hvds.fragments.len()], smooth_densities(&world), world.densities.clone()];
    for (densities, naming) in
        densities.iter().flat_map(|densities| NAMINGS.map(|naming| (densities, naming)))
    {
        let strata = Strata::new(&world.hvds, densities, |_| 1.0, count, (SEED, naming));
        let points = place(&world.context, &world.buffers, &world.clusters, &strata, SEED).unwrap();
        let lightest = points.iter().map(|point| point.weight).fold(f32::INFINITY, f32::min);
        let heaviest = points.iter().map(|point| point.weight).fold(0.0, f32::max);
        assert!(heaviest <= lightest * DENSEST * 1.001);
        let functions: [(&str, &dyn Fn(DVec3) -> f64); 3] = [
            ("area", &|_| 1.0),
            ("slope", &|p| 2.0 + p.x + 0.5 * p.y - 0.3 * p.z),
            ("bowl", &|p| 0.1 + p.x * p.x + 0.7 * p.z * p.z),
        ];
        for (name, f) in functions {
            let sum: f64 = points.iter().map(|p| f64::from(p.weight) * f(p.position.as_dvec3())).sum();
            let (estimate, exact) = (sum * strata.area_m2 / f64::from(count), integral(&world, f));
            let error = estimate / exact - 1.0;
            println!("{name}, weights {lightest:.3} to {heaviest:.3}: {:+.4} %", 100.0 * error);
            assert!(error.abs() < 3e-3, "{name}: {estimate} for {exact}");
        }
    }
    assert_silent(&world.context);
}

#[test]
fn another_seed_gives_other_points_and_the_same_seed_the_same() {
    let world = World::room();
    let strata = Strata::new(&world.hvds, &world.densities, |_| 1.0, 501, (SEED, Naming::Number));
    let points = |seed| {
        let placed = place(&world.context, &world.buffers, &world.clusters, &strata, seed).unwrap();
        placed.iter().map(|point| point.position).collect::<Vec<_>>()
    };
    assert!(points(1) == points(1) && points(1) != points(2));
    let mut curve = points(1);
    entry_points::sort_along_curve(&mut curve, &world.hvds.grid, |position| *position);
    assert!(curve == points(1), "they come in Morton order");
    assert_silent(&world.context);
}
