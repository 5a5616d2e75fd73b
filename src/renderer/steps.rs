//! Steps of a frame that consist of several passes: hierarchy, near field,
//! per-light irradiance buffers.

use super::Renderer;
use super::liveness::Scope;
use crate::gpu::Recorder;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_TRANSFER};
use crate::passes::frame::{
    antialias::Antialias, compose::Irradiances, direct::Direct, gather::GatherSources, hvds::ClusterLight,
    needed_records::RecordList,
};

impl Renderer {
    /// Records the hierarchy within `scope`: the irradiance buffers of the lights in `due`, then
    /// the sum over all lights.
    pub(super) fn record_flux(&self, rec: &mut Recorder, scope: &Scope, due: &[ClusterLight<'_>]) {
        if !due.is_empty() {
            self.pyramid.record_lights(rec, due, &self.path_scan.contributions, &scope.clusters);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        self.pyramid.record_sum(rec, &self.lights.clusters(), &scope.clusters);
        rec.barrier(COMPUTE_TO_COMPUTE);
    }

    /// Records proxies and the near field. Small clusters and near-field patches take the
    /// irradiance of the records beside them; proxies are then evaluated again. Each extra gather
    /// iteration repeats both with records that are gathered again.
    pub(super) fn record_near_field(&self, rec: &mut Recorder, scope: &Scope) {
        let (near_field, records) = (&scope.near_field, &self.gather.records);
        let patch_count = near_field.patch_count();
        self.proxies.record(rec, &self.pyramid);
        near_field.record_patches(rec, &self.pyramid, None, patch_count);
        self.gather.record(rec, self.gather_sources(), &scope.sources);
        rec.barrier(COMPUTE_TO_COMPUTE);
        let take = |rec: &mut Recorder, patches| {
            near_field.record(rec, &self.pyramid, records);
            rec.barrier(COMPUTE_TO_COMPUTE);
            self.proxies.record(rec, &self.pyramid);
            near_field.record_patches(rec, &self.pyramid, Some(records), patches);
        };
        for (list, _, patches) in self.gathered_again(scope) {
            take(rec, patches);
            self.gather.record(rec, self.gather_sources(), list);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        take(rec, patch_count);
    }

    /// The extra gather iterations: records, their number, and the number of near-field patches
    /// that they read. If there are several iterations, the first takes all records, because few
    /// paths sample the light in shadows. The others take the records in narrow cavities, where
    /// light is reflected to and fro.
    pub(super) fn gathered_again<'a>(
        &self,
        scope: &'a Scope,
    ) -> impl Iterator<Item = (&'a RecordList, u32, u32)> {
        let all = (&scope.sources, scope.source_count, scope.near_field.patch_count());
        let gaps = (&scope.gaps, scope.gap_count, self.narrow_patches);
        let rounds = self.scene.quality.gap_rounds;
        let round = move |round| if round == 0 && rounds > 1 { all } else { gaps };
        (0..rounds).map(round).filter(|again| again.1 > 0)
    }

    pub(super) fn gather_sources(&self) -> GatherSources<'_> {
        GatherSources {
            materials: &self.buffers.materials,
            irradiance: &self.pyramid.irradiance,
            inverse_areas: &self.pyramid.inverse_areas,
            gloss: self.gloss.as_ref().map(|gloss| &gloss.clusters),
        }
    }

    /// Records the irradiance buffers of pixels of lights with a stale one.
    pub(super) fn record_irradiances(&self, rec: &mut Recorder) {
        let (lights, pixels) = (self.lights.stale_irradiance(), &self.primary.pixels);
        if !self.lights.has_batches {
            self.direct.record_batches(rec, &self.buffers, pixels);
            rec.barrier(COMPUTE_TO_COMPUTE);
        }
        let mut pass = rec.pass(Direct::STEM);
        for (place, &(light, irradiance)) in lights.iter().enumerate() {
            if place > 0 {
                pass.barrier(COMPUTE_TO_TRANSFER);
            }
            self.direct.record(&mut pass, &self.buffers, light, pixels, irradiance);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
        drop(pass);
        let mut pass = rec.pass(Antialias::SHADOW_STEM);
        for (place, (light, irradiance)) in lights.into_iter().enumerate() {
            if place > 0 {
                pass.barrier(COMPUTE_TO_TRANSFER);
            }
            let irradiance = (irradiance, self.lights.shadow_groups(light));
            self.antialias.record_light(&mut pass, &self.buffers, &self.view, light, pixels, irradiance);
        }
        pass.barrier(COMPUTE_TO_COMPUTE);
    }

    pub(super) fn irradiances(&self) -> Irradiances<'_> {
        Irradiances {
            pixels: &self.primary.pixels,
            direct: &self.direct.irradiance,
            indirect: &self.splat.irradiance,
            gloss: self.gloss.as_ref().map(|gloss| &gloss.pixels.radiance),
            antialias: &self.antialias,
            colours: &self.pixel_colours,
            emission_scale: self.lights.emission_scale,
        }
    }
}
