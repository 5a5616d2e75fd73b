//! The renderer: owns the passes; the precomputation and the frame are recipes in the paper's order.

mod accounts;
mod precompute;
mod report;
mod twins;

pub use crate::passes::precompute::{Progress, Silent};
pub use report::{Columns, Edit, FrameReport, Layer, Statistics};
pub use twins::{Exact, Stage};

use crate::error::{Error, Result};
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::frame::{
    antialias::Antialias,
    blend::Blend,
    compose::{Compose, Irradiances},
    direct::Direct,
    form_factors::FormFactors,
    gather::Gather,
    hvds::Pyramid,
    near_field::NearField,
    path_scan::PathScan,
    pixel_colours::PixelColours,
    primary::Primary,
    splat::Splat,
    tonemap::Tonemap,
};
use crate::passes::precompute::gather_rays::RayTable;
use crate::passes::{ClusterBuffers, SceneBuffers, light_sources};
use crate::scene::{Light, LightKind, Scene};
use crate::types::{NO_SIDE, PixelSurface, Surface, View};
use glam::Vec3;
use std::sync::Arc;
use std::time::Instant;

/// A scene whose light paths, cache points and gather rays are traced: every frame is the converged picture.
pub struct Renderer {
    context: Arc<Context>,
    scene: Scene,
    surfaces: Vec<Surface>,
    view: View,
    buffers: SceneBuffers,
    lights: Buffer,
    primary: Primary,
    direct: Direct,
    antialias: Antialias,
    form_factors: FormFactors,
    path_scan: PathScan,
    pyramid: Pyramid,
    near_field: NearField,
    /// Cache points that see the near field: the first so many.
    near_count: u32,
    gather: Gather,
    blend: Blend,
    splat: Splat,
    pixel_colours: PixelColours,
    compose: Compose,
    tonemap: Tonemap,
    exposure_stops: f32,
    clusters: ClusterBuffers,
    statistics: Statistics,
    /// No frame has run yet.
    is_fresh: bool,
}

impl Renderer {
    /// Precomputes a scene for its first camera.
    ///
    /// # Errors
    /// A light of a kind that is not rendered yet; the device lacks memory or failed.
    pub fn new(context: &Arc<Context>, mut scene: Scene, progress: &mut dyn Progress) -> Result<Self> {
        check_lights(&scene.lights)?;
        let lights = light_sources(&scene.lights);
        let made = precompute::precompute(context, &mut scene, progress)?;
        let size = scene.cameras[0].size;
        let pixels = size[0] * size[1];
        let light_count = lights.len() as u32;
        let antialias = Antialias::new(context, size, scene.quality.edge_samples)?;
        Ok(Self {
            context: context.clone(),
            view: View::from(&scene.cameras[0]),
            lights: Buffer::from_slice(context, "lights", &lights)?,
            primary: Primary::new(context, pixels)?,
            direct: Direct::new(context, pixels)?,
            pixel_colours: PixelColours::new(context, &made.buffers, pixels, antialias.capacity)?,
            antialias,
            form_factors: FormFactors::new(context, &made.entry_points, made.area_m2, light_count)?,
            path_scan: PathScan::new(context, &made.paths.steps, &made.paths.colours, &made.paths.deposits)?,
            pyramid: Pyramid::new(context, &made.hvds, &made.paths.first_deposits, made.area_m2)?,
            near_count: made.near_count,
            near_field: NearField::new(context, &made.near_clusters)?,
            gather: Gather::new(
                context,
                made.cache_points,
                made.point_count,
                made.rays,
                made.hemisphere,
                made.code,
            )?,
            blend: Blend::new(context, &made.neighbourhoods)?,
            splat: Splat::new(context, made.point_count, size)?,
            compose: Compose::new(context, &made.buffers, pixels)?,
            tonemap: Tonemap::new(context, pixels)?,
            exposure_stops: 0.0,
            clusters: made.clusters,
            buffers: made.buffers,
            surfaces: made.surfaces,
            scene,
            statistics: made.statistics,
            is_fresh: true,
        })
    }

