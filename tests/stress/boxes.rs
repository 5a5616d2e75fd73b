//! The Box as small as a grain and as large as a town, and far away: the picture is the same.

use crate::common::{assert_silent, context};
use crate::{SMALL, count, relative_mse, render};
use glam::{DVec3, Vec3};
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, LoadOptions, Quality, Scene};

/// The Box with all its lengths times `scale`, moved by `to` metres; its lamp is as bright on the walls as before.
fn placed(scale: f64, to: DVec3, size: u32) -> Scene {
    let still = Scene::load("box", &LoadOptions::default()).unwrap();
    let vector = |v: DVec3| format!("[{:e},{:e},{:e}]", v.x, v.y, v.z);
    // Where it was in the file.
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

/// Scales, and moves in units of the Box's size at that scale.
fn check(places: &[(f64, f64)], quality: &Quality, size: u32) {
    let picture = |scale: f64, to: f64| {
        let to = 2.0 * scale * to * DVec3::new(1.0, -1.0, 0.7);
        let renderer = render(placed(scale, to, size), quality.clone());
        assert_eq!(count(&renderer, "path vertices outside all clusters"), 0, "scale {scale}");
        [Layer::Direct, Layer::Indirect].map(|layer| renderer.layer(layer).unwrap())
    };
    let reference = picture(1.0, 0.0);
    for &(scale, to) in places {
        let image = picture(scale, to);
        let errors = [0, 1].map(|layer: usize| relative_mse(&image[layer], &reference[layer]));
        println!(
            "scale {scale:e}, moved by {to:e} sizes: relMSE direct {:.1e}, indirect {:.1e}",
            errors[0], errors[1]
        );
        assert!(
            errors.iter().all(|error| *error <= 1e-3),
            "scale {scale:e}, moved by {to:e} sizes: {errors:?}"
        );
    }
    assert_silent(&context());
}

#[test]
fn the_box_is_the_same_at_other_scales_and_places() {
    // Powers of two round alike: what else differs in so coarse a picture is where its few records come to stand.
    let [grain, town] = [-10, 13].map(|power| 2f64.powi(power));
    check(&[(grain, 0.0), (town, 0.0), (1.0, 65_536.0), (grain, 65_536.0)], &SMALL, 64);
}

#[test]
#[ignore = "full size: make stress"]
fn the_box_is_the_same_at_every_scale_and_place() {
    let scales = (-3..=4).map(|power| (10f64.powi(power), 0.0)).filter(|place| place.0 != 1.0);
    let moves = [10.0, 1e3, 1e5].into_iter().flat_map(|to| [1e-3, 1.0, 1e4].map(|scale| (scale, to)));
    check(&scales.chain(moves).collect::<Vec<_>>(), &Quality::PAPER, 256);
}
