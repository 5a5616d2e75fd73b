//! The same inputs give the same bytes, whatever came before.

use crate::common::{assert_silent, context};
use crate::{LAYERS, SMALL, prepare, the_box};
use lightpaths::renderer::{Renderer, Work};

/// Every layer's bits.
pub(crate) fn bits(renderer: &Renderer) -> Vec<u32> {
    let layers = LAYERS.iter().flat_map(|layer| renderer.layer(*layer).unwrap());
    layers.flat_map(|pixel| pixel.map(f32::to_bits)).collect()
}

fn cold() -> Renderer {
    prepare(the_box(&[]), SMALL)
}

#[test]
fn cold_starts_and_the_hundredth_frame_agree_to_the_bit() {
    let mut first = cold();
    first.frame().unwrap();
    let expected = bits(&first);
    assert!(expected.iter().any(|word| *word != 0));
    let mut second = cold();
    second.frame().unwrap();
    assert!(bits(&second) == expected, "two cold starts");
    let mut third = cold();
    for _ in 0..100 {
        third.force(Work::Everything);
        third.frame().unwrap();
    }
    assert!(bits(&third) == expected, "the 100th frame");
    assert_silent(&context());
}

#[test]
fn a_light_and_a_camera_edited_are_as_good_as_loaded() {
    let moved = ["light.lamp.position=[0.3,1.2,0.4]", "camera.position=[0.2,1.1,3.5]"].map(str::to_owned);
    let mut loaded = prepare(the_box(&moved), SMALL);
    loaded.frame().unwrap();
    let target = loaded.scene().cameras[0].clone();
    let mut edited = cold();
    edited.frame().unwrap();
    edited.move_light(0, loaded.scene().lights[0].kind.position().unwrap()).unwrap();
    edited.frame().unwrap();
    edited.move_camera(target.position, target.target);
    edited.frame().unwrap();
    assert!(bits(&edited) == bits(&loaded));
    assert_silent(&context());
}
