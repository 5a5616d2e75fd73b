//! The gather rays of a cache point. Their hits are not stored, so the rays are traced again in the
//! same directions. The targets that they read are stored in the point's merged rays.
//!
//! A ray that meets a cluster reads one of three gather targets: the cluster itself; a *patch*, the
//! near-field patch that the point sees; or a *gloss bin*, one outgoing direction of a cluster.
//!
//! A merged ray stores the target, not which rays read it. If several targets of a point stand for
//! the cluster that a ray met, the direction decides.

use super::super::Renderer;
use crate::cpu::gather_rays::{Ray, Tracing};
use crate::cpu::hemisphere::Strata;
use crate::cpu::rays::Hit;
use crate::error::Result;
use crate::passes::frame::gather::Gather;
use crate::passes::gather_targets::{GatherTarget, Met};
use crate::passes::gloss_tables::GlossBin;
use crate::passes::precompute::gather_rays::{Hemisphere, MIN_ENTRY_POINTS, far_cells};
use crate::passes::precompute::rays::{RayAnswer, RayQuery};
use crate::scene::octahedral;
use crate::types::{CachePoint, NO_SIDE};
use glam::{DVec3, Vec3, Vec4};

/// A gather ray, its hit and its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GatherRaySegment {
    /// Origin of the ray, off the surface of its cache point.
    pub origin: Vec3,
    /// Unit direction of the ray.
    pub direction: Vec3,
    /// Hit on a surface. `None` if the ray left the scene.
    pub hit: Option<Vec3>,
    /// The cluster, of any level, that stands for the hit. `None` if the ray left the scene or met
    /// a side that takes no part in transport.
    pub cluster: Option<u32>,
    /// Index of the gather target: the cluster, or its patch or gloss bin, and the material.
    pub target_index: Option<u32>,
    /// Radiance that the last gather pass read from the target or the sky, W/m²/sr. Zero if the ray
    /// reads nothing, or before the first frame.
    pub radiance: Vec3,
}

/// The kinds of gather targets.
enum Kind {
    Cluster,
    Patch,
    /// With the unit direction of the gloss bin.
    Bin(Vec3),
}

/// A gather target that some rays of a point read.
struct Reading {
    target_index: u32,
    met: Met,
    kind: Kind,
    /// The cluster that the target stands for.
    cluster: u32,
}

#[doc(hidden)]
impl Renderer {
    /// The gather rays of a cache point, except rays that would start into its surface. Empty if
    /// there is no such point. Traces the rays again and reads the radiance of all targets.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn gather_rays_of(&self, point: u32) -> Result<Vec<GatherRaySegment>> {
        if point >= self.transport.gather.point_count() {
            return Ok(Vec::new());
        }
        let place = self.transport.gather.cache_points.read_range::<CachePoint>(point as usize, 1)?[0];
        let Hemisphere { rings, sectors } = self.transport.gather.hemisphere;
        let tracing = Tracing {
            geometry: self.geometry()?,
            hvds: &self.world.cluster_tables.hvds,
            strata: Strata { rings, sectors },
            seed: self.world.scene.quality.seed,
            naming: self.world.scene.naming(),
            entry_points: &self.world.cluster_tables.entry_points,
            min_entry_points: MIN_ENTRY_POINTS,
        };
        let rays = (0..tracing.strata.rays()).filter_map(|ray| tracing.ray(&place, ray));
        let rays: Vec<Ray> = rays.collect();
        let query = |ray: &Ray| RayQuery { origin: ray.origin, direction: ray.direction.as_vec3() };
        let queries: Vec<RayQuery> = rays.iter().map(query).collect();
        let answers = self.world.enclosures.rays.trace(&self.world.buffers, &queries)?;
        let readings = self.readings(point)?;
        let radiances = self.reflected()?;
        let (sky, sky_side) = (self.lights.sky_radiance(), self.world.scene.emission.sky_side());
        let sky_along = |direction: DVec3| {
            sky.get(octahedral::cell(direction, sky_side.max(1)) as usize).copied().unwrap_or(Vec3::ZERO)
        };

