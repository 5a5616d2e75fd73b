//! Points that see a light alike take one shadow ray: each light is the same, bit for bit, as with
//! a ray for each point.

use crate::common::assert_silent;
use crate::dark_sides;
use crate::determinism::bits;
use glam::Vec3;
use lightpaths::gpu::{Context, ContextOptions};
use lightpaths::renderer::{Renderer, Silent};
use lightpaths::scene::{LightKind, LoadOptions, Quality, Scene, shapes};
use std::sync::Arc;

/// A device that looks for such points, or does not.
fn device(finds_alike: bool) -> Arc<Context> {
    let options = ContextOptions { validation: true, hazard_check: true, ..ContextOptions::default() };
    let tuning = vec![format!("finds_alike={}", u32::from(finds_alike)).parse().unwrap()];
    Context::new(&ContextOptions { tuning, ..options }).unwrap()
}

/// Places in the middle half of the scene's bounds, and a direction for each.
fn places(scene: &Scene, count: u32) -> Vec<(Vec3, Vec3)> {
    let (low, high) = scene.bounds();
    // Multiples of the plastic number's powers fill the unit cube evenly.
    let at =
        |k: u32, power: i32| (0.5 + f64::from(k) * 1.220_744_084_605_759_5_f64.powi(-power)).fract() as f32;
    let place = |k| {
        let unit = Vec3::new(at(k, 1), at(k, 2), at(k, 3));
        let towards = Vec3::new(at(k, 4) - 0.5, -1.0, at(k, 5) - 0.5);
        (low + (0.25 + 0.5 * unit) * (high - low), towards.normalize())
    };
    (1..=count).map(place).collect()
}

/// Lights of each kind with maps.
fn kinds(place: Vec3, towards: Vec3) -> [LightKind; 4] {
    let intensity = Vec3::ONE;
    [
        LightKind::Point { position: place, intensity },
        LightKind::Spot { position: place, direction: towards, intensity, angle: 0.9, penumbra: 0.2 },
        LightKind::Directional { direction: towards, irradiance: intensity },
        LightKind::Area {
            corner: place,
            edge_u: 0.3 * towards.any_orthonormal_pair().0,
            edge_v: 0.2 * towards.any_orthonormal_pair().1,
            radiance: intensity,
            samples: 10,
        },
    ]
}

/// Direct light and form factors for each place of a light, with common rays and without.
fn lights_are_the_same(scene: &Scene, quality: &Quality, count: u32) {
    let mut scene = scene.clone();
    scene.quality = quality.clone();
    scene.lights.truncate(1);
    let mut found = [true, false].map(|finds_alike| {
        let context = device(finds_alike);
        let renderer = Renderer::new(&context, scene.clone(), &mut Silent).unwrap();
        (context, renderer)
    });
    let mut rays = 0;
    for (place, towards) in places(&scene, count) {
        for kind in kinds(place, towards) {
            let bits = found.each_mut().map(|(context, renderer)| {
                renderer.set_light(0, kind).unwrap();
                renderer.frame().unwrap();
                assert_silent(context);
                bits(renderer)
            });
            assert!(bits[0] == bits[1], "{kind:?}");
            rays += found[0].1.statistics().unwrap().counts["shadow rays of pixels"];
        }
    }
    assert!(rays > 0, "rays are counted only where points take common ones");
}

fn built_in(name: &str, set: &[&str]) -> Scene {
    let set = set.iter().map(|&change| change.to_owned()).collect();
    Scene::load(name, &LoadOptions { set, ..LoadOptions::default() }).unwrap()
}

const SIZE: &str = "camera.size=[96,72]";

#[test]
fn lights_of_common_rays_are_those_of_single_rays() {
    lights_are_the_same(&built_in("box", &[SIZE]), &crate::FEW, 3);
}

/// Walls of a millimetre that cross others, objects that touch a floor, a screen before a light.
#[test]
fn thin_and_touching_surfaces_hide_lights_as_for_single_rays() {
    let mut scenes: Vec<Scene> = dark_sides::scenes().into_iter().map(|sides| sides.scene).collect();
    scenes.extend([shapes::thin_wall(), shapes::hidden_light(1.0, 0.2, 0.5)]);
    for mut scene in scenes {
        scene.cameras[0].size = [48, 36];
        lights_are_the_same(&scene, &crate::FEW, 1);
    }
}

#[test]
#[ignore = "full size: make stress"]
fn lights_of_common_rays_are_those_of_single_rays_in_all_scenes() {
    for name in ["box", "atrium", "room"] {
        lights_are_the_same(&built_in(name, &["camera.size=[320,240]"]), &Quality::DRAFT, 20);
    }
}
