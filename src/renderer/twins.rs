//! Stages of a frame replaced by exact twins, one at a time, to find out which of them errs. Slow; not part of any frame.

use super::{Layer, Renderer};
use crate::error::Result;
use crate::gpu::Buffer;
use crate::passes::frame::gather::Gather;
use crate::passes::precompute::{Silent, gather_rays};
use crate::types::{CachePoint, NO_SIDE, PixelSurface, Record};
use glam::Vec3;

/// Pixels that are gathered at a time: their rays are the largest buffer.
const PIXELS_AT_A_TIME: usize = 1 << 14;

impl Renderer {
    /// The last frame's picture as it would be without splatting: the final gather at every pixel, from the same clusters.
    /// Edge pixels take their samples' indirect light from pixels around them, as in a frame.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn layer_gathered_at_pixels(&self, layer: Layer) -> Result<Vec<[f32; 3]>> {
        let pixels: Vec<PixelSurface> = self.primary.pixels.read()?;
        let splatted: Vec<Vec3> = self.splat.irradiance.read()?;
        let mut irradiance = vec![Vec3::ZERO; pixels.len()];
        let seen: Vec<usize> = (0..pixels.len()).filter(|&index| pixels[index].side != NO_SIDE).collect();
        for indices in seen.chunks(PIXELS_AT_A_TIME) {
            let point = |&index: &usize| CachePoint {
                position: pixels[index].position,
                radius: 0.0,
                normal: pixels[index].normal,
                side: pixels[index].side,
                wall: Vec3::ZERO,
            };
            let points: Vec<CachePoint> = indices.iter().map(point).collect();
            for (&index, record) in indices.iter().zip(self.gather_at(&points)?) {
                irradiance[index] = record.irradiance;
            }
        }
        self.splat.irradiance.write(&irradiance)?;
        self.context.run(|rec| self.compose.record(rec, &self.buffers, self.irradiances(), [1.0, 1.0]))?;
        let layer = self.layer(layer)?;
        self.splat.irradiance.write(&splatted)?;
        Ok(layer)
    }

    /// Gathers at any points from the clusters of the last frame.
    fn gather_at(&self, points: &[CachePoint]) -> Result<Vec<Record>> {
        let count = points.len() as u32;
        let buffer = Buffer::from_slice(&self.context, "gather points", points)?;
        let (hemisphere, code) = (self.gather.hemisphere, self.gather.code);
        let rays = gather_rays::trace(
            &self.context,
            &self.buffers,
            &self.clusters,
            &buffer,
            count,
            hemisphere,
            code,
            self.scene.quality.seed,
            &mut Silent,
        )?;
        let gather = Gather::new(&self.context, buffer, count, rays, hemisphere, code)?;
        self.context
            .run(|rec| gather.record(rec, &self.buffers.materials, &self.pyramid.irradiance, count))?;
        gather.records.read()
    }
}
