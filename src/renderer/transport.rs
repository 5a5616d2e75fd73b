//! Light transport: the passes from form factors to blended records. Their tables come from the
//! precomputation; none depends on the camera, except for rays of glossy pixels.

use super::gloss::GlossPasses;
use super::lights::Lights;
use super::liveness::{LiveSet, LiveSets};
use super::plan::{FramePlan, Gathering, Scan};
use crate::error::Result;
use crate::gpu::barrier::{
    COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE,
};
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::SceneBuffers;
use crate::passes::frame::{
    blend::Blend,
    bright::Bright,
    form_factors::FormFactors,
    gather::{BrightSources, Gather, GatherSources},
    hvds::{ClusterLight, Pyramid},
    near_lights::NearLights,
    needed_records::{NeededRecords, RecordList},
    path_scan::PathScan,
    splat::{SeenSurfaces, Splat},
};
use crate::passes::precompute::path_orders::PathRange;
use std::ops::Range;
use std::sync::Arc;

/// The passes from form factors to blended records.
pub(super) struct Transport {
    pub(super) form_factors: FormFactors,
    pub(super) near_lights: NearLights,
    pub(super) path_scan: PathScan,
    /// Ranges of light paths by the editable materials that reflect them.
    pub(super) path_ranges: Vec<PathRange>,
    pub(super) pyramid: Pyramid,
    pub(super) live_sets: LiveSets,
    /// Number of near-field patches that cache points in narrow cavities see. They come first.
    pub(super) narrow_patches: u32,
    /// Extra gather iterations; see [`Self::extra_iterations`].
    pub(super) gap_rounds: u32,
    pub(super) gather: Gather,
    /// `None`: gather rays bring the light of bright clusters, too.
    pub(super) bright: Option<Bright>,
    pub(super) record_lists: RecordLists,
    pub(super) blend: Blend,
    /// `None` if no material may be glossy.
    pub(super) gloss: Option<GlossPasses>,
}

/// Lists of records that are gathered.
pub(super) struct RecordLists {
    pub(super) needed: NeededRecords,
    pub(super) all: RecordList,
}

impl RecordLists {
    pub(super) fn new(context: &Arc<Context>, gather: &Gather) -> Result<Self> {
        let (record_count, chunk) = (gather.point_count(), gather.merged_rays.records_per_chunk);
        Ok(Self {
            needed: NeededRecords::new(context, record_count, chunk)?,
            all: RecordList::all(context, record_count, chunk)?,
        })
    }

