//! Powers, albedos and quality settings at the ends of their ranges.

use crate::common::{assert_silent, context};
use crate::{SMALL, count, render, room, the_box};
use glam::Vec3;
use lightpaths::Error;
use lightpaths::passes::precompute::entry_points::DENSEST;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{Light, LightKind, Quality, Scene, shapes};
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
    edited.frame().unwrap();
    assert!(edited.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]), "edited to black");
    assert_silent(&context());
}

/// Where nothing is absorbed, no path ever ends.
#[test]
fn a_closed_room_that_absorbs_nothing_is_refused() {
    let mut scene = shapes::closed_box(Vec3::ONE, 1.0);
    scene.quality = Quality { entry_points: 100_000, ..SMALL };
    let Err(Error::OutOfMemory(message)) = Renderer::new(&context(), scene, &mut Silent).map(|_| ()) else {
        panic!("it was rendered")
    };
    assert!(message.contains("quality.entry_points"), "{message}");
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
    let lights = [Vec3::new(-0.3, 0.2, 0.1), Vec3::new(0.3, 0.1, -0.2)].map(|position| {
        let kind = LightKind::Point { position, intensity: Vec3::new(1.0, 0.5, 0.25) };
        Light { name: format!("{position}"), kind, is_on: true }
    });
    let picture = |lights: &[Light]| {
        // Which pixels show an edge, a shadow's among them, is no sum over lights.
        let quality = Quality { edge_samples: 0, ..SMALL };
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
        assert_eq!(count(&renderer, "pixels without a covering record"), 0, "nobody wants one");
    }
    assert_silent(&context());
}

#[test]
fn throughputs_are_shares_of_what_paths_start_with() {
    let renderer = render(the_box(&[]), SMALL);
    let deposits: Vec<Deposit> = renderer.stages().deposits.read().unwrap();
    // The weight of an entry point is the mean density over its own; reflection and roulette never raise it.
    let is_share = |t: Vec3| t.is_finite() && t.cmpge(Vec3::ZERO).all() && t.max_element() <= DENSEST;
    assert!(deposits.iter().all(|deposit| is_share(deposit.throughput)));
    assert_silent(&context());
}
