//! Near-light correction: lights nearer to a surface than entry points are apart.

use crate::common::{assert_silent, context};
use crate::world::{Random, World};
use glam::Vec3;
use lightpaths::cpu;
use lightpaths::cpu::lights::Intensities;
use lightpaths::gpu::barrier::COMPUTE_TO_TRANSFER;
use lightpaths::gpu::{Buffer, HostBlock};
use lightpaths::passes::frame::near_lights::{NearInputs, NearLights};
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
    let is_glossy = vec![false; world.materials.len()];
    NearLights::new(&world.context, points, &world.surfaces, &is_glossy, AREA_M2).unwrap()
}

/// The form factors after the device has corrected `factors`, and whether it did.
fn corrected(
    world: &World,
    near: &mut NearLights,
    light: &LightSource,
    factors: &[f32],
) -> (Vec<f32>, Option<NearInputs>) {
    let Some(inputs) = near.inputs(light, Intensities::NONE) else { return (factors.to_vec(), None) };
    near.reserve(std::slice::from_ref(&inputs)).unwrap();
    let buffer = Buffer::from_slice(&world.context, "factors", factors).unwrap();
    let state = Buffer::storage(&world.context, "near state", 8).unwrap();
    let block = HostBlock::new(&world.context, "nearest", 1).unwrap();
    world
        .context
        .run(|rec| {
            near.record(&mut rec.pass("near_lights"), &world.buffers, &inputs, (&state, &buffer));
            rec.barrier(COMPUTE_TO_TRANSFER);
            near.copy_nearest(rec, &state, &block, 0);
        })
        .unwrap();
    let is_near = near.is_near(f32::from_bits(block.word(0)));
    (buffer.read().unwrap(), is_near.then_some(inputs))
}

/// Form factors of the points without the correction.
fn factors_of(world: &World, points: &[PathVertex], light: &LightSource) -> Vec<f32> {
    let factor = |point: &PathVertex| {
        cpu::form_factors::form_factor(world.geometry(), point.position, point.side, light, AREA_M2) as f32
    };
    points.iter().map(factor).collect()
}

#[test]
fn form_factors_equal_the_reference() {
    let (world, points) = world();
    let mut near = near_lights(&world, &points);
    let is_diffuse = |side: u32| world.surfaces[side as usize / 2].side_is_active(side % 2 == 1);
    let (mut corrected_points, mut differing) = (0, 0);
    // Over the floor, at the wall's foot, and where the correction fades out.
    for (x, height) in [(-0.25, 1e-3), (-0.25, 1.5e-2), (-2e-3, 1e-3), (0.3, 0.031)] {
        let light = LightSource::point(Vec3::new(x, FLOOR + height, 0.02), Vec3::ONE);
        let before = factors_of(&world, &points, &light);
        let (after, inputs) = corrected(&world, &mut near, &light, &before);
        let inputs = inputs.expect("the light is near the floor");
        let rays: Vec<(Vec3, f64)> =
            inputs.rays.iter().map(|ray| (ray.direction, f64::from(ray.flux))).collect();
        let near_points: Vec<cpu::near_lights::Point> = inputs
            .points
            .iter()
            .map(|point| cpu::near_lights::Point {
                position: point.position.as_dvec3(),
                normal: point.normal.as_dvec3(),
                area_m2: f64::from(point.area_m2),
            })
            .collect();
        let reference = cpu::near_lights::corrections(
            world.geometry(),
            is_diffuse,
            &cpu::near_lights::Near {
                light: light.position,
                rays: &rays,
                points: &near_points,
                mean_spacing: f64::from(SPACING),
                spacing: f64::from(inputs.spacing),
                area_m2: f64::from(AREA_M2),
            },
        );
        let mut expected: Vec<f64> = before.iter().map(|&factor| f64::from(factor)).collect();
        for (point, [kept, added]) in inputs.points.iter().zip(reference) {
            expected[point.index as usize] = kept * expected[point.index as usize] + added;
        }
        let most = expected.iter().copied().fold(0.0, f64::max);
        for ((&after, &before), expected) in after.iter().zip(&before).zip(expected) {
            corrected_points += usize::from(after != before);
            differing +=
                usize::from((f64::from(after) - expected).abs() > 1e-4 * expected.abs() + 1e-6 * most);
        }
    }
    // Points at the limit of a hit's clearance may fall on either side of it.
    println!("{corrected_points} form factors, {differing} differ");
    assert!(
        corrected_points > 2000 && differing * 200 < corrected_points,
        "{differing} of {corrected_points}"
    );
    assert_silent(&context());
}

