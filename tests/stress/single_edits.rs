//! An edit alone ends where a cold start does. Edits that come together hide what one of them forgets.

use crate::common::edits::{TINY, scene};
use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::prepare;
use glam::Vec3;

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
