//! Any sequence of edits ends where a cold start does, to the bit; and leaving work out changes no bit.

use crate::common::{assert_silent, context, random_words};
use crate::determinism::bits;
use crate::{prepare, the_box};
use glam::Vec3;
use lightpaths::renderer::{Renderer, Work};
use lightpaths::scene::{Light, LightKind, Material, Quality, Scene};

/// As small as a picture of the Box can be that has all there is to a frame.
const TINY: Quality = Quality {
    preset: "test",
    entry_points: 4_000,
    cache_points: 500,
    gather_rays: 64,
    cells: 8,
    ..Quality::DRAFT
};

/// The Box with a teapot that may be edited, and so may shine; or in which nothing may.
fn scene(may_shine: bool) -> Scene {
    let mut scene = the_box(&["camera.size=[40,30]".to_owned()]);
    let teapot = scene.materials.iter_mut().find(|material| material.name == "teapot").unwrap();
    teapot.editable = may_shine;
    scene
}

/// Seeded decisions.
struct Dice(std::vec::IntoIter<u32>);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(random_words(seed, 200_000).into_iter())
    }

    fn below(&mut self, end: usize) -> usize {
        self.0.next().unwrap() as usize % end
    }

    fn unit(&mut self) -> f32 {
        (self.0.next().unwrap() >> 8) as f32 / 16_777_216.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    /// Anywhere in the Box, the inside of the teapot's closed parts not excepted, and some way out of it.
    fn place(&mut self) -> Vec3 {
        2.2 * (self.vector() - 0.5)
    }

    fn direction(&mut self) -> Vec3 {
        (self.vector() - Vec3::new(0.5, 1.5, 0.5)).normalize()
    }

    fn kind(&mut self) -> LightKind {
        let (position, direction, power) = (self.place(), self.direction(), 3.0 * self.vector());
        match self.below(4) {
            0 => LightKind::Point { position, intensity: power },
            1 => LightKind::Spot {
                position,
                direction,
                intensity: power,
                angle: 0.3 + self.unit(),
                penumbra: self.unit(),
            },
            2 => LightKind::Area {
                corner: position,
                edge_u: Vec3::new(0.2, 0.0, 0.1) * self.unit(),
                edge_v: Vec3::new(0.0, 0.1, 0.3),
                radiance: power,
                samples: 1 + self.below(20) as u32,
            },
            _ => LightKind::Directional { direction, irradiance: power },
        }
    }
}

/// Everything that can be edited, as it should stand. An edit is one arm of [`State::edit`] and one line of [`State::cold`]:
/// a new one is added there.
struct State {
    may_shine: bool,
    lights: Vec<(Light, bool)>,
    materials: Vec<Material>,
    camera: Vec3,
}

impl State {
    fn of(renderer: &Renderer) -> Self {
        let scene = renderer.scene();
        Self {
            may_shine: scene.materials.iter().any(Material::may_shine),
            lights: scene.lights.iter().map(|light| (light.clone(), true)).collect(),
            materials: scene.materials.clone(),
            camera: scene.cameras[0].position,
        }
    }

