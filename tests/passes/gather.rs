//! Final gathering: irradiance and both gradients, from given rays.

use crate::common::{assert_silent, context};
use crate::world::{Random, SUM, assert_near};
use glam::{DMat3, Mat3, Vec3};
use lightpaths::cpu::gather::{Sources, gather, unpack};
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::gather::{Gather, GatherSources};
use lightpaths::passes::frame::needed_records::RecordList;
use lightpaths::passes::gather_targets::{GatherTargetPacking, GatherTargets};
use lightpaths::passes::precompute::gather_rays::{Hemisphere, RayTable};
use lightpaths::passes::precompute::merged_rays::{MergedRayPacking, MergedRays};
use lightpaths::types::{CachePoint, GatherRay, MergedRay, NO_TARGET, Record, Reflectance};

const CLUSTERS: u32 = 501;
const ALBEDOS: [Vec3; 3] = [Vec3::new(0.9, 0.5, 0.1), Vec3::ZERO, Vec3::new(0.2, 0.4, 0.8)];

/// Rays with random targets, and gradients of any sign and size up to 2, subnormal halves included.
pub(crate) fn random_rays(
    random: &mut Random,
    packing: GatherTargetPacking,
    clusters: u32,
    count: u32,
) -> Vec<GatherRay> {
    let ray = |_| {
        let target = random.below(clusters) | random.below(6) << packing.cluster_bits;
        let target = if random.below(5) == 0 { NO_TARGET } else { target };
        GatherRay { target, gradient: random.word() & 0xbfff_bfff }
    };
    (0..count).map(ray).collect()
}

/// Targets of the rays.
pub(crate) fn targets(rays: &[GatherRay]) -> Vec<u32> {
    rays.iter().map(|ray| ray.target).filter(|&target| target != NO_TARGET).collect()
}

fn random_points(random: &mut Random, count: u32) -> Vec<CachePoint> {
    let point = |index| {
        // The difficult cases of the tangent frame come first.
        let normal = [Vec3::Z, Vec3::NEG_Z].get(index as usize).copied().unwrap_or_else(|| random.sphere());
        CachePoint {
            position: random.cube(),
            radius: 1.0,
            normal,
            side: 0,
            occluder: Vec3::ZERO,
            facet: normal,
            inverse_reach: 0.0,
            stream: 0,
        }
    };
    (0..count).map(point).collect()
}

#[test]
fn irradiance_and_gradients_equal_the_reference() {
    let context = context();
    let mut random = Random::new(31);
    let packing = GatherTargetPacking::new(CLUSTERS, ALBEDOS.len(), 0.037).unwrap();
    let reflectance = |diffuse| Reflectance { diffuse, exponent: 1.0, specular: Vec3::ZERO, flags: 0 };
    let materials = Buffer::from_slice(&context, "materials", &ALBEDOS.map(reflectance)).unwrap();
    // Values over eight orders of magnitude.
    let irradiance: Vec<Vec3> =
        (0..CLUSTERS).map(|_| (1.0 + random.cube()) * 10f32.powf(8.0 * random.unit() - 4.0)).collect();
    let irradiance_buffer = Buffer::from_slice(&context, "irradiance", &irradiance).unwrap();
    let inverse_areas = Buffer::from_slice(&context, "inverse areas", &[1.0_f32; CLUSTERS as usize]).unwrap();
    for (rings, point_count, has_colours) in [
        (1, 0, false),
        (1, 1, true),
        (1, 65, false),
        (3, 17, true),
        (4, 63, false),
        (8, 1, false),
        (8, 67, true),
        (8, 67, false),
    ] {
        let strata = Strata { rings, sectors: 4 * rings };
        let points = random_points(&mut random, point_count);
        let mut rays = random_rays(&mut random, packing, CLUSTERS, point_count * strata.rays());
        if let Some(last) = rays.last_chunk_mut::<4>().filter(|_| rings == 1) {
            last.fill(GatherRay { target: NO_TARGET, gradient: 0x3c00_3c00 });
        }
        // The table is split, as it is on devices with small bindings.
        let rows = point_count.div_ceil(3).max(1);
        let parts = rays.chunks((rows * strata.rays()) as usize);
        let buffers = parts.map(|part| Buffer::from_slice(&context, "gather rays", part).unwrap());
        let colours: Vec<u32> = rays.iter().map(|_| random.word()).collect();
        let colour_parts = colours.chunks((rows * strata.rays()) as usize);
        let colour_buffers =
            colour_parts.map(|part| Buffer::from_slice(&context, "ray colours", part).unwrap());
        let hemisphere = Hemisphere { rings, sectors: strata.sectors };
        let merging = MergedRayPacking::new(targets(&rays), hemisphere);
        let sources = Sources {
            albedos: &ALBEDOS,
            irradiance: &irradiance,
            targets: &merging.targets,
            target_bits: merging.target_bits,
            cluster_bits: packing.cluster_bits,
            min_distance: packing.min_distance,
            rotation_unit: merging.rotation_unit(),
            bins: &[],
        };
        let table = RayTable {
            rows_per_buffer: rows,
            buffers: buffers.collect(),
            colours: colour_buffers.collect(),
            has_colours,
        };
        let pass = Gather::new(
            &context,
            Buffer::from_slice(&context, "cache points", &points).unwrap(),
            point_count,
            MergedRays::new(&context, table, (&GatherTargets::of_hits(packing), &packing), hemisphere, None)
                .unwrap(),
            hemisphere,
            packing,
            false,
        )
        .unwrap();
        let buffers = GatherSources {
            materials: &materials,
            irradiance: &irradiance_buffer,
            inverse_areas: &inverse_areas,
            gloss: None,
            sky: None,
            bright: None,
        };
        let list = RecordList::all(&context, point_count, rows).unwrap();
        context.run(|rec| pass.record(rec, buffers, &list)).unwrap();
        let records: Vec<Record> = pass.records.read().unwrap();
        assert_listed_alone(&pass, buffers, &records, rows);
        assert_eq!(records.len(), points.len());
        let colour_rows = colours.chunks_exact(strata.rays() as usize);
        for ((record, point), (row, colours)) in
            records.iter().zip(&points).zip(rays.chunks_exact(strata.rays() as usize).zip(colour_rows))
        {
            assert_eq!(record.position, point.position);
            let colours = if has_colours { colours } else { &[] };
            let (merged_rays, colours): (Vec<MergedRay>, Vec<u32>) =
                merging.merged_rays(row, colours, None).into_iter().map(|m| (m.ray, m.colour)).unzip();
            let colours = if has_colours { &colours[..] } else { &[] };
            let reference = gather(sources, strata, point.normal, &merged_rays, colours);
            assert_near(record.irradiance, reference.irradiance, SUM, 0.0, "irradiance");
            // Terms of both signs cancel in a gradient: the error is relative to the sum of their
            // sizes. The outermost ring is the steepest; a turn of it counts √(2·rings) times.
            let brightest = reference.irradiance.max_element();
            let steepness = row.iter().map(|ray| unpack(ray.gradient).abs().max_element()).sum::<f64>();
            let scale = brightest * steepness / f64::from(packing.min_distance);
            assert_columns(&record.translation, reference.translation, scale, "translation");
            let scale = brightest * f64::from(2 * rings).sqrt();
            assert_columns(&record.rotation, reference.rotation, scale, "rotation");
        }
        if rings == 1 && point_count > 0 {
            assert_eq!(records.last().unwrap().irradiance, Vec3::ZERO, "no ray, no light");
        }
    }
    assert_silent(&context);
}

