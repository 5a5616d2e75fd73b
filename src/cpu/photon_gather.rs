//! Twin of the final gathering: one sample at a time, asking every irradiance point.

use crate::cpu::brdf::{brdf, sample_brdf};
use crate::cpu::lights::{is_lit, sample_light};
use crate::cpu::photons::{Cells, SurfacePoint, is_within_reach, offset};
use crate::cpu::rays::{Geometry, Hit};
use crate::cpu::sampling::{hash_pair, sample_3d};
use crate::types::{LightSource, Reflectance, View};
use glam::{DVec3, IVec3, Vec3};
use std::f64::consts::PI;

/// An irradiance point.
#[derive(Clone, Copy, Debug)]
pub struct IrradiancePoint {
    /// Where it is.
    pub surface: SurfacePoint,
    /// How far it reaches.
    pub reach: [u8; 16],
    /// W/m².
    pub irradiance: DVec3,
}

/// What gather rays go through, and by which rules.
#[derive(Clone, Copy)]
pub struct Gather<'a> {
    /// What they hit.
    pub geometry: Geometry<'a>,
    /// What it reflects.
    pub materials: &'a [Reflectance],
    /// What lights it.
    pub lights: &'a [LightSource],
    /// What is known of it.
    pub points: &'a [IrradiancePoint],
    /// The cells of the points.
    pub cells: Cells,
    /// Of the density estimate, metres.
    pub radius: f64,
    /// The camera.
    pub view: View,
    /// Seed of all decisions.
    pub seed: u32,
}

struct Vertex {
    position: Vec3,
    normal: Vec3,
    shading: DVec3,
    outgoing: DVec3,
    material: Reflectance,
}

impl Gather<'_> {
    /// Light reflected once and all other light that sample `ray` of a pixel finds, W/m²/sr.
    pub fn sample(&self, pixel: u32, ray: u32) -> [DVec3; 2] {
        let seed = hash_pair(self.seed, pixel);
        let jitter = sample_3d(ray, hash_pair(seed, 0)).as_dvec3();
        let (x, y) = (f64::from(pixel % self.view.width), f64::from(pixel / self.view.width));
        let across = (x + jitter.x) / f64::from(self.view.width) * 2.0 - 1.0;
        let down = (y + jitter.y) / f64::from(self.view.height) * 2.0 - 1.0;
        let [right, up, forward] = [self.view.right, self.view.up, self.view.forward].map(Vec3::as_dvec3);
        let direction = (forward + across * right - down * up).normalize();
        let Some(hit) = self.geometry.closest(self.view.position, direction) else { return [DVec3::ZERO; 2] };
        let seen = self.vertex(&hit, direction, true);
        [self.direct(&seen, ray, hash_pair(seed, 1)), self.indirect(seen, ray, seed)]
    }

    fn vertex(&self, hit: &Hit, direction: DVec3, is_smooth: bool) -> Vertex {
        let surface = &self.geometry.surfaces[hit.triangle as usize];
        let side = self.geometry.side(hit.triangle, direction);
        let normal = self.geometry.normal(side);
        let [n0, n1, n2] = [surface.n0, surface.n1, surface.n2].map(|normal| normal.as_dvec3());
        let smooth = hit.barycentric.x * n0 + hit.barycentric.y * n1 + hit.barycentric.z * n2;
        let turn = if side % 2 == 1 { -1.0 } else { 1.0 };
        Vertex {
            position: hit.position.as_vec3(),
            normal,
            shading: if is_smooth { turn * smooth.normalize() } else { normal.as_dvec3() },
            outgoing: -direction,
            material: self.materials[surface.material as usize],
        }
    }

    fn direct(&self, vertex: &Vertex, ray: u32, seed: u32) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for (number, light) in (0..).zip(self.lights) {
            let u = sample_3d(ray, hash_pair(seed, number)).truncate().as_dvec2();
            let Some(found) = sample_light(light, vertex.position.as_dvec3(), u) else { continue };
            let cosine = vertex.shading.dot(found.direction);
            let is_above = cosine > 0.0 && vertex.normal.as_dvec3().dot(found.direction) > 0.0;
            if is_above && is_lit(self.geometry, vertex.position, vertex.normal, &found) {
                let reflected = brdf(&vertex.material, vertex.shading, vertex.outgoing, found.direction);
                sum += reflected * found.irradiance * cosine;
            }
        }
        sum
    }

    fn indirect(&self, mut vertex: Vertex, ray: u32, seed: u32) -> DVec3 {
        let (mut sum, mut throughput) = (DVec3::ZERO, DVec3::ONE);
        for depth in 1.. {
            let u = sample_3d(ray, hash_pair(seed, 2 * depth)).as_dvec3();
            let next = sample_brdf(&vertex.material, vertex.shading, vertex.outgoing, u.truncate());
            throughput *= next.weight;
            let survival = if depth == 1 { 1.0 } else { throughput.max_element().min(0.95) };
            let is_above = vertex.normal.as_dvec3().dot(next.incident) > 0.0;
            if u.z >= survival || throughput.max_element() <= 0.0 || !is_above {
                break;
            }
            throughput /= survival;
            let origin = self.geometry.offset_origin(vertex.position, vertex.normal);
            let Some(hit) = self.geometry.closest(origin, next.incident) else { break };
            vertex = self.vertex(&hit, next.incident, false);
            let place = SurfacePoint { position: vertex.position, normal: vertex.normal };
            let known = if hit.t > self.radius { self.nearest(place) } else { None };
            if let Some(point) = known {
                sum += throughput * vertex.material.diffuse.as_dvec3() * point.irradiance / PI;
                vertex.material.diffuse = Vec3::ZERO;
            }
            sum += throughput * self.direct(&vertex, ray, hash_pair(seed, 2 * depth + 1));
        }
        sum
    }

    /// The nearest irradiance point on a surface point's surface: of the eight nearest cells, or else of 64.
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
