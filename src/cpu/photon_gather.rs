//! Reference of the final gathering of a photon map: one sample at a time, with a search over
//! all irradiance points.

use crate::cpu::brdf::sample_brdf;
use crate::cpu::lit_scene::{LitScene, Vertex};
use crate::cpu::photons::{Cells, SurfacePoint, is_within_reach, offset};
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::View;
use glam::{DVec3, IVec3, Vec3};
use std::f64::consts::PI;

/// An irradiance point.
#[derive(Clone, Copy, Debug)]
pub struct IrradiancePoint {
    /// Its position and normal.
    pub surface: SurfacePoint,
    /// Its reach in each sector.
    pub reach: [u8; 16],
    /// Irradiance at the point, W/m².
    pub irradiance: DVec3,
}

/// Inputs of the gather rays.
#[derive(Clone, Copy)]
pub struct Gather<'a> {
    /// The scene and its lights.
    pub scene: LitScene<'a>,
    /// Irradiance points of the scene.
    pub points: &'a [IrradiancePoint],
    /// The cells of the points.
    pub cells: Cells,
    /// Radius of the density estimate, metres.
    pub radius: f64,
    /// Camera that the rays start from.
    pub view: View,
    /// Seed of all decisions.
    pub seed: u32,
}

impl Gather<'_> {
    /// Radiance of sample `ray` of a pixel: light reflected once, and all other light, W/m²/sr.
    pub fn sample(&self, pixel: u32, ray: u32) -> [DVec3; 2] {
        let seed = hash_pair(self.seed, pixel);
        let jitter = sample_3d(ray, hash_pair(seed, 0)).as_dvec3();
        let (x, y) = (f64::from(pixel % self.view.width), f64::from(pixel / self.view.width));
        let across = (x + jitter.x) / f64::from(self.view.width) * 2.0 - 1.0;
        let down = (y + jitter.y) / f64::from(self.view.height) * 2.0 - 1.0;
        let [right, up, forward] = [self.view.right, self.view.up, self.view.forward].map(Vec3::as_dvec3);
        let direction = (forward + across * right - down * up).normalize();
        let Some(hit) = self.scene.geometry.closest(self.view.position, direction) else {
            return [DVec3::ZERO; 2];
        };
        let seen = self.scene.vertex(&hit, direction, true);
        [self.direct(&seen, ray, hash_pair(seed, 1)), self.indirect(seen, ray, seed)]
    }

    fn direct(&self, vertex: &Vertex, ray: u32, seed: u32) -> DVec3 {
        let u = |number: u32| sample_3d(ray, hash_pair(seed, number)).as_dvec3();
        self.scene.reflected_light(vertex, u, &mut 0)
    }

    fn indirect(&self, mut vertex: Vertex, ray: u32, seed: u32) -> DVec3 {
        let (mut sum, mut throughput) = (DVec3::ZERO, DVec3::ONE);
        for depth in 1.. {
            let u = sample_3d(ray, hash_pair(seed, 2 * depth)).as_dvec3();
            let next = sample_brdf(&vertex.material, vertex.shading, vertex.outgoing, u.truncate());
            throughput *= next.weight;
            let survival = if depth == 1 { 1.0 } else { throughput.max_element().min(0.95) };
            let is_above = vertex.geometric.as_dvec3().dot(next.incident) > 0.0;
            if u.z >= survival || throughput.max_element() <= 0.0 || !is_above {
                break;
            }
            throughput /= survival;
            let origin = self.scene.geometry.offset_origin(vertex.position, vertex.geometric);
            let Some(hit) = self.scene.geometry.closest(origin, next.incident) else { break };
            vertex = self.scene.vertex(&hit, next.incident, false);
            let place = SurfacePoint { position: vertex.position, normal: vertex.geometric };
            let known = if hit.t > self.radius { self.nearest(place) } else { None };
            if let Some(point) = known {
                sum += throughput * vertex.material.diffuse.as_dvec3() * point.irradiance / PI;
                vertex.material.diffuse = Vec3::ZERO;
            }
            sum += throughput * self.direct(&vertex, ray, hash_pair(seed, 2 * depth + 1));
        }
        sum
    }

    /// The nearest irradiance point on a surface point's surface: among the eight nearest cells,
    /// else among 64.
    fn nearest(&self, place: SurfacePoint) -> Option<&IrradiancePoint> {
        let half = 0.5 / self.cells.inverse_cell;
        let corner = self.cells.cell_of(place.position - Vec3::splat(half));
        let within = |cell: IVec3, ring: i32| {
            let offset = cell - corner + ring;
            offset.min_element() >= 0 && offset.max_element() < 2 + 2 * ring
        };
        let apart = |point: &IrradiancePoint| {
            let offset = offset(point.surface, place);
            let turned = 1.0 - place.normal.as_dvec3().dot(point.surface.normal.as_dvec3());
            let above = offset.dot(place.normal.as_dvec3());
            let apart = offset.length_squared() + 16.0 * above * above + self.radius.powi(2) * turned;
            (turned <= 0.75 && is_within_reach(point.reach, point.surface, place, self.radius))
                .then_some(apart)
        };
        [0, 1].into_iter().find_map(|ring| {
            let near = |point: &&IrradiancePoint| within(self.cells.cell_of(point.surface.position), ring);
            let candidates = self.points.iter().filter(near).filter_map(|point| Some((apart(point)?, point)));
            candidates.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point)
        })
    }
}
