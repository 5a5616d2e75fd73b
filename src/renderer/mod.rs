//! The renderer: owns the passes; the precomputation and the frame are recipes in the paper's order.

mod accounts;
mod changes;
mod edits;
mod lights;
mod precompute;
mod report;
mod shine;
mod skips;
mod twins;
mod views;

pub use crate::passes::precompute::{Progress, Silent};
pub use changes::Work;
pub use report::{Columns, FrameReport, Layer, Statistics};
pub use twins::{Exact, Stage};

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::frame::{
    antialias::Antialias,
    blend::Blend,
    compose::{Compose, Irradiances},
    direct::Direct,
    form_factors::FormFactors,
    gather::{Gather, GatherSources},
    hvds::Pyramid,
    near_field::NearField,
    path_scan::PathScan,
    primary::Primary,
    splat::Splat,
    tonemap::Tonemap,
};
use crate::passes::precompute::gather_rays::RayTable;
use crate::passes::precompute::light_paths::PathGroup;
use crate::passes::{ClusterBuffers, SceneBuffers};
use crate::scene::Scene;
use crate::types::{NO_SIDE, PixelSurface, Surface, View};
use changes::{Changes, Stages};
use glam::Vec3;
use lights::Lights;
use shine::Shine;
use std::sync::Arc;
use std::time::Instant;
use views::Views;

/// A scene whose light paths, cache points and gather rays are traced: every frame is the converged picture.
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
    form_factors: FormFactors,
    path_scan: PathScan,
    /// Paths by which editable materials reflect them.
    path_groups: Vec<PathGroup>,
    pyramid: Pyramid,
    views: Views,
    near_field: NearField,
    /// Cache points that see the near field: the first so many.
    near_count: u32,
    gather: Gather,
    /// None where no material may shine.
    shine: Option<Shine>,
    blend: Blend,
    splat: Splat,
    compose: Compose,
    tonemap: Tonemap,
    exposure_stops: f32,
    clusters: ClusterBuffers,
    statistics: Statistics,
    changes: Changes,
    /// Frames leave out what has not changed.
    skips: bool,
}

