//! Reference of the photon tracing: one surface at a time.

use crate::cpu::brdf::sample_brdf;
use crate::cpu::emission::emit;
use crate::cpu::lights::{Intensities, chosen_part};
use crate::cpu::lit_scene::LitScene;
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::{LIGHT_AREA, NO_SIDE};
use glam::{DVec3, Vec3};

/// Inputs of the photon paths.
#[derive(Clone, Copy)]
pub struct Photons<'a> {
    /// The scene and its lights.
    pub scene: LitScene<'a>,
    /// Middle of the scene.
    pub scene_centre: Vec3,
    /// Radius of a sphere around the scene, metres.
    pub scene_radius: f32,
    /// Seed of all decisions.
    pub seed: u32,
    /// Upper bound of the survival probability.
    pub max_survival: f64,
}

/// State of a path.
#[derive(Clone, Copy, Debug)]
pub struct PathEnd {
    /// Origin of its next ray.
    pub origin: Vec3,
    /// Unit direction of its next ray.
    pub direction: DVec3,
    /// Flux of the photon, W.
    pub flux: DVec3,
    /// The light that it comes from.
    pub light: u32,
    /// Index among the light's rays.
    pub ray: u32,
    /// Surfaces so far.
    pub depth: u32,
}

/// A photon at a surface.
#[derive(Clone, Copy, Debug)]
pub struct Arrival {
    /// Position of the photon, metres.
    pub position: Vec3,
    /// 2·triangle + (1 if the back side); [`NO_SIDE`] if the material has no diffuse albedo.
    pub side: u32,
    /// Flux of the photon, W.
    pub flux: DVec3,
}

impl Photons<'_> {
    /// Ray `ray` of a light, which is one of `count`.
    pub fn start(&self, light: u32, ray: u32, count: f64) -> PathEnd {
        let stream = hash_pair(self.seed, light);
        let source = &self.scene.lights[light as usize];
        let [u, v] = [0, 1].map(|number| sample_3d(ray, hash_pair(stream, number)).as_dvec3());
        let source = chosen_part(source, self.scene.lights, u.z);
        let (centre, radius) = (self.scene_centre.as_dvec3(), f64::from(self.scene_radius));
        let emitted = emit(&source, Intensities::NONE, (centre, radius), u.truncate(), v);
        let origin = emitted.origin.as_vec3();
        let origin = if source.kind == LIGHT_AREA {
            let is_back = source.axis.as_dvec3().dot(emitted.direction) < 0.0;
            self.scene.geometry.offset_origin(origin, if is_back { -source.axis } else { source.axis })
        } else {
            origin
        };
        PathEnd { origin, direction: emitted.direction, flux: emitted.flux / count, light, ray, depth: 0 }
    }

    /// The next surface that a path meets, if any, and whether the path continues from there.
    pub fn step(&self, path: &mut PathEnd) -> (Option<Arrival>, bool) {
        if path.flux.max_element() <= 0.0 {
            return (None, false);
        }
        let Some(hit) = self.scene.geometry.closest(path.origin, path.direction) else {
            return (None, false);
        };
        let side = self.scene.geometry.side(hit.triangle, path.direction);
        let normal = self.scene.geometry.normal(side);
        let mut material =
            self.scene.materials[self.scene.geometry.surfaces[hit.triangle as usize].material as usize];
        let position = hit.position.as_vec3();
        let is_diffuse = material.diffuse.max_element() > 0.0;
        let arrival = Arrival { position, side: if is_diffuse { side } else { NO_SIDE }, flux: path.flux };
        material.diffuse *= self.scene.geometry.colour(hit.triangle, hit.barycentric).as_vec3();
        path.depth += 1;

        let stream = hash_pair(self.seed, path.light);
        let u = sample_3d(path.ray, hash_pair(stream, 1 + path.depth)).as_dvec3();
        let next = sample_brdf(&material, normal.as_dvec3(), -path.direction, u.truncate());
        let reflected = path.flux * next.weight;
        let survival = (reflected.max_element() / path.flux.max_element()).min(self.max_survival);
        if u.z >= survival {
            return (Some(arrival), false);
        }
        path.flux = reflected / survival;
        path.direction = next.incident;
        path.origin = self.scene.geometry.offset_origin(position, normal);
        (Some(arrival), true)
    }
}