        let segment = |(ray, answer): (&Ray, &RayAnswer)| {
            let direction = ray.direction.as_vec3();
            let mut segment = GatherRaySegment {
                origin: ray.origin,
                direction,
                hit: None,
                cluster: None,
                target_index: None,
                radiance: Vec3::ZERO,
            };
            if answer.side == NO_SIDE {
                segment.radiance = self.lights.emission_scale * sky_along(ray.direction);
                return segment;
            }
            let hit = hit(&tracing, ray, answer);
            segment.hit = Some(hit.position.as_vec3());
            let Some((cluster, material)) = tracing.target(&hit, ray.direction, hit.t * ray.width) else {
                return segment;
            };
            segment.cluster = Some(cluster);
            let met = Met { material, is_far: is_far(&tracing, &hit, ray.direction) };
            segment.target_index = reading_of(&readings, (cluster, met), -ray.direction);
            if let Some(target_index) = segment.target_index {
                let colour = tracing.geometry.colour(hit.triangle, hit.barycentric).as_vec3();
                let [diffuse, gloss] = radiances
                    .each_ref()
                    .map(|list| list.get(target_index as usize).copied().unwrap_or(Vec3::ZERO));
                segment.radiance = self.lights.emission_scale * (colour * diffuse + gloss);
            }
            segment
        };
        Ok(rays.iter().zip(&answers).map(segment).collect())
    }

    /// Radiance of all targets: without images all of it; with images the diffuse part, and that of
    /// their lobes if any material is glossy.
    fn reflected(&self) -> Result<[Vec<Vec3>; 2]> {
        let (transport, materials) = (&self.transport, &self.world.buffers.materials);
        // Gather rays leave out the light of bright clusters. The next gather computes these anew.
        self.context.run(|rec| {
            let sources = transport.gather_sources(materials, self.lights.sky());
            let list = &transport.record_lists.all;
            transport.gather.record_radiances(&mut rec.pass(Gather::STEM), sources, list);
        })?;
        let [diffuse, gloss] = transport.gather.radiances();
        let count =
            if self.has_picture() { self.transport.gather.merged_rays.target_count as usize } else { 0 };
        let has_list = self.transport.gloss.is_some() && self.transport.gather.merged_rays.has_colours;
        let lobe_count = if has_list { count } else { 0 };
        let diffuse = diffuse.read_range::<Vec4>(0, count)?;
        Ok([diffuse.into_iter().map(Vec4::truncate).collect(), gloss.read_range(0, lobe_count)?])
    }

    /// The targets of a cache point.
    fn readings(&self, point: u32) -> Result<Vec<Reading>> {
        let merged_rays = &self.transport.gather.merged_rays;
        let of_point = merged_rays.of_point(point)?;
        let mut target_indices: Vec<u32> =
            of_point.iter().map(|merged_ray| merged_rays.target_index_of(merged_ray)).collect();
        target_indices.sort_unstable();
        target_indices.dedup();
        let targets: Vec<u32> = merged_rays.targets.read()?;
        let bins: Vec<GlossBin> = match &self.transport.gloss {
            Some(gloss) => gloss.clusters.bins.read()?,
            None => Vec::new(),
        };
        let patches = self.transport.live_sets.near_patches();
        let packing = &self.transport.gather.packing;
        let reading = |target_index: u32| {
            let (target, met) = packing.unpack(targets[target_index as usize])?;
            let (kind, cluster) = match target {
                GatherTarget::Sky(_) => return None,
                GatherTarget::Cluster(cluster) => (Kind::Cluster, cluster),
                GatherTarget::Patch(patch) => (Kind::Patch, patches[patch as usize].cluster),
                GatherTarget::GlossBin(bin) => {
                    let gloss_bin = bins[bin as usize];
                    (Kind::Bin(gloss_bin.direction), gloss_bin.cluster)
                }
            };
            Some(Reading { target_index, met, kind, cluster })
        };
        Ok(target_indices.into_iter().filter_map(reading).collect())
    }
}

/// The index of the target that a ray reads if it met that cluster so; `back` points to its origin.
fn reading_of(readings: &[Reading], (cluster, met): (u32, Met), back: DVec3) -> Option<u32> {
    let fits = |found: &&Reading| (found.cluster, found.met) == (cluster, met);
    // A gloss bin gets at most 1: rays of other directions may read it better.
    let fitness = |found: &Reading| match found.kind {
        Kind::Cluster | Kind::Patch => 2.0,
        Kind::Bin(direction) => direction.as_dvec3().dot(back),
    };
    let fitting = readings.iter().filter(fits);
    let best = fitting.max_by(|a, b| fitness(a).total_cmp(&fitness(b)));
    best.map(|found| found.target_index)
}

/// Whether a hit is so far away that bright clusters are sampled apart.
fn is_far(tracing: &Tracing<'_>, hit: &Hit, direction: DVec3) -> bool {
    let normal = tracing.geometry.normal(tracing.geometry.side(hit.triangle, direction));
    let level = tracing.hvds.cell_at(hit.position.as_vec3(), normal).level;
    let cell = tracing.hvds.grid.cell_size() * f64::from(1_u32 << level);
    let Strata { rings, sectors } = tracing.strata;
    hit.t > f64::from(far_cells(Hemisphere { rings, sectors })) * cell
}

/// The hit of a ray, from the device's answer.
fn hit(tracing: &Tracing<'_>, ray: &Ray, answer: &RayAnswer) -> Hit {
    let (t, triangle) = (f64::from(answer.t), answer.side / 2);
    let along = ray.origin.as_dvec3() + t * ray.direction;
    let barycentric = tracing.geometry.barycentric_at(triangle, along);
    let [p0, p1, p2] = tracing.geometry.triangles[triangle as usize].positions.map(Vec3::as_dvec3);
    let position = barycentric.x * p0 + barycentric.y * p1 + barycentric.z * p2;
    Hit { t, triangle, barycentric, position }
}
