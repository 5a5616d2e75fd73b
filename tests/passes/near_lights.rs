//! Near-light correction: lights nearer to a surface than entry points are apart.

use crate::common::{assert_silent, context};
use crate::world::{FLOAT, Random, World};
use glam::Vec3;
use lightpaths::cpu;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::near_lights::{NearFactor, NearLights};
use lightpaths::passes::precompute::rays::Rays;
use lightpaths::scene::shapes;
use lightpaths::types::{LIGHT_SPOT, LightSource, PathVertex};
use std::f64::consts::{PI, TAU};

/// Entry points a centimetre apart.
const SPACING: f32 = 0.01;
const AREA_M2: f32 = SPACING * SPACING;
/// Height of the floor, metres.
const FLOOR: f32 = -0.5;

/// A room of two metres, divided by a wall of one millimetre, with entry points on its floor around
/// the middle of the wall's foot.
fn world() -> (World, Vec<PathVertex>) {
    let world = World::new(&shapes::thin_wall(), 16);
    let side = world.triangles.iter().position(|t| t.geometric_normal().y > 0.9).unwrap() as u32 * 2;
    let mut random = Random::new(5);
    let mut points = Vec::new();
    for cell in (0..100).flat_map(|x| (0..100).map(move |z| Vec3::new(x as f32, 0.0, z as f32))) {
        let jitter = Vec3::new(random.unit(), 0.0, random.unit());
        let position = SPACING * (cell + jitter - Vec3::new(50.0, 0.0, 50.0)) + FLOOR * Vec3::Y;
        if position.x.abs() > 5e-4 {
            let (incoming, weight) = (Vec3::ZERO, 1.0);
            points.push(PathVertex { position, side, incoming, weight, cluster: 0, lobe: 0.0 });
        }
    }
    (world, points)
}

fn near_lights(world: &World, points: &[PathVertex]) -> NearLights {
    NearLights::new(&world.context, points, &world.surfaces, |_| false, AREA_M2).unwrap()
}

fn find(world: &World, near: &NearLights, light: &LightSource) -> Vec<NearFactor> {
    let rays = Rays::new(&world.context).unwrap();
    let is_diffuse = |side: u32| world.surfaces[side as usize / 2].side_is_active(side % 2 == 1);
    near.find((&rays, &world.buffers), &world.surfaces, is_diffuse, light).unwrap().0
}

#[test]
fn form_factors_change_as_the_reference_says() {
    let (world, _) = world();
    let near = near_lights(&world, &[]);
    let mut random = Random::new(8);
    for count in [0, 1, 63, 64, 65, 997_u32] {
        // Every second one, from the last.
        let change =
            |k| NearFactor { point: 2 * (count - 1 - k), kept: 2.0 * random.unit(), added: random.unit() };
        let changes: Vec<NearFactor> = (0..count).map(change).collect();
        let before: Vec<f32> = (0..2 * count).map(|_| random.unit()).collect();
        let factors = Buffer::from_slice(&world.context, "factors", &before).unwrap();
        let found = near.upload(&changes).unwrap();
        world.context.run(|rec| near.record(&mut rec.pass("near_lights"), &found, count, &factors)).unwrap();
        let after: Vec<f32> = factors.read().unwrap();
        let mut expected: Vec<f64> = before.iter().map(|&factor| f64::from(factor)).collect();
        for NearFactor { point, kept, added } in changes {
            expected[point as usize] = cpu::near_lights::near_factor(before[point as usize], kept, added);
        }
        for (&after, expected) in after.iter().zip(expected) {
            assert!((f64::from(after) - expected).abs() <= FLOAT * expected.abs(), "{after}, {expected}");
        }
    }
    assert_silent(&context());
}

/// Irradiance of the entry points by a light over the floor, per unit of its intensity: the sum,
/// and the maximum behind the wall, sr.
fn received(world: &World, points: &[PathVertex], near: &NearLights, light: &LightSource) -> [f64; 2] {
    let mut factors: Vec<f64> = Vec::new();
    for point in points {
        let geometry = world.geometry();
        let (position, side) = (point.position, point.side);
        factors.push(cpu::form_factors::form_factor(geometry, position, side, light, AREA_M2));
    }
    for NearFactor { point, kept, added } in find(world, near, light) {
        let factor = &mut factors[point as usize];
        *factor = cpu::near_lights::near_factor(*factor as f32, kept, added);
    }
    let behind = points.iter().zip(&factors).filter(|(point, _)| point.position.x > 0.0);
    let behind = behind.fold(0.0, |most: f64, (_, factor)| most.max(*factor));
    [f64::from(AREA_M2) * factors.iter().sum::<f64>(), behind]
}

#[test]
fn a_light_beside_a_floor_lights_it_wherever_entry_points_are() {
    let (world, points) = world();
    let near = near_lights(&world, &points);
    // At a position with entry points far to all sides, except behind the wall.
    for height in [1e-6, 1e-4, 1e-3, 5e-3, 2e-2, 3e-2] {
        let position = Vec3::new(-0.25, FLOOR + height, 0.02);
        let light = LightSource::point(position, Vec3::ONE);
        let [all, behind] = received(&world, &points, &near, &light);
        // The light that goes down, minus the light that goes beyond the entry points. The wall
        // takes little of the light so near to the floor.
        let far = PI * f64::from(height) / 0.25;
        println!("{height:e} m: {:.4} of 2π, {:.4} beyond", all / TAU, far / TAU);
        assert!(all < 1.01 * TAU && all > 0.99 * TAU - 2.0 * far, "{height:e} m: {all} sr of {TAU}");
        assert_eq!(behind, 0.0, "{height:e} m");
        let cone =
            LightSource { kind: LIGHT_SPOT, axis: Vec3::NEG_Y, inner_angle: 0.3, outer_angle: 0.3, ..light };
        let [all, _] = received(&world, &points, &near, &cone);
        let expected = TAU * (1.0 - 0.3_f64.cos());
        assert!(height > 1e-2 || (all / expected - 1.0).abs() < 0.02, "{height:e} m: {all} sr of {expected}");
    }
    // Close to the foot of the wall: half of the light that goes down meets the wall or is
    // reflected, and none comes through.
    let light = LightSource::point(Vec3::new(-1.5e-3, FLOOR + 1e-3, 0.02), Vec3::ONE);
    let [all, behind] = received(&world, &points, &near, &light);
    println!("beside the wall: {:.4} of 2π", all / TAU);
    assert!(all > 0.5 * TAU && all < 0.9 * TAU && behind == 0.0, "{all} sr, {behind} behind");
    assert_silent(&context());
}

#[test]
fn lights_away_from_all_surface_change_nothing() {
    let (world, points) = world();
    let near = near_lights(&world, &points);
    let place = |height: f32| Vec3::new(-0.25, FLOOR + height, 0.02);
    assert!(find(&world, &near, &LightSource::point(place(4.1 * SPACING), Vec3::ONE)).is_empty());
    assert!(!find(&world, &near, &LightSource::point(place(3.9 * SPACING), Vec3::ONE)).is_empty());
    let upwards = LightSource {
        kind: LIGHT_SPOT,
        axis: Vec3::Y,
        inner_angle: 0.3,
        outer_angle: 0.3,
        ..LightSource::point(place(1e-3), Vec3::ONE)
    };
    assert!(find(&world, &near, &upwards).is_empty(), "it does not light the floor");
    assert_silent(&context());
}
