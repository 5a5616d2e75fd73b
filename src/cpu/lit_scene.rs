//! Reference shared by all shaders that follow paths: hit surfaces and the light that they reflect.

use crate::cpu::brdf::brdf;
use crate::cpu::lights::{Intensities, chosen_part, is_lit, sample_light};
use crate::cpu::rays::{Geometry, Hit};
use crate::cpu::receivers::{Receiver, receiver};
use crate::types::{LIGHT_GROUP, LightSource, Reflectance};
use glam::{DVec3, Vec3};

/// A scene and its lights.
#[derive(Clone, Copy)]
pub struct LitScene<'a> {
    /// Geometry that rays hit.
    pub geometry: Geometry<'a>,
    /// Reflectances of its materials.
    pub materials: &'a [Reflectance],
    /// Lights of the scene, then the parts of lights of several parts.
    pub lights: &'a [LightSource],
}

/// A surface point with the direction to its viewer.
pub(super) struct Vertex {
    pub(super) position: Vec3,
    /// Of direct light.
    pub(super) receiver: Receiver,
    pub(super) geometric: Vec3,
    pub(super) shading: DVec3,
    pub(super) outgoing: DVec3,
    pub(super) material: Reflectance,
}

impl LitScene<'_> {
    /// The vertex at a hit; `is_smooth`: shaded by the interpolated normal.
    pub(super) fn vertex(&self, hit: &Hit, direction: DVec3, is_smooth: bool) -> Vertex {
        let surface = &self.geometry.surfaces[hit.triangle as usize];
        let side = self.geometry.side(hit.triangle, direction);
        let geometric = self.geometry.normal(side);
        let [n0, n1, n2] = [surface.n0, surface.n1, surface.n2].map(|normal| normal.as_dvec3());
        let smooth = hit.barycentric.x * n0 + hit.barycentric.y * n1 + hit.barycentric.z * n2;
        let shading = match (is_smooth, side % 2) {
            (false, _) => geometric.as_dvec3(),
            (true, 0) => smooth.normalize(),
            (true, _) => -smooth.normalize(),
        };
        let mut material = self.materials[surface.material as usize];
        material.diffuse *= self.geometry.colour(hit.triangle, hit.barycentric).as_vec3();
        let position = hit.position.as_vec3();
        Vertex {
            position,
            receiver: match is_smooth {
                true => receiver(self.geometry, position, side, shading.as_vec3()),
                false => Receiver { position, normal: geometric },
            },
            geometric,
            shading,
            outgoing: -direction.normalize(),
            material,
        }
    }

    /// Direct light that a vertex reflects, W/m²/sr; `u` returns the random numbers of a light by
    /// its index. Counts shadow rays.
    pub(super) fn reflected_light(&self, vertex: &Vertex, u: impl Fn(u32) -> DVec3, rays: &mut u32) -> DVec3 {
        let (mut radiance, at) = (DVec3::ZERO, vertex.receiver);
        // Parts follow the lights.
        let firsts = self.lights.iter().filter(|light| light.kind == LIGHT_GROUP).map(|light| light.stride);
        let count = firsts.min().map_or(self.lights.len(), |first| first as usize);
        for (number, light) in (0_u32..).zip(&self.lights[..count]) {
            let u = u(number);
            let light = chosen_part(light, self.lights, u.z);
            let found = sample_light(&light, Intensities::NONE, at.position.as_dvec3(), u.truncate());
            let Some(found) = found else { continue };
            let cosine = vertex.shading.dot(found.direction);
            if cosine <= 0.0 || at.normal.as_dvec3().dot(found.direction) <= 0.0 {
                continue;
            }
            let reflected = brdf(&vertex.material, vertex.shading, vertex.outgoing, found.direction);
            if reflected * found.irradiance == DVec3::ZERO {
                continue;
            }
            *rays += 1;
            if is_lit(self.geometry, at.position, at.normal, &found) {
                radiance += cosine * reflected * found.irradiance;
            }
        }
        radiance
    }
}
