//! The places of a view that want own records.

use super::test_light::TestRecords;
use crate::error::Result;
use crate::passes::frame::own_records::Place;
use crate::passes::frame::splat::{SeenSurfaces, SplatWeight, WeightRange};
use crate::passes::gloss_tables::GlossBin;
use crate::renderer::Renderer;
use crate::types::{NO_SIDE, PixelSurface};
use rayon::prelude::*;

/// A place that wants an own record.
pub(super) struct Wanted {
    disagreement: f32,
    pub(super) place: Place,
    pub(super) surface: PixelSurface,
}

impl Renderer {
    /// What the records of cache points gather of test light.
    pub(super) fn test_records(&self) -> Result<TestRecords> {
        let gather = &self.transport.gather;
        let merged_rays = &gather.merged_rays;
        let bins: Vec<GlossBin> = match &self.transport.gloss {
            Some(gloss) => gloss.clusters.bins.read()?,
            None => Vec::new(),
        };
        let bins: Vec<u32> = bins.iter().map(|bin| bin.cluster).collect();
        Ok(TestRecords::new(
            &merged_rays.lists()?,
            merged_rays.target_bits,
            gather.hemisphere.rays(),
            &gather.packing,
            (&self.world.cluster_tables.hvds.parents, self.transport.live_sets.near_patches(), &bins),
        ))
    }

    /// The places that want own records, pixels first, each in order.
    pub(super) fn wanted(&self, records: &TestRecords) -> Result<Vec<Wanted>> {
        let quality = &self.world.scene.quality;
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
}
