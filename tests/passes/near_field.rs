//! Near field: small clusters that read the record beside them, and the choice of this record.

use crate::common::assert_silent;
use crate::world::{Random, SUM, World, assert_near};
use glam::{DVec3, Mat3, Vec3};
use lightpaths::cpu;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::gpu::{Buffer, SplitBuffer};
use lightpaths::passes::frame::hvds::{ClusterFlux, ClusterLight, ClusterLists, Pyramid};
use lightpaths::passes::frame::near_field::{NearCluster, NearField};
use lightpaths::passes::precompute::cache_points::Placed;
use lightpaths::passes::precompute::visibility::near_clusters::{self, Extent};
use lightpaths::scene::fragment::Fragment;
use lightpaths::types::{Contribution, NO_CLUSTER, OPEN, Record};

#[test]
fn irradiance_of_near_clusters_equals_the_reference() {
    let world = World::room();
    let mut random = Random::new(91);
    let base = world.hvds.levels[0].len();
    // Each base cluster has one entry point, on its own path.
    let lists: Vec<u32> = (0..=2 * base as u32).map(|list| list.div_ceil(2)).collect();
    let contributions: Vec<Contribution> = (0..=base as u32)
        .map(|path| Contribution {
            throughput: Vec3::ONE,
            ..Contribution::new(path.min(base as u32 - 1), OPEN)
        })
        .collect();
    let factors: Vec<f32> = (0..base).map(|_| 1.0 + random.unit()).collect();
    let emission = Vec3::new(0.5, 1.0, 1.5);
    let min_area_m2 = 1e-3;
    let factors = Buffer::from_slice(&world.context, "factors", &factors).unwrap();
    let flux = Pyramid::new_light_flux(&world.context, base as u32).unwrap();
    let light = ClusterLight { factors: &factors, first_bounce: None, flux: &flux };
    let contributions = SplitBuffer::cut(&world.context, "contributions", &contributions, u32::MAX).unwrap();
    for count in [0, 1, 63, 64, 65, 997] {
        let record = |_| Record {
            position: random.cube(),
            irradiance: 100.0 * (1.0 + random.cube()),
            translation: 1e3 * Mat3::from_cols(random.cube(), random.cube(), random.cube()),
            rotation: Mat3::from_cols(random.cube(), random.cube(), random.cube()),
        };
        let records: Vec<Record> = (0..50).map(record).collect();
        let near = |index: u32| NearCluster {
            cluster: 2 * index + 1,
            record: random.below(50),
            offset: 0.2 * random.cube(),
            target: 2 * index + 1,
        };
        let near: Vec<NearCluster> = (0..count).map(near).collect();
        // Patches of clusters, near or not, with entries after all clusters.
        let part = |index: u32| NearCluster {
            cluster: random.below(world.hvds.cluster_count()),
            record: random.below(50),
            offset: 0.2 * random.cube(),
            target: world.hvds.cluster_count() + index,
        };
        let parts: Vec<NearCluster> = (0..count).map(part).collect();
        let pass = NearField::new(&world.context, &near, &parts).unwrap();
        // Before records exist, a near-field patch reads its entry and its cluster's irradiance,
        // and writes its own.
        let moved = u64::from(count) * (size_of::<NearCluster>() + 2 * size_of::<Vec3>()) as u64;
        assert_eq!(pass.bytes(std::iter::empty()), moved);
        let mut pyramid =
            Pyramid::new(&world.context, (&world.hvds, &world.hvds.areas_m2), &lists, min_area_m2, false)
                .unwrap();
        let all = ClusterLists::all(&world.context, &world.hvds.levels).unwrap();
        pyramid.reserve_patches(&world.context, pass.patch_count()).unwrap();
        let buffer = Buffer::from_slice(&world.context, "records", &records).unwrap();
        world
            .context
            .run(|rec| {
                pyramid.record_lights(rec, &[light], &contributions, &all);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pyramid.record_sum(rec, &[(emission, &flux)], &all);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pass.record_patches(rec, &pyramid, None, count);
            })
            .unwrap();
        let plain: Vec<Vec3> = pyramid.irradiance.read().unwrap();
        for part in &parts {
            assert_eq!(plain[part.target as usize], plain[part.cluster as usize], "a part before records");
        }
        world
            .context
            .run(|rec| {
                pass.record(rec, &pyramid, &buffer);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pass.record_patches(rec, &pyramid, Some(&buffer), count);
            })
            .unwrap();
        let flux: Vec<ClusterFlux> = pyramid.flux.read().unwrap();
        let irradiance: Vec<Vec3> = pyramid.irradiance.read().unwrap();
        let direct = |cluster: usize| {
            flux[cluster].direct.as_dvec3()
                * cpu::hvds::inverse_area(&world.hvds, &world.hvds.areas_m2, cluster, min_area_m2)
        };
        let mut dark = 0;
        for (cluster, device) in irradiance.iter().enumerate().take(world.hvds.cluster_count() as usize) {
            // Clusters that are not listed keep their value: direct light alone.
            let mut reference = direct(cluster);
            if let Some(near) = near.iter().find(|near| near.cluster as usize == cluster) {
                let record = &records[near.record as usize];
                reference = cpu::near_field::near_field(direct(cluster), record, near.offset);
                dark += usize::from(reference.cmpeq(direct(cluster)).any());
                // The change may cancel the value.
                let scale = f64::from(record.irradiance.max_element()) + 3.0 * 200.0;
                assert_near(*device, reference, SUM / 10.0, scale, "near cluster");
            } else {
                assert_near(*device, reference, SUM, 0.0, "other cluster");
            }
        }
        for part in &parts {
            let record = &records[part.record as usize];
            let reference = cpu::near_field::near_field(direct(part.cluster as usize), record, part.offset);
            let scale = f64::from(record.irradiance.max_element()) + 3.0 * 200.0;
            assert_near(irradiance[part.target as usize], reference, SUM / 10.0, scale, "part");
        }
        assert!(count < 60 || (dark > 0 && dark < count as usize), "{dark} of {count} would be negative");
    }
    assert_silent(&world.context);
}

