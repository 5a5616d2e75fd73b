//! The renderer owns the passes. The precomputation and the frame run them in the paper's order.

mod ablation;
mod changes;
mod clamping;
mod culling;
mod edits;
mod enclosures;
mod film;
mod gloss;
mod inspect;
mod lights;
mod liveness;
mod memory_hint;
mod near_lights;
mod needs;
mod outputs;
mod pass_costs;
mod precompute;
mod precompute_cache;
mod preview;
mod proxies;
mod quality_warnings;
mod replay;
mod report;
mod resize;
mod seen;
mod statistics;
mod steps;

pub use crate::passes::precompute::{Progress, Silent};
pub use ablation::{Exact, Stage};
pub use changes::Work;
pub use inspect::{ClusterAt, GatherRaySegment, PathPoint, RecordWeight, SurfaceAt};
pub use outputs::StageBuffers;
pub use precompute_cache::{Store, Written, miss_reason};
pub use preview::Preview;
pub use report::{Columns, FrameReport, Layer, Statistics};

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER};
use crate::gpu::{Context, Recorder};
use crate::passes::frame::{
    antialias::Antialias, blend::Blend, compose::Compose, direct::Direct, form_factors::FormFactors,
    gather::Gather, hvds::Pyramid, near_lights::NearLights, path_scan::PathScan, pixel_colours::PixelColours,
    primary::Primary, splat::Splat, tonemap::Tonemap,
};
use crate::passes::precompute::path_orders::PathGroup;
use crate::passes::{ClusterBuffers, ClusterTables, SceneBuffers, reflectances};
use crate::scene::Scene;
use crate::scene::directions::Directions;
use crate::types::{Reflectance, Surface, View};
use changes::{Changes, Stages};
use enclosures::Enclosures;
use gloss::GlossPasses;
use lights::Lights;
use liveness::Scopes;
use needs::{Gathering, Needs};
use precompute::Precomputed;
use proxies::Proxies;
use report::FrameWatch;
use std::sync::Arc;
use std::time::Instant;

/// A scene with traced light paths, cache points and gather rays. Every frame is
/// the converged picture.
pub struct Renderer {
    context: Arc<Context>,
    scene: Scene,
    surfaces: Vec<Surface>,
    view: View,
    buffers: SceneBuffers,
    lights: Lights,
    primary: Primary,
    direct: Direct,
    antialias: Antialias,
    /// Number of edge pixels in the last view.
    edge_count: u32,
    form_factors: FormFactors,
    near_lights: NearLights,
    path_scan: PathScan,
    /// Ranges of light paths by the editable materials that reflect them.
    path_groups: Vec<PathGroup>,
    path_names: Vec<u32>,
    /// Materials at the time when the light paths were traced.
    traced_with: Vec<Reflectance>,
    pyramid: Pyramid,
    proxies: Proxies,
    scopes: Scopes,
    /// Number of near-field patches that cache points in narrow cavities see. They come first.
    narrow_patches: u32,
    gather: Gather,
    needs: Needs,
    /// `None` if no material may be glossy.
    gloss: Option<GlossPasses>,
    blend: Blend,
    splat: Splat,
    pixel_colours: PixelColours,
    compose: Compose,
    tonemap: Tonemap,
    exposure_stops: f32,
    /// Weights of direct and indirect light in the picture.
    light_weights: [f32; 2],
    cluster_tables: ClusterTables,
    /// `None` if no material may be glossy: no ray queries clusters after the precomputation.
    clusters: Option<ClusterBuffers>,
    closed: Enclosures,
    statistics: Statistics,
    changes: Changes,
    /// Frames skip passes whose inputs have not changed.
    skips: bool,
}