    /// Builds the list of stale records and makes it visible to the gather pass. Returns the list
    /// and a mask of records to blend (`None`: all). Returns `None` if no record is stale.
    fn record(
        &self,
        rec: &mut Recorder,
        gathering: Gathering,
        splat: (&Splat, SeenSurfaces<'_>),
        blend: &Blend,
    ) -> Option<(&RecordList, Option<&Buffer>)> {
        let needed = &self.needed;
        match gathering {
            Gathering::Nothing => None,
            Gathering::All => Some((&self.all, None)),
            Gathering::Listed => Some((&needed.list, Some(&needed.is_seen))),
            Gathering::List(request) => {
                needed.record(rec, request, splat, blend);
                rec.barrier(COMPUTE_TO_INDIRECT);
                Some((&needed.list, (!request.all).then_some(&needed.is_seen)))
            }
        }
    }
}

impl Transport {
    /// Records form factors and beams of the lights that the plan names.
    pub(super) fn record_factors(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        buffers: &SceneBuffers,
        lights: &Lights,
    ) {
        let planned = lights.planned_factors(plan);
        if planned.is_empty() {
            return;
        }
        let mut pass = rec.pass(FormFactors::STEM);
        for (place, (light, factors)) in planned.into_iter().enumerate() {
            if place > 0 {
                pass.barrier(COMPUTE_TO_TRANSFER);
            }
            self.form_factors.record(&mut pass, buffers, light, factors);
            if let Some((near, state)) = lights.near(light.index) {
                pass.barrier(COMPUTE_TO_COMPUTE);
                self.near_lights.record(&mut pass, buffers, near, (state, factors));
            }
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
        drop(pass);
        if let Some(gloss) = &self.gloss {
            gloss.record_beams(rec, plan, (buffers, &self.form_factors), lights);
        }
    }

    /// Records the energy scan of the paths that the plan names.
    pub(super) fn record_scan(&self, rec: &mut Recorder, plan: &FramePlan, materials: &Buffer) {
        let ranges: Option<Vec<Range<u32>>> = match plan.scan {
            Scan::None => return,
            Scan::All => None,
            Scan::Materials(bits) => {
                let groups = self.path_ranges.iter().filter(|group| group.materials & bits != 0);
                Some(groups.map(|group| group.steps.clone()).collect())
            }
        };
        self.path_scan.record(rec, materials, ranges.as_deref());
        rec.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records the hierarchy, its glossy radiance and the near field.
    pub(super) fn record_hierarchy(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        materials: &Buffer,
        lights: &Lights,
    ) {
        if !plan.hierarchy {
            return;
        }
        if let Some(gloss) = &self.gloss {
            gloss.record_entries(rec, plan, materials, lights);
        }
        let set = self.live_sets.of(plan.is_whole);
        if lights.record_clear(rec, plan) {
            rec.barrier(TRANSFER_TO_COMPUTE);
        }
        self.record_flux(rec, set, &lights.planned_clusters(plan), lights);
        if let Some(gloss) = &self.gloss {
            let contributions = self.path_scan.contributions.whole();
            gloss.record_clusters(rec, plan, materials, contributions, lights);
        }
        self.record_near_field(rec, materials, set);
        self.record_bright(rec, materials);
    }

    /// Records which clusters are bright.
    pub(super) fn record_bright(&self, rec: &mut Recorder, materials: &Buffer) {
        if let Some(bright) = &self.bright {
            bright.record(rec, materials, &self.pyramid);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// Records the flux of clusters within `set`: of the lights in `planned`, and then the sum
    /// over all lights.
    pub(super) fn record_flux(
        &self,
        rec: &mut Recorder,
        set: &LiveSet,
        planned: &[ClusterLight<'_>],
        lights: &Lights,
    ) {
        if !planned.is_empty() {
            self.pyramid.record_lights(rec, planned, &self.path_scan.contributions, &set.clusters);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        self.pyramid.record_sum(rec, &lights.clusters(), &set.clusters);
        rec.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records the near field: small clusters and near-field patches take the irradiance of the
    /// records beside them. These records leave out the sky, which the clusters' own form factors
    /// hold. Each extra gather iteration gathers records again, and repeats it.
    pub(super) fn record_near_field(&self, rec: &mut Recorder, materials: &Buffer, set: &LiveSet) {
        let (near_field, records) = (&set.near_field, &self.gather.records);
        let patch_count = near_field.patch_count();
        near_field.record_patches(rec, &self.pyramid, None, patch_count);
        self.gather.record(rec, self.gather_sources(materials, None), &set.sources);
        rec.barrier(COMPUTE_TO_COMPUTE);
        let take = |rec: &mut Recorder, patches| {
            near_field.record(rec, &self.pyramid, records);
            rec.barrier(COMPUTE_TO_COMPUTE);
            near_field.record_patches(rec, &self.pyramid, Some(records), patches);
        };
        for (list, _, patches) in self.extra_iterations(set) {
            take(rec, patches);
            self.gather.record(rec, self.gather_sources(materials, None), list);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        take(rec, patch_count);
    }

    /// The extra gather iterations: records, their number, and the number of near-field patches
    /// that they read. If there are several iterations, the first takes all records, because few
    /// paths sample the light in shadows. The others take the records in narrow cavities, where
    /// light is reflected to and fro.
    pub(super) fn extra_iterations<'a>(
        &self,
        set: &'a LiveSet,
    ) -> impl Iterator<Item = (&'a RecordList, u32, u32)> + use<'a> {
        let all = (&set.sources, set.source_count, set.near_field.patch_count());
        let gaps = (&set.gaps, set.gap_count, self.narrow_patches);
        let rounds = self.gap_rounds;
        let round = move |round| if round == 0 && rounds > 1 { all } else { gaps };
        (0..rounds).map(round).filter(|again| again.1 > 0)
    }

    /// Records the final gather and the blending of the records that the plan names.
    pub(super) fn record_gather(
        &self,
        rec: &mut Recorder,
        plan: &FramePlan,
        (scene, sky): (&SceneBuffers, Option<&Buffer>),
        splat: (&Splat, SeenSurfaces<'_>),
    ) {
        let Some((list, seen)) = self.record_lists.record(rec, plan.gather, splat, &self.blend) else {
            return;
        };
        self.gather.record(rec, self.all_sources(scene, sky), list);
        rec.barrier(COMPUTE_TO_COMPUTE);
        self.blend.record(rec, &self.gather.cache_points, &self.gather.records, seen);
        if plan.splat {
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
    }

    /// What a gather reads, if rays of their own bring the light of bright clusters.
    pub(super) fn all_sources<'a>(
        &'a self,
        scene: &'a SceneBuffers,
        sky: Option<&'a Buffer>,
    ) -> GatherSources<'a> {
        let pyramid = &self.pyramid;
        let bright = self.bright.as_ref().map(|bright| BrightSources { bright, scene, pyramid });
        GatherSources { bright, ..self.gather_sources(&scene.materials, sky) }
    }

    /// What a gather reads, if gather rays bring all light. `sky`: radiance of the sky; `None`
    /// leaves it out.
    pub(super) fn gather_sources<'a>(
        &'a self,
        materials: &'a Buffer,
        sky: Option<&'a Buffer>,
    ) -> GatherSources<'a> {
        GatherSources {
            materials,
            irradiance: &self.pyramid.irradiance,
            inverse_areas: &self.pyramid.inverse_areas,
            gloss: self.gloss.as_ref().map(|gloss| &gloss.clusters),
            sky,
            bright: None,
        }
    }
}
