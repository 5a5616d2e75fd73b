//! Own records: pixels and edge points whose records disagree under [test light](test_light) gather
//! for themselves, once a view. They do not depend on the lights. Each frame relights them, as it
//! relights all records.

mod test_light;

use super::Renderer;
use crate::error::Result;
use crate::gpu::Buffer;
use crate::passes::GrowsWith;
use crate::passes::frame::gather::Gather;
use crate::passes::frame::own_records::{OwnRecords, Place};
use crate::passes::frame::splat::{SeenSurfaces, SplatWeight, WeightRange};
use crate::passes::gather_targets::{GatherTarget, GatherTargets};
use crate::passes::gloss_tables::GlossBin;
use crate::passes::precompute::Silent;
use crate::passes::precompute::gather_rays::{self, RayDirections};
use crate::passes::precompute::live_clusters::LiveClusters;
use crate::passes::precompute::merged_rays::MergedRays;
use crate::types::{CachePoint, NO_SIDE, PixelSurface};
use glam::Vec3;
use rayon::prelude::*;
use test_light::TestRecords;

/// The own records of a view.
pub(super) struct ViewRecords {
    pub(super) records: OwnRecords,
    /// The view is the one that they were traced for.
    pub(super) is_current: bool,
}

/// A place that wants an own record.
struct Wanted {
    disagreement: f32,
    place: Place,
    surface: PixelSurface,
}

impl Renderer {
    /// Traces an own record for each pixel and edge point of the last frame whose records
    /// disagree by more than `quality.record_error`: relative to random light of single rays,
    /// root mean square. At most `quality.cache_points` places have one, where records disagree
    /// most. Returns their number. The next frame shows them, until the view changes. Without a
    /// frame of this view, and at a `record_error` of 1, there are none.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn refine(&mut self) -> Result<u32> {
        if let Some(own) = self.own_records.as_ref().filter(|own| own.is_current) {
            return Ok(own.records.record_count());
        }
        self.own_records = None;
        let quality = &self.world.scene.quality;
        if quality.record_error >= 1.0 || self.dirty.changes.view {
            return Ok(0);
        }
        let wanted = self.wanted()?;
        if wanted.is_empty() {
            return Ok(0);
        }
        let points: Vec<CachePoint> =
            (0..).zip(&wanted).map(|(stream, wanted)| self.gather_point(&wanted.surface, stream)).collect();
        let places: Vec<Place> = wanted.iter().map(|wanted| wanted.place).collect();
        let records = OwnRecords::new(&self.context, self.gather_at_points(&points)?, &places)?;
        self.keep_alive(&records)?;
        let count = records.record_count();
        self.own_records = Some(ViewRecords { records, is_current: true });
        Ok(count)
    }

    /// The places that want own records, pixels first, each in order.
    fn wanted(&self) -> Result<Vec<Wanted>> {
        let (gather, quality) = (&self.transport.gather, &self.world.scene.quality);
        let merged_rays = &gather.merged_rays;
        let bins: Vec<GlossBin> = match &self.transport.gloss {
            Some(gloss) => gloss.clusters.bins.read()?,
            None => Vec::new(),
        };
        let bins: Vec<u32> = bins.iter().map(|bin| bin.cluster).collect();
        let records = TestRecords::new(
            &merged_rays.lists()?,
            merged_rays.target_bits,
            gather.hemisphere.rays(),
            &gather.packing,
            (&self.world.cluster_tables.hvds.parents, self.transport.live_sets.near_patches(), &bins),
        );
        let SeenSurfaces { pixels, edge_points, point_groups } = self.image.seen();
        let edge_count = point_groups.read_range::<u32>(3, 1)?[0] as usize;
        let [pixel_ranges, weights] = self.splat.lists();
        let weight_count = self.counters.splat().weights as usize;
        let weights: Vec<SplatWeight> = weights.read_range(0, weight_count)?;
        let find =
            |surfaces: &[PixelSurface], ranges: &[WeightRange], place: fn(u32) -> Place| -> Vec<Wanted> {
                let of_point = |(index, (surface, range)): (usize, (&PixelSurface, &WeightRange))| {
                    let served = &weights[range.first as usize..range.end as usize];
                    let disagreement = match served {
                        [] => return None,
                        // Nothing says how far off a single record is that is not valid here.
                        [one] if one.weight < 0.0 => f32::INFINITY,
                        _ => records.disagreement(served.iter().map(|one| (one.record, one.weight))),
                    };
                    let is_wanted = surface.side != NO_SIDE && disagreement > quality.record_error;
                    is_wanted.then(|| Wanted { disagreement, place: place(index as u32), surface: *surface })
                };
                surfaces.par_iter().zip(ranges).enumerate().filter_map(of_point).collect()
            };
        let mut wanted = find(&pixels.read()?, &pixel_ranges.read()?, Place::Pixel);
        let (edge_points, edge_ranges) =
            (edge_points.read_range(0, edge_count)?, self.splat.edge_ranges().read_range(0, edge_count)?);
        wanted.append(&mut find(&edge_points, &edge_ranges, Place::EdgePoint));
        let most = quality.cache_points as usize;
        if wanted.len() > most {
            wanted.sort_by(|a, b| b.disagreement.total_cmp(&a.disagreement).then(a.place.cmp(&b.place)));
            wanted.truncate(most);
            wanted.sort_by_key(|wanted| wanted.place);
        }
        Ok(wanted)
    }

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
        let (context, count) = (&self.context, points.len() as u32);
        let buffer = Buffer::from_slice(context, GrowsWith::GatherRays.named("gather points"), points)?;
        let (hemisphere, packing) = (self.transport.gather.hemisphere, self.transport.gather.packing);
        let rays = gather_rays::trace(
            context,
            &self.world.buffers,
            &self.world.cluster_tables.upload(context)?,
            &buffer,
            count,
            hemisphere,
            packing,
            self.world.scene.quality.seed,
            &mut Silent,
        )?;
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

    /// Extends the live set by what own records read. The next frame computes it.
    fn keep_alive(&mut self, records: &OwnRecords) -> Result<()> {
        let Self { transport, world, dirty, .. } = self;
        // With glossy materials, frames compute all clusters.
        if transport.gloss.is_some() {
            dirty.live_set_changed();
            return Ok(());
        }
        let mut targets: Vec<u32> = transport.gather.merged_rays.targets.read()?;
        targets.extend(records.targets()?);
        let sources: Vec<u32> = transport.pyramid.indirect_sources.read()?;
        let (hvds, packing) = (&world.cluster_tables.hvds, &transport.gather.packing);
        let reads =
            LiveClusters::from_targets(hvds, targets, packing, transport.live_sets.near_patches(), &sources);
        transport.live_sets.extend(&reads)?;
        dirty.live_set_changed();
        Ok(())
    }
}
