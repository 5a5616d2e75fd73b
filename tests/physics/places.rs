//! The atrium and the room through the whole pipeline, coarsely cut and at few entry points: energy against the path tracer, covered pixels,
//! and walls that keep light out.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use crate::{assert_close, render};
use glam::Vec3;
use lightpaths::reference::Progressive;
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, LoadOptions, Quality, Scene};

/// Settings for places with thousands of parts in a few seconds.
const COARSE: Quality = Quality {
    preset: "test",
    entry_points: 60_000,
    cache_points: 6_000,
    gather_rays: 64,
    cells: 32,
    ..Quality::DRAFT
};

const SIZE: [u32; 2] = [64, 48];

fn place(name: &str) -> Scene {
    let set = vec!["model.0.triangles=15000".to_owned()];
    Scene::load(name, &LoadOptions { set, size: Some(SIZE), ..LoadOptions::default() }).unwrap()
}

/// Sum over all pixels and channels.
fn energy(pixels: &[[f32; 3]]) -> f64 {
    pixels.as_flattened().iter().map(|value| f64::from(*value)).sum()
}

#[test]
fn places_have_the_path_tracers_energy() {
    for (name, sky) in [("atrium", 0.3), ("room", 0.0)] {
        let renderer = render(place(name), COARSE);
        let statistics = renderer.statistics().unwrap();
        let uncovered = statistics.counts["pixels without a covering record"];
        let pixels = u64::from(SIZE[0] * SIZE[1]);
        assert!(uncovered < pixels / 50, "{name}: {uncovered} pixels without a covering record");
        let layer = |layer| renderer.layer(layer).unwrap();
        let is_black = |pixel: &&[f32; 3]| pixel.iter().all(|value| *value == 0.0);
        let black = layer(Layer::Beauty).iter().filter(is_black).count();
        assert!((black as f64) < sky * pixels as f64 + 1.0, "{name}: {black} black pixels");

        let traced = trace(place(name), SIZE, 96).picture().unwrap();
        assert_close(name, energy(&layer(Layer::Beauty)), energy(&traced.beauty), 0.03);
        assert_close(name, energy(&layer(Layer::Direct)), energy(&traced.direct), 0.02);
    }
    assert_silent(&context());
}

/// A light behind a wall, over the ceiling or under the floor lights nothing that a camera inside sees.
#[test]
fn no_light_comes_through_the_walls() {
    let hidden = [
        ("room", [Vec3::new(0.3, 1.5, -2.9), Vec3::new(0.0, 3.1, 0.0), Vec3::new(3.0, -0.3, 0.5)]),
        ("atrium", [Vec3::new(1.0, 2.0, 8.6), Vec3::new(-15.8, 4.0, 0.0), Vec3::new(0.0, -0.9, 0.0)]),
    ];
    for (name, places) in hidden {
        let mut scene = place(name);
        scene.lights.truncate(1);
        let LightKind::Point { intensity, .. } = scene.lights[0].kind else { panic!("{:?}", scene.lights) };
        let origin = scene.origin.as_vec3();
        let mut renderer = render(scene, COARSE);
        let lit = energy(&renderer.layer(Layer::Indirect).unwrap());
        for position in places {
            let kind = LightKind::Point { position: position - origin, intensity };
            renderer.set_light(0, kind).unwrap();
            renderer.frame().unwrap();
            let leak = |layer| energy(&renderer.layer(layer).unwrap());
            assert_eq!(leak(Layer::Direct), 0.0, "{name}: light at {position}");
            // Clusters of an eave hold what is outside, too.
            assert!(leak(Layer::Indirect) <= 1e-5 * lit, "{name}: light at {position}");
        }
    }
    assert_silent(&context());
}
