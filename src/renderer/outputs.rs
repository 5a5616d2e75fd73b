//! Outputs of a frame: pictures, statistics, and the buffers between its stages.

use super::{Layer, Renderer, Statistics};
use crate::error::Result;
use crate::gpu::{Buffer, SplitBuffer};
use crate::passes::GrowsWith;
use crate::passes::frame::coverage::Coverage;
use crate::passes::frame::splat_capacity::SplatCounts;
use crate::passes::precompute::merged_rays::MergedRays;
use crate::scene::Scene;
use crate::types::{NO_SIDE, PixelSurface};
use glam::Vec3;

impl Renderer {
    /// Width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.image.size()
    }

    /// The scene, with its triangles in BVH order.
    pub fn scene(&self) -> &Scene {
        &self.world.scene
    }

    /// The displayed picture of the last frame: sRGB codes R, G, B, 255, row by row from the top.
    ///
    /// # Errors
    /// The device failed.
    pub fn display(&self) -> Result<Vec<[u8; 4]>> {
        self.image.tonemap.display.read()
    }

    /// The displayed picture on the device, for passes and windows.
    #[doc(hidden)]
    pub fn display_buffer(&self) -> &Buffer {
        &self.image.tonemap.display
    }

    /// A layer of the last frame, row by row from the top, linear Rec.709.
    ///
    /// # Errors
    /// The device failed.
    pub fn layer(&self, layer: Layer) -> Result<Vec<[f32; 3]>> {
        let pixels = || self.image.primary.pixels.read::<PixelSurface>();
        // The picture is composed again with one kind of light, and then restored.
        let fraction = |weights: [f32; 2]| -> Result<Vec<[f32; 3]>> {
            let compose = |weights| self.compose_with(weights);
            compose(weights)?;
            let layer = self.image.compose.radiance.read()?;
            compose(self.image.light_weights)?;
            Ok(layer)
        };
        match layer {
            Layer::Beauty if self.image.light_weights == [1.0, 1.0] => self.image.compose.radiance.read(),
            Layer::Beauty => fraction([1.0, 1.0]),
            Layer::Direct => fraction([1.0, 0.0]),
            Layer::Indirect => fraction([0.0, 1.0]),
            Layer::Irradiance => self.irradiance(&pixels()?),
            Layer::Position => Ok(pixels()?.iter().map(|pixel| pixel.position.to_array()).collect()),
            Layer::Albedo => self.image.pixel_colours.albedos(
                &pixels()?,
                &self.world.surfaces,
                &self.world.scene.materials,
            ),
            Layer::Normal => Ok(pixels()?.iter().map(|pixel| pixel.normal.to_array()).collect()),
            Layer::Depth => {
                let depth = |pixel: &PixelSurface| match pixel.side {
                    NO_SIDE => f32::INFINITY,
                    _ => (pixel.position - self.image.view.position).dot(self.image.view.forward),
                };
                Ok(pixels()?.iter().map(|pixel| [depth(pixel); 3]).collect())
            }
        }
    }

    /// [`Layer::Position`] in the coordinates of the scene file; zero where there is no surface.
    ///
    /// # Errors
    /// The device failed.
    pub fn positions_in_file(&self) -> Result<Vec<[f32; 3]>> {
        let normals = self.layer(Layer::Normal)?;
        Ok(self.world.scene.layer_in_file(self.layer(Layer::Position)?, &normals))
    }

    /// The sides that each pixel of the last frame shows, from the samples that antialias it.
    ///
    /// # Errors
    /// The device failed.
    #[doc(hidden)]
    pub fn coverage(&self) -> Result<Coverage> {
        Coverage::read(self.image.seen_fragments())
    }

    /// Direct and indirect irradiance of these pixels, W/m².
    fn irradiance(&self, pixels: &[PixelSurface]) -> Result<Vec<[f32; 3]>> {
        let direct: Vec<Vec3> = self.image.direct.irradiance.read_range(0, pixels.len())?;
        let indirect: Vec<Vec3> = self.splat.irradiance().read_range(0, pixels.len())?;
        let scale = self.lights.emission_scale;
        let sum = |((pixel, direct), indirect): ((&PixelSurface, Vec3), Vec3)| match pixel.side {
            NO_SIDE => [0.0; 3],
            _ => (scale * (direct + indirect)).to_array(),
        };
        Ok(pixels.iter().zip(direct).zip(indirect).map(sum).collect())
    }

    /// Composes the picture again with these weights of direct and indirect light.
    pub(super) fn compose_with(&self, weights: [f32; 2]) -> Result<()> {
        let light = self.indirect_light();
        self.context.run(|rec| self.image.record_composition(rec, &self.world.buffers, light, weights))?;
        Ok(())
    }

    /// Wall-clock time of the precomputation, seconds.
    pub fn precompute_s(&self) -> f64 {
        self.statistics.precompute_s
    }

    /// Costs and sizes so far, the warnings of the last view included. Reads
    /// back large buffers.
    ///
    /// # Errors
    /// The device failed.
    #[doc(hidden)]
    pub fn statistics(&self) -> Result<Statistics> {
        let mut statistics = self.statistics.clone();
        let memory = self.context.memory();
        statistics.memory_bytes = memory.current_bytes;
        statistics.peak_memory_bytes = memory.peak_bytes;
        statistics.largest_binding_bytes = memory.largest_binding_bytes;
        let SplatCounts { weights, relaxed, uncovered, .. } = self.counters.splat();
        let counts = [
            ("pixels", self.size()[0] * self.size()[1]),
            ("edge pixels", self.counters.edge_pixels()),
            ("fragments", self.counters.fragments()),
            ("edge points", self.counters.edge_points()),
            ("pixels without a covering record", relaxed + uncovered),
            ("pixels that take the nearest record", uncovered),
            ("splat weights", weights),
        ];
        statistics.counts.extend(counts.map(|(name, value)| (name.to_owned(), u64::from(value))));
        let rays = self.counters.rays();
        let more = [
            ("shadow edge pixels of all lights", self.lights.shadow_edge_count()),
            ("mixed fragments of all lights", self.lights.mixed_fragment_count()),
            ("shadow rays of pixels", u64::from(rays[0])),
            ("shadow rays of fragments", u64::from(rays[1])),
            ("shadow rays of entry points", u64::from(rays[2])),
            ("records gathered last", u64::from(self.dirty.records.gathered)),
            (
                "records gathered ahead, for small clusters beside them",
                u64::from(self.transport.live_sets.read.source_count),
            ),
        ];
        statistics.counts.extend(more.map(|(name, value)| (name.to_owned(), value)));
        if let Some(needed) = self.dirty.records.of_view() {
            let fraction = f64::from(needed) / f64::from(self.transport.gather.point_count().max(1));
            statistics.skipped.insert("records that no pixel of the view uses".into(), 1.0 - fraction);
        }
        let (skipped, unreached) = self.skipped_light()?;
        statistics.skipped.extend(skipped);
        statistics.counts.insert("entry points that no light reaches".into(), unreached);
        statistics.removed = self.clamped_light()?;
        statistics.counts.extend(self.limited()?.map(|(name, value)| (name.to_owned(), value)));
        Ok(statistics)
    }

    /// Flux of each light path's first vertex, W. It is summed on request; no frame needs it.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    #[doc(hidden)]
    pub fn path_flux(&self) -> Result<Vec<Vec3>> {
        let flux = Buffer::storage(
            &self.context,
            GrowsWith::EntryPoints.named("path flux"),
            12 * u64::from(self.transport.form_factors.point_count()),
        )?;
        self.context
            .run(|rec| self.transport.form_factors.record_entry_flux(rec, &self.lights.factors(), &flux))?;
        flux.read()
    }

    /// The buffers between the stages of a frame, for tests.
    #[doc(hidden)]
    pub fn stages(&self) -> StageBuffers<'_> {
        StageBuffers {
            emission_scale: self.lights.emission_scale,
            contributions: &self.transport.path_scan.contributions,
            contribution_ranges: &self.transport.pyramid.contribution_ranges,
            inverse_areas: &self.transport.pyramid.inverse_areas,
            cluster_flux: &self.transport.pyramid.flux,
            cluster_irradiance: &self.transport.pyramid.irradiance,
            cache_points: &self.transport.gather.cache_points,
            merged_rays: &self.transport.gather.merged_rays,
            gathered: &self.transport.gather.records,
            records: &self.transport.blend.records,
            truncated_loops: &self.world.buffers.truncated_loops,
        }
    }
}

/// The buffers between the stages of a frame.
pub struct StageBuffers<'a> {
    /// Factor of all light in these buffers: the emission of a single active light.
    pub emission_scale: Vec3,
    /// `Contribution`s in the order of clusters.
    pub contributions: &'a SplitBuffer,
    /// `ContributionRange` of each base cluster.
    pub contribution_ranges: &'a Buffer,
    /// 1 / exposed area of each cluster, 1/m².
    pub inverse_areas: &'a Buffer,
    /// `ClusterFlux` of each cluster, W.
    pub cluster_flux: &'a Buffer,
    /// Irradiance of each cluster, W/m²; three floats.
    pub cluster_irradiance: &'a Buffer,
    /// A `CachePoint` for each record.
    pub cache_points: &'a Buffer,
    /// Merged rays of all cache points.
    pub merged_rays: &'a MergedRays,
    /// `Record`s of the cache points before blending.
    pub gathered: &'a Buffer,
    /// `Record`s of the cache points after blending.
    pub records: &'a Buffer,
    /// Host-visible flag: [`LOOP_TRUNCATED`](crate::types::LOOP_TRUNCATED) once the device has
    /// truncated a loop of a kernel that traces rays.
    pub truncated_loops: &'a Buffer,
}
