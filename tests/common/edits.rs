//! Random edits of the built-in Box at its smallest.

#![allow(dead_code, unreachable_pub, clippy::unwrap_used, reason = "each test binary uses a part")]

use super::random_words;
use glam::Vec3;
use lightpaths::renderer::{Renderer, Work};
use lightpaths::scene::{Light, LightKind, LoadOptions, Material, Quality, Scene};

/// The smallest settings of the Box that still run every pass of a frame.
pub const TINY: Quality = Quality {
    preset: "test",
    entry_points: 4_000,
    cache_points: 500,
    gather_rays: 64,
    cells: 8,
    ..Quality::DRAFT
};

/// The Box with an editable teapot, which may become glossy; or without glossy materials.
pub fn scene(may_be_glossy: bool) -> Scene {
    let options = LoadOptions { set: vec!["camera.size=[40,30]".to_owned()], ..LoadOptions::default() };
    let mut scene = Scene::load("box", &options).unwrap();
    let teapot = scene.materials.iter_mut().find(|material| material.name == "teapot").unwrap();
    teapot.editable = may_be_glossy;
    scene
}

/// Seeded decisions.
pub struct Dice(std::vec::IntoIter<u32>);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(random_words(seed, 200_000).into_iter())
    }

    pub fn below(&mut self, end: usize) -> usize {
        self.0.next().unwrap() as usize % end
    }

    fn unit(&mut self) -> f32 {
        (self.0.next().unwrap() >> 8) as f32 / 16_777_216.0
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    /// A position in or near the Box, the inside of the teapot's watertight solids included.
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

/// The expected state of all editable properties. A new kind of edit needs an arm of
/// [`State::edit`] and a line of [`State::cold`].
pub struct State {
    pub may_be_glossy: bool,
    pub lights: Vec<(Light, bool)>,
    pub materials: Vec<Material>,
    pub camera: Vec3,
}

impl State {
    pub fn from_renderer(renderer: &Renderer) -> Self {
        let scene = renderer.scene();
        Self {
            may_be_glossy: scene.materials.iter().any(Material::may_be_glossy),
            lights: scene.lights.iter().map(|light| (light.clone(), true)).collect(),
            materials: scene.materials.clone(),
            camera: scene.cameras[0].position,
        }
    }

    /// Applies one random edit to the state and to the renderer.
    pub fn edit(&mut self, dice: &mut Dice, renderer: &mut Renderer) {
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
                let light = Light::new("one more", dice.kind());
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
            (11, _) if self.may_be_glossy => {
                let teapot = self.materials.iter().position(|material| material.editable).unwrap();
                let material = &mut self.materials[teapot];
                // Diffuse, or with a broad to sharp lobe.
                material.specular = [0.0, 0.4][dice.below(2)] * dice.vector();
                material.exponent = 1.0 + 200.0 * dice.unit().powi(3);
                let Material { diffuse, specular, exponent, .. } = *material;
                renderer.set_material(teapot, diffuse, specular, exponent).unwrap();
            }
            _ => {}
        }
    }
}
