//! The renderer: plans which results are stale, and records the passes that compute them. [Yue §3]

mod ablation;
mod clamping;
mod counters;
mod culling;
mod dirty;
mod edits;
mod enclosures;
mod film;
mod frame;
mod gathers;
mod gloss;
mod image;
mod inspect;
mod light_cache;
mod light_pictures;
mod lights;
mod liveness;
mod meters;
mod mixing;
mod outputs;
mod own_records;
mod pass_costs;
mod pass_sizes;
mod passes;
mod plan;
mod precompute;
mod precompute_cache;
mod preview;
mod quality_warnings;
mod readings;
mod reopen;
mod replay;
mod report;
mod resize;
mod seen;
mod statistics;
mod transport;
mod world;

pub use crate::passes::precompute::kept::Kept;
pub use crate::passes::precompute::{Progress, Silent};
pub use ablation::{Exact, Stage};
pub use dirty::Work;
pub use frame::RecordedFrame;
pub use inspect::{ClusterAt, GatherRaySegment, PathPoint, RecordWeight, SurfaceAt};
pub use light_pictures::LightPicture;
pub use meters::Measured;
pub use mixing::Mix;
pub use outputs::StageBuffers;
pub use plan::{FramePlan, Gathering, LightResults, Scan, Uploads};
pub use precompute_cache::{Store, Written, miss_reason};
pub use preview::Preview;
pub use readings::Reading;
pub use report::{Columns, FrameCounts, FrameReport, Layer, Statistics};

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE};
use crate::gpu::{Context, Recorder};
use crate::passes::bright_tables::BrightTables;
use crate::passes::frame::{
    antialias, blend::Blend, bright::Bright, form_factors::FormFactors, gather::Gather, hvds::Pyramid,
    near_lights::NearLights, path_scan::PathScan, record_tree::RecordTree, splat::Splat,
};
use crate::passes::precompute::begin_stage;
use crate::passes::precompute::live_clusters::LiveClusters;
use crate::passes::reflectances;
use crate::scene::directions::Directions;
use crate::scene::{Material, Measure, Naming, Scene};
use crate::types::{CachePoint, PathVertex, View};
use counters::FrameCounters;
use dirty::Dirty;
use gloss::GlossPasses;
use image::{Image, IndirectLight};
use lights::Lights;
use liveness::LiveSets;
use precompute::Precomputed;
use report::FrameWatch;
use std::sync::Arc;
use std::time::Instant;
use transport::{RecordLists, Transport};
use world::World;

/// A scene with traced light paths, cache points and gather rays. Every frame is
/// the converged picture.
pub struct Renderer {
    context: Arc<Context>,
    world: World,
    lights: Lights,
    transport: Transport,
    image: Image,
    splat: Splat,
    own_records: own_records::ViewRecords,
    dirty: Dirty,
    counters: FrameCounters,
    /// `None` without meters.
    meters: Option<meters::MeterPasses>,
    statistics: Statistics,
    /// Passes wait for each other, so that each can be timed.
    is_serialised: bool,
}

