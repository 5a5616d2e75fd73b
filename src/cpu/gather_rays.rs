//! Reference of the gather rays: the cluster that each reads, and the gradient of
//! stratified hemisphere sampling.

use crate::cpu::hemisphere::{Strata, frame};
use crate::cpu::rays::{Geometry, Hit};
use crate::cpu::sampling::hash_pair;
use crate::scene::{Naming, hvds::Hvds, unweighted::NEARBY};
use crate::types::{CachePoint, NO_CLUSTER};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::{PI, SQRT_2};

/// Width of the cells that rays read, in widths of a stratum.
const SHARE: f64 = 0.25;
/// Maximum distance between covered and covering surface, in base cells; mirrors
/// `COVERED_SIGHT` in `glsl/include/target.glsl`.
pub const COVERED_SIGHT: f32 = 0.5;

/// Inputs of gather rays.
#[derive(Clone, Copy)]
pub struct Tracing<'a> {
    /// The scene that they hit.
    pub geometry: Geometry<'a>,
    /// The clusters that they read.
    pub hvds: &'a Hvds,
    /// Strata of the hemisphere.
    pub strata: Strata,
    /// Seed of all decisions.
    pub seed: u32,
    /// What they are named by.
    pub naming: Naming,
    /// Expected number of entry points of every cluster.
    pub entry_points: &'a [f32],
    /// Minimum sample count of a cluster.
    pub min_entry_points: f32,
}

/// A ray before it is traced.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin, offset from its surface.
    pub origin: Vec3,
    /// Unit vector along the ray.
    pub direction: DVec3,
    /// Width of the cells that it reads, over the distance, on a surface that faces it.
    pub width: f64,
}

/// The result of a ray.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Cluster and material that it reads. `None` if the ray left the scene or met
    /// an inactive side.
    pub target: Option<(u32, u32)>,
    /// Colour of the image at the hit; white if there is none.
    pub colour: DVec3,
    /// Distance to the hit, metres; infinite if the ray left the scene.
    pub distance: f64,
}

