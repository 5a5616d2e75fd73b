//! The sky: form factors and beams of its smooth part.

use crate::common::assert_silent;
use crate::world::{Random, World};
use bytemuck::Zeroable;
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::cpu::sampling::hash;
use lightpaths::gpu::{Buffer, SplitBuffer};
use lightpaths::passes::frame::form_factors::EntryPoint;
use lightpaths::passes::frame::gloss::GlossBeam;
use lightpaths::passes::frame::sky_factors::{SKY_RAYS, SKY_SEED, SkyFactors};
use lightpaths::passes::gloss_tables::GlossEntry;
use lightpaths::passes::precompute::gather_rays::Hemisphere;
use lightpaths::passes::{OneLight, SkyTable};
use lightpaths::scene::{octahedral, shapes};
use lightpaths::types::LightSource;
use std::f64::consts::PI;

const SIDE: u32 = 8;

/// A box without its wall at +z.
fn open_box() -> World {
    let mut scene = shapes::closed_box(Vec3::splat(2.0), 0.5);
    scene.triangles.retain(|triangle| !triangle.positions.iter().all(|point| point.z > 0.99));
    World::new(&scene, 8)
}

fn strata() -> Strata {
    let [(_, rings), (_, sectors)] = Hemisphere::new(SKY_RAYS).constants();
    Strata { rings, sectors }
}

/// Entry points inside the box, and radiances of a sky behind one row of the table of lights.
fn inputs(world: &World, count: u32) -> (Vec<EntryPoint>, Vec<f32>, Buffer, SkyTable) {
    let mut random = Random::new(5);
    let points = (0..count).map(|_| {
        let (position, _, side) = world.surface_point(&mut random);
        EntryPoint { position, side }
    });
    let points = points.collect();
    let radiances: Vec<f32> = (0..SIDE * SIDE).map(|cell| 0.5 + (cell % 7) as f32).collect();
    let row = [LightSource::point(Vec3::ZERO, Vec3::ONE)];
    let words = [bytemuck::cast_slice(&row), &radiances[..]].concat();
    let table = Buffer::from_slice(&world.context, "lights", &words).unwrap();
    let first_word = (size_of::<LightSource>() / 4) as u32;
    (points, radiances, table, SkyTable { first_word, side: SIDE })
}

/// Random stream indices of as many entry points.
fn streams(count: u32) -> Vec<u32> {
    (0..count).map(hash).collect()
}

fn sky_light(lights: &Buffer, table: SkyTable) -> OneLight<'_> {
    let row = LightSource::point(Vec3::ZERO, Vec3::ONE);
    OneLight { part_count: 0, sky: Some(table), ..OneLight::new(lights, 0, &row) }
}

#[test]
fn sky_factors_equal_the_reference() {
    let world = open_box();
    for (count, most) in [(1, 64), (97, 64), (1_500, 1_500), (1_500, 512)] {
        let (points, radiances, lights, table) = inputs(&world, count);
        let entry_points = SplitBuffer::cut(&world.context, "entry points", &points, most).unwrap();
        let sky = SkyFactors::new(&world.context, &world.buffers, &entry_points, &streams(count)).unwrap();
        let factors = Buffer::storage(&world.context, "factors", 4 * u64::from(count)).unwrap();
        let light = sky_light(&lights, table);
        let record = |rec: &mut lightpaths::gpu::Recorder| {
            let mut pass = rec.pass("sky_factors");
            sky.record(&mut pass, &world.buffers, light, &entry_points, &factors);
        };
        world.context.run(record).unwrap();
        let found: Vec<f32> = factors.read().unwrap();
        let reference = |(number, point): (usize, &EntryPoint)| {
            let point = (point.position, point.side, hash(number as u32));
            cpu::sky_factors::sky_factor(world.geometry(), strata(), point, (&radiances, SIDE), SKY_SEED)
        };
        let expected: Vec<f64> = points.iter().enumerate().map(reference).collect();
        // A ray that passes an edge, or the border of a cell of the table, may go either way.
        let differ = |(found, expected): (&f32, &f64)| (f64::from(*found) - expected).abs() > 1e-4;
        let differing = found.iter().zip(&expected).filter(|&pair| differ(pair)).count();
        assert!(differing * 250 <= count as usize, "{differing} of {count}");
        let lit = found.iter().filter(|found| **found > 0.0).count();
        assert!(count < 1_000 || lit * 2 > count as usize, "{lit} of {count} see the sky");
    }
    assert_silent(&world.context);
}

