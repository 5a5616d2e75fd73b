//! Powers, albedos and quality settings at the ends of their ranges.

use crate::common::{assert_silent, context, random_words};
use crate::{FEW, SMALL, assert_finite, count, prepare, render, room, the_box};
use glam::Vec3;
use lightpaths::Error;
use lightpaths::passes::precompute::entry_points::DENSEST;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{Light, LightKind, Quality, Scene, shapes};
use lightpaths::types::{Contribution, Record};

fn with_intensity(mut scene: Scene, watts_per_steradian: f32) -> Scene {
    for light in &mut scene.lights {
        if let LightKind::Point { intensity, .. } = &mut light.kind {
            *intensity = Vec3::splat(watts_per_steradian);
        }
    }
    scene
}

#[test]
fn pictures_are_linear_in_the_power_of_the_light() {
    let mut edited = render(with_intensity(the_box(&[]), 1.0), FEW);
    let unit = edited.layer(Layer::Beauty).unwrap();
    // At load and as an edit, at the ends of the range.
    for (power, is_loaded) in
        [(1e-8, true), (1e12, true), (1e-8, false), (1e-3, false), (1e6, false), (1e12, false)]
    {
        let beauty = if is_loaded {
            render(with_intensity(the_box(&[]), power), FEW).layer(Layer::Beauty).unwrap()
        } else {
            let kind = edited.scene().lights[0].kind.with_emission(Vec3::splat(power));
            edited.set_light(0, kind).unwrap();
            edited.frame().unwrap();
            assert_finite(&edited);
            edited.layer(Layer::Beauty).unwrap()
        };
        for (pixel, unit) in beauty.as_flattened().iter().zip(unit.as_flattened()) {
            let expected = power * unit;
            assert!(
                (pixel - expected).abs() <= 1e-4 * expected,
                "{power} W/sr: {pixel} instead of {expected}"
            );
        }
    }
    assert_silent(&context());
}

/// Two separate rooms in one scene, one lit a hundred million times as brightly as the other.
#[test]
fn light_beside_what_is_much_brighter_is_not_lost() {
    let open = |wall: usize, x: f32| {
        let mut triangles = shapes::closed_box(Vec3::ONE, 0.5).triangles;
        triangles.drain(2 * wall..2 * wall + 2);
        for triangle in &mut triangles {
            triangle.positions = triangle.positions.map(|p| p + x * Vec3::X);
        }
        triangles
    };
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    // Without front and back walls.
    scene.triangles = [open(3, 0.0), open(0, 3.0)].concat();
    let lamp = |x: f32, power: f32| {
        let kind = LightKind::Point { position: x * Vec3::X, intensity: Vec3::splat(power) };
        Light::new(format!("{power:e}"), kind)
    };
    scene.lights = vec![lamp(0.0, 1.0), lamp(3.0, 1e8)];
    let mut renderer = render(scene, SMALL);
    let both = renderer.layer(Layer::Indirect).unwrap();
    let irradiance: Vec<Vec3> = renderer.stages().cluster_irradiance.read().unwrap();
    let brightest = irradiance.iter().map(|e| e.x).fold(0.0, f32::max);
    renderer.switch_light(1, false).unwrap();
    renderer.frame().unwrap();
    let mut range = [f32::INFINITY, 0.0];
    for (both, alone) in
        both.as_flattened().iter().zip(renderer.layer(Layer::Indirect).unwrap().as_flattened())
    {
        assert!((both - alone).abs() <= 1e-5 * alone, "{both} instead of {alone} W/m²/sr");
        range = [range[0].min(*alone), range[1].max(*alone)];
    }
    println!("{range:?} W/m²/sr in the picture, beside {brightest} W/m²");
    assert!(range[0] > 0.0 && brightest > 1e8 * range[1]);
    assert_silent(&context());
}