/// Irradiance of the entry points by a light over the floor, per unit of its intensity: the sum,
/// and the maximum behind the wall, sr.
fn received(world: &World, points: &[PathVertex], near: &mut NearLights, light: &LightSource) -> [f64; 2] {
    let (factors, _) = corrected(world, near, light, &factors_of(world, points, light));
    let behind = points.iter().zip(&factors).filter(|(point, _)| point.position.x > 0.0);
    let behind = behind.fold(0.0, |most: f64, (_, factor)| most.max(f64::from(*factor)));
    [f64::from(AREA_M2) * factors.iter().map(|&factor| f64::from(factor)).sum::<f64>(), behind]
}

#[test]
fn a_light_beside_a_floor_lights_it_wherever_entry_points_are() {
    let (world, points) = world();
    let mut near = near_lights(&world, &points);
    // At a position with entry points far to all sides, except behind the wall.
    for height in [1e-6, 1e-4, 1e-3, 5e-3, 2e-2, 3e-2] {
        let position = Vec3::new(-0.25, FLOOR + height, 0.02);
        let light = LightSource::point(position, Vec3::ONE);
        let [all, behind] = received(&world, &points, &mut near, &light);
        // The light that goes down, minus the light that goes beyond the entry points. The wall
        // takes little of the light so near to the floor.
        let far = PI * f64::from(height) / 0.25;
        println!("{height:e} m: {:.4} of 2π, {:.4} beyond", all / TAU, far / TAU);
        assert!(all < 1.01 * TAU && all > 0.99 * TAU - 2.0 * far, "{height:e} m: {all} sr of {TAU}");
        assert_eq!(behind, 0.0, "{height:e} m");
        let cone =
            LightSource { kind: LIGHT_SPOT, axis: Vec3::NEG_Y, inner_angle: 0.3, outer_angle: 0.3, ..light };
        let [all, _] = received(&world, &points, &mut near, &cone);
        let expected = TAU * (1.0 - 0.3_f64.cos());
        assert!(height > 1e-2 || (all / expected - 1.0).abs() < 0.02, "{height:e} m: {all} sr of {expected}");
    }
    // Close to the foot of the wall: half of the light that goes down meets the wall or is
    // reflected, and none comes through.
    let light = LightSource::point(Vec3::new(-1.5e-3, FLOOR + 1e-3, 0.02), Vec3::ONE);
    let [all, behind] = received(&world, &points, &mut near, &light);
    println!("beside the wall: {:.4} of 2π", all / TAU);
    assert!(all > 0.5 * TAU && all < 0.9 * TAU && behind == 0.0, "{all} sr, {behind} behind");
    assert_silent(&context());
}

#[test]
fn lights_away_from_all_surface_change_nothing() {
    let (world, points) = world();
    let mut near = near_lights(&world, &points);
    let at = |height: f32| LightSource::point(Vec3::new(-0.25, FLOOR + height, 0.02), Vec3::ONE);
    let mut is_changed = |light: &LightSource| {
        let before = factors_of(&world, &points, light);
        let (after, inputs) = corrected(&world, &mut near, light, &before);
        assert_eq!(after != before, inputs.is_some());
        after != before
    };
    assert!(!is_changed(&at(4.1 * SPACING)));
    assert!(is_changed(&at(3.9 * SPACING)));
    let upwards =
        LightSource { kind: LIGHT_SPOT, axis: Vec3::Y, inner_angle: 0.3, outer_angle: 0.3, ..at(1e-3) };
    assert!(!is_changed(&upwards), "it does not light the floor");
    assert_silent(&context());
}
