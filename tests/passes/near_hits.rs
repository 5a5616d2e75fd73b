//! Near hits: rays of a cache point that meet a near cluster read a near-field patch, which the
//! record beside the hit lights.

use crate::common::assert_silent;
use crate::world::{Random, World};
use glam::{DVec3, Vec3};
use lightpaths::cpu::hemisphere::{Strata, frame};
use lightpaths::gpu::Buffer;
use lightpaths::passes::gather_targets::{GatherTarget, GatherTargetPacking, GatherTargets, TargetCounts};
use lightpaths::passes::precompute::Silent;
use lightpaths::passes::precompute::cache_points::Placed;
use lightpaths::passes::precompute::gather_rays::{self, Hemisphere};
use lightpaths::passes::precompute::visibility::near_clusters::{self, Extent};
use lightpaths::passes::precompute::visibility::near_hits::{
    NearHits, Sources, near_clusters as near_clusters_of,
};
use lightpaths::types::{GatherRay, MAY_BE_GLOSSY, NO_TARGET};
use std::collections::HashMap;

const SEED: u32 = 5;
const REACH: f32 = 0.3;
const MIN_RADIUS: f32 = 0.1;

#[test]
fn rays_that_meet_near_clusters_read_entries_of_their_own() {
    for world in [World::room(), World::glossy_room()] {
        near_hits_of(&world);
    }
}