/// Beams hold the light of the form factor, and come from where the sky is.
#[test]
fn sky_beams_hold_the_form_factor() {
    let world = open_box();
    let (points, radiances, lights, table) = inputs(&world, 300);
    let entry_points = SplitBuffer::cut(&world.context, "entry points", &points, 128).unwrap();
    let sky = SkyFactors::new(&world.context, &world.buffers, &entry_points, &streams(300)).unwrap();
    // Every third entry point is glossy.
    let glossy: Vec<GlossEntry> = (0..300)
        .step_by(3)
        .map(|path| {
            let point = points[path as usize];
            let normal = world.geometry().normal(point.side);
            GlossEntry { position: point.position, path, normal, ..GlossEntry::zeroed() }
        })
        .collect();
    let light = sky_light(&lights, table);
    let beam_count = light.beam_count();
    let entries = Buffer::from_slice(&world.context, "glossy entry points", &glossy).unwrap();
    let bytes = u64::from(beam_count) * (glossy.len() * size_of::<GlossBeam>()) as u64;
    let beams = Buffer::storage(&world.context, "beams", bytes).unwrap();
    let record = |rec: &mut lightpaths::gpu::Recorder| {
        let mut pass = rec.pass("sky_beams");
        sky.record_beams(&mut pass, light, &entry_points, (&entries, glossy.len() as u32), &beams);
    };
    world.context.run(record).unwrap();
    let found: Vec<GlossBeam> = beams.read().unwrap();
    let mut differing = 0;
    for (entry, beams) in glossy.iter().zip(found.chunks_exact(beam_count as usize)) {
        let point = (entry.position, points[entry.path as usize].side, hash(entry.path));
        let expected =
            cpu::sky_factors::sky_factor(world.geometry(), strata(), point, (&radiances, SIDE), SKY_SEED);
        let sum: f64 = beams.iter().map(|beam| f64::from(beam.factor)).sum();
        differing += u32::from((sum - expected).abs() > 1e-4);
        for beam in beams.iter().filter(|beam| beam.factor > 0.0) {
            let toward = 2.0 * beam.mirror.dot(entry.normal) * entry.normal - beam.mirror;
            assert!(toward.dot(entry.normal) > 0.0 && (toward.length() - 1.0).abs() < 1e-4);
        }
    }
    assert!(differing <= 1, "{differing} of {}", glossy.len());
    assert_silent(&world.context);
}

/// A point on an unbounded plane sees half of the sky: π times its radiance.
#[test]
fn an_open_point_receives_all_of_its_hemisphere() {
    let table = vec![1.0; (SIDE * SIDE) as usize];
    let whole: f64 = (0..SIDE * SIDE)
        .flat_map(|cell| octahedral::directions_in(cell, SIDE, 256))
        .map(|direction| octahedral::relative_solid_angle(direction) * direction.dot(DVec3::Y).max(0.0))
        .sum();
    let all: f64 = (0..SIDE * SIDE)
        .flat_map(|cell| octahedral::directions_in(cell, SIDE, 256))
        .map(octahedral::relative_solid_angle)
        .sum();
    assert!((4.0 * PI * whole / all / PI - 1.0).abs() < 1e-3);
    let mut scene = shapes::closed_box(Vec3::splat(2.0), 0.5);
    scene.triangles.retain(|triangle| triangle.positions.iter().all(|point| point.y < -0.99));
    let world = World::new(&scene, 4);
    let side = (0..4).find(|&side| world.geometry().normal(side).y > 0.9).unwrap();
    let position = world.triangles[side as usize / 2].positions.iter().sum::<Vec3>() / 3.0;
    let point = (position, side, 7);
    let factor = cpu::sky_factors::sky_factor(world.geometry(), strata(), point, (&table, SIDE), SKY_SEED);
    assert!((factor / PI - 1.0).abs() < 1e-9, "{factor}");
}
