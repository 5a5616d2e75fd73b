//! Frame passes of glossy surfaces. A scene without a glossy material has none of them.

use super::image::Image;
use super::light_cache::GlossCapacity;
use super::lights::Lights;
use super::plan::FramePlan;
use super::quality_warnings::outgoing_directions;
use super::world::World;
use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::SceneBuffers;
use crate::passes::frame::bin_reads::BinReads;
use crate::passes::frame::form_factors::FormFactors;
use crate::passes::frame::gather::Gather;
use crate::passes::frame::gloss::{Gloss, vertices_for};
use crate::passes::frame::gloss_pixels::{GlossPixels, Surroundings};
use crate::passes::frame::gloss_records::{BroadLobes, GlossRecords, LobeExponents, RecordLobes};
use crate::passes::frame::hvds::Pyramid;
use crate::passes::frame::splat::Splat;
use crate::passes::gather_targets::{GatherTargets, Reader};
use crate::passes::gloss_tables::GlossTables;
use crate::passes::precompute::gather_rays::{RayDirections, RayTable};
use crate::passes::precompute::gloss::wanted_directions;
use crate::scene::directions::Directions;
use crate::scene::{Material, Scene};
use glam::Vec3;
use std::mem;
use std::sync::Arc;

/// The passes of glossy surfaces.
pub(super) struct GlossPasses {
    pub(super) clusters: Gloss,
    /// Glossy radiance of pixels.
    pub(super) pixels: GlossPixels,
    /// Broad lobes at records.
    pub(super) records: GlossRecords,
    /// Cluster gloss bins that the rays of pixels read.
    reads: BinReads,
    /// For each material, whether it was glossy when the paths were traced.
    may_be_glossy: Vec<bool>,
    /// Some material has a lobe now.
    pub(super) is_glossy: bool,
    /// Some lobe's light comes along rays from pixels.
    has_rays: bool,
    has_sky: bool,
    /// Gather rays of a cache point.
    gather_rays: u32,
    has_records: bool,
    /// Fraction of the scene's area that each material has.
    area_parts: Vec<f64>,
    /// For each material, whether its lobe takes its light from records.
    of_records: Vec<bool>,
    seed: u32,
}

impl GlossPasses {
    /// The rays of a table that read gloss bins. Rays of cache points read these bins, too.
    pub(super) fn readers(
        &self,
        directions: &RayDirections<'_>,
        rays: &RayTable,
        targets: &GatherTargets,
    ) -> Result<Vec<Reader>> {
        let bins = (&self.may_be_glossy[..], self.reads.directions);
        self.reads.readers(&wanted_directions(bins, directions, rays, targets)?)
    }

    pub(super) fn new(
        context: &Arc<Context>,
        scene: &Scene,
        buffers: &SceneBuffers,
        tables: &GlossTables,
        (path_count, area_m2): (u32, f32),
        (gather, cluster_bits): (&Gather, u32),
    ) -> Result<Self> {
        let quality = &scene.quality;
        let [width, height] = scene.cameras[0].size;
        let gather_rays = gather.hemisphere.rays();
        let has_records = gather.point_count() > 0;
        let directions = outgoing_directions(&scene.materials, Directions::new(quality.directions));
        let area_parts = area_parts(scene);
        let broad = broad_lobes(&scene.materials, &area_parts, gather_rays, has_records);
        let pixels = GlossPixels::new(
            context,
            buffers,
            width * height,
            quality.gloss_rays,
            cluster_bits,
            [quality.entry_points > 0, may_trace(&scene.materials, broad)],
        )?;
        let mut passes = Self {
            reads: BinReads::new(context, tables, directions)?,
            clusters: Gloss::new(context, buffers, tables, path_count, area_m2)?,
            pixels,
            records: GlossRecords::new(context, gather, LobeExponents::new(&scene.materials, broad))?,
            may_be_glossy: scene.materials.iter().map(Material::may_be_glossy).collect(),
            is_glossy: false,
            has_rays: false,
            has_sky: scene.emission.sky.is_some(),
            gather_rays,
            has_records,
            area_parts,
            of_records: Vec::new(),
            seed: quality.seed,
        };
        passes.edited(&scene.materials);
        Ok(passes)
    }

    /// Sizes of the lights' buffers for glossy materials.
    pub(super) fn capacity(&self) -> GlossCapacity {
        GlossCapacity {
            beam_bytes: self.clusters.beam_bytes(1),
            bin_count: self.clusters.leaf_count,
            sample_count: self.pixels.capacity,
        }
    }

    /// Whether a material had a lobe or was editable when the paths were traced.
    pub(super) fn may_be_glossy(&self, material: usize) -> bool {
        self.may_be_glossy[material]
    }

    /// Updates the passes after an edit of materials. Returns whether other lobes than before take
    /// their light from records.
    pub(super) fn edited(&mut self, materials: &[Material]) -> bool {
        let lobes_at_records =
            |has_records| broad_lobes(materials, &self.area_parts, self.gather_rays, has_records);
        let broad = lobes_at_records(self.has_records);
        let lobes: Vec<&Material> =
            materials.iter().filter(|material| material.specular != Vec3::ZERO).collect();
        let takes_rays = |broad: BroadLobes| lobes.iter().any(|material| !broad.hold(material));
        self.is_glossy = !lobes.is_empty();
        self.has_rays = takes_rays(broad);
        // Highlights are the same with and without records.
        self.pixels.takes_samples = self.has_sky || takes_rays(lobes_at_records(true));
        let of_records: Vec<bool> = materials.iter().map(|material| broad.hold(material)).collect();
        self.records.edited(LobeExponents::new(materials, broad));
        self.pixels.broad = broad;
        self.clusters.max_asked = max_asked(materials);
        mem::replace(&mut self.of_records, of_records) != self.of_records
    }