impl Renderer {
    /// Precomputes a scene for its first camera.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(context: &Arc<Context>, scene: Scene, progress: &mut dyn Progress) -> Result<Self> {
        let make = || {
            let (start, mut scene) = (Instant::now(), scene);
            let made = precompute::precompute(context, &mut scene, progress)?;
            Self::from_precomputed(context, scene, made, start)
        };
        make().map_err(memory_hint::with_hint)
    }

    /// Builds the renderer from the results of a precomputation that began at `start`.
    fn from_precomputed(
        context: &Arc<Context>,
        mut scene: Scene,
        mut made: Precomputed,
        start: Instant,
    ) -> Result<Self> {
        let reach = seen::paths_to_view(&mut scene, &made)?;
        let size = scene.cameras[0].size;
        let pixels = size[0] * size[1];
        let antialias = Antialias::new(context, size, scene.quality.edge_samples)?;
        let direct = Direct::new(context, size, antialias.capacity.slots)?;
        let form_factors = FormFactors::new(context, &made.buffers, &made.entry_points, made.area_m2)?;
        let factor_count = form_factors.point_count();
        let is_glossy = made.gloss.is_some();
        let near_lights = near_lights::near_lights(context, &scene, &made)?;
        let (paths, bits) = ((factor_count, made.area_m2), made.packing.cluster_bits);
        let gloss = |tables| GlossPasses::new(context, &scene, &made.buffers, tables, paths, bits);
        let gloss = made.gloss.as_ref().map(gloss).transpose()?;
        let mut pyramid =
            Pyramid::new(context, &made.hvds, &made.paths.contribution_offsets, made.area_m2, is_glossy)?;
        let proxies = Proxies::new(context, made.proxies.take(), &made.hvds, &mut pyramid)?;
        pyramid.reserve_patches(context, made.near_patches.len() as u32)?;
        let reads = liveness::reads(&made, &proxies, &pyramid)?;
        made.statistics.skipped.extend(liveness::unread(
            &made,
            &reads,
            Directions::new(scene.quality.directions),
        ));
        let scopes = Scopes::new(context, &mut made, &reads)?;
        let counts = [factor_count, direct.point_count(), pyramid.base_count()];
        let gloss_capacity = gloss.as_ref().map(GlossPasses::capacity);
        let (points, hemisphere) = (made.point_count, made.hemisphere);
        let gather = Gather::of_merged_rays(
            context,
            made.cache_points,
            points,
            made.merged_rays,
            hemisphere,
            made.packing,
            is_glossy,
        )?;
        let mut renderer = Self {
            context: context.clone(),
            view: View::from(&scene.cameras[0]),
            lights: Lights::new(context, &scene.lights, counts, gloss_capacity)?,
            primary: Primary::new(context, pixels)?,
            direct,
            pixel_colours: PixelColours::new(context, &made.buffers, pixels, antialias.capacity.slots)?,
            antialias,
            edge_count: 0,
            form_factors,
            near_lights,
            path_scan: PathScan::new(
                context,
                &made.paths.steps,
                &made.paths.colours,
                &made.paths.arrivals.lobes,
                &made.paths.contributions,
            )?,
            path_groups: made.paths.groups,
            path_names: made.paths.names,
            traced_with: reflectances(&scene.materials),
            pyramid,
            proxies,
            scopes,
            narrow_patches: made.narrow_patches,
            needs: Needs::new(context, &gather)?,
            gather,
            blend: Blend::new(context, &made.neighbourhoods)?,
            splat: Splat::new(context, made.point_count, size)?,
            gloss,
            compose: Compose::new(context, &made.buffers, size, is_glossy)?,
            tonemap: Tonemap::new(context, pixels)?,
            exposure_stops: 0.0,
            light_weights: [1.0, 1.0],
            cluster_tables: made.cluster_tables,
            clusters: made.clusters,
            closed: made.closed,
            buffers: made.buffers,
            surfaces: made.surfaces,
            scene,
            statistics: made.statistics,
            changes: Changes::ALL,
            skips: true,
        };
        renderer.warn_of_few_paths(&reach)?;
        renderer.statistics.end_precomputation("tables for frames", start.elapsed());
        Ok(renderer)
    }

    /// Renders one frame: updates the stale results and everything that depends on them. The first
    /// frame without a change after a light edit gathers the records that the view does not use,
    /// so that they are current when the camera moves. Later frames without a change do nothing.
    /// If the camera and a light have come into the same enclosure, the frame precomputes the
    /// scene anew ([`Self::open_enclosures`]).
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn frame(&mut self) -> Result<FrameReport> {
        self.open_enclosures()?;
        if !self.skips {
            self.force(Work::Everything);
        }
        let watch = FrameWatch::start(&self.context);
        let near_lights_ms = self.find_near_lights()?;
        self.scopes.prepare(self.skips)?;
        let stages = Stages::new(self.changes, &self.lights);
        let gathering = self.needs.of(stages, self.skips);
        let mut passes = loop {
            let ((), passes) = self.context.run(|rec| self.record(rec, stages, gathering))?;
            self.buffers.refuse_truncated_loops("frame", 0)?;
            if !stages.view || !self.splat.grow()? {
                break passes;
            }
        };
        let [frame_ms, pipelines_ms] = watch.stop(&self.context);
        if let Some(pass) = passes.iter_mut().find(|pass| pass.name == FormFactors::STEM) {
            pass.ms += near_lights_ms;
        }
        if stages.view {
            self.edge_count = self.antialias.edge_count()?;
        }
        let gathered = self.needs.settle(stages, gathering)?;
        let columns = Columns::from_passes(&passes);
        let (bytes, rays) = self.accounts(&passes)?;
        let lights_unchanged = self.lights.unchanged();
        self.lights.settle();
        self.changes = Changes::default();
        Ok(FrameReport { passes, frame_ms, pipelines_ms, columns, bytes, rays, gathered, lights_unchanged })
    }

    /// Records the frame. [Yue §3] Each pass waits for the one before, so that the timings of
    /// passes are separate.
    fn record(&self, rec: &mut Recorder, stages: Stages, gathering: Gathering) {
        let pixels = &self.primary.pixels;
        if stages.view {
            self.primary.record(rec, &self.buffers, &self.view);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.antialias.record(rec, &self.buffers, &self.view, pixels);
            rec.barrier(COMPUTE_TO_INDIRECT);
            if self.buffers.textures.are_used {
                self.pixel_colours.record(rec, &self.buffers, &self.view, pixels, Some(&self.antialias));
                rec.barrier(COMPUTE_TO_COMPUTE);
            }
        }
        if let (Some(gloss), Some(clusters), true) = (&self.gloss, &self.clusters, stages.lobes) {
            gloss.record_rays(rec, &self.buffers, clusters, pixels, &self.view);
        }
        if let Some(gloss) = &self.gloss {
            gloss.record_highlights(rec, &self.buffers, &self.lights, self.view.position);
        }
        if !self.lights.stale_irradiance().is_empty() {
            self.record_irradiances(rec);
        }
        if stages.direct {
            self.direct.record_sum(rec, &self.antialias, &self.lights.irradiances());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        let stale_factors = self.lights.stale_factors();
        if !stale_factors.is_empty() {
            let mut pass = rec.pass(FormFactors::STEM);
            for (place, (light, factors)) in stale_factors.into_iter().enumerate() {
                if place > 0 {
                    pass.barrier(COMPUTE_TO_TRANSFER);
                }
                self.form_factors.record(&mut pass, &self.buffers, light, factors);
                if let Some((near, count)) = self.lights.near(light.index) {
                    pass.barrier(COMPUTE_TO_COMPUTE);
                    self.near_lights.record(&mut pass, near, *count, factors);
                }
            }
            pass.barrier(COMPUTE_TO_COMPUTE);
            drop(pass);
            if let Some(gloss) = &self.gloss {
                gloss.record_beams(rec, &self.buffers, &self.lights);
            }
        }
        if stages.scan {
            self.path_scan.record(rec, &self.buffers.materials, self.edited_paths().as_deref());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.energy {
            let materials = &self.buffers.materials;
            if let Some(gloss) = &self.gloss {
                gloss.record_entries(rec, materials, &self.lights);
            }
            let scope = self.scopes.of(self.skips);
            self.record_flux(rec, scope, &self.lights.stale_clusters());
            if let Some(gloss) = &self.gloss {
                let contributions = self.path_scan.contributions.whole();
                gloss.record_clusters(rec, stages, materials, &self.pyramid, contributions, &self.lights);
            }
            self.record_near_field(rec, scope);
        }
        if stages.view {
            let (surfaces, points) = (&self.buffers.surfaces, &self.gather.cache_points);
            self.splat.record(rec, surfaces, points, &self.primary.pixels, &self.view);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if let Some((list, seen)) = self.needs.record(rec, gathering, &self.splat, &self.blend) {
            self.gather.record(rec, self.gather_sources(), list);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.blend.record(rec, &self.gather.cache_points, &self.gather.records, seen);
            if stages.splat {
                rec.barrier(COMPUTE_TO_COMPUTE);
            }
        }
        if stages.splat {
            self.splat.record_apply(rec, &self.primary.pixels, &self.blend.records);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if let Some(gloss) = self.gloss.as_ref().filter(|_| stages.gloss) {
            let contributions = self.path_scan.contributions.whole();
            gloss.record_pixels(rec, &self.buffers, pixels, &self.pyramid, contributions, &self.lights);
        }
        if stages.compose {
            self.compose.record(rec, &self.buffers, self.irradiances(), self.light_weights);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.display {
            self.tonemap.record(rec, &self.compose.radiance, self.exposure_stops);
        }
    }
}