fn check_materials(rounds: usize, quality: &Quality, scene: impl Fn() -> Scene) {
    let mut words = random_words(7, 20 * rounds * 64).into_iter();
    let mut unit = || (words.next().unwrap() >> 8) as f32 / 16_777_216.0;
    let mut renderer = None;
    for round in 0..rounds {
        // Every fourth round is a cold start with these materials; the others are edits.
        let is_cold = round % 4 == 0;
        let mut cold = scene();
        let powers = [1e-8, 1.0, 1e12];
        let power = powers[round % 3];
        for index in 0..cold.materials.len() {
            let mut albedo =
                || Vec3::from([0; 3].map(|_| [0.0, 1.0, unit(), unit()][(4.0 * unit()) as usize % 4]));
            let (mut diffuse, mut specular) = (albedo(), albedo());
            // With only white surfaces no path ends, and the scene is refused.
            diffuse.x = diffuse.x.min(0.9);
            let exponent = 10f32.powf(6.0 * unit());
            let material = &mut cold.materials[index];
            specular = if material.editable { specular } else { Vec3::ZERO };
            if !is_cold {
                let edited: &mut Renderer = renderer.as_mut().unwrap();
                edited.set_material(index, diffuse, specular, exponent).unwrap();
            }
            (material.diffuse, material.specular, material.exponent) = (diffuse, specular, exponent);
            material.conserve_energy();
        }
        if is_cold {
            renderer = Some(prepare(with_intensity(cold, power), quality.clone()));
        }
        let renderer = renderer.as_mut().unwrap();
        for light in 0..renderer.scene().lights.len() {
            let kind = renderer.scene().lights[light].kind.with_emission(Vec3::splat(power));
            renderer.set_light(light, kind).unwrap();
        }
        renderer.frame().unwrap();
        assert_finite(renderer);
    }
    assert_silent(&context());
}

/// The Box with only editable materials.
fn fickle_box() -> Scene {
    let mut scene = the_box(&["camera.size=[40,30]".to_owned()]);
    scene.materials.iter_mut().for_each(|material| material.editable = true);
    scene
}

#[test]
fn random_materials_and_powers_give_finite_pictures() {
    check_materials(6, &FEW, fickle_box);
}

#[test]
#[ignore = "full size: make stress"]
fn many_random_materials_and_powers_give_finite_pictures() {
    check_materials(200, &SMALL, fickle_box);
}

#[test]
fn a_dark_light_leaves_everything_black() {
    let renderer = render(with_intensity(the_box(&[]), 0.0), FEW);
    assert!(renderer.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    assert_silent(&context());
}

#[test]
fn black_walls_have_no_indirect_light() {
    let renderer = render(shapes::closed_box(Vec3::ONE, 0.0), FEW);
    assert!(renderer.layer(Layer::Indirect).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    let irradiance: Vec<Vec3> = renderer.stages().cluster_irradiance.read().unwrap();
    assert!(irradiance.iter().any(|e| e.x > 0.0), "direct light arrives all the same");
    let mut edited = render(shapes::closed_box(Vec3::ONE, 0.5), FEW);
    edited.set_diffuse(0, Vec3::ZERO).unwrap();
    edited.frame().unwrap();
    assert!(edited.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]), "edited to black");
    assert_silent(&context());
}

/// If no surface absorbs, no path ends. The vertices fill the device's memory before the renderer
/// refuses the scene.
#[test]
#[ignore = "full size: make stress"]
fn a_closed_room_that_absorbs_nothing_is_refused() {
    let mut scene = shapes::closed_box(Vec3::ONE, 1.0);
    scene.quality = Quality { entry_points: 100_000, ..SMALL };
    let Err(Error::OutOfMemory(message)) = Renderer::new(&context(), scene, &mut Silent).map(|_| ()) else {
        panic!("it was rendered")
    };
    assert!(message.contains("quality.entry_points"), "{message}");
    assert_silent(&context());
}

/// The integrating sphere with nearly white walls, beyond `tests/physics/sphere.rs`. A path has a
/// hundred bounces, so the mean of these paths is accurate to a quarter of a per cent.
#[test]
#[ignore = "full size: make stress"]
fn a_white_furnace_is_as_bright_as_its_closed_form() {
    const ALBEDO: f32 = 0.99;
    let scene = shapes::integrating_sphere(1.5, 3, ALBEDO, Vec3::new(0.2, 0.1, -0.3), 10.0);
    let expected = 10.0 / scene.area_m2() * f64::from(ALBEDO / (1.0 - ALBEDO));
    let quality = Quality { entry_points: 200_000, cache_points: 400, ..Quality::PAPER };
    let mut renderer = prepare(scene, quality);
    renderer.set_skipping(false);
    renderer.frame().unwrap();
    let records: Vec<Record> = renderer.stages().records.read().unwrap();
    let emission_scale = renderer.stages().emission_scale;
    let sum: f64 = records.iter().map(|record| f64::from((emission_scale * record.irradiance).x)).sum();
    let error = sum / records.len() as f64 / expected - 1.0;
    println!("albedo {ALBEDO}: {:+.3} %", 100.0 * error);
    assert!(error.abs() <= 5e-3, "{error}");
    assert_silent(&context());
}

