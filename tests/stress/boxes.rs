//! The Box as small as a grain, as large as a town, and far from the origin: the picture
//! is the same.

use crate::common::{assert_silent, context};
use crate::{SMALL, count, relative_mse, render};
use glam::{DVec3, Vec3};
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, LoadOptions, Quality, Scene};

/// The Box scaled by `scale` and moved by `to` metres; its light is as bright on the
/// walls as before.
fn placed(scale: f64, to: DVec3, size: u32) -> Scene {
    let still = Scene::load("box", &LoadOptions::default()).unwrap();
    let vector = |v: DVec3| format!("[{:e},{:e},{:e}]", v.x, v.y, v.z);
    // Position in the file.
    let place = |p: Vec3| vector(scale * (p.as_dvec3() + still.origin) + to);
    let (camera, light) = (&still.cameras[0], still.lights[0].kind);
    let LightKind::Point { position, intensity } = light else { panic!("the Box has a lamp") };
    let set = [
        format!("model.0.scale={scale:e}"),
        format!("model.0.translate={}", vector(to)),
        format!("camera.position={}", place(camera.position)),
        format!("camera.target={}", place(camera.target)),
        format!("camera.size=[{size},{size}]"),
        format!("light.lamp.position={}", place(position)),
        format!("light.lamp.intensity={}", vector(scale * scale * intensity.as_dvec3())),
    ];
    Scene::load("box", &LoadOptions { set: set.to_vec(), ..LoadOptions::default() }).unwrap()
}

/// Cases are scales, and translations in units of the scaled Box. Random numbers of surface points
/// depend on the bits of their positions. So indirect light differs between scales as between two
/// seeds; the bound is twice that difference, unless one is given.
fn check(places: &[(f64, f64)], quality: &Quality, size: u32, bound: Option<f64>) {
    let picture = |scale: f64, to: f64, seed: u32| {
        let to = 2.0 * scale * to * DVec3::new(1.0, -1.0, 0.7);
        let renderer = render(placed(scale, to, size), Quality { seed, ..quality.clone() });
        assert_eq!(count(&renderer, "path vertices outside all clusters"), 0, "scale {scale}");
        [Layer::Direct, Layer::Indirect].map(|layer| renderer.layer(layer).unwrap())
    };
    let reference = picture(1.0, 0.0, 0);
    let error =
        |image: [Vec<[f32; 3]>; 2]| [0, 1].map(|layer| relative_mse(&image[layer], &reference[layer]));
    let seeds = error(picture(1.0, 0.0, 1));
    println!("another seed: relMSE direct, indirect {seeds:?}");
    let bound = bound.unwrap_or(2.0 * seeds[1]);
    for &(scale, to) in places {
        let found = error(picture(scale, to, 0));
        println!("scale {scale:e}, moved by {to:e} sizes: {found:?}");
        assert!(found[0] <= 1e-6 && found[1] <= bound, "scale {scale:e}, moved by {to:e} sizes: {found:?}");
    }
    assert_silent(&context());
}

#[test]
fn the_box_is_the_same_at_other_scales_and_places() {
    let quality = Quality { entry_points: 5_000, cache_points: 600, ..SMALL };
    check(&[(1e-3, 0.0), (1e4, 1e5)], &quality, 32, None);
}

#[test]
#[ignore = "full size: make stress"]
fn the_box_is_the_same_at_every_scale_and_place() {
    let scales = (-3..=4).map(|power| (10f64.powi(power), 0.0)).filter(|place| place.0 != 1.0);
    let moves = [10.0, 1e3, 1e5].into_iter().flat_map(|to| [1e-3, 1.0, 1e4].map(|scale| (scale, to)));
    check(&scales.chain(moves).collect::<Vec<_>>(), &Quality::PAPER, 256, Some(1e-3));
}
