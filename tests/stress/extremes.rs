//! Powers, albedos and quality settings at the ends of their ranges.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_finite, count, prepare, render, the_box};
use glam::Vec3;
use lightpaths::renderer::{Edit, Layer, Renderer, Silent};
use lightpaths::scene::{LightKind, Quality, Scene, shapes};
use lightpaths::types::Deposit;

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
    let beauty =
        |power: f32| render(with_intensity(the_box(&[]), power), SMALL).layer(Layer::Beauty).unwrap();
    let unit = beauty(1.0);
    for power in [1e-8, 1e-3, 1e6, 1e12] {
        for (pixel, unit) in beauty(power).as_flattened().iter().zip(unit.as_flattened()) {
            let expected = power * unit;
            assert!(
                (pixel - expected).abs() <= 1e-4 * expected,
                "{power} W/sr: {pixel} instead of {expected}"
            );
        }
    }
    assert_silent(&context());
}

#[test]
fn a_dark_lamp_leaves_everything_black() {
    let renderer = render(with_intensity(the_box(&[]), 0.0), SMALL);
    assert!(renderer.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    assert_silent(&context());
}

#[test]
fn black_walls_have_no_indirect_light() {
    let renderer = render(shapes::closed_box(Vec3::ONE, 0.0), SMALL);
    assert!(renderer.layer(Layer::Indirect).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    let irradiance: Vec<Vec3> = renderer.stages().cluster_irradiance.read().unwrap();
    assert!(irradiance.iter().any(|e| e.x > 0.0), "direct light arrives all the same");
    let mut edited = render(shapes::closed_box(Vec3::ONE, 0.5), SMALL);
    edited.set_diffuse(0, Vec3::ZERO).unwrap();
    edited.frame(Edit::Material).unwrap();
    assert!(edited.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]), "edited to black");
    assert_silent(&context());
}

#[test]
fn paths_end_even_where_nothing_is_absorbed() {
    let renderer = render(shapes::closed_box(Vec3::ONE, 1.0), Quality { entry_points: 2_000, ..SMALL });
    assert!(renderer.layer(Layer::Indirect).unwrap().iter().all(|pixel| pixel[0] > 1.0));
    assert_silent(&context());
}

#[test]
fn each_setting_at_its_least() {
    let least = Quality { entry_points: 1, cache_points: 1, gather_rays: 4, cells: 8, ..SMALL };
    for quality in [
        Quality { entry_points: 1, ..SMALL },
        Quality { cache_points: 1, ..SMALL },
        Quality { gather_rays: 4, ..SMALL },
        Quality { cells: 8, ..SMALL },
        least,
    ] {
        for scene in [the_box(&[]), shapes::integrating_sphere(1.0, 2, 0.5, Vec3::ZERO, 1.0)] {
            let renderer = render(scene, quality.clone());
            assert!(count(&renderer, "cache points") <= u64::from(quality.cache_points));
            assert!(count(&renderer, "cache points") >= 1);
        }
    }
    assert_silent(&context());
}

#[test]
fn two_lights_add_up() {
    let lights = [Vec3::new(-0.4, 0.5, 0.2), Vec3::new(0.4, 0.6, -0.1)].map(|position| {
        let kind = LightKind::Point { position, intensity: Vec3::new(1.0, 0.5, 0.25) };
        lightpaths::scene::Light { name: format!("{position}"), kind }
    });
    let picture = |lights: Vec<_>| {
        let mut scene = the_box(&[]);
        scene.lights = lights;
        render(scene, SMALL).layer(Layer::Beauty).unwrap()
    };
    let [one, other] = lights.clone().map(|light| picture(vec![light]));
    for ((both, one), other) in
        picture(lights.to_vec()).as_flattened().iter().zip(one.as_flattened()).zip(other.as_flattened())
    {
        // Irradiance extrapolated below zero is cut off for each picture apart.
        assert!((both - one - other).abs() <= 1e-3 * both + 1e-4, "{one} + {other} = {both}");
    }
    assert_silent(&context());
}

#[test]
fn a_scene_without_a_light_is_black() {
    let mut scene = the_box(&[]);
    scene.lights.clear();
    let renderer = render(scene, SMALL);
    assert!(renderer.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    assert_silent(&context());
}

/// Surfaces that see no other surface: light arrives and leaves for good.
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
        assert_eq!(count(&renderer, "pixels without a record"), 0, "nobody wants one");
    }
    assert_silent(&context());
}

#[test]
fn deposits_hold_no_throughput_that_is_not_a_share() {
    let renderer = prepare(the_box(&[]), SMALL);
    drop(renderer);
    let renderer = render(the_box(&[]), SMALL);
    let deposits: Vec<Deposit> = renderer.stages().deposits.read().unwrap();
    let is_share = |d: &Deposit| {
        d.throughput.is_finite() && d.throughput.cmpge(Vec3::ZERO).all() && d.throughput.max_element() <= 1.0
    };
    assert!(deposits.iter().all(is_share), "no albedo of the Box is above one half of its neighbours'");
    assert_finite(&renderer);
    assert_silent(&context());
}

/// What cannot be held is refused in words, not by a crash.
#[test]
fn too_many_path_vertices_are_refused() {
    let mut scene = shapes::closed_box(Vec3::ONE, 1.0);
    scene.quality = Quality { entry_points: 120_000, ..SMALL };
    match Renderer::new(&context(), scene, &mut Silent).map(|_| ()) {
        Err(lightpaths::Error::OutOfMemory(message)) => assert!(message.contains("deposits"), "{message}"),
        Ok(()) => {}
        Err(other) => panic!("{other}"),
    }
    assert_silent(&context());
}