    /// Renders one frame, redoing what the edit has changed. The first frame does everything.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn frame(&mut self, edit: Edit) -> Result<FrameReport> {
        let edit = if std::mem::take(&mut self.is_fresh) { Edit::Everything } else { edit };
        let start = Instant::now();
        let passes = loop {
            let ((), passes) = self.context.run(|rec| self.record(rec, edit))?;
            if !edit.stages().view || !self.splat.grow()? {
                break passes;
            }
        };
        let frame_ms = start.elapsed().as_secs_f64() * 1e3;
        let columns = Columns::of(&passes);
        let (bytes, rays) = self.accounts(&passes);
        Ok(FrameReport { passes, frame_ms, columns, bytes, rays })
    }

    /// The frame. [Yue §3] Every pass waits for the one before, so that the timings tell them apart.
    fn record(&self, rec: &mut Recorder, edit: Edit) {
        let stages = edit.stages();
        let light_count = self.scene.lights.len() as u32;
        let size = self.size();
        if stages.view {
            self.primary.record(rec, &self.buffers, &self.view);
            rec.barrier(COMPUTE_TO_COMPUTE);
            if self.buffers.textures.are_used {
                self.pixel_colours.record(rec, &self.buffers, &self.view, &self.primary.pixels);
                rec.barrier(COMPUTE_TO_COMPUTE);
            }
        }
        if stages.direct {
            let pixels = &self.primary.pixels;
            self.direct.record(rec, &self.buffers, &self.lights, light_count, pixels, size);
            rec.barrier(COMPUTE_TO_COMPUTE);
            let direct = &self.direct.irradiance;
            self.antialias.record(rec, &self.buffers, &self.view, &self.lights, light_count, pixels, direct);
            rec.barrier(COMPUTE_TO_COMPUTE);
            if self.buffers.textures.are_used {
                self.pixel_colours.record_edges(rec, &self.buffers, &self.view, &self.antialias);
                rec.barrier(COMPUTE_TO_COMPUTE);
            }
        }
        if stages.light {
            self.form_factors.record(rec, &self.buffers, &self.light_positions());
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.form_factors.record_flux(rec, &self.lights, light_count);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.scan {
            self.path_scan.record(rec, &self.buffers.materials);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.energy {
            self.pyramid.record(rec, &self.form_factors.flux, &self.path_scan.deposits);
            rec.barrier(COMPUTE_TO_COMPUTE);
            let (materials, clusters) = (&self.buffers.materials, &self.pyramid.irradiance);
            self.gather.record(rec, materials, clusters, self.gather.point_count());
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.near_field.record(rec, &self.pyramid, &self.gather.records);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.gather.record(rec, materials, clusters, self.near_count);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.blend.record(rec, &self.gather.cache_points, &self.gather.records);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.view {
            let (surfaces, points) = (&self.buffers.surfaces, &self.gather.cache_points);
            self.splat.record(rec, surfaces, points, &self.primary.pixels, &self.view);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        if stages.picture {
            self.splat.record_apply(rec, &self.primary.pixels, &self.blend.records);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.compose.record(rec, &self.buffers, self.irradiances(), [1.0, 1.0]);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.tonemap.record(rec, &self.compose.radiance, self.exposure_stops);
        }
    }

    fn irradiances(&self) -> Irradiances<'_> {
        Irradiances {
            pixels: &self.primary.pixels,
            direct: &self.direct.irradiance,
            indirect: &self.splat.irradiance,
            antialias: &self.antialias,
            colours: &self.pixel_colours,
        }
    }

    fn light_positions(&self) -> Vec<(u32, Vec3)> {
        let positions = self.scene.lights.iter().filter_map(|light| light.kind.position());
        (0..).zip(positions).collect()
    }

    /// Moves the light of that index; the next frame wants [`Edit::Light`].
    ///
    /// # Errors
    /// The device failed.
    pub fn move_light(&mut self, light: usize, to: Vec3) -> Result<()> {
        if let LightKind::Point { position, .. } = &mut self.scene.lights[light].kind {
            *position = to;
        }
        self.lights.write(&light_sources(&self.scene.lights))
    }

    /// Changes a material's diffuse albedo, which an image of it is multiplied with; the next frame wants [`Edit::Material`]. Exact downwards; far above the albedo at
    /// load, paths that would matter were ended early, and indirect light comes out low.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_diffuse(&mut self, material: usize, diffuse: Vec3) -> Result<()> {
        self.scene.materials[material].diffuse = diffuse;
        self.buffers.materials.write(&crate::passes::reflectances(&self.scene.materials))
    }

    /// Looks from elsewhere; the image keeps its size; the next frame wants [`Edit::View`].
    pub fn move_camera(&mut self, position: Vec3, target: Vec3) {
        let camera = &mut self.scene.cameras[0];
        (camera.position, camera.target) = (position, target);
        self.view = View::from(&*camera);
    }

    /// Brightens the displayed picture by so many stops, from the next frame on.
    pub fn set_exposure(&mut self, stops: f32) {
        self.exposure_stops = stops;
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
            Layer::Albedo => self.pixel_colours.albedos(&pixels()?, &self.surfaces, &self.scene.materials),
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
        let counts = [
            ("pixels", self.size()[0] * self.size()[1]),
            ("edge pixels", self.antialias.edge_count()?),
            ("pixels without a covering record", self.splat.bare_pixel_count()?),
            ("splat tile pairs", pairs),
            ("splat weights", weights),
        ];
        statistics.counts.extend(counts.map(|(name, value)| (name.to_owned(), u64::from(value))));
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

/// Light kinds whose light the paths carry.
fn check_lights(lights: &[Light]) -> Result<()> {
    match lights.iter().find(|light| !matches!(light.kind, LightKind::Point { .. })) {
        None => Ok(()),
        Some(light) => Err(Error::Usage(format!(
            "light `{}`: the method lightpaths takes point lights in this version, not kind `{}`; --method path takes all",
            light.name,
            light.kind.word()
        ))),
    }
}
