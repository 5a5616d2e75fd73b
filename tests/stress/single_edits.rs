//! A single edit gives the bits of a cold start. Edits that come together may hide an error of one
//! of them. A query between two frames changes neither.

use crate::common::edits::{TINY, scene};
use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::prepare;
use glam::Vec3;
use lightpaths::renderer::{Exact, Layer, Renderer, Stage};
use lightpaths::scene::LightKind;

#[test]
fn an_exponent_alone_reaches_the_picture() {
    let mut scene = scene(true);
    let teapot = scene.materials.iter().position(|material| material.editable).unwrap();
    let (diffuse, specular) = (Vec3::splat(0.3), Vec3::splat(0.5));
    let mut render = |exponent: f32| {
        let material = &mut scene.materials[teapot];
        (material.diffuse, material.specular, material.exponent) = (diffuse, specular, exponent);
        let mut renderer = prepare(scene.clone(), TINY);
        renderer.frame().unwrap();
        renderer
    };
    let mut edited = render(5.0);
    let broad = bits(&edited);
    let sharp = bits(&render(80.0));
    assert!(broad != sharp);
    edited.set_material(teapot, diffuse, specular, 80.0).unwrap();
    edited.frame().unwrap();
    assert!(bits(&edited) == sharp, "sharper");
    edited.set_material(teapot, diffuse, specular, 5.0).unwrap();
    edited.frame().unwrap();
    assert!(bits(&edited) == broad, "and back");
    assert_silent(&context());
}

/// A query of a renderer between frames.
type Look = fn(&mut Renderer);

const LOOKS: [(&str, Look); 6] = [
    ("clusters of pixels", |renderer| drop(renderer.cluster_colours(0).unwrap())),
    ("the gather at pixels", |renderer| drop(renderer.layer_gathered_at_pixels(Layer::Indirect).unwrap())),
    ("exact records", |renderer| drop(renderer.layer_with_exact(EXACT, Layer::Indirect).unwrap())),
    ("exact irradiance", |renderer| drop(renderer.exact_irradiance(EXACT).unwrap())),
    ("records of a pixel", |renderer| drop(renderer.records_at([4, 4]).unwrap())),
    ("gather rays", |renderer| drop(renderer.gather_rays_of(0).unwrap())),
];

const EXACT: Exact = Exact { stage: Stage::Gather, samples: 1, sequence: 0 };

/// Some queries need clusters and records that the last frame skipped. Computing these must not
/// change which results the next frame takes for current.
#[test]
fn looking_between_frames_leaves_the_picture() {
    let scene = scene(false);
    let light = scene.lights[0].kind;
    let LightKind::Point { position, intensity } = light else { panic!("{light:?}") };
    let moved = LightKind::Point { position: position + Vec3::X * 0.1, intensity };
    let home = scene.cameras[0].clone();
    let mut away = home.clone();
    away.position += Vec3::new(0.1, 0.0, -0.5);
    let mut renderer = prepare(scene.clone(), TINY);
    renderer.frame().unwrap();
    let first = bits(&renderer);
    for (what, look) in LOOKS {
        // After a light edit, only the records of this view are current.
        for kind in [moved, light] {
            renderer.set_light(0, kind).unwrap();
            renderer.frame().unwrap();
        }
        look(&mut renderer);
        assert!(bits(&renderer) == first, "{what}: the picture stays");
        for camera in [&away, &home] {
            renderer.set_camera(camera);
            renderer.frame().unwrap();
        }
        assert!(bits(&renderer) == first, "{what}: the camera is back");
    }
    assert_silent(&context());
}
