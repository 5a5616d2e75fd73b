//! Reference of the path tracer: one path at a time.

use crate::cpu::brdf::sample_brdf;
use crate::cpu::lit_scene::{LitScene, Vertex};
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::View;
use glam::{DVec3, Vec3};

/// Inputs of the paths.
#[derive(Clone, Copy)]
pub struct Paths<'a> {
    /// The scene and its lights.
    pub scene: LitScene<'a>,
    /// Camera that the rays start from.
    pub view: View,
    /// Seed of all decisions.
    pub seed: u32,
    /// Throughput below which roulette may end a path.
    pub roulette_threshold: f64,
}

/// Radiance of one sample of a pixel, W/m²/sr.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Light that was reflected once.
    pub direct: DVec3,
    /// All other light.
    pub indirect: DVec3,
    /// Camera, shadow and reflected rays.
    pub rays: u32,
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
            let Some(hit) = self.scene.geometry.closest(origin, direction) else { break };
            let vertex = self.scene.vertex(&hit, direction, depth == 0);
            let seed = hash_pair(pixel_seed, depth + 1);
            let radiance = throughput * self.reflected_light(&vertex, index, seed, &mut found.rays);
            if depth == 0 {
                found.direct = radiance;
            } else {
                found.indirect += radiance;
            }

            let u = sample_3d(index, seed).as_dvec3();
            let Some(next) = self.reflect(&vertex, u, &mut throughput) else { break };
            origin = self.scene.geometry.offset_origin(vertex.position, vertex.geometric);
            direction = next;
        }
        found
    }

    /// Direct light that a vertex reflects, W/m²/sr, by sample `index` of the random
    /// numbers of `seed`.
    pub(super) fn reflected_light(&self, vertex: &Vertex, index: u32, seed: u32, rays: &mut u32) -> DVec3 {
        let u = |number: u32| sample_3d(index, hash_pair(seed, !number)).as_dvec3();
        self.scene.reflected_light(vertex, u, rays)
    }

    /// The continuation of a path. `None` if roulette ends it.
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
}