/// Centre, mean normal and mean clearance of a cluster, in f64, and whether it holds backs.
struct Cluster {
    middle: DVec3,
    normal: DVec3,
    clearance: f64,
    is_back: bool,
}

fn cluster(world: &World, clearances: &[f32], index: u32) -> Cluster {
    let (mut area, mut room) = (0.0, 0.0);
    let (mut middle, mut normal) = (DVec3::ZERO, DVec3::ZERO);
    let mut is_back = None;
    for (fragment, &clearance) in world.hvds.fragments.iter().zip(clearances) {
        let around = |mut at: u32| {
            while at != index && at != NO_CLUSTER {
                at = world.hvds.parents[at as usize];
            }
            at == index
        };
        if around(fragment.cluster) || around(world.hvds.unweighted[fragment.cluster as usize]) {
            let corners = fragment.corners.iter().map(|corner| corner.as_dvec3());
            area += fragment.area_m2;
            room += fragment.area_m2 * f64::from(clearance);
            middle += fragment.area_m2 * corners.sum::<DVec3>() / fragment.corners.len() as f64;
            normal += fragment.area_m2 * world.geometry().normal(fragment.side).as_dvec3();
            let back = fragment.side % 2 == 1;
            assert!(is_back.replace(back).is_none_or(|before| before == back), "a cluster has one side");
        }
    }
    Cluster {
        middle: middle / area,
        normal: normal.normalize_or_zero(),
        clearance: room / area,
        is_back: is_back.unwrap(),
    }
}

#[test]
fn near_clusters_have_the_nearest_record_that_sees_what_they_see() {
    near_clusters_of(Extent::CONTACTS);
    near_clusters_of(Extent { levels: 3, close: 6.0 });
}

fn near_clusters_of(extent: Extent) {
    let world = World::room();
    let mut random = Random::new(92);
    // The nearest surfaces on one side of the room are within three cells of 0.1 m, on the
    // other within six.
    const CELL_SIZE: f32 = 0.1;
    let clearance = |fragment: &Fragment| if fragment.corners[0].x > 0.0 { 0.2 } else { 0.5 };
    let clearances: Vec<f32> = world.hvds.fragments.iter().map(clearance).collect();
    let place = |point| Placed { point, clearance: 0.1, spacing: 1.0 };
    let placed: Vec<Placed> = world.cache_points(&mut random, 800, 0.12).into_iter().map(place).collect();
    let normal = |side: u32| world.geometry().normal(side);
    let patches = near_clusters::patches(&world.hvds, &clearances, normal, extent.levels);
    let near = near_clusters::find(&patches, extent, CELL_SIZE, &placed);
    assert!(near.is_sorted_by(|a, b| a.cluster < b.cluster), "each cluster once");
    let end = world.hvds.levels[extent.levels - 1].end;
    assert!(near.iter().all(|near| near.cluster < end), "the finest levels");
    let close = f64::from(extent.close * CELL_SIZE);
    assert!(near.iter().all(|near| near.target == near.cluster));
    let distance_if_fit = |cluster: &Cluster, placed: &Placed, slack: f64| {
        let point = &placed.point;
        let apart = cluster.middle - point.position.as_dvec3();
        let height = apart.dot(point.normal.as_dvec3());
        let room = if height > 0.0 { f64::from(placed.clearance) } else { cluster.clearance };
        let fits = (point.side % 2 == 1) == cluster.is_back
            && apart.length() <= 1.5 * f64::from(point.radius) * (1.0 + slack)
            && point.normal.as_dvec3().dot(cluster.normal) >= 0.8 - slack
            && apart.dot(point.occluder.as_dvec3()) <= 1.0 + slack
            // No other surface is between: a point at that height above or below belongs
            // to another surface.
            && (height.abs() <= 0.5 * room * (1.0 + slack) || height.abs() <= 0.1 * apart.length() * (1.0 + slack));
        fits.then_some(apart.length())
    };
    let mut listed = near.iter().peekable();
    let (mut with, mut without) = (0, 0);
    for index in 0..end {
        let found = listed.next_if(|near| near.cluster == index);
        // Only every fifth cluster: the reference visits every pair.
        if index % 5 != 0 {
            continue;
        }
        let cluster = cluster(&world, &clearances, index);
        let nearest = |slack: f64| {
            let fits = placed.iter().filter_map(|placed| distance_if_fit(&cluster, placed, slack));
            fits.fold(f64::INFINITY, f64::min)
        };
        if let Some(found) = found {
            let record = &placed[found.record as usize];
            assert!(cluster.clearance < close + 1e-4, "cluster {index} is near: {}", cluster.clearance);
            let distance = distance_if_fit(&cluster, record, 1e-3).expect("the record fits the cluster");
            assert!(distance <= nearest(-1e-3) + 1e-5, "cluster {index} has the nearest record");
            let offset = cluster.middle - record.point.position.as_dvec3();
            assert!(offset.distance(found.offset.as_dvec3()) < 1e-5);
            with += 1;
        } else {
            let is_open = cluster.clearance > close - 1e-4;
            assert!(is_open || nearest(-1e-3).is_infinite(), "cluster {index} has a record beside it");
            without += usize::from(!is_open);
        }
    }
    println!("{with} clusters with a record, {without} without");
    assert!(listed.next().is_none() && with > 20 && without > 20);
}
