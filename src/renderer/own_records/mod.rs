//! Own records: pixels and edge points whose records disagree under [test light](test_light) gather
//! for themselves, once a view. They do not depend on the lights. Each frame relights them, as it
//! relights all records. They are traced in parts, so that a window can wait for input in between.

mod test_light;
mod wanted;

use super::Renderer;
use crate::error::Result;
use crate::gpu::Buffer;
use crate::passes::frame::own_records::{OwnRecords, Place};
use crate::passes::precompute::Silent;
use crate::passes::precompute::gather_rays::{RayTable, Rows};
use crate::passes::precompute::live_clusters::LiveClusters;
use crate::passes::{ClusterBuffers, GrowsWith};
use crate::types::CachePoint;
use std::mem;
use test_light::TestRecords;
use wanted::Wanted;

/// Points whose rays one part traces.
const POINTS: u32 = 512;

/// The own records of the view, as far as they are traced.
#[derive(Default)]
pub(super) struct ViewRecords {
    /// What the records of cache points gather of test light. It does not depend on the view.
    test_records: Option<TestRecords>,
    stage: Stage,
}

enum Stage {
    /// Nothing is known of this view. A frame in flight may still read these, of another view.
    Begin(Option<OwnRecords>),
    Traces(Box<Traces>),
    /// `None` if the view has none.
    Done(Option<OwnRecords>),
}

impl Default for Stage {
    fn default() -> Self {
        Self::Done(None)
    }
}

/// Own records whose rays are traced.
struct Traces {
    points: Vec<CachePoint>,
    places: Vec<Place>,
    /// The points on the device.
    buffer: Buffer,
    clusters: ClusterBuffers,
    rays: RayTable,
    /// Points whose rays are traced.
    traced: u32,
}

impl ViewRecords {
    /// The own records that the next frame shows.
    pub(super) fn shown(&self) -> Option<&OwnRecords> {
        match &self.stage {
            Stage::Done(records) => records.as_ref(),
            Stage::Begin(_) | Stage::Traces(_) => None,
        }
    }

    /// The next frame shows another view.
    pub(super) fn view_changed(&mut self) {
        let records = match mem::take(&mut self.stage) {
            Stage::Begin(records) | Stage::Done(records) => records,
            Stage::Traces(_) => None,
        };
        self.stage = Stage::Begin(records);
    }
}

impl Renderer {
    /// Traces an own record for each pixel and edge point of the last frame whose records disagree
    /// by more than `quality.record_error`: root mean square, beyond the noise of their rays, and
    /// relative to random light of single rays. At most `quality.cache_points` places have one,
    /// where records disagree most. Returns their number. The next frame shows them, until the view
    /// changes. Without a frame of this view, and at a `record_error` of 1, there are none.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn refine(&mut self) -> Result<u32> {
        while self.refine_in_part()? {}
        Ok(self.own_records.shown().map_or(0, OwnRecords::record_count))
    }

    /// Whether [`Self::refine_in_part`] has work.
    #[doc(hidden)]
    pub fn may_refine(&self) -> bool {
        self.world.scene.quality.record_error < 1.0
            && !self.dirty.changes.view
            && !matches!(self.own_records.stage, Stage::Done(_))
    }

    /// Does a part of what [`Self::refine`] does. Returns whether more is left. No frame may be in
    /// flight. If it fails, the view has no own records.
    ///
    /// # Errors
    /// As of [`Self::refine`].
    #[doc(hidden)]
    pub fn refine_in_part(&mut self) -> Result<bool> {
        if !self.may_refine() {
            return Ok(false);
        }
        match mem::take(&mut self.own_records.stage) {
            Stage::Begin(_) => match self.own_records.test_records.take() {
                None => {
                    let found = self.test_records()?;
                    self.own_records = ViewRecords { test_records: Some(found), stage: Stage::Begin(None) };
                }
                Some(test_records) => {
                    let wanted = self.wanted(&test_records);
                    self.own_records.test_records = Some(test_records);
                    let traces = self.begin_traces(&wanted?)?;
                    self.own_records.stage =
                        traces.map_or(Stage::Done(None), |traces| Stage::Traces(Box::new(traces)));
                }
            },
            Stage::Traces(mut traces) if traces.traced < traces.points.len() as u32 => {
                self.trace_part(&mut traces)?;
                self.own_records.stage = Stage::Traces(traces);
            }
            Stage::Traces(traces) => {
                let Traces { points, places, buffer, rays, .. } = *traces;
                let gather = self.gather_of_rays(&points, buffer, rays)?;
                let records = OwnRecords::new(&self.context, gather, &places)?;
                self.keep_alive(&records)?;
                self.own_records.stage = Stage::Done(Some(records));
            }
            Stage::Done(_) => unreachable!("there is work"),
        }
        Ok(self.may_refine())
    }

    /// `None` if nothing is wanted.
    fn begin_traces(&self, wanted: &[Wanted]) -> Result<Option<Traces>> {
        if wanted.is_empty() {
            return Ok(None);
        }
        let points: Vec<CachePoint> =
            (0..).zip(wanted).map(|(stream, wanted)| self.gather_point(&wanted.surface, stream)).collect();
        let clusters = self.world.cluster_tables.upload(&self.context)?;
        let buffer =
            Buffer::from_slice(&self.context, GrowsWith::GatherRays.named("gather points"), &points)?;
        let rays = self.tracer(&clusters).table(points.len() as u32)?;
        let places = wanted.iter().map(|wanted| wanted.place).collect();
        Ok(Some(Traces { points, places, buffer, clusters, rays, traced: 0 }))
    }

    fn trace_part(&self, traces: &mut Traces) -> Result<()> {
        let Traces { points, buffer, clusters, rays, traced, .. } = traces;
        let count = points.len() as u32;
        let part = *traced..count.min(*traced + POINTS);
        *traced = part.end;
        self.tracer(clusters).rows(rays, (buffer, &Rows::none(count)), part, &mut Silent)?;
        Ok(())
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
