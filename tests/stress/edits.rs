//! Any sequence of edits gives the bits of a cold start; and skipping work changes no bit.

use crate::common::edits::{Dice, State, TINY, scene};
use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::prepare;
use glam::Vec3;
use lightpaths::renderer::Renderer;
use lightpaths::scene::Quality;

/// Enough for lists of several workgroups.
const TINIER: Quality = Quality { entry_points: 1_000, cache_points: 150, gather_rays: 32, ..TINY };

/// A renderer of the scene in the expected state, before its first frame. Lights that are off are
/// left out. Albedos of materials that are not editable are set afterwards, because paths are
/// traced for the albedos at load.
fn cold(state: &State, quality: &Quality) -> Renderer {
    let mut scene = scene(state.may_be_glossy);
    let on = state.lights.iter().filter(|(_, is_on)| *is_on);
    scene.lights = on.map(|(light, _)| light.clone()).collect();
    (scene.cameras[0].position, scene.cameras[0].target) = (state.camera, Vec3::ZERO);
    for (material, state) in scene.materials.iter_mut().zip(&state.materials) {
        if state.editable {
            *material = state.clone();
        }
    }
    let mut renderer = prepare(scene, quality.clone());
    for (material, state) in state.materials.iter().enumerate() {
        renderer.set_diffuse(material, state.diffuse).unwrap();
    }
    renderer
}

#[test]
fn any_sequence_of_edits_ends_where_a_cold_start_does() {
    any_sequence_ends_where_a_cold_start_does(true, &TINIER, [3, 24], 90);
}

#[test]
fn any_sequence_of_edits_of_diffuse_surfaces_ends_where_a_cold_start_does() {
    any_sequence_ends_where_a_cold_start_does(false, &TINIER, [3, 30], 100);
}

#[test]
#[ignore = "full size: make stress"]
fn any_long_sequence_of_edits_ends_where_a_cold_start_does() {
    for may_be_glossy in [true, false] {
        any_sequence_ends_where_a_cold_start_does(may_be_glossy, &TINY, [6, 105], 1_000);
    }
}

/// Makes `checks` checks, and renders `frames` frames before each; at least `least` edits
/// must be made.
fn any_sequence_ends_where_a_cold_start_does(
    may_be_glossy: bool,
    quality: &Quality,
    [checks, frames]: [usize; 2],
    least: usize,
) {
    let mut edited = prepare(scene(may_be_glossy), quality.clone());
    edited.move_camera(edited.scene().cameras[0].position, Vec3::ZERO);
    let mut state = State::from_renderer(&edited);
    let mut dice = Dice::new(4);
    let mut edits = 0;
    let mut max_lights = 0;
    for check in 0..checks {
        for _ in 0..frames {
            let some = [0, 1, 1, 1, 2, 5][dice.below(6)];
            (0..some).for_each(|_| state.edit(&mut dice, &mut edited));
            edits += some;
            edited.frame().unwrap();
            max_lights = max_lights.max(state.lights.len());
        }
        let mut fresh = cold(&state, quality);
        fresh.frame().unwrap();
        let expected = bits(&fresh);
        assert!(bits(&edited) == expected, "after {edits} edits");
        if check % 3 == 2 {
            let mut untiring = cold(&state, quality);
            untiring.set_skipping(false);
            untiring.frame().unwrap();
            assert!(bits(&untiring) == expected, "with nothing left out, after {edits} edits");
            // The same within one renderer, with lights that are off.
            edited.set_skipping(false);
            edited.frame().unwrap();
            assert!(bits(&edited) == expected, "with nothing left out after {edits} edits");
            edited.set_skipping(true);
        }
    }
    println!("{edits} edits, up to {max_lights} lights");
    assert!(edits >= least && max_lights >= 4, "{edits} edits, up to {max_lights} lights");
    assert_silent(&context());
}
