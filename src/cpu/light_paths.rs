//! Twin of the light paths: one vertex at a time.

use crate::cpu::hemisphere::frame;
use crate::cpu::rays::Geometry;
use crate::cpu::sampling::{hash_pair, sample_3d, sample_cosine};
use crate::scene::{Material, hvds::Hvds};
use crate::types::PathVertex;
use glam::{DVec3, Vec3};

/// Where a path stands.
#[derive(Clone, Copy, Debug)]
pub struct Walker {
    /// Its last vertex.
    pub position: Vec3,
    /// Of the last vertex: 2·triangle + (1 if the back side).
    pub side: u32,
    /// Product of albedos and roulette weights so far.
    pub throughput: DVec3,
    /// Names its random numbers.
    pub path: u32,
    /// Vertices behind the entry point.
    pub depth: u32,
}

/// What the walks go through, and by which rules.
#[derive(Clone, Copy)]
pub struct Walk<'a> {
    /// What they hit.
    pub geometry: Geometry<'a>,
    /// What it reflects.
    pub materials: &'a [Material],
    /// The clusters that vertices fall into.
    pub hvds: &'a Hvds,
    /// Seed of all decisions.
    pub seed: u32,
    /// Throughput below which roulette may end a path.
    pub roulette_threshold: f64,
}

impl Walk<'_> {
    /// The walker's next vertex; None where the path ends, by roulette or because it leaves the scene.
    pub fn step(&self, walker: &mut Walker) -> Option<PathVertex> {
        let u = sample_3d(walker.path, hash_pair(self.seed, walker.depth));
        let surface = &self.geometry.surfaces[walker.side as usize / 2];
        let normal = self.geometry.normal(walker.side);

        walker.throughput *= self.materials[surface.material as usize].diffuse.as_dvec3();
        walker.throughput *= self.geometry.colour_at(walker.side, walker.position);
        let survival = (walker.throughput.max_element() / self.roulette_threshold).min(1.0);
        if f64::from(u.z) >= survival {
            return None;
        }
        walker.throughput /= survival;

        let direction = frame(normal) * sample_cosine(u.truncate().as_dvec2());
        let hit = self.geometry.closest(self.geometry.offset_origin(walker.position, normal), direction)?;
        walker.position = hit.position.as_vec3();
        walker.side = self.geometry.side(hit.triangle, direction);
        walker.depth += 1;
        Some(PathVertex {
            position: walker.position,
            side: walker.side,
            incoming: direction.as_vec3(),
            weight: (1.0 / survival) as f32,
            cluster: self.geometry.cluster(self.hvds, walker.position, walker.side),
        })
    }
}
