//! Directional proxies of clusters: their irradiance and their weights.

use crate::common::assert_silent;
use crate::world::{Random, SUM, World, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::hemisphere::{Strata, frame};
use lightpaths::gpu::Buffer;
use lightpaths::passes::ClusterTables;
use lightpaths::passes::frame::cluster_proxies::{ClusterProxies, ProxyTermPacking};
use lightpaths::passes::gather_targets::{GatherTarget, GatherTargetPacking, GatherTargets};
use lightpaths::passes::precompute::gather_rays::{self, Hemisphere, RayTable};
use lightpaths::passes::precompute::visibility::cluster_proxies::{self, ProxyTables};
use lightpaths::passes::precompute::{Silent, rays::Rays};
use lightpaths::scene::{Scene, directions::Directions, shapes};
use lightpaths::types::CachePoint;

#[test]
fn irradiance_of_views_equals_the_reference() {
    let world = World::room();
    let mut random = Random::new(101);
    let clusters = world.hvds.cluster_count();
    for count in [0, 1, 63, 64, 65, 997] {
        let mut term_offsets = vec![0];
        let packing = ProxyTermPacking::new(clusters);
        let mut terms = Vec::new();
        for _ in 0..count {
            let term = |_| packing.pack(random.below(clusters), 1 + random.below(packing.steps()));
            terms.extend((0..=count % 7).map(term));
            term_offsets.push(terms.len() as u32);
        }
        let irradiance: Vec<Vec3> = (0..clusters + count).map(|_| 1.0 + random.cube()).collect();
        let buffer = Buffer::from_slice(&world.context, "irradiance", &irradiance).unwrap();
        let pass = ClusterProxies::new(&world.context, clusters, &term_offsets, &terms, packing).unwrap();
        world.context.run(|rec| pass.record(rec, &buffer)).unwrap();
        let found: Vec<Vec3> = buffer.read().unwrap();
        let (kept, proxies) = found.split_at(clusters as usize);
        assert!(*kept == irradiance[..clusters as usize], "clusters keep what they have");
        for (device, run) in proxies.iter().zip(term_offsets.windows(2)) {
            let terms = &terms[run[0] as usize..run[1] as usize];
            let shown = |&term: &u32| (irradiance[packing.cluster(term) as usize], packing.weight(term));
            let reference = cpu::cluster_proxies::proxy(terms.iter().map(shown));
            assert_near(*device, reference, SUM, 0.0, "proxy");
        }
    }
    assert_silent(&world.context);
}

/// Few wide rays, which read coarse clusters.
const HEMISPHERE: u32 = 16;
const SEED: u32 = 5;

/// Proxies of some cache points, and their rays with targets before and after.
struct Made {
    world: World,
    points: Vec<CachePoint>,
    tables: ProxyTables,
    rays: RayTable,
    before: Vec<Option<(GatherTarget, u32)>>,
    after: Vec<Option<(GatherTarget, u32)>>,
    packing: GatherTargetPacking,
}

fn make(scene: &Scene) -> Made {
    let world = World::new(scene, 32);
    // Many entry points in every cluster: all proxies reach the minimum count, and no ray reads a
    // cluster coarser than its footprint.
    let many = vec![1e3; world.in_clusters.len()];
    let points = world.cache_points(&mut Random::new(102), 1_000, 0.1);
    let buffer = Buffer::from_slice(&world.context, "cache points", &points).unwrap();
    let hemisphere = Hemisphere::new(HEMISPHERE);
    let packing = GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.01).unwrap();
    let clusters = ClusterTables::new(&world.hvds, &many).upload(&world.context).unwrap();
    let rays = gather_rays::trace(
        &world.context,
        &world.buffers,
        &clusters,
        &buffer,
        points.len() as u32,
        hemisphere,
        packing,
        SEED,
        &mut Silent,
    )
    .unwrap();
    let traced = rays.read().unwrap();
    let targets = GatherTargets::of_hits(packing);
    let before = targets.of_rays(0, &traced);
    let sources = cluster_proxies::Sources {
        hvds: &world.hvds,
        in_clusters: &many,
        surfaces: &world.surfaces,
        materials: &world.materials,
        cache_points: &points,
        hemisphere,
        seed: SEED,
        directions: Directions::new(256),
        clear_distance: world.clear_distance,
    };
    let tracer = Rays::of_segments(&world.context).unwrap();
    let (tables, readers) =
        cluster_proxies::build((&tracer, &world.buffers), sources, &rays, &targets, &mut Silent).unwrap();
    let after = targets.with(GatherTarget::Proxy, readers).of_rays(0, &traced);
    assert_silent(&world.context);
    Made { world, points, tables, rays, before, after, packing }
}

#[test]
fn a_closed_room_without_furniture_has_no_views() {
    let made = make(&shapes::closed_box(Vec3::new(2.0, 1.5, 1.0), 0.7));
    assert!(made.tables.is_empty() && made.tables.count() == 0);
    assert_eq!(made.before, made.after);
}