    /// Records the list of glossy pixels and traces their rays.
    pub(super) fn record_rays(&self, rec: &mut Recorder, plan: &FramePlan, world: &World, image: &Image) {
        let Some(clusters) = world.clusters.as_ref().filter(|_| plan.lobe_rays) else { return };
        let (seen, view) = (image.seen_fragments(), &image.view);
        self.pixels.record_rays(rec, &world.buffers, (clusters, &self.reads), seen, view, self.seed);
        rec.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records highlights of the lights that the plan names.
    pub(super) fn record_highlights(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        world: &World,
        lights: &Lights,
        eye: Vec3,
    ) {
        let planned = lights.planned_highlights(plan);
        if planned.is_empty() {
            return;
        }
        let mut pass = rec.pass(GlossPixels::HIGHLIGHTS_STEM);
        for (place, (light, highlights)) in planned.into_iter().enumerate() {
            if place > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            self.pixels.record_highlights(&mut pass, &world.buffers, light, (eye, self.seed), highlights);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records beams of the lights whose form factors the plan names.
    pub(super) fn record_beams(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        (buffers, form_factors): (&SceneBuffers, &FormFactors),
        lights: &Lights,
    ) {
        let mut pass = rec.pass(Gloss::BEAMS_STEM);
        for (place, (light, factors, found)) in lights.planned_beams(plan).into_iter().enumerate() {
            if place > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            self.clusters.record_beams(&mut pass, buffers, light, factors, &found);
            form_factors.record_sky_beams(&mut pass, light, &self.clusters, &found);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records the first reflection of the lights whose clusters the plan names. The hierarchy
    /// waits for it.
    pub(super) fn record_entries(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        materials: &Buffer,
        lights: &Lights,
    ) {
        let planned = lights.planned_bins(plan);
        if !planned.is_empty() {
            self.clusters.record_entries(rec, materials, &planned);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Records the glossy radiance of clusters from the contributions. After the last lobe is
    /// removed, the pass runs once more and writes zero.
    pub(super) fn record_clusters(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        materials: &Buffer,
        contributions: &Buffer,
        lights: &Lights,
    ) {
        if self.is_glossy || plan.lobe_rays {
            self.clusters.record(rec, materials, contributions, &lights.planned_bins(plan), &lights.bins());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Records the glossy radiance of pixels.
    pub(super) fn record_pixels(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        (world, image, splat): (&World, &Image, &Splat),
        (pyramid, gather, contributions): (&Pyramid, &Gather, &Buffer),
        lights: &Lights,
    ) {
        if !plan.gloss || !self.is_glossy {
            return;
        }
        let (seen, eye) = (image.seen_fragments(), image.view.position);
        if self.records.exponents().count > 0 && (plan.splat || plan.lobe_rays) {
            self.records.record(rec, &world.buffers, (seen, splat), gather, eye);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        let around = Surroundings {
            scene: &world.buffers,
            seen,
            irradiance: &pyramid.irradiance,
            inverse_areas: &pyramid.inverse_areas,
            gloss: &self.clusters,
            contributions,
            lobes: Some(RecordLobes { lobes: &self.records, splat, eye }),
        };
        let due = if self.has_rays { lights.planned_hits(plan) } else { Vec::new() };
        let of_lights = [&*lights.hits(), &*lights.highlights()];
        self.pixels.record(rec, around, &due, of_lights);
        rec.barrier(COMPUTE_TO_COMPUTE);
    }
}

/// Maximum number of vertices that a gloss bin sums: what the most demanding lobe needs. No limit
/// if a lobe needs all vertices. The rays of pixels use the number of the material that they meet.
fn max_asked(materials: &[Material]) -> u32 {
    let lobes = materials.iter().filter(|material| material.specular != Vec3::ZERO);
    let needed: Vec<u32> = lobes.map(vertices_for).collect();
    if needed.contains(&0) { u32::MAX } else { needed.into_iter().max().unwrap_or(0) }
}

/// The lobes that records bring; none without records.
fn broad_lobes(
    materials: &[Material],
    area_parts: &[f64],
    gather_rays: u32,
    has_records: bool,
) -> BroadLobes {
    if has_records { BroadLobes::new(materials, area_parts, gather_rays) } else { BroadLobes::default() }
}

/// Fraction of the scene's area that each material has.
fn area_parts(scene: &Scene) -> Vec<f64> {
    let mut areas = vec![0.0; scene.materials.len()];
    for triangle in &scene.triangles {
        areas[triangle.material as usize] += triangle.area_m2();
    }
    let whole: f64 = areas.iter().sum();
    areas.into_iter().map(|area| area / whole).collect()
}

/// Whether some lobe takes rays from pixels, now or after an edit.
pub(super) fn may_trace(materials: &[Material], broad: BroadLobes) -> bool {
    materials.iter().any(|material| material.may_be_glossy() && (material.editable || !broad.hold(material)))
}