    /// One edit, here and there.
    fn edit(&mut self, dice: &mut Dice, renderer: &mut Renderer) {
        let light = if self.lights.is_empty() { None } else { Some(dice.below(self.lights.len())) };
        match (dice.below(13), light) {
            (0 | 1, Some(light)) => {
                let to = dice.place();
                self.lights[light].0.kind = self.lights[light].0.kind.moved_to(to);
                renderer.move_light(light, to).unwrap();
            }
            (2, Some(light)) => {
                self.lights[light].0.kind = dice.kind();
                renderer.set_light(light, self.lights[light].0.kind).unwrap();
            }
            (3, Some(light)) => {
                let emission = if dice.below(5) == 0 { Vec3::ZERO } else { 4.0 * dice.vector() };
                self.lights[light].0.kind = self.lights[light].0.kind.with_emission(emission);
                renderer.set_light(light, self.lights[light].0.kind).unwrap();
            }
            (4 | 5, Some(light)) => {
                self.lights[light].1 ^= true;
                renderer.switch_light(light, self.lights[light].1).unwrap();
            }
            (6, _) if self.lights.len() < 7 => {
                let light = Light { name: "one more".to_owned(), kind: dice.kind(), is_on: true };
                self.lights.push((light.clone(), true));
                renderer.add_light(light).unwrap();
            }
            (7, Some(light)) => {
                self.lights.remove(light);
                renderer.remove_light(light).unwrap();
            }
            (8, _) => {
                let material = dice.below(self.materials.len());
                let diffuse = 0.5 * dice.vector();
                self.materials[material].diffuse = diffuse;
                renderer.set_diffuse(material, diffuse).unwrap();
            }
            (9, _) => {
                self.camera = dice.vector() - 0.5 + 3.0 * Vec3::Z;
                renderer.move_camera(self.camera, Vec3::ZERO);
            }
            (10, _) => renderer.force(match dice.below(5) {
                0 => Work::Everything,
                1 => Work::Colour,
                2 => Work::View,
                3 => Work::Material,
                _ => light.map_or(Work::Colour, Work::Light),
            }),
            (11, _) if self.may_shine => {
                let teapot = self.materials.iter().position(|material| material.editable).unwrap();
                let material = &mut self.materials[teapot];
                // Matt, or with a lobe from broad to sharp.
                material.specular = [0.0, 0.4][dice.below(2)] * dice.vector();
                material.exponent = 1.0 + 200.0 * dice.unit().powi(3);
                let Material { diffuse, specular, exponent, .. } = *material;
                renderer.set_material(teapot, diffuse, specular, exponent).unwrap();
            }
            _ => {}
        }
    }

    /// A renderer of the scene as it should stand, ahead of its first frame. Lights that are off are not there. Albedos of materials
    /// that are not editable are set afterwards: paths are traced for those at load.
    fn cold(&self) -> Renderer {
        let mut scene = scene(self.may_shine);
        let on = self.lights.iter().filter(|(_, is_on)| *is_on);
        scene.lights = on.map(|(light, _)| light.clone()).collect();
        (scene.cameras[0].position, scene.cameras[0].target) = (self.camera, Vec3::ZERO);
        for (material, state) in scene.materials.iter_mut().zip(&self.materials) {
            if state.editable {
                *material = state.clone();
            }
        }
        let mut renderer = prepare(scene, TINY);
        for (material, state) in self.materials.iter().enumerate() {
            renderer.set_diffuse(material, state.diffuse).unwrap();
        }
        renderer
    }
}

#[test]
fn any_sequence_of_edits_ends_where_a_cold_start_does() {
    any_sequence_ends_where_a_cold_start_does(true);
}

#[test]
fn any_sequence_of_edits_of_matt_surfaces_ends_where_a_cold_start_does() {
    any_sequence_ends_where_a_cold_start_does(false);
}

fn any_sequence_ends_where_a_cold_start_does(may_shine: bool) {
    let mut edited = prepare(scene(may_shine), TINY);
    edited.move_camera(edited.scene().cameras[0].position, Vec3::ZERO);
    let mut state = State::of(&edited);
    let mut dice = Dice::new(4);
    let mut edits = 0;
    let mut most_lights = 0;
    for check in 0..6 {
        for _ in 0..105 {
            let some = [0, 1, 1, 1, 2, 5][dice.below(6)];
            (0..some).for_each(|_| state.edit(&mut dice, &mut edited));
            edits += some;
            edited.frame().unwrap();
            most_lights = most_lights.max(state.lights.len());
        }
        let mut fresh = state.cold();
        fresh.frame().unwrap();
        let expected = bits(&fresh);
        assert!(bits(&edited) == expected, "after {edits} edits");
        if check % 3 == 2 {
            let mut untiring = state.cold();
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
    assert!(edits >= 1_000 && most_lights >= 4, "{edits} edits, up to {most_lights} lights");
    assert_silent(&context());
}