#[test]
fn each_setting_at_its_least() {
    let least = Quality { entry_points: 1, cache_points: 1, gather_rays: 4, cells: 8, ..FEW };
    let sphere = || shapes::integrating_sphere(1.0, 2, 0.5, Vec3::ZERO, 1.0);
    for (scene, quality) in [
        (room(), Quality { entry_points: 1, ..FEW }),
        (the_box(&[]), Quality { cache_points: 1, ..FEW }),
        (room(), Quality { gather_rays: 4, ..FEW }),
        (sphere(), Quality { cells: 8, ..FEW }),
        (the_box(&[]), least.clone()),
        (sphere(), least),
    ] {
        let renderer = render(scene, quality.clone());
        assert!(count(&renderer, "cache points") <= u64::from(quality.cache_points));
        assert!(count(&renderer, "cache points") >= 1);
    }
    assert_silent(&context());
}

#[test]
fn two_lights_add_up() {
    let lights = [Vec3::new(-0.3, 0.2, 0.1), Vec3::new(0.3, 0.1, -0.2)].map(|position| {
        let kind = LightKind::Point { position, intensity: Vec3::new(1.0, 0.5, 0.25) };
        Light::new(format!("{position}"), kind)
    });
    let picture = |lights: &[Light]| {
        // The set of edge pixels, shadow edges included, is not additive over lights.
        let quality = Quality { edge_samples: 0, ..FEW };
        let renderer = render(Scene { lights: lights.to_vec(), ..room() }, quality);
        renderer.layer(Layer::Beauty).unwrap().into_flattened()
    };
    let (one, other, both) = (picture(&lights[..1]), picture(&lights[1..]), picture(&lights));
    for ((one, other), both) in one.iter().zip(&other).zip(&both) {
        assert!((both - one - other).abs() <= 1e-4 * both, "{one} + {other} = {both}");
    }
    assert_silent(&context());
}

#[test]
fn a_scene_without_a_light_is_black() {
    let mut scene = the_box(&[]);
    scene.lights.clear();
    let renderer = render(scene, FEW);
    assert!(renderer.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    assert_silent(&context());
}

/// Surfaces that see no other surface: light is not reflected twice.
#[test]
fn scenes_without_any_bounce() {
    let mut square = shapes::facing_squares(1.0, 0.0, 0.5);
    square.triangles.truncate(2);
    let mut triangle = square.clone();
    triangle.triangles.truncate(1);
    for mut scene in [square, triangle] {
        scene.cameras[0].position = Vec3::new(0.1, 1.0, 0.8);
        scene.lights[0].kind = LightKind::Point { position: Vec3::new(0.0, 1.0, 0.0), intensity: Vec3::ONE };
        let renderer = render(scene, SMALL);
        let lit = |layer: Layer| renderer.layer(layer).unwrap().iter().any(|pixel| pixel[0] > 0.0);
        assert!(lit(Layer::Direct) && lit(Layer::Beauty) && !lit(Layer::Indirect));
        assert_eq!(count(&renderer, "pixels without a covering record"), 0, "nobody wants one");
    }
    assert_silent(&context());
}

#[test]
fn throughputs_are_shares_of_what_paths_start_with() {
    let renderer = render(the_box(&[]), FEW);
    let contributions: Vec<Contribution> = renderer.stages().contributions.read().unwrap();
    // The weight of an entry point is the mean density over its own density; reflection and
    // roulette never increase it.
    let is_fraction = |t: Vec3| t.is_finite() && t.cmpge(Vec3::ZERO).all() && t.max_element() <= DENSEST;
    assert!(contributions.iter().all(|contribution| is_fraction(contribution.throughput)));
    assert_silent(&context());
}