#[test]
fn weights_of_a_view_are_what_its_readers_see() {
    let made = make(&shapes::hidden_light(0.8, 0.16, 0.5));
    let (world, tables) = (&made.world, &made.tables);
    assert!(tables.count() > 50 && tables.pairs.is_sorted());
    for run in tables.term_offsets.windows(2) {
        let terms = &tables.terms[run[0] as usize..run[1] as usize];
        let sum: f64 = terms.iter().map(|&term| f64::from(tables.packing.weight(term))).sum();
        assert!(sum == 1.0 && terms.len() <= 64, "{sum} of {} terms", terms.len());
    }

    // Each ray reads the same cluster or a proxy of it, and the proxy shows the surface that
    // the ray hits.
    let is_below = |mut term: u32, cluster: u32| {
        while term < cluster {
            term = world.hvds.parents[term as usize];
        }
        term == cluster
    };
    let Hemisphere { rings, sectors } = Hemisphere::new(HEMISPHERE);
    let strata = Strata { rings, sectors };
    let mut readers: Vec<Vec<DVec3>> = vec![Vec::new(); tables.pairs.len()];
    for (index, (&before, &after)) in made.before.iter().zip(&made.after).enumerate() {
        let (Some((old, material)), Some((new, same))) = (before, after) else {
            assert_eq!(before, after);
            continue;
        };
        assert_eq!(material, same);
        let GatherTarget::Cluster(cluster) = old else { panic!("a ray meets {old:?}") };
        let point = &made.points[index / HEMISPHERE as usize];
        let back = -(frame(point.normal)
            * strata.direction(index as u32 % HEMISPHERE, index as u32 / HEMISPHERE, SEED));
        let key = [cluster, Directions::new(256).bin(back)];
        let found = tables.pairs.binary_search_by_key(&key, |pair| [pair[0], pair[1]]);
        let GatherTarget::Proxy(proxy) = new else {
            assert_eq!(old, new);
            continue;
        };
        let pair = found.expect("who reads a proxy is of one of its pairs");
        assert_eq!(tables.pairs[pair][2], proxy);
        readers[pair]
            .push(point.position.as_dvec3() + f64::from(world.clear_distance) * point.normal.as_dvec3());
    }
    let (mut fractions, mut wrong) = (0, 0);
    for (pair, readers) in tables.pairs.iter().zip(&readers).step_by(7) {
        assert!(!readers.is_empty());
        let run = &tables.term_offsets[pair[2] as usize..][..2];
        let terms = &tables.terms[run[0] as usize..run[1] as usize];
        assert!(terms.iter().all(|&term| is_below(tables.packing.cluster(term), pair[0])));
        // The visibility of each child from all readers, sampled with many points, compared
        // with the proxy.
        let children =
            world.hvds.child_offsets[pair[0] as usize]..world.hvds.child_offsets[pair[0] as usize + 1];
        let seen = |cluster: u32| -> f64 {
            let of_reader = |&reader: &DVec3| {
                cpu::cluster_proxies::seen_area(world.geometry(), &world.hvds, cluster, reader, 4)[0]
            };
            readers.iter().map(of_reader).sum()
        };
        let seen: Vec<f64> = children.clone().map(seen).collect();
        let all: f64 = seen.iter().sum();
        for (child, seen) in children.zip(seen) {
            let weights = terms.iter().filter(|&&term| is_below(tables.packing.cluster(term), child));
            let weight: f64 = weights.map(|&term| f64::from(tables.packing.weight(term))).sum();
            fractions += 1;
            // Each child has eight samples: errors of a tenth in the weights are rare.
            wrong += u32::from((weight - seen / all).abs() > 0.1);
        }
    }
    println!("{wrong} of {fractions} shares off by more than a tenth");
    assert!(fractions > 100 && wrong * 50 <= fractions, "{wrong} of {fractions}");
}

#[test]
fn views_are_the_same_each_time() {
    let [a, b] = [0; 2].map(|_| make(&crate::world::room()));
    assert!(!a.tables.is_empty() && a.tables.terms.len() == b.tables.terms.len());
    assert_eq!((&a.tables.pairs, &a.tables.term_offsets), (&b.tables.pairs, &b.tables.term_offsets));
    assert_eq!(a.tables.terms, b.tables.terms);
    assert_eq!(a.after, b.after);

    // Rays of the same points, redirected like rays of other points, read the same proxies.
    let (hemisphere, targets) = (Hemisphere::new(HEMISPHERE), GatherTargets::of_hits(a.packing));
    let directions = (SEED, Directions::new(256));
    let readers = a.tables.readers(&a.rays, &targets, &a.points, hemisphere, directions).unwrap();
    let traced = a.rays.read().unwrap();
    let found = targets.with(GatherTarget::Proxy, readers).of_rays(0, &traced);
    let differing = found.iter().zip(&a.after).filter(|(a, b)| a != b).count();
    // A ray without occluders may share a pair with a ray that has some.
    assert!(differing * 10 <= a.tables.readers as usize, "{differing} of {}", a.tables.readers);
}