impl Tracing<'_> {
    /// A ray of a cache point. `None` if it would start into the surface.
    pub fn ray(&self, point: &CachePoint, ray: u32) -> Option<Ray> {
        let local = self.strata.direction(ray, point.stream, self.seed);
        let direction = frame(point.normal) * local;
        let solid_angle = PI / (f64::from(self.strata.rays()) * local.z);
        (direction.dot(point.facet.as_dvec3()) > 0.0).then(|| Ray {
            origin: self.geometry.offset_origin(point.position, point.facet),
            direction,
            width: SHARE * solid_angle.sqrt(),
        })
    }

    /// Traces a ray of a cache point.
    pub fn trace(&self, point: &CachePoint, ray: u32) -> Found {
        let nothing = Found { target: None, colour: DVec3::ONE, distance: f64::INFINITY };
        let Some(Ray { origin, direction, width }) = self.ray(point, ray) else { return nothing };
        let Some(hit) = self.geometry.closest(origin, direction) else { return nothing };
        Found {
            target: self.target(&hit, direction, hit.t * width),
            colour: self.geometry.colour(hit.triangle, hit.barycentric),
            distance: hit.t,
        }
    }

    /// Cluster and material that a ray reads at its hit; `footprint` in metres, before projection
    /// to the surface.
    pub fn target(&self, hit: &Hit, direction: DVec3, footprint: f64) -> Option<(u32, u32)> {
        let surface = &self.geometry.surfaces[hit.triangle as usize];
        let side = self.geometry.side(hit.triangle, direction);
        let mut cluster = NO_CLUSTER;
        if surface.side_is_active(side % 2 == 1) {
            cluster = self.geometry.cluster(self.hvds, hit.position.as_vec3(), side);
        }
        let cell = self.hvds.grid.cell_size();
        let is_near = |cells: f32| hit.t < f64::from(cells) * cell;
        if cluster != NO_CLUSTER && self.entry_points[cluster as usize] == 0.0 && is_near(COVERED_SIGHT) {
            return None;
        }
        if is_near(NEARBY) && cluster != NO_CLUSTER {
            let unweighted = self.hvds.unweighted[cluster as usize];
            cluster = if unweighted == NO_CLUSTER { cluster } else { unweighted };
        }
        let facing = surface.normal.as_dvec3().dot(direction).abs().max(0.1);
        (cluster != NO_CLUSTER).then(|| (self.coarsen(cluster, footprint / facing.sqrt()), surface.material))
    }

    /// The cluster of the level whose cells are nearest to the footprint in size, in octaves; or a
    /// coarser one that reaches the minimum sample count.
    fn coarsen(&self, base: u32, footprint: f64) -> u32 {
        let mut cluster = base;
        let mut cell = self.hvds.grid.cell_size();
        while self.hvds.coarser(cluster) != NO_CLUSTER
            && (footprint >= SQRT_2 * cell || self.entry_points[cluster as usize] < self.min_entry_points)
        {
            cluster = self.hvds.coarser(cluster);
            cell *= 2.0;
        }
        cluster
    }

    /// Distance to the nearest hit of a point's hemisphere, at most `far`, without rays within 10°
    /// of the tangent plane, and the nearest occluder plane; mirrors `clearance`.
    pub fn clearance(&self, point: &CachePoint, far: f32) -> (f64, DVec3) {
        let mut nearest = (f64::from(far), DVec3::ZERO);
        for ray in 0..self.strata.rays() {
            let Some((hit, _)) = self.clearance_hit(point, ray).filter(|(hit, _)| hit.t < nearest.0) else {
                continue;
            };
            let plane = self.geometry.surfaces[hit.triangle as usize].normal.as_dvec3();
            let distance = plane.dot(hit.position - point.position.as_dvec3());
            let facing = if distance > 0.0 { -plane } else { plane };
            let is_alike = facing.dot(point.normal.as_dvec3()) >= std::f64::consts::FRAC_1_SQRT_2;
            nearest = (hit.t, if is_alike || distance == 0.0 { DVec3::ZERO } else { plane / distance });
        }
        nearest
    }

    /// Whether a point is in a solid: its nearest hit is on an inner side, or most hits of its
    /// probes are. Hits count up to `far`. Mirrors `clearance`.
    pub fn is_in_solid(&self, point: &CachePoint, far: f32) -> bool {
        let count = self.strata.rays();
        let hits = |rays: std::ops::Range<u32>| {
            rays.filter_map(|number| self.clearance_hit(point, number * 11 % count))
                .filter(|(hit, _)| hit.t < f64::from(far))
        };
        let is_inner = |(hit, direction): &(Hit, DVec3)| {
            let surface = &self.geometry.surfaces[hit.triangle as usize];
            !surface.side_is_active(surface.normal.as_dvec3().dot(*direction) > 0.0)
        };
        let nearest = hits(0..count).min_by(|a, b| a.0.t.total_cmp(&b.0.t));
        let probes: Vec<bool> = hits(0..count.min(8)).map(|found| is_inner(&found)).collect();
        let inner = probes.iter().filter(|&&is_inner| is_inner).count();
        2 * inner > probes.len() || nearest.is_some_and(|found| is_inner(&found))
    }

    /// Hit and direction of a ray of a clearance, unless it is within 10° of the tangent plane.
    fn clearance_hit(&self, point: &CachePoint, ray: u32) -> Option<(Hit, DVec3)> {
        let [x, y, z] = point.position.to_array().map(f32::to_bits);
        let name = hash_pair(x, hash_pair(y, hash_pair(z, point.side & self.naming.side_bits())));
        let origin = self.geometry.offset_origin(point.position, point.facet);
        let local = self.strata.direction(ray, name, self.seed);
        let direction = frame(point.normal) * local;
        let hit = self.geometry.closest(origin, direction).filter(|_| local.z > 0.1736)?;
        Some((hit, direction))
    }
}

/// ∂E/∂(tangent, bitangent) of rays with these hit `distances` (m) and `radiance`, term by term as
/// in \[Krivanek\]; `min_distance` bounds the distances from below.
pub fn translational_gradient(
    strata: Strata,
    distances: &[f64],
    radiance: impl Fn(u32) -> f64,
    min_distance: f64,
) -> DVec2 {
    let mut gradient = DVec2::ZERO;
    let inverse_nearer =
        |a: u32, b: u32| 1.0 / distances[a as usize].min(distances[b as usize]).max(min_distance);
    for sector in 0..strata.sectors {
        let before = (sector + strata.sectors - 1) % strata.sectors;
        let (middle, edge) = (strata.azimuth_middle(sector), strata.azimuth_edge(sector));
        let outward = DVec2::new(middle.cos(), middle.sin());
        let around = DVec2::new(-edge.sin(), edge.cos());
        for ring in 0..strata.rings {
            let [low, high] = [ring, ring + 1].map(|ring| strata.polar_edge(ring));
            let here = ring * strata.sectors + sector;
            if ring > 0 {
                let below = here - strata.sectors;
                let width = std::f64::consts::TAU / f64::from(strata.sectors);
                let size = width * low.cos().powi(2) * low.sin() * inverse_nearer(here, below);
                gradient += size * (radiance(here) - radiance(below)) * outward;
            }
            let beside = ring * strata.sectors + before;
            let theta = strata.polar_middle(ring);
            let size = theta.cos() * (low.cos() - high.cos()) / theta.sin() * inverse_nearer(here, beside);
            gradient += size * (radiance(here) - radiance(beside)) * around;
        }
    }
    gradient
}
