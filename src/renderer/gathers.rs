//! Gathers at points that are no cache points: own records, and the exact splat.

use super::Renderer;
use crate::error::Result;
use crate::gpu::Buffer;
use crate::passes::frame::gather::Gather;
use crate::passes::gather_targets::{GatherTarget, GatherTargets};
use crate::passes::precompute::Silent;
use crate::passes::precompute::gather_rays::{GatherTracer, RayDirections, RayTable, Rows};
use crate::passes::precompute::merged_rays::MergedRays;
use crate::passes::{ClusterBuffers, GrowsWith};
use crate::types::{CachePoint, PixelSurface};
use glam::Vec3;

impl Renderer {
    /// Where a seen surface gathers. `stream`: index of its random stream.
    pub(super) fn gather_point(&self, surface: &PixelSurface, stream: u32) -> CachePoint {
        CachePoint {
            position: surface.position,
            radius: 0.0,
            normal: surface.normal,
            side: surface.side,
            occluder: Vec3::ZERO,
            facet: self.world.normal(surface.side),
            inverse_reach: 0.0,
            stream,
        }
    }

    /// A gather at points that are no cache points, from the same clusters and gloss bins.
    pub(super) fn gather_at_points(&self, points: &[CachePoint]) -> Result<Gather> {
        let buffer = Buffer::from_slice(&self.context, GrowsWith::GatherRays.named("gather points"), points)?;
        let clusters = self.world.cluster_tables.upload(&self.context)?;
        let rows = Rows::none(points.len() as u32);
        let (rays, _) = self.tracer(&clusters).trace((&buffer, &rows), &mut Silent)?;
        self.gather_of_rays(points, buffer, rays)
    }

    /// What traces rays as those of cache points were traced.
    pub(super) fn tracer<'a>(&'a self, clusters: &'a ClusterBuffers) -> GatherTracer<'a> {
        GatherTracer {
            context: &self.context,
            scene: &self.world.buffers,
            clusters,
            hemisphere: self.transport.gather.hemisphere,
            packing: self.transport.gather.packing,
            seed: self.world.scene.quality.seed,
        }
    }

    /// The gather of traced rays. `buffer` has the points.
    pub(super) fn gather_of_rays(
        &self,
        points: &[CachePoint],
        buffer: Buffer,
        rays: RayTable,
    ) -> Result<Gather> {
        let (context, count) = (&self.context, points.len() as u32);
        let (hemisphere, packing) = (self.transport.gather.hemisphere, self.transport.gather.packing);
        let mut targets = GatherTargets::of_hits(packing);
        if let Some(gloss) = &self.transport.gloss {
            let directions = RayDirections::new(points, hemisphere, self.world.scene.quality.seed);
            let readers = gloss.readers(&directions, &rays, &targets)?;
            targets = targets.with(GatherTarget::GlossBin, readers);
        }
        let merged_rays = MergedRays::new(context, rays, (&targets, &packing), hemisphere, None)?;
        let is_glossy = self.transport.gloss.is_some();
        Gather::new(context, buffer, count, merged_rays, hemisphere, packing, is_glossy)
    }
}
