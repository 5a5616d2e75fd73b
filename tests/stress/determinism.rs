//! The same inputs give the same bytes, whatever came before.

use crate::common::{assert_silent, context, random_words};
use crate::{LAYERS, SMALL, prepare, the_box};
use glam::Vec3;
use lightpaths::renderer::{Edit, Renderer};

/// Every layer's bits.
fn bits(renderer: &Renderer) -> Vec<u32> {
    let layers = LAYERS.iter().flat_map(|layer| renderer.layer(*layer).unwrap());
    layers.flat_map(|pixel| pixel.map(f32::to_bits)).collect()
}

fn cold() -> Renderer {
    prepare(the_box(&[]), SMALL)
}

#[test]
fn cold_starts_and_the_hundredth_frame_agree_to_the_bit() {
    let mut first = cold();
    first.frame(Edit::Everything).unwrap();
    let expected = bits(&first);
    assert!(expected.iter().any(|word| *word != 0));
    let mut second = cold();
    second.frame(Edit::Everything).unwrap();
    assert!(bits(&second) == expected, "two cold starts");
    let mut third = cold();
    for _ in 0..100 {
        third.frame(Edit::Everything).unwrap();
    }
    assert!(bits(&third) == expected, "the 100th frame");
    assert_silent(&context());
}

/// Where everything that can be edited stands.
#[derive(Clone)]
struct State {
    light: Vec3,
    albedos: Vec<Vec3>,
    camera: Vec3,
}

impl State {
    fn of(renderer: &Renderer) -> Self {
        let scene = renderer.scene();
        Self {
            light: scene.lights[0].kind.position().unwrap(),
            albedos: scene.materials.iter().map(|material| material.diffuse).collect(),
            camera: scene.cameras[0].position,
        }
    }

    fn apply(&self, renderer: &mut Renderer) {
        renderer.move_light(0, self.light).unwrap();
        renderer.move_camera(self.camera, Vec3::ZERO);
        for (index, albedo) in self.albedos.iter().enumerate() {
            renderer.set_diffuse(index, *albedo).unwrap();
        }
    }
}

#[test]
fn any_sequence_of_edits_ends_where_a_cold_start_does() {
    let mut edited = cold();
    let mut state = State::of(&edited);
    state.apply(&mut edited);
    edited.frame(Edit::Everything).unwrap();
    let unit = |word: u32| (f64::from(word) / f64::from(u32::MAX)) as f32;
    for words in random_words(4, 5 * 120).chunks_exact(5) {
        let random = Vec3::new(unit(words[0]), unit(words[1]), unit(words[2]));
        let edit = match words[3] % 4 {
            0 => {
                state.light = 1.6 * random - 0.8;
                edited.move_light(0, state.light).unwrap();
                Edit::Light
            }
            1 => {
                let material = words[4] as usize % state.albedos.len();
                state.albedos[material] = 0.8 * random;
                edited.set_diffuse(material, state.albedos[material]).unwrap();
                Edit::Material
            }
            2 => {
                state.camera = random - 0.5 + 3.0 * Vec3::Z;
                edited.move_camera(state.camera, Vec3::ZERO);
                Edit::View
            }
            _ => Edit::Nothing,
        };
        edited.frame(edit).unwrap();
    }
    let mut fresh = cold();
    state.apply(&mut fresh);
    fresh.frame(Edit::Everything).unwrap();
    assert!(bits(&edited) == bits(&fresh));
    assert_silent(&context());
}

#[test]
fn a_light_and_a_camera_edited_are_as_good_as_loaded() {
    let moved = ["light.lamp.position=[0.3,1.2,0.4]", "camera.position=[0.2,1.1,3.5]"].map(str::to_owned);
    let mut loaded = prepare(the_box(&moved), SMALL);
    loaded.frame(Edit::Everything).unwrap();
    let target = loaded.scene().cameras[0].clone();
    let mut edited = cold();
    edited.frame(Edit::Everything).unwrap();
    edited.move_light(0, State::of(&loaded).light).unwrap();
    edited.frame(Edit::Light).unwrap();
    edited.move_camera(target.position, target.target);
    edited.frame(Edit::View).unwrap();
    assert!(bits(&edited) == bits(&loaded));
    assert_silent(&context());
}