fn near_hits_of(world: &World) {
    let (materials, clusters) = (world.materials.len(), world.hvds.cluster_count());
    let hemisphere = Hemisphere::new(64);
    let strata = Strata { rings: hemisphere.rings, sectors: hemisphere.sectors };
    let packing = GatherTargetPacking::new(clusters, materials, 0.05).unwrap();
    let mut random = Random::new(57);
    let place = |point| Placed { point, clearance: 0.1, spacing: 1.0 };
    let points: Vec<Placed> = world.cache_points(&mut random, 700, 0.2).into_iter().map(place).collect();
    let near_count = 400;
    let cache_points: Vec<_> = points.iter().map(|placed| placed.point).collect();
    let cache_points = Buffer::from_slice(&world.context, "cache points", &cache_points).unwrap();
    let (count, progress) = (points.len() as u32, &mut Silent);
    let table = gather_rays::trace(
        &world.context,
        &world.buffers,
        &world.clusters,
        &cache_points,
        count,
        hemisphere,
        packing,
        SEED,
        progress,
    )
    .unwrap();
    let before: Vec<GatherRay> = table.read().unwrap();
    let clearances = vec![0.1; world.hvds.fragments.len()];
    let patches = near_clusters::patches(
        &world.hvds,
        &clearances,
        |side| world.geometry().normal(side),
        Extent::CONTACTS.levels,
    );
    let sources = Sources {
        patches: &patches,
        materials: &world.materials,
        points: &points,
        near_count,
        min_radius: MIN_RADIUS,
        reach: REACH,
        hemisphere,
        seed: SEED,
    };
    let targets = GatherTargets::of_hits(packing);
    let near = NearHits::find(sources, &table, &targets).unwrap();
    let readers = near.readers.len() as u64;
    let counts = TargetCounts { clusters, patches: near.patches.len() as u32, gloss_bins: 17, sky_side: 0 };
    let packed = GatherTargetPacking::of_counts(counts, materials, 0.05).unwrap();
    let targets = targets.with(GatherTarget::Patch, near.readers.clone());
    let after: Vec<GatherRay> = targets.packed(&packed, 0, &before).into_owned();
    let patch_clusters = near_clusters_of(&near.patches, &packed);

    let may_be_glossy = |material: u32| world.reflectances()[material as usize].flags & MAY_BE_GLOSSY != 0;
    let mut places: HashMap<u32, Vec<(u32, DVec3)>> = HashMap::new();
    let mut untouched = 0;
    for (index, (before, after)) in (0..).zip(before.iter().zip(&after)) {
        let (point, ray) = (index / strata.rays(), index % strata.rays());
        assert_eq!(before.gradient, after.gradient);
        let Some((GatherTarget::Cluster(cluster), met)) = packing.unpack(before.target) else {
            assert_eq!(after.target, NO_TARGET);
            continue;
        };
        let (read, same) = packed.unpack(after.target).unwrap();
        assert_eq!(met, same);
        let from = &points[point as usize].point;
        let GatherTarget::Patch(read) = read else {
            assert_eq!(read, GatherTarget::Cluster(cluster));
            untouched += 1;
            continue;
        };
        assert!(point < near_count && !met.is_far && !may_be_glossy(met.material));
        let patch = &patches[cluster as usize];
        assert!(from.position.distance(patch.middle) < REACH);
        let entry = &patch_clusters[read as usize];
        assert_eq!((entry.cluster, entry.target), (cluster, packed.number(GatherTarget::Patch(read))));
        let direction = frame(from.normal) * strata.direction(ray, from.stream, SEED);
        let normal = world.geometry().normal(from.side);
        let origin = world.geometry().offset_origin(from.position, normal);
        let hit = world.geometry().closest(origin, direction).expect("a ray with a target met something");
        places.entry(read).or_default().push((point, hit.position));
    }
    assert_eq!(places.len(), near.patches.len(), "each entry has a reader");
    assert_eq!(places.values().map(|rays| rays.len() as u64).sum::<u64>(), readers);
    let (mut errors, mut widths) = (0.0, 0.0);
    for (read, rays) in &places {
        let entry = &near.patches[*read as usize];
        let patch = &patches[entry.cluster as usize];
        assert!(rays.iter().all(|ray| ray.0 == rays[0].0), "an entry is one point's");
        let hit = rays.iter().map(|ray| ray.1).sum::<DVec3>() / rays.len() as f64;
        let record = &points[entry.record as usize].point;
        let place = record.position + entry.offset;
        errors += (place.as_dvec3() - hit).length_squared();
        widths += f64::from(patch.high.distance_squared(patch.low));
        let speaks = |point: &&Placed| {
            let (point, apart) = (&point.point, place - point.point.position);
            (point.side % 2 == 1) == patch.is_back
                && apart.length() < 1.5 * point.radius
                && point.normal.dot(patch.normal) >= 0.8
                && apart.dot(point.occluder) <= 1.0
        };
        let distances = points.iter().filter(speaks).map(|placed| placed.point.position.distance(place));
        let nearest = distances.fold(f32::INFINITY, f32::min);
        assert!((entry.offset.length() - nearest).abs() < 1e-5, "{} {nearest}", entry.offset.length());
        assert!(entry.offset.length() < 2.0 * MIN_RADIUS);
    }
    let fraction = (errors / widths).sqrt();
    println!(
        "{} entries of {readers} rays, {untouched} others, off by {fraction:.3} of a cell",
        places.len()
    );
    // Clusters that hold two facets have no plane.
    assert!(places.len() > 30 && untouched > 1000 && fraction < 0.1, "{fraction}");
    assert_silent(&world.context);
}

#[test]
fn without_near_points_all_stays() {
    let world = World::room();
    let hemisphere = Hemisphere::new(16);
    let packing = GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
    let cache_points = Buffer::from_slice::<Vec3>(&world.context, "cache points", &[]).unwrap();
    let (context, buffers, clusters) = (&world.context, &world.buffers, &world.clusters);
    let table = gather_rays::trace(
        context,
        buffers,
        clusters,
        &cache_points,
        0,
        hemisphere,
        packing,
        SEED,
        &mut Silent,
    );
    let (table, materials) = (table.unwrap(), &world.materials);
    let (patches, points) = (&[], &[]);
    let sources = Sources {
        patches,
        materials,
        points,
        near_count: 0,
        min_radius: MIN_RADIUS,
        reach: REACH,
        hemisphere,
        seed: SEED,
    };
    let near = NearHits::find(sources, &table, &GatherTargets::of_hits(packing)).unwrap();
    assert!(near.patches.is_empty() && near.readers.is_empty());
    assert_eq!(near.patches_of(0, hemisphere), 0);
}
