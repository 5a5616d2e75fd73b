//! Reference of the light paths: one vertex at a time.

use crate::cpu::brdf::sample_brdf;
use crate::cpu::hemisphere::frame;
use crate::cpu::rays::Geometry;
use crate::cpu::sampling::{hash_pair, sample_3d, sample_cosine};
use crate::scene::hvds::Hvds;
use crate::types::{EDITABLE, MAY_BE_GLOSSY, PathVertex, Reflectance};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// State of a path.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    /// Its last vertex.
    pub position: Vec3,
    /// Of the last vertex: 2·triangle + (1 if the back side).
    pub side: u32,
    /// Product of the reflectances and roulette weights so far.
    pub throughput: DVec3,
    /// Unit direction of travel when it arrived; zero at an entry point.
    pub incoming: DVec3,
    /// Random stream index of the path.
    pub stream: u32,
    /// Vertices behind the entry point.
    pub depth: u32,
}

/// Inputs of the walks.
#[derive(Clone, Copy)]
pub struct Walk<'a> {
    /// The scene that they hit.
    pub geometry: Geometry<'a>,
    /// Reflectances of its materials.
    pub materials: &'a [Reflectance],
    /// The clusters that vertices fall into.
    pub hvds: &'a Hvds,
    /// Seed of all decisions.
    pub seed: u32,
    /// Throughput below which roulette may end a path.
    pub roulette_threshold: f64,
    /// Albedo of editable materials in the roulette.
    pub editable_albedo: f64,
}

impl Walk<'_> {
    /// The walker's next vertex. `None` if the path ends by roulette or leaves the scene.
    pub fn step(&self, walker: &mut Walker) -> Option<PathVertex> {
        let u = sample_3d(walker.stream, hash_pair(self.seed, walker.depth));
        let surface = &self.geometry.surfaces[walker.side as usize / 2];
        let normal = self.geometry.normal(walker.side);

        let mut material = self.materials[surface.material as usize];
        let diffuse = material.diffuse.as_dvec3() * self.geometry.colour_at(walker.side, walker.position);
        material.diffuse = diffuse.as_vec3();
        let mut direction = frame(normal) * sample_cosine(u.truncate().as_dvec2());
        let mut reflected = diffuse;
        let (mut weight, mut lobe) = (1.0, 0.0);
        if material.flags & MAY_BE_GLOSSY != 0 {
            let is_editable = material.flags & EDITABLE != 0;
            reflected += material.specular.as_dvec3();
            if is_editable {
                reflected = DVec3::splat(self.editable_albedo);
            }
            if walker.depth > 0 {
                let normal = normal.as_dvec3();
                if !is_editable {
                    let found = sample_brdf(&material, normal, -walker.incoming, u.truncate().as_dvec2());
                    (direction, reflected) = (found.incident, found.weight);
                    weight = direction.dot(normal) / (PI * found.pdf);
                }
                let mirror = walker.incoming - 2.0 * walker.incoming.dot(normal) * normal;
                lobe = 0.5 * (mirror - direction).length_squared();
            }
        }
        walker.throughput *= reflected;
        if walker.throughput.max_element() <= 0.0 {
            return None;
        }
        let survival = (walker.throughput.max_element() / self.roulette_threshold).min(1.0);
        if f64::from(u.z) >= survival {
            return None;
        }
        walker.throughput /= survival;

        let hit = self.geometry.closest(self.geometry.offset_origin(walker.position, normal), direction)?;
        walker.position = hit.position.as_vec3();
        walker.side = self.geometry.side(hit.triangle, direction);
        walker.depth += 1;
        walker.incoming = direction;
        Some(PathVertex {
            position: walker.position,
            side: walker.side,
            incoming: direction.as_vec3(),
            weight: (weight / survival) as f32,
            cluster: self.geometry.cluster(self.hvds, walker.position, walker.side),
            lobe: lobe as f32,
        })
    }
}
