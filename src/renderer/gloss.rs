//! Frame passes of glossy surfaces. A scene without a glossy material has none of them.

use super::Stages;
use super::lights::{GlossCapacity, Lights};
use super::quality_warnings::outgoing_directions;
use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::frame::bin_reads::BinReads;
use crate::passes::frame::gloss::{Gloss, vertices_for};
use crate::passes::frame::gloss_pixels::{GlossPixels, Surroundings};
use crate::passes::frame::hvds::Pyramid;
use crate::passes::precompute::gloss::GlossTables;
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::scene::directions::Directions;
use crate::scene::{Material, Scene};
use crate::types::View;
use glam::Vec3;
use std::sync::Arc;

/// The passes of glossy surfaces.
pub(super) struct GlossPasses {
    pub(super) clusters: Gloss,
    /// Glossy radiance of pixels.
    pub(super) pixels: GlossPixels,
    /// Cluster gloss bins that the rays of pixels read.
    reads: BinReads,
    /// For each material, whether it was glossy when the paths were traced.
    may_be_glossy: Vec<bool>,
    /// Some material has a lobe now.
    pub(super) is_glossy: bool,
    seed: u32,
}

impl GlossPasses {
    pub(super) fn new(
        context: &Arc<Context>,
        scene: &Scene,
        buffers: &SceneBuffers,
        tables: &GlossTables,
        (path_count, area_m2): (u32, f32),
        cluster_bits: u32,
    ) -> Result<Self> {
        let quality = &scene.quality;
        let [width, height] = scene.cameras[0].size;
        let directions = outgoing_directions(&scene.materials, Directions::new(quality.directions));
        let mut clusters = Gloss::new(context, buffers, tables, path_count, area_m2)?;
        clusters.max_asked = max_asked(&scene.materials);
        Ok(Self {
            reads: BinReads::new(context, tables, directions)?,
            clusters,
            pixels: GlossPixels::new(
                context,
                buffers,
                width * height,
                quality.gloss_rays,
                (cluster_bits, quality.entry_points > 0),
            )?,
            may_be_glossy: scene.materials.iter().map(Material::may_be_glossy).collect(),
            is_glossy: has_lobes(&scene.materials),
            seed: quality.seed,
        })
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

    /// Updates the passes after an edit of materials.
    pub(super) fn edited(&mut self, materials: &[Material]) {
        self.is_glossy = has_lobes(materials);
        self.clusters.max_asked = max_asked(materials);
    }

    /// Records the list of glossy pixels and traces their rays.
    pub(super) fn record_rays(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        clusters: &ClusterBuffers,
        pixels: &Buffer,
        view: &View,
    ) {
        self.pixels.record_rays(rec, scene, (clusters, &self.reads), pixels, view, self.seed);
        rec.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records the highlights of lights with stale ones.
    pub(super) fn record_highlights(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        lights: &Lights,
        eye: Vec3,
    ) {
        let due = lights.stale_highlights();
        if due.is_empty() {
            return;
        }
        let mut pass = rec.pass(GlossPixels::HIGHLIGHTS_STEM);
        for (place, (light, highlights)) in due.into_iter().enumerate() {
            if place > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            self.pixels.record_highlights(&mut pass, scene, light, (eye, self.seed), highlights);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records the beams of lights with stale form factors.
    pub(super) fn record_beams(&self, rec: &mut Recorder, scene: &SceneBuffers, lights: &Lights) {
        let mut pass = rec.pass(Gloss::BEAMS_STEM);
        for (place, (light, factors, found)) in lights.stale_beams().into_iter().enumerate() {
            if place > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            self.clusters.record_beams(&mut pass, scene, light, factors, &found);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records the first reflection of lights with stale clusters. The hierarchy waits for it.
    pub(super) fn record_entries(&self, rec: &mut Recorder, materials: &Buffer, lights: &Lights) {
        let due = lights.stale_bins();
        if !due.is_empty() {
            self.clusters.record_entries(rec, materials, &due);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Records the glossy radiance of clusters. After the last lobe is removed, the pass runs once
    /// more and writes zero.
    pub(super) fn record_clusters(
        &self,
        rec: &mut Recorder,
        stages: Stages,
        materials: &Buffer,
        pyramid: &Pyramid,
        contributions: &Buffer,
        lights: &Lights,
    ) {
        if self.is_glossy || stages.lobes {
            let paths = (&pyramid.contribution_ranges, contributions);
            self.clusters.record(rec, materials, paths, &lights.stale_bins(), &lights.bins());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Glossy radiance of pixels.
    pub(super) fn record_pixels(
        &self,
        rec: &mut Recorder,
        scene: &SceneBuffers,
        pixels: &Buffer,
        pyramid: &Pyramid,
        contributions: &Buffer,
        lights: &Lights,
    ) {
        if !self.is_glossy {
            return;
        }
        let around = Surroundings {
            scene,
            pixels,
            irradiance: &pyramid.irradiance,
            inverse_areas: &pyramid.inverse_areas,
            gloss: &self.clusters,
            contribution_ranges: &pyramid.contribution_ranges,
            contributions,
        };
        let of_lights = [&*lights.hits(), &*lights.highlights()];
        self.pixels.record(rec, around, &lights.stale_hits(), of_lights);
        rec.barrier(COMPUTE_TO_COMPUTE);
    }
}

/// Maximum number of vertices that a gloss bin sums: twice what the most demanding lobe needs,
/// because many rays read one gloss bin. No limit if a lobe needs all vertices. The rays of pixels
/// use the number of the material that they meet.
fn max_asked(materials: &[Material]) -> u32 {
    let lobes = materials.iter().filter(|material| material.specular != Vec3::ZERO);
    let needed: Vec<u32> = lobes.map(vertices_for).collect();
    if needed.contains(&0) { u32::MAX } else { 2 * needed.into_iter().max().unwrap_or(0) }
}

fn has_lobes(materials: &[Material]) -> bool {
    materials.iter().any(|material| material.specular != Vec3::ZERO)
}