impl Renderer {
    /// Precomputes a scene for its first camera.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(context: &Arc<Context>, scene: Scene, progress: &mut dyn Progress) -> Result<Self> {
        Self::trace(context, scene, None, progress)
    }

    /// As [`Self::new`], with what the precomputation before left: less is traced if only models
    /// that can move have moved since. The bits are the same.
    ///
    /// # Errors
    /// As for [`Self::new`].
    #[doc(hidden)]
    pub fn new_keeping(
        context: &Arc<Context>,
        scene: Scene,
        kept: &mut Kept,
        progress: &mut dyn Progress,
    ) -> Result<Self> {
        if scene.naming() == Naming::Number {
            return Self::new(context, scene, progress);
        }
        match Self::trace(context, scene.clone(), Some(kept), progress) {
            // What is kept takes memory, too.
            Err(error) if error.is_out_of_memory() => {
                *kept = Kept::default();
                Self::new(context, scene, progress)
            }
            traced => traced,
        }
    }

    fn trace(
        context: &Arc<Context>,
        mut scene: Scene,
        kept: Option<&mut Kept>,
        progress: &mut dyn Progress,
    ) -> Result<Self> {
        let start = Instant::now();
        let kept = precompute_cache::begun(kept, &scene);
        let made = precompute::precompute(context, &mut scene, kept, progress)?;
        Self::from_precomputed(context, scene, made, start, progress)
    }

    /// Builds the renderer from the results of a precomputation that began at `start`.
    fn from_precomputed(
        context: &Arc<Context>,
        mut scene: Scene,
        made: Precomputed,
        start: Instant,
        progress: &mut dyn Progress,
    ) -> Result<Self> {
        begin_stage(progress, "tables for frames", 1)?;
        let reach = seen::paths_to_view(&mut scene, &made)?;
        let (view, is_glossy) = (View::from(&scene.cameras[0]), made.gloss.is_some());
        let mut image = Image::new(context, &made.buffers, view, scene.quality.edge_samples, is_glossy)?;
        image.antialias.smooth_m = antialias::SMOOTH * made.hvds.grid.cell_size() as f32;
        let mut points: Vec<CachePoint> = made.cache_points.read()?;
        points.truncate(points.len() - scene.measuring_points().iter().product::<usize>());
        let tree = RecordTree::new(context, &points, &scene.triangles)?;
        let splat = Splat::new(context, tree.into(), image.size(), image.antialias.capacity.points)?;
        let (world, transport, statistics) = Self::upload(context, scene, made)?;
        let factor_count = transport.form_factors.point_count();
        let counts = [factor_count, image.direct.point_count(), transport.pyramid.base_count()];
        let gloss_capacity = transport.gloss.as_ref().map(GlossPasses::capacity);
        let mut renderer = Self {
            context: context.clone(),
            lights: Lights::new(
                context,
                (&world.scene.lights, &world.scene.emission, world.buffers.light_channels),
                counts,
                gloss_capacity,
                world.buffers.silhouette_edges.is_some(),
            )?,
            dirty: Dirty::new(world.scene.lights.len()),
            counters: FrameCounters::new(context)?,
            meters: meters::MeterPasses::new(context, &transport.gather, world.scene.measuring_points())?,
            world,
            transport,
            image,
            splat,
            own_records: own_records::ViewRecords::default(),
            statistics,
            is_serialised: true,
        };
        renderer.warn_of_few_paths(&reach)?;
        renderer.statistics.end_precomputation("tables for frames", start.elapsed());
        progress.finish();
        Ok(renderer)
    }

    /// Uploads the results of the precomputation that frames read.
    fn upload(
        context: &Arc<Context>,
        scene: Scene,
        mut made: Precomputed,
    ) -> Result<(World, Transport, Statistics)> {
        // A path's stream is its number before paths are grouped by editable materials. Rays of the
        // sky take the number after that.
        let numbers: Vec<u32> = (0..made.entry_points.len() as u32).collect();
        let streams = match scene.naming() {
            Naming::Number => &numbers,
            Naming::Place => &made.paths.streams,
        };
        let entry_points = (&made.entry_points[..], &streams[..]);
        let form_factors = FormFactors::new(context, &made.buffers, entry_points, made.area_m2)?;
        let is_glossy = made.gloss.is_some();
        let may_be_glossy: Vec<bool> = scene.materials.iter().map(Material::may_be_glossy).collect();
        let near: &[PathVertex] =
            if scene.quality.takes(Measure::NearLights) { &made.entry_points } else { &[] };
        let near_lights = NearLights::new(context, near, &made.surfaces, &may_be_glossy, made.area_m2)?;
        let (paths, bits) = ((form_factors.point_count(), made.area_m2), made.packing.cluster_bits);
        let mut pyramid = Pyramid::new(
            context,
            (&made.hvds, &made.shown_m2),
            &made.paths.contribution_offsets,
            made.area_m2,
            is_glossy,
        )?;
        pyramid.reserve_patches(context, made.near_patches.len() as u32)?;
        let reads = liveness::reads(&made, &pyramid)?;
        let unread = liveness::unread(&made, &reads, Directions::new(scene.quality.directions));
        made.statistics.skipped.extend(unread);
        let live_sets = LiveSets::new(context, &mut made, &reads)?;
        let bright = Self::bright(context, &scene, &made, &reads)?;
        let gather = Gather::new(
            context,
            made.cache_points,
            made.point_count,
            made.merged_rays,
            made.hemisphere,
            made.packing,
            is_glossy,
        )?;
        let gloss = |tables| GlossPasses::new(context, &scene, &made.buffers, tables, paths, (&gather, bits));
        let gloss = made.gloss.as_ref().map(gloss).transpose()?;
        let paths = &made.paths;
        let transport = Transport {
            form_factors,
            near_lights,
            path_scan: PathScan::new(
                context,
                &paths.steps,
                &paths.colours,
                &paths.arrivals.lobes,
                &paths.contributions,
            )?,
            path_ranges: made.paths.ranges,
            pyramid,
            live_sets,
            narrow_patches: made.narrow_patches,
            gap_rounds: scene.quality.gap_rounds,
            record_lists: RecordLists::new(context, &gather)?,
            gather,
            bright,
            blend: Blend::new(context, &made.neighbourhoods)?,
            gloss,
        };
        let world = World {
            traced_with: reflectances(&scene.materials),
            scene,
            surfaces: made.surfaces,
            buffers: made.buffers,
            enclosures: made.enclosures,
            cluster_tables: made.cluster_tables,
            clusters: made.clusters,
            path_streams: made.paths.streams,
        };
        Ok((world, transport, made.statistics))
    }

    /// The pass that samples bright clusters.
    fn bright(
        context: &Arc<Context>,
        scene: &Scene,
        made: &Precomputed,
        reads: &LiveClusters,
    ) -> Result<Option<Bright>> {
        if !scene.quality.takes(Measure::BrightClusters) {
            return Ok(None);
        }
        let points = (&made.entry_points[..], &made.surfaces[..]);
        let tables = BrightTables::new(&made.hvds, points, &reads.flux, made.hemisphere);
        Bright::new(context, &made.buffers, &tables, made.hemisphere, scene.quality.seed).map(Some)
    }

    /// What the next frame will do.
    #[doc(hidden)]
    pub fn plan(&self) -> FramePlan {
        self.dirty.plan(&self.lights.traced(), self.transport.gloss.is_some())
    }

    /// Whether the picture of the last frame shows the scene as it is now.
    pub fn is_current(&self) -> bool {
        self.plan().is_idle()
    }

    /// Renders one frame: computes the stale results and everything that depends on them, in one
    /// submission. The first frame without a change after a light edit gathers the records that the
    /// view does not use, so that they are current when the camera moves. Later frames without a
    /// change do nothing. A frame never precomputes: see [`FrameReport::needs_precompute`].
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn frame(&mut self) -> Result<FrameReport> {
        let watch = FrameWatch::start(&self.context);
        let (recorder, frame) = self.begin_frame()?;
        let mut passes = recorder.submit()?.wait()?;
        while !self.fits(&frame)? {
            passes = self.record_frame(&frame)?.submit()?.wait()?;
        }
        self.frame_is_valid(&frame);
        let [frame_ms, pipelines_ms] = watch.stop(&self.context);
        let report = self.end_frame(&frame, passes)?;
        let (bytes, rays) = self.costs(&frame.plan, &report.passes);
        let counts = self.frame_counts(&frame.plan);
        Ok(FrameReport { bytes, rays, counts, frame_ms, pipelines_ms, ..report })
    }

    /// Sets whether the passes of a frame wait for each other, so that each can be timed; by
    /// default they do. If not, commands wait only for their data, independent ones may run at
    /// once, and [`FrameReport::passes`] is empty. The picture has the same bits.
    pub fn set_serialised(&mut self, is_serialised: bool) {
        self.is_serialised = is_serialised;
    }

    /// Records what the plan names, in the paper's order. [Yue §3] Each pass waits for the one
    /// before, so that the timings of passes are separate; free recordings ignore these barriers.
    fn record(&self, rec: &mut Recorder, plan: &FramePlan) {
        let Self { world, lights, transport, image, splat, .. } = self;
        let (buffers, materials) = (&world.buffers, &world.buffers.materials);
        let points = &transport.gather.cache_points;
        self.record_uploads(rec, plan);
        if plan.traces_shadows() && self.context.tuning().finds_alike {
            buffers.ray_counts.iter().for_each(|count| rec.fill_zero(count));
            rec.barrier(TRANSFER_TO_COMPUTE);
        }
        if plan.view {
            image.record_view(rec, buffers);
        }
        if let Some(gloss) = &transport.gloss {
            gloss.record_rays(rec, plan, world, image);
            gloss.record_highlights(rec, plan, world, lights, image.view.position);
        }
        image.record_direct(rec, plan, buffers, lights);
        transport.record_factors(rec, plan, buffers, lights);
        transport.record_scan(rec, plan, materials);
        transport.record_hierarchy(rec, plan, materials, lights);
        if plan.view {
            splat.record(rec, &buffers.surfaces, points, image.seen());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        transport.record_gather(rec, plan, (buffers, lights.sky()), (splat, image.seen()));
        if plan.splat {
            self.record_splat(rec);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if let Some(gloss) = &transport.gloss {
            let sources = (&transport.pyramid, &transport.gather, transport.path_scan.contributions.whole());
            gloss.record_pixels(rec, plan, (world, image, splat), sources, lights);
        }
        image.record_picture(rec, plan, buffers, self.indirect_light());
        self.record_counters(rec, plan);
    }

    /// Records the indirect light of pixels and edge points, by records and own records.
    fn record_splat(&self, rec: &mut Recorder) {
        let Self { world, lights, transport, image, splat, .. } = self;
        splat.record_apply(rec, image.seen(), &transport.blend.records);
        if let Some(records) = self.own_records.shown() {
            rec.barrier(COMPUTE_TO_COMPUTE);
            records.record(rec, transport.all_sources(&world.buffers, lights.sky()), splat);
        }
    }

    /// Records the upload of edited tables.
    fn record_uploads(&self, rec: &mut Recorder, plan: &FramePlan) {
        if plan.uploads.lights {
            self.lights.record_upload(rec);
        }
        if plan.uploads.emission {
            self.lights.record_sky_upload(rec);
            self.world.buffers.emission.record_upload(rec, &self.world.scene.lights);
        }
        if plan.uploads.materials {
            rec.upload(&self.world.buffers.materials, &reflectances(&self.world.scene.materials));
        }
        if plan.uploads != Uploads::default() {
            rec.barrier(TRANSFER_TO_COMPUTE);
        }
    }

    /// Records copies of counters to the host.
    fn record_counters(&self, rec: &mut Recorder, plan: &FramePlan) {
        let lists = matches!(plan.gather, Gathering::List(_));
        let traces = plan.traces_shadows();
        let bright = self.transport.bright.as_ref().filter(|_| plan.gather != Gathering::Nothing);
        if plan.view || lists || traces || bright.is_some() {
            rec.barrier(COMPUTE_TO_TRANSFER);
            let needed = &self.transport.record_lists.needed;
            self.counters.record(rec, plan, (&self.splat, &self.image.antialias, needed), bright);
            if traces && self.context.tuning().finds_alike {
                self.counters.copy_rays(rec, &self.world.buffers.ray_counts);
            }
            let near_lights = &self.transport.near_lights;
            self.lights.copy_counters(rec, plan, (&self.image.antialias, near_lights));
        }
    }

    /// What the picture adds to direct light.
    fn indirect_light(&self) -> IndirectLight<'_> {
        IndirectLight {
            irradiance: self.splat.irradiance(),
            at_edges: self.splat.edge_irradiance(),
            gloss: self.transport.gloss.as_ref().map(|gloss| &gloss.pixels.radiance),
            emission_scale: self.lights.emission_scale,
        }
    }
}