/// Gathers at some points only: these get new values, and the others keep theirs.
#[track_caller]
fn assert_listed_alone(pass: &Gather, sources: GatherSources<'_>, gathered: &[Record], rows: u32) {
    let kept = Record {
        position: Vec3::ONE,
        irradiance: Vec3::NEG_ONE,
        translation: Mat3::IDENTITY,
        rotation: Mat3::IDENTITY,
    };
    let count = gathered.len() as u32;
    let listed: Vec<u32> = (0..count).filter(|index| index % 7 < 3).collect();
    let list = RecordList::fixed(&context(), count, rows, &listed).unwrap();
    pass.records.write(&vec![kept; gathered.len()]).unwrap();
    context().run(|rec| pass.record(rec, sources, &list)).unwrap();
    let records: Vec<Record> = pass.records.read().unwrap();
    for (index, (record, gathered)) in (0..).zip(records.iter().zip(gathered)) {
        let expected = if index % 7 < 3 { gathered } else { &kept };
        assert_eq!(bytemuck::bytes_of(record), bytemuck::bytes_of(expected), "record {index}");
    }
}

#[track_caller]
fn assert_columns(device: &Mat3, reference: DMat3, scale: f64, what: &str) {
    for channel in 0..3 {
        assert_near(device.col(channel), reference.col(channel), 1e-5, scale, what);
    }
}

/// The reference's gradients: irradiance over a slanted source, against a difference quotient.
#[test]
fn the_rotational_gradient_is_a_derivative() {
    let strata = Strata { rings: 64, sectors: 256 };
    // A radiance field that depends only on the direction in the world, with one cluster for each
    // of 64 steps of height.
    let irradiance: Vec<Vec3> = (0..64).map(|step| Vec3::splat(step as f32)).collect();
    let merging = MergedRayPacking::new((0..64).collect(), Hemisphere { rings: 64, sectors: 256 });
    let sources = Sources {
        albedos: &[Vec3::ONE],
        irradiance: &irradiance,
        targets: &merging.targets,
        target_bits: merging.target_bits,
        cluster_bits: 8,
        min_distance: 1.0,
        rotation_unit: merging.rotation_unit(),
        bins: &[],
    };
    let gathered = |normal: Vec3| {
        let frame = lightpaths::cpu::hemisphere::frame(normal);
        let ray = |ray| {
            let direction = frame * strata.direction(ray, 0, 0);
            GatherRay { target: (32.0 * (1.0 + direction.x)) as u32, gradient: 0 }
        };
        let rays: Vec<GatherRay> = (0..strata.rays()).map(ray).collect();
        let merged_rays: Vec<MergedRay> =
            merging.merged_rays(&rays, &[], None).into_iter().map(|merged| merged.ray).collect();
        gather(sources, strata, normal, &merged_rays, &[])
    };
    let at = gathered(Vec3::Z);
    for turned in [Vec3::new(0.05, 0.0, 1.0), Vec3::new(0.0, 0.05, 1.0), Vec3::new(-0.03, 0.04, 1.0)] {
        let normal = turned.normalize();
        let change = (gathered(normal).irradiance - at.irradiance).x;
        let predicted = at.rotation.col(0).dot(normal.as_dvec3());
        assert!((change - predicted).abs() < 0.005 * at.irradiance.x, "{change} came, {predicted} foretold");
        assert!(turned.x == 0.0 || predicted.abs() > 0.01 * at.irradiance.x);
    }
}
