//! An edit alone ends where a cold start does. Edits that come together hide what one of them forgets.

use crate::common::edits::{TINY, scene};
use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::prepare;
use glam::Vec3;
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

/// Who looks at the hierarchy has all of it worked out, which must leave what frames take for current as it is.
#[test]
fn looking_at_clusters_leaves_the_picture() {
    let scene = scene(false);
    let mut renderer = prepare(scene.clone(), TINY);
    renderer.frame().unwrap();
    let first = bits(&renderer);
    let light = scene.lights[0].kind;
    let LightKind::Point { position, intensity } = light else { panic!("{light:?}") };
    let moved = LightKind::Point { position: position + Vec3::X * 0.1, intensity };
    let mut camera = scene.cameras[0].clone();
    for kind in [moved, light, moved, light] {
        renderer.set_light(0, kind).unwrap();
        renderer.frame().unwrap();
    }
    assert!(bits(&renderer) == first, "the light is back");
    renderer.cluster_colours(0).unwrap();
    camera.position += Vec3::new(0.1, 0.0, -0.5);
    renderer.set_camera(&camera);
    renderer.frame().unwrap();
    renderer.set_camera(&scene.cameras[0]);
    renderer.frame().unwrap();
    assert!(bits(&renderer) == first, "the camera is back");
    assert_silent(&context());
}
