//! Blending: lists of any length, and the guarantees of the neighbourhoods.

use crate::common::{assert_silent, context};
use crate::world::{Random, World};
use glam::{DMat3, DVec3, Mat3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::records::FACETS_ALIKE;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::blend::Blend;
use lightpaths::passes::precompute::cache_points::Placed;
use lightpaths::passes::precompute::neighbours::{Neighbour, Neighbourhoods};
use lightpaths::types::{CachePoint, Record};

/// Tolerance relative to the sum of the terms' sizes; the terms may cancel.
const SUM: f64 = 1e-5;

fn random_record(random: &mut Random, point: &CachePoint) -> Record {
    let mut matrix = || Mat3::from_cols(random.cube(), random.cube(), random.cube());
    let (translation, rotation) = (matrix(), matrix());
    Record { position: point.position, irradiance: 1.0 + random.cube(), translation, rotation }
}

fn largest(columns: &DMat3) -> f64 {
    columns.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}

#[test]
fn blended_records_equal_the_reference() {
    let (context, world) = (context(), World::room());
    let mut random = Random::new(7);
    for count in [1, 63, 64, 65, 257] {
        let points = world.cache_points(&mut random, count, 0.2);
        let records: Vec<Record> = points.iter().map(|point| random_record(&mut random, point)).collect();
        let mut lists = Neighbourhoods { first: vec![0], list: Vec::new() };
        for _ in 0..count {
            // Some lists are empty: their result is zero.
            for _ in 0..random.below(9) {
                let record = random.below(count as u32);
                lists.list.push(Neighbour { record, weight: random.unit() });
            }
            lists.first.push(lists.list.len() as u32);
        }
        let cache_points = Buffer::from_slice(&context, "cache points", &points).unwrap();
        let given = Buffer::from_slice(&context, "records", &records).unwrap();
        let pass = Blend::new(&context, &lists).unwrap();
        context.run(|rec| pass.record(rec, &cache_points, &given, None)).unwrap();
        let blended: Vec<Record> = pass.records.read().unwrap();
        for (i, (point, device)) in points.iter().zip(&blended).enumerate() {
            let own = &lists.list[lists.first[i] as usize..lists.first[i + 1] as usize];
            let weights: Vec<_> = own.iter().map(|n| (records[n.record as usize], n.weight)).collect();
            let (irradiance, translation, rotation) = cpu::blend::blend(point, &weights);
            let bound = SUM * 10.0 * (1.0 + weights.len() as f64);
            assert_eq!(device.position, point.position);
            let off: DVec3 = device.irradiance.as_dvec3() - irradiance;
            assert!(off.abs().max_element() <= bound, "record {i}: {off}");
            assert!(largest(&(device.translation.as_dmat3() - translation)) <= bound);
            assert!(largest(&(device.rotation.as_dmat3() - rotation)) <= bound);
        }
    }
    assert_silent(&context);
}

#[test]
fn neighbours_lie_within_both_clearances_and_shares_sum_to_one() {
    let world = World::room();
    let mut random = Random::new(8);
    let place = |point| Placed { point, clearance: 0.3 * random_clearance(&point), spacing: 1.0 };
    let placed: Vec<Placed> = world.cache_points(&mut random, 3000, 0.1).into_iter().map(place).collect();
    let lists = Neighbourhoods::new(&placed);
    assert_eq!(lists.first.len(), placed.len() + 1);
    let mut pairs = 0;
    for (i, own) in placed.iter().enumerate() {
        let list = &lists.list[lists.first[i] as usize..lists.first[i + 1] as usize];
        assert!(list.iter().any(|n| n.record as usize == i), "a record is its own neighbour");
        let sum: f32 = list.iter().map(|n| n.weight).sum();
        assert!((sum - 1.0).abs() < 1e-5, "{sum}");
        assert!(list.is_sorted_by(|a, b| a.record < b.record));
        for other in list.iter().map(|n| &placed[n.record as usize]) {
            let distance = own.point.position.distance(other.point.position);
            let reach = |p: &Placed| p.clearance.min(2.0 * p.point.radius);
            assert!(distance <= reach(own).min(reach(other)));
            assert!(own.point.normal.dot(other.point.normal) > 0.98);
            assert!(own.point.facet.dot(other.point.facet) >= FACETS_ALIKE);
            pairs += 1;
        }
        // The search by cells finds every neighbour that brute force finds well inside.
        let reach = |p: &Placed| p.clearance.min(2.0 * p.point.radius);
        for (j, other) in placed.iter().enumerate() {
            let is_near = own.point.position.distance(other.point.position)
                < 0.99 * reach(own).min(reach(other))
                && own.point.normal.dot(other.point.normal) > 0.99
                && own.point.facet.dot(other.point.facet) >= FACETS_ALIKE;
            assert!(!is_near || list.iter().any(|n| n.record as usize == j), "{i} misses {j}");
        }
    }
    assert!(pairs > 2 * placed.len(), "{pairs} pairs");
}

/// A clearance that differs between points and is reproducible.
fn random_clearance(point: &CachePoint) -> f32 {
    let Vec3 { x, y, z } = point.position;
    (x * 12.3 + y * 45.6 + z * 78.9).fract().abs()
}

/// A quadratic irradiance field: the result is exact with neighbours all around a point. With
/// neighbours on one side, the error depends on their mean offset.
#[test]
fn a_quadratic_field_is_blended_without_flattening_it() {
    let context = context();
    let slope = DVec3::new(0.7, 0.0, -0.4);
    let bend = DMat3::from_cols(DVec3::new(2.0, 0.0, 0.5), DVec3::ZERO, DVec3::new(0.5, 0.0, -3.0));
    let record_at = |position: Vec3| {
        let x = position.as_dvec3();
        let irradiance = (3.0 + slope.dot(x) + 0.5 * x.dot(bend * x)) as f32;
        let gradient = (slope + bend * x).as_vec3();
        let translation = Mat3::from_cols(gradient, gradient, gradient);
        Record { position, irradiance: Vec3::splat(irradiance), translation, rotation: Mat3::ZERO }
    };
    let side = 0.3;
    let around = [Vec3::X, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Z].map(|to| side * to);
    let aside = [Vec3::ZERO, side * Vec3::X, side * (Vec3::X + Vec3::Z), side * Vec3::Z];
    for (positions, mean_offset) in [(around, 0.0), (aside, 0.5 * 2f64.sqrt() * f64::from(side))] {
        let middle = CachePoint {
            position: Vec3::ZERO,
            radius: 1.0,
            normal: Vec3::Y,
            side: 0,
            occluder: Vec3::ZERO,
            facet: Vec3::Y,
            inverse_reach: 0.0,
            stream: 0,
        };
        let records = positions.map(record_at);
        let list = (0..4).map(|record| Neighbour { record, weight: 0.25 }).collect();
        let lists = Neighbourhoods { first: vec![0, 4, 4, 4, 4], list };
        let cache_points = Buffer::from_slice(&context, "cache points", &[middle; 4]).unwrap();
        let given = Buffer::from_slice(&context, "records", &records).unwrap();
        let pass = Blend::new(&context, &lists).unwrap();
        context.run(|rec| pass.record(rec, &cache_points, &given, None)).unwrap();
        let blended: Vec<Record> = pass.records.read().unwrap();
        // Half the curvature, which is at most 3.1, times the square of the mean offset.
        let bound = 0.5 * 3.1 * mean_offset * mean_offset + 1e-5;
        let off = (f64::from(blended[0].irradiance.x) - 3.0).abs();
        assert!(off <= bound, "{off} for {bound}");
    }
    assert_silent(&context);
}

/// Steep gradients, some of which extrapolate below zero. As many records as reported are clamped
/// at zero; the others are the blend of all.
#[test]
fn records_are_kept_from_falling_below_zero_where_it_is_told() {
    let (context, world) = (context(), World::room());
    let mut random = Random::new(9);
    let points = world.cache_points(&mut random, 257, 0.2);
    let steep = |point: &CachePoint| {
        let Record { position, irradiance, translation, rotation } = random_record(&mut random, point);
        Record { position, irradiance, translation: 2.0 * translation, rotation: 0.2 * rotation }
    };
    let records: Vec<Record> = points.iter().map(steep).collect();
    let list = |record| {
        [(record, 0.75), ((record + 1) % 257, 0.25)].map(|(record, weight)| Neighbour { record, weight })
    };
    let lists = Neighbourhoods {
        first: (0..=257).map(|record| 2 * record).collect(),
        list: (0..257).flat_map(list).collect(),
    };
    let cache_points = Buffer::from_slice(&context, "cache points", &points).unwrap();
    let given = Buffer::from_slice(&context, "records", &records).unwrap();
    let pass = Blend::new(&context, &lists).unwrap();
    context.run(|rec| pass.record(rec, &cache_points, &given, None)).unwrap();
    let blended: Vec<Record> = pass.records.read().unwrap();
    let mut limited = 0;
    for (i, (point, device)) in points.iter().zip(&blended).enumerate() {
        let weights = [(records[i], 0.75), (records[(i + 1) % 257], 0.25)];
        let (mut free, mut offset, mut translation) = (DVec3::ZERO, DVec3::ZERO, DMat3::ZERO);
        for (record, fraction) in &weights {
            let moved = point.position.as_dvec3() - record.position.as_dvec3();
            let along = record.translation.as_dmat3();
            let turned = record.rotation.as_dmat3().transpose() * point.normal.as_dvec3();
            let value = record.irradiance.as_dvec3() + 0.5 * along.transpose() * moved + turned;
            (free, offset) = (free + f64::from(*fraction) * value, offset + f64::from(*fraction) * moved);
            translation += along * f64::from(*fraction);
        }
        free += 0.5 * translation.transpose() * offset;
        let irradiance = device.irradiance.as_dvec3();
        assert!(irradiance.min_element() >= 0.0, "record {i}: {irradiance}");
        let is_limited = (irradiance - free).abs().max_element() > 30.0 * SUM;
        assert_eq!(
            is_limited,
            cpu::blend::is_limited(point, &weights),
            "record {i}: {irradiance}, {free} without limits"
        );
        limited += u32::from(is_limited);
    }
    assert!((20..237).contains(&limited), "{limited} of 257");
    assert_silent(&context);
}
