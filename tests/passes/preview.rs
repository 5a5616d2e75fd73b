//! The preview: direct light before there are light paths equals the renderer's direct light
//! to the bit.

use crate::common::{assert_silent, context};
use crate::world::textured;
use glam::Vec3;
use lightpaths::renderer::{Layer, Preview, Renderer, Silent};
use lightpaths::scene::emission::Sky;
use lightpaths::scene::environment::Environment;
use lightpaths::scene::{Camera, DisplayTransform, Emission, Light, LightKind, Quality, Scene, shapes};
use std::sync::Arc;

fn scene() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.6);
    scene.cameras[0].size = [67, 45];
    scene.quality =
        Quality { entry_points: 500, cache_points: 50, edge_samples: 0, cells: 8, ..Quality::DRAFT };
    let (edge_u, edge_v) = (Vec3::new(0.2, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.2));
    let corner = Vec3::new(0.1, 0.3, 0.1);
    let kind = LightKind::Area { corner, edge_u, edge_v, radiance: Vec3::new(1.0, 2.0, 3.0), samples: 20 };
    scene.lights.push(Light::new("large", kind));
    scene
}

#[test]
fn direct_light_is_what_the_renderer_shows_of_it() {
    for (what, scene) in [("plain", scene()), ("textured", textured(scene()))] {
        let mut preview = Preview::new(&context(), scene.clone()).unwrap();
        let mut renderer = Renderer::new(&context(), scene.clone(), &mut Silent).unwrap();
        renderer.set_light_weights([1.0, 0.0]);
        let mut show = |camera: &Camera, lights: &[Light], stops: f32| -> [Vec<u32>; 2] {
            preview.frame(camera, lights, &scene.materials, DisplayTransform::exposed(stops)).unwrap();
            renderer.resize(camera.size).unwrap();
            renderer.set_camera(camera);
            renderer.set_exposure(stops);
            for (index, light) in lights.iter().enumerate() {
                renderer.set_light(index, light.kind).unwrap();
                renderer.switch_light(index, light.is_on).unwrap();
            }
            renderer.frame().unwrap();
            [preview.display().read().unwrap(), renderer.display_buffer().read().unwrap()]
        };
        let (mut camera, mut lights) = (scene.cameras[0].clone(), scene.lights.clone());
        let [first, expected] = show(&camera, &lights, 0.0);
        assert!(first == expected, "{what}: as loaded");
        lights[0].kind = lights[0].kind.moved_to(Vec3::new(0.2, 0.1, -0.1));
        camera.position += Vec3::new(0.05, 0.02, 0.0);
        let [moved, expected] = show(&camera, &lights, 1.0);
        assert!(moved == expected && moved != first, "{what}: light and camera moved");
        lights[1].is_on = false;
        camera.size = [31, 64];
        let [fewer, expected] = show(&camera, &lights, -0.5);
        assert!(fewer == expected, "{what}: one light, another size");
        let lit = fewer.iter().filter(|pixel| *pixel & 0xff_ffff != 0).count();
        assert!(lit > fewer.len() / 2, "{what}: {lit} pixels are lit");
    }
    assert_silent(&context());
}

/// A renderer without light paths builds almost no clusters, and shows the same direct light.
#[test]
fn direct_light_needs_neither_light_paths_nor_clusters() {
    for (what, scene) in [("plain", scene()), ("textured", textured(scene()))] {
        let show = |quality: Quality| {
            let scene = Scene { quality, ..scene.clone() };
            let mut renderer = Renderer::new(&context(), scene, &mut Silent).unwrap();
            renderer.frame().unwrap();
            (renderer.layer(Layer::Direct).unwrap(), renderer)
        };
        for edge_samples in [0, 8] {
            let quality = Quality { edge_samples, ..scene.quality.clone() };
            let (expected, all) = show(quality.clone());
            let (direct, alone) = show(Quality { entry_points: 0, cache_points: 0, ..quality });
            assert!(direct == expected, "{what}: {edge_samples} edge samples");
            assert!(alone.layer(Layer::Beauty).unwrap() == expected, "{what}: there is no other light");
            let clusters = |renderer: &Renderer| renderer.statistics().unwrap().counts["clusters"];
            assert!(clusters(&alone) * 10 < clusters(&all), "{what}: {}", clusters(&alone));
            assert_eq!(alone.scene().warnings, scene.warnings, "{what}: nothing is said of indirect light");
        }
    }
    assert_silent(&context());
}

/// A sky shows in the preview: evenly, since shadows of it take cache points.
#[test]
fn the_sky_lights_the_preview_evenly() {
    let mut scene = scene();
    scene.triangles.truncate(2);
    let sky = Some(Sky::new(Environment::constant(), 64));
    scene.emission = Arc::new(Emission::new(&scene.triangles, &scene.materials, sky));
    let kind = LightKind::Sky { radiance: Vec3::splat(0.5), turn: 0.0, channel: None };
    scene.lights = vec![Light::new("sky", kind)];
    let mut preview = Preview::new(&context(), scene.clone()).unwrap();
    let mut show = |lights: &[Light]| {
        preview.frame(&scene.cameras[0], lights, &scene.materials, DisplayTransform::default()).unwrap();
        preview.radiance().unwrap()
    };
    // Half of the sky's radiance at an albedo of 0.6, and the sky itself.
    for pixel in show(&scene.lights) {
        assert!((pixel[0] - 0.15).abs() < 1e-5 || (pixel[0] - 0.5).abs() < 1e-5, "{pixel:?}");
    }
    let off = Light { is_on: false, ..scene.lights[0].clone() };
    assert!(show(&[off]).iter().all(|pixel| pixel[0] == 0.0));
    assert_silent(&context());
}
