//! The renderer warns of settings that are too coarse for a light, and of no others.

use crate::common::{assert_silent, context};
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::scene::{Light, LightKind, LoadOptions, Quality, Scene, Triangle, shapes};

/// A room of 5 × 2.6 × 4 m. The sun falls through a square window of width `window`. Around it is a
/// ground of width `ground`, if not zero.
fn room(window: f32, ground: f32) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(5.0, 2.6, 4.0), 0.75);
    scene.triangles.retain(|triangle| !triangle.positions.iter().all(|corner| corner.x < -2.49));
    let mut quad = |corners: [Vec3; 4]| {
        let [a, b, c, d] = corners;
        for positions in [[a, b, c], [a, c, d]] {
            let mut made = Triangle { positions, normals: [Vec3::X; 3], material: 0, object: 0 };
            made.normals = [made.geometric_normal(); 3];
            scene.triangles.push(made);
        }
    };
    let half = 0.5 * window;
    let mut wall = |low: [f32; 2], high: [f32; 2]| {
        let corner = |y, z| Vec3::new(-2.5, y, z);
        quad([
            corner(low[0], low[1]),
            corner(high[0], low[1]),
            corner(high[0], high[1]),
            corner(low[0], high[1]),
        ]);
    };
    wall([-1.3, -2.0], [-half, 2.0]);
    wall([half, -2.0], [1.3, 2.0]);
    wall([-half, -2.0], [half, -half]);
    wall([-half, half], [half, 2.0]);
    if ground > 0.0 {
        let corner = |x: f32, z: f32| Vec3::new(x * ground, -1.31, z * ground);
        quad([corner(-0.5, -0.5), corner(-0.5, 0.5), corner(0.5, 0.5), corner(0.5, -0.5)]);
    }
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (Vec3::new(2.2, 0.1, 1.8), Vec3::new(-0.6, -0.4, -0.6));
    (camera.fov_y_degrees, camera.size) = (70.0, [24, 18]);
    scene.lights[0].kind =
        LightKind::Directional { direction: Vec3::new(1.0, -0.7, -0.15), irradiance: Vec3::splat(100.0) };
    scene
}

fn warnings(scene: Scene, quality: &Quality) -> Vec<String> {
    let about = |warning: &&String| warning.contains("quality.entry_points") || warning.contains("cells are");
    render(scene, quality.clone()).scene().warnings.iter().filter(about).cloned().collect()
}

#[test]
fn a_light_that_few_entry_points_carry_is_told() {
    let quality = Quality { entry_points: 100_000, ..SMALL };
    let told = warnings(room(0.1, 0.0), &quality);
    assert!(told.len() == 1 && told[0].contains("--set quality.entry_points="), "{told:?}");
    assert_eq!(warnings(room(1.2, 0.0), &quality), Vec::<String>::new());
    // With the suggested number, a small window is right, too.
    let value = told[0].rsplit('=').next().unwrap().trim_end_matches(')').parse().unwrap();
    assert!((800_000..4_000_000).contains(&value), "{told:?}");
    // Entry points outside do not help a camera inside.
    let told = warnings(room(0.3, 1000.0), &quality);
    assert!(!told.is_empty(), "a small building on a large ground");
    assert_silent(&context());
}

/// The room is beside a box with the camera and a light. The box opens away from the sun.
#[test]
fn what_few_entry_points_carry_where_no_camera_looks_is_not_told() {
    let mut scene = room(0.1, 0.0);
    let away = Vec3::new(6.0, 0.0, 6.0);
    let mut shelter = shapes::closed_box(Vec3::splat(2.0), 0.5).triangles;
    shelter.retain(|triangle| !triangle.positions.iter().all(|corner| corner.x > 0.99));
    for triangle in &mut shelter {
        triangle.positions = triangle.positions.map(|corner| corner + away);
    }
    scene.triangles.extend(shelter);
    let lamp = LightKind::Point { position: away + Vec3::new(0.2, 0.3, 0.1), intensity: Vec3::splat(50.0) };
    scene.lights.push(Light::new("lamp", lamp));
    let quality = Quality { entry_points: 100_000, ..SMALL };
    let told = |scene: &Scene| {
        let told = warnings(scene.clone(), &quality).into_iter();
        told.filter(|warning| warning.contains("quality.entry_points")).collect::<Vec<_>>()
    };
    assert_eq!(told(&scene).len(), 1, "the camera in the room");
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (away + Vec3::X * 0.9, away - Vec3::X);
    assert_eq!(told(&scene), [""; 0], "the camera in the box");
    assert_silent(&context());
}

#[test]
fn built_in_scenes_are_resolved() {
    // Neither pixels nor records affect the result.
    let set = vec!["camera.size=[16,16]".to_owned()];
    let scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    assert_eq!(warnings(scene, &Quality { cache_points: 100, ..Quality::DRAFT }), Vec::<String>::new());
    assert_silent(&context());
}
