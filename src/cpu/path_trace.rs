//! Twin of the path tracer: one path at a time.

use crate::cpu::brdf::{brdf, sample_brdf};
use crate::cpu::lights::{is_lit, sample_light};
use crate::cpu::rays::{Geometry, Hit};
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::{LightSource, Reflectance, View};
use glam::{DVec3, Vec3};

/// What paths go through, and by which rules.
#[derive(Clone, Copy)]
pub struct Paths<'a> {
    /// What they hit.
    pub geometry: Geometry<'a>,
    /// What it reflects.
    pub materials: &'a [Reflectance],
    /// What lights it.
    pub lights: &'a [LightSource],
    /// The camera.
    pub view: View,
    /// Seed of all decisions.
    pub seed: u32,
    /// Throughput below which roulette may end a path.
    pub roulette_threshold: f64,
}

/// What one sample of a pixel found, W/m²/sr.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Light that was reflected once.
    pub direct: DVec3,
    /// All other light.
    pub indirect: DVec3,
    /// Camera, shadow and reflected rays.
    pub rays: u32,
}

pub(super) struct Vertex {
    pub(super) position: Vec3,
    pub(super) geometric: Vec3,
    shading: DVec3,
    outgoing: DVec3,
    material: Reflectance,
}

impl Paths<'_> {
    /// Sample `index` of pixel (x, y).
    pub fn sample(&self, x: u32, y: u32, index: u32) -> Sample {
        let pixel_seed = hash_pair(self.seed, y * self.view.width + x);
        let jitter = sample_3d(index, pixel_seed).as_dvec3();
        let across = (f64::from(x) + jitter.x) / f64::from(self.view.width) * 2.0 - 1.0;
        let down = (f64::from(y) + jitter.y) / f64::from(self.view.height) * 2.0 - 1.0;
        let [right, up, forward] = [self.view.right, self.view.up, self.view.forward].map(Vec3::as_dvec3);

        let (mut origin, mut direction) = (self.view.position, forward + across * right - down * up);
        let mut throughput = DVec3::ONE;
        let mut found = Sample::default();
        for depth in 0.. {
            found.rays += 1;
            let Some(hit) = self.geometry.closest(origin, direction) else { break };
            let vertex = self.vertex(&hit, direction, depth == 0);
            let seed = hash_pair(pixel_seed, depth + 1);
            let radiance = throughput * self.reflected_light(&vertex, index, seed, &mut found.rays);
            if depth == 0 {
                found.direct = radiance;
            } else {
                found.indirect += radiance;
            }

            let u = sample_3d(index, seed).as_dvec3();
            let Some(next) = self.reflect(&vertex, u, &mut throughput) else { break };
            origin = self.geometry.offset_origin(vertex.position, vertex.geometric);
            direction = next;
        }
        found
    }

    /// Where a path goes on, if it does.
    pub(super) fn reflect(&self, vertex: &Vertex, u: DVec3, throughput: &mut DVec3) -> Option<DVec3> {
        let next = sample_brdf(&vertex.material, vertex.shading, vertex.outgoing, u.truncate());
        let is_above = vertex.geometric.as_dvec3().dot(next.incident) > 0.0;
        *throughput *= if is_above { next.weight } else { DVec3::ZERO };
        let survival = (throughput.max_element() / self.roulette_threshold).min(1.0);
        if u.z >= survival {
            return None;
        }
        *throughput /= survival;
        Some(next.incident)
    }

    pub(super) fn vertex(&self, hit: &Hit, direction: DVec3, is_first: bool) -> Vertex {
        let surface = &self.geometry.surfaces[hit.triangle as usize];
        let side = self.geometry.side(hit.triangle, direction);
        let geometric = self.geometry.normal(side);
        let [n0, n1, n2] = [surface.n0, surface.n1, surface.n2].map(|normal| normal.as_dvec3());
        let smooth = hit.barycentric.x * n0 + hit.barycentric.y * n1 + hit.barycentric.z * n2;
        let shading = match (is_first, side % 2) {
            (false, _) => geometric.as_dvec3(),
            (true, 0) => smooth.normalize(),
            (true, _) => -smooth.normalize(),
        };
        let material = self.materials[surface.material as usize];
        Vertex {
            position: hit.position.as_vec3(),
            geometric,
            shading,
            outgoing: -direction.normalize(),
            material,
        }
    }

    pub(super) fn reflected_light(&self, vertex: &Vertex, index: u32, seed: u32, rays: &mut u32) -> DVec3 {
        let mut radiance = DVec3::ZERO;
        for (number, light) in (0_u32..).zip(self.lights) {
            let u = sample_3d(index, hash_pair(seed, !number)).truncate().as_dvec2();
            let Some(found) = sample_light(light, vertex.position.as_dvec3(), u) else { continue };
            let cosine = vertex.shading.dot(found.direction);
            if cosine <= 0.0 || vertex.geometric.as_dvec3().dot(found.direction) <= 0.0 {
                continue;
            }
            let reflected = brdf(&vertex.material, vertex.shading, vertex.outgoing, found.direction);
            if reflected * found.irradiance == DVec3::ZERO {
                continue;
            }
            *rays += 1;
            if is_lit(self.geometry, vertex.position, vertex.geometric, &found) {
                radiance += cosine * reflected * found.irradiance;
            }
        }
        radiance
    }
}