impl Renderer {
    /// Precomputes a scene for its first camera.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(context: &Arc<Context>, mut scene: Scene, progress: &mut dyn Progress) -> Result<Self> {
        let made = precompute::precompute(context, &mut scene, progress)?;
        let size = scene.cameras[0].size;
        let pixels = size[0] * size[1];
        let antialias = Antialias::new(context, size, scene.quality.edge_samples)?;
        let direct = Direct::new(context, size, antialias.capacity)?;
        let form_factors = FormFactors::new(context, &made.entry_points, made.area_m2)?;
        let (factor_count, point_count) = (form_factors.point_count(), direct.point_count());
        let shines = made.gloss.is_some();
        let (paths, bits) = ((factor_count, made.area_m2), made.code.cluster_bits);
        let shine = |tables| Shine::new(context, &scene, &tables, paths, bits);
        let shine = made.gloss.map(shine).transpose()?;
        let mut pyramid = Pyramid::new(context, &made.hvds, &made.paths.first_deposits, made.area_m2)?;
        let views = Views::new(context, made.views, &made.hvds, &mut pyramid)?;
        let gloss_room = shine.as_ref().map(Shine::room);
        Ok(Self {
            context: context.clone(),
            view: View::from(&scene.cameras[0]),
            lights: Lights::new(context, &scene.lights, factor_count, point_count, gloss_room)?,
            primary: Primary::new(context, pixels)?,
            direct,
            antialias,
            form_factors,
            path_scan: PathScan::new(
                context,
                &made.paths.steps,
                &made.paths.arrivals.lobes,
                &made.paths.deposits,
            )?,
            path_groups: made.paths.groups,
            pyramid,
            views,
            near_count: made.near_count,
            near_field: NearField::new(context, &made.near_clusters)?,
            gather: Gather::new(
                context,
                made.cache_points,
                made.point_count,
                made.rays,
                made.hemisphere,
                made.code,
                shines,
            )?,
            blend: Blend::new(context, &made.neighbourhoods)?,
            splat: Splat::new(context, made.point_count, size)?,
            shine,
            compose: Compose::new(context, pixels, shines)?,
            tonemap: Tonemap::new(context, pixels)?,
            exposure_stops: 0.0,
            clusters: made.clusters,
            buffers: made.buffers,
            surfaces: made.surfaces,
            scene,
            statistics: made.statistics,
            changes: Changes::ALL,
            skips: true,
        })
    }

    /// Renders one frame: redoes what has changed since the last, and what depends on it. Does nothing where nothing has.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn frame(&mut self) -> Result<FrameReport> {
        if !self.skips {
            self.force(Work::Everything);
        }
        let stages = Stages::new(self.changes, &self.lights);
        let start = Instant::now();
        let passes = loop {
            let ((), passes) = self.context.run(|rec| self.record(rec, stages))?;
            if !stages.view || !self.splat.grow()? {
                break passes;
            }
        };
        let frame_ms = start.elapsed().as_secs_f64() * 1e3;
        let columns = Columns::of(&passes);
        let (bytes, rays) = self.accounts(&passes);
        let lights_unchanged = self.lights.unchanged();
        self.lights.settle();
        self.changes = Changes::default();
        Ok(FrameReport { passes, frame_ms, columns, bytes, rays, lights_unchanged })
    }

    /// The frame. [Yue §3] Every pass waits for the one before, so that the timings tell them apart.
    fn record(&self, rec: &mut Recorder, stages: Stages) {
        let pixels = &self.primary.pixels;
        if stages.view {
            self.primary.record(rec, &self.buffers, &self.view);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.antialias.record(rec, &self.buffers, &self.view, pixels);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if let Some(shine) = self.shine.as_ref().filter(|_| stages.lobes) {
            shine.record_rays(rec, &self.buffers, &self.clusters, pixels, &self.view);
        }
        if let Some(shine) = &self.shine {
            shine.record_highlights(rec, &self.buffers, &self.lights, self.view.position);
        }
        if !self.lights.without_layer().is_empty() {
            self.record_layers(rec);
        }
        if stages.direct {
            self.direct.record_sum(rec, &self.lights.layers());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        let without_factors = self.lights.without_factors();
        if !without_factors.is_empty() {
            let mut pass = rec.pass(FormFactors::STEM);
            for (light, factors) in without_factors {
                self.form_factors.record(&mut pass, &self.buffers, light, factors);
            }
            pass.barrier(COMPUTE_TO_COMPUTE);
            drop(pass);
            if let Some(shine) = &self.shine {
                shine.record_beams(rec, &self.buffers, &self.lights);
            }
        }
        if stages.flux {
            let reflected_flux = self.shine.as_ref().map(|shine| &shine.clusters.reflected_flux);
            self.form_factors.record_flux(rec, &self.lights.factors(), reflected_flux);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.scan {
            self.path_scan.record(rec, &self.buffers.materials, self.edited_paths().as_deref());
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.energy {
            let materials = &self.buffers.materials;
            let (flux, deposits) = (&self.form_factors.flux, &self.path_scan.deposits);
            if let Some(shine) = &self.shine {
                shine.record_entries(rec, materials, &self.lights);
            }
            let reflected_flux = self.shine.as_ref().map_or(flux, |shine| &shine.clusters.reflected_flux);
            self.pyramid.record(rec, flux, reflected_flux, deposits);
            rec.barrier(COMPUTE_TO_COMPUTE);
            if let Some(shine) = &self.shine {
                shine.record_clusters(rec, stages, materials, &self.pyramid, deposits, &self.lights);
            }
            self.views.record(rec, &self.pyramid);
            let sources = self.gather_sources();
            self.gather.record(rec, sources, self.gather.point_count());
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.near_field.record(rec, &self.pyramid, &self.gather.records);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.views.record(rec, &self.pyramid);
            self.gather.record(rec, sources, self.near_count);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.blend.record(rec, &self.gather.cache_points, &self.gather.records);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.view {
            let (surfaces, points) = (&self.buffers.surfaces, &self.gather.cache_points);
            self.splat.record(rec, surfaces, points, &self.primary.pixels, &self.view);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.splat {
            self.splat.record_apply(rec, &self.primary.pixels, &self.blend.records);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if let Some(shine) = self.shine.as_ref().filter(|_| stages.shine) {
            let deposits = &self.path_scan.deposits;
            shine.record_pixels(rec, &self.buffers, pixels, &self.pyramid, deposits, &self.lights);
        }
        if stages.compose {
            self.compose.record(rec, &self.buffers, self.irradiances(), [1.0, 1.0]);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.display {
            self.tonemap.record(rec, &self.compose.radiance, self.exposure_stops);
        }
    }

    fn gather_sources(&self) -> GatherSources<'_> {
        GatherSources {
            materials: &self.buffers.materials,
            irradiance: &self.pyramid.irradiance,
            inverse_areas: &self.pyramid.inverse_areas,
            gloss: self.shine.as_ref().map(|shine| &shine.clusters),
        }
    }

    /// The layers of the lights that have none.
    fn record_layers(&self, rec: &mut Recorder) {
        let (lights, pixels) = (self.lights.without_layer(), &self.primary.pixels);
        let mut pass = rec.pass(Direct::STEM);
        for &(light, layer) in &lights {
            self.direct.record(&mut pass, &self.buffers, light, pixels, layer);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
        drop(pass);
        let mut pass = rec.pass(Antialias::SHADOW_STEM);
        for (light, layer) in lights {
            self.direct.record_samples(&mut pass, &self.buffers, light, &self.antialias.edge_surfaces, layer);
            pass.barrier(COMPUTE_TO_COMPUTE);
            self.antialias.record_shadows(&mut pass, &self.buffers, &self.view, light, pixels, layer);
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    fn irradiances(&self) -> Irradiances<'_> {
        Irradiances {
            pixels: &self.primary.pixels,
            direct: &self.direct.irradiance,
            indirect: &self.splat.irradiance,
            gloss: self.shine.as_ref().map(|shine| &shine.pixels.radiance),
            antialias: &self.antialias,
        }
    }

    /// The last frame for eyes: sRGB codes R, G, B, 255, row by row from the top.
    ///
    /// # Errors
    /// The device failed.
    pub fn display(&self) -> Result<Vec<[u8; 4]>> {
        self.tonemap.display.read()
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.view.width, self.view.height]
    }

    /// The scene, its triangles in BVH order.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// A layer of the last frame, row by row from the top, linear Rec.709.
    ///
    /// # Errors
    /// The device failed.
    pub fn layer(&self, layer: Layer) -> Result<Vec<[f32; 3]>> {
        let pixels = || self.primary.pixels.read::<PixelSurface>();
        let albedo = |pixel: &PixelSurface| match pixel.side {
            NO_SIDE => Vec3::ZERO,
            side => self.scene.materials[self.surfaces[side as usize / 2].material as usize].diffuse,
        };
        // Composed again with a share of the light only; then the picture is put back.
        let share = |shares: [f32; 2]| -> Result<Vec<[f32; 3]>> {
            let compose = |shares| {
                self.context.run(|rec| self.compose.record(rec, &self.buffers, self.irradiances(), shares))
            };
            compose(shares)?;
            let layer = self.compose.radiance.read()?;
            compose([1.0, 1.0])?;
            Ok(layer)
        };
        match layer {
            Layer::Beauty => self.compose.radiance.read(),
            Layer::Direct => share([1.0, 0.0]),
            Layer::Indirect => share([0.0, 1.0]),
            Layer::Albedo => Ok(pixels()?.iter().map(|pixel| albedo(pixel).to_array()).collect()),
            Layer::Normal => Ok(pixels()?.iter().map(|pixel| pixel.normal.to_array()).collect()),
            Layer::Depth => {
                let depth = |pixel: &PixelSurface| match pixel.side {
                    NO_SIDE => f32::INFINITY,
                    _ => (pixel.position - self.view.position).dot(self.view.forward),
                };
                Ok(pixels()?.iter().map(|pixel| [depth(pixel); 3]).collect())
            }
        }
    }

    /// Costs and sizes so far, the last view's shortcomings included.
    ///
    /// # Errors
    /// The device failed.
    pub fn statistics(&self) -> Result<Statistics> {
        let mut statistics = self.statistics.clone();
        let memory = self.context.memory();
        statistics.memory_bytes = memory.current_bytes;
        statistics.peak_memory_bytes = memory.peak_bytes;
        statistics.largest_binding_bytes = memory.largest_binding_bytes;
        let (pairs, weights) = self.splat.list_lengths()?;
        let [edges, shadow_edges] = self.antialias.edge_counts()?;
        let counts = [
            ("pixels", self.size()[0] * self.size()[1]),
            ("edge pixels", edges),
            ("shadow edge pixels of the light traced last", shadow_edges),
            ("pixels without a covering record", self.splat.bare_pixel_count()?),
            ("splat tile pairs", pairs),
            ("splat weights", weights),
        ];
        statistics.counts.extend(counts.map(|(name, value)| (name.to_owned(), u64::from(value))));
        let (skipped, unreached) = self.skipped_light()?;
        statistics.skipped.extend(skipped);
        statistics.counts.insert("entry points that no light reaches".into(), unreached);
        Ok(statistics)
    }

    /// What the passes can be asked about, for tests: the buffers between the stages.
    pub fn stages(&self) -> StageBuffers<'_> {
        StageBuffers {
            path_flux: &self.form_factors.flux,
            deposits: &self.path_scan.deposits,
            cluster_flux: &self.pyramid.flux,
            cluster_irradiance: &self.pyramid.irradiance,
            cache_points: &self.gather.cache_points,
            gather_rays: &self.gather.rays,
            gathered: &self.gather.records,
            records: &self.blend.records,
        }
    }
}

/// The buffers between the stages of a frame.
pub struct StageBuffers<'a> {
    /// Flux of each path's first vertex, W; three floats.
    pub path_flux: &'a Buffer,
    /// `Deposit`s in cluster order.
    pub deposits: &'a Buffer,
    /// `ClusterFlux` of each cluster, W.
    pub cluster_flux: &'a Buffer,
    /// Irradiance of each cluster, W/m²; three floats.
    pub cluster_irradiance: &'a Buffer,
    /// `CachePoint`s.
    pub cache_points: &'a Buffer,
    /// `GatherRay`s, a row a cache point.
    pub gather_rays: &'a RayTable,
    /// `Record`s of the cache points as gathered.
    pub gathered: &'a Buffer,
    /// `Record`s of the cache points, blended.
    pub records: &'a Buffer,
}
