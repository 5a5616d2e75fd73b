//! Any sequence of edits ends where a cold start does, to the bit; and leaving work out changes no bit.

use crate::common::edits::{Dice, State, TINY, scene};
use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::prepare;
use glam::Vec3;
use lightpaths::renderer::Renderer;

/// A renderer of the scene as it should stand, ahead of its first frame. Lights that are off are not there. Albedos of materials
/// that are not editable are set afterwards: paths are traced for those at load.
fn cold(state: &State) -> Renderer {
    let mut scene = scene(state.may_shine);
    let on = state.lights.iter().filter(|(_, is_on)| *is_on);
    scene.lights = on.map(|(light, _)| light.clone()).collect();
    (scene.cameras[0].position, scene.cameras[0].target) = (state.camera, Vec3::ZERO);
    for (material, state) in scene.materials.iter_mut().zip(&state.materials) {
        if state.editable {
            *material = state.clone();
        }
    }
    let mut renderer = prepare(scene, TINY);
    for (material, state) in state.materials.iter().enumerate() {
        renderer.set_diffuse(material, state.diffuse).unwrap();
    }
    renderer
}

#[test]
fn any_sequence_of_edits_ends_where_a_cold_start_does() {
    any_sequence_ends_where_a_cold_start_does(true, [3, 40], 150);
}

#[test]
fn any_sequence_of_edits_of_matt_surfaces_ends_where_a_cold_start_does() {
    any_sequence_ends_where_a_cold_start_does(false, [3, 30], 100);
}

#[test]
#[ignore = "full size: make stress"]
fn any_long_sequence_of_edits_ends_where_a_cold_start_does() {
    for may_shine in [true, false] {
        any_sequence_ends_where_a_cold_start_does(may_shine, [6, 105], 1_000);
    }
}

/// Checks so often, and renders so many frames before each; `least`: edits that must have been made.
fn any_sequence_ends_where_a_cold_start_does(may_shine: bool, [checks, frames]: [usize; 2], least: usize) {
    let mut edited = prepare(scene(may_shine), TINY);
    edited.move_camera(edited.scene().cameras[0].position, Vec3::ZERO);
    let mut state = State::of(&edited);
    let mut dice = Dice::new(4);
    let mut edits = 0;
    let mut most_lights = 0;
    for check in 0..checks {
        for _ in 0..frames {
            let some = [0, 1, 1, 1, 2, 5][dice.below(6)];
            (0..some).for_each(|_| state.edit(&mut dice, &mut edited));
            edits += some;
            edited.frame().unwrap();
            most_lights = most_lights.max(state.lights.len());
        }
        let mut fresh = cold(&state);
        fresh.frame().unwrap();
        let expected = bits(&fresh);
        assert!(bits(&edited) == expected, "after {edits} edits");
        if check % 3 == 2 {
            let mut untiring = cold(&state);
            untiring.set_skipping(false);
            untiring.frame().unwrap();
            assert!(bits(&untiring) == expected, "with nothing left out, after {edits} edits");
            // Within one renderer, too, with lights that are off.
            edited.set_skipping(false);
            edited.frame().unwrap();
            assert!(bits(&edited) == expected, "with nothing left out after {edits} edits");
            edited.set_skipping(true);
        }
    }
    println!("{edits} edits, up to {most_lights} lights");
    assert!(edits >= least && most_lights >= 4, "{edits} edits, up to {most_lights} lights");
    assert_silent(&context());
}
