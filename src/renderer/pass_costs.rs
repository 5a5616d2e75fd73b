//! Pass cost model: bytes and rays that each pass needs at least, from its inputs.

use super::Renderer;
use super::plan::FramePlan;
use crate::cpu::antialias::{samples_per_edge, slots_per_edge};
use crate::gpu::{Buffer, PassTiming};
use crate::passes::OneLight;
use crate::passes::frame::{
    antialias::{Antialias, EdgeCapacity, EdgeSample, EdgeSlot},
    blend::Blend,
    cluster_proxies::ClusterProxies,
    compose::Compose,
    direct::Direct,
    form_factors::FormFactors,
    gather::Gather,
    hvds::LightFlux,
    hvds::Pyramid,
    near_field::NearField,
    needed_records::NeededRecords,
    path_scan::PathScan,
    pixel_colours::PixelColours,
    primary::Primary,
    splat::Splat,
    tonemap::Tonemap,
};
use std::collections::BTreeMap;

type Account = BTreeMap<&'static str, u64>;

impl Renderer {
    /// Bytes and rays of the passes that ran. Each stored input and output counts once, whatever
    /// the caches do. Scene data that traced rays read does not count: rays per second measure
    /// such a pass.
    pub(super) fn accounts(&self, plan: &FramePlan, passes: &[PassTiming]) -> (Account, Account) {
        let pixels = u64::from(self.size()[0]) * u64::from(self.size()[1]);
        let paths = u64::from(self.transport.form_factors.point_count());
        let lights = self.lights.irradiances().len() as u64;
        let due = |lights: Vec<(OneLight<'_>, &Buffer)>| {
            let samples: u64 = lights.iter().map(|(light, _)| u64::from(light.samples)).sum();
            (lights.len() as u64, samples)
        };
        let (due_irradiances, irradiance_rays) = due(self.lights.planned_irradiances(plan));
        let (due_factors, factor_rays) = due(self.lights.planned_factors(plan));
        let EdgeCapacity { max_samples, samples, slots } = self.image.antialias.capacity;
        let (capacity, edge_count) = ([samples, slots], self.counters.edge_pixels());
        let per_edge =
            [samples_per_edge(edge_count, max_samples, capacity), slots_per_edge(edge_count, slots)];
        let [sample_count, slot_count] = per_edge.map(|count| u64::from(count) * u64::from(edge_count));
        let edge_samples = sample_count * size_of::<EdgeSample>() as u64;
        let slots = slot_count * size_of::<EdgeSlot>() as u64;
        let points = pixels + slot_count;
        // Shadow rays start at all samples of edge pixels, and at the samples of pixels
        // at shadow edges.
        let mut edge_rays = 0;
        for (light, _) in self.lights.planned_irradiances(plan) {
            let crossed = self.lights.shadow_edges(light);
            let of_crossed = samples_per_edge(crossed, max_samples, capacity);
            edge_rays +=
                u64::from(light.samples) * (sample_count + u64::from(of_crossed) * u64::from(crossed));
        }
        let records = self.transport.gather.records.bytes();
        // Passes of the same name share one entry, which is their mean: gather passes ahead of the
        // frame's own, again in narrow cavities, and the rest.
        let gathers = passes.iter().filter(|pass| pass.name == Gather::STEM).count();
        let scope = self.transport.scopes.of(plan.is_whole);
        let ahead =
            scope.source_count + self.transport.gathered_again(scope).map(|again| again.1).sum::<u32>();
        let ahead = if gathers > 1 { ahead } else { 0 };
        let gathered = u64::from(self.dirty.records.gathered + ahead) / gathers.max(1) as u64;
        let in_all = u64::from(self.transport.gather.point_count().max(1));
        let near_passes = passes.iter().filter(|pass| pass.name == NearField::STEM).count().max(1) as u64;
        let patch_counts = self.transport.gathered_again(scope).map(|again| again.2);
        let near = scope.near_field.bytes(patch_counts.chain([scope.near_field.patch_count()])) / near_passes;
        let surface = self.image.primary.pixels.bytes();
        let clusters = self.transport.pyramid.irradiance.bytes();
        let clusters_due = self.lights.planned_clusters(plan).len() as u64;
        let light_flux = (size_of::<LightFlux>() as u64) * u64::from(self.transport.pyramid.base_count());
        let contributions = self.transport.path_scan.contributions.bytes();
        let first_bounce = if self.transport.gloss.is_some() { 4 + 12 } else { 4 };
        let [steps, once] = self.transport.path_scan.step_bytes();
        let [pixel_colours, edge_colours] =
            [&self.image.pixel_colours.of_pixels, &self.image.pixel_colours.of_edges].map(Buffer::bytes);
        let [pairs, weights] = self.splat.list_bytes();
        let image = 12 * pixels;
        let mut bytes = Account::new();
        let mut rays = Account::new();
        for pass in passes {
            let moved = match pass.name {
                Primary::STEM => surface,
                Direct::BATCHES_STEM => surface,
                Direct::STEM => due_irradiances * (surface + 4 * pixels),
                Direct::SUM_STEM => (4 * lights + 12) * points,
                FormFactors::STEM => due_factors * 20 * paths,
                // Steps are read twice, contributions written one vec3 at a time.
                PathScan::STEM => 2 * steps + once + contributions,
                Pyramid::LIGHTS_STEM => contributions + clusters_due * (first_bounce * paths + light_flux),
                Pyramid::STEM => lights * light_flux + 3 * clusters,
                ClusterProxies::STEM => self.transport.proxies.bytes(),
                Gather::STEM => {
                    gathered * (self.transport.gather.merged_rays.bytes() + records) / in_all + clusters
                }
                NearField::STEM => near,
                // Mask and sums of records, and sums of the list. Splat weights only if the
                // view is new.
                NeededRecords::STEM => {
                    u64::from(self.dirty.records.marked_view) * weights
                        + self.transport.blend.list_bytes()
                        + 24 * in_all
                }
                Blend::STEM => {
                    self.transport.blend.list_bytes()
                        + 2 * records
                        + self.transport.gather.cache_points.bytes()
                }
                Splat::STEM => surface + self.transport.gather.cache_points.bytes() + 4 * pairs + weights,
                Splat::APPLY_STEM => surface + weights + records + image,
                Antialias::STEM => surface + 8 * pixels + edge_samples + slots,
                PixelColours::STEM => surface + edge_samples + pixel_colours + edge_colours,
                Antialias::SHADOW_STEM => due_irradiances * (2 * edge_samples + 4 * slot_count + 8 * pixels),
                Compose::STEM => {
                    let colours = pixel_colours + edge_colours;
                    surface + 3 * image + 4 * pixels + 12 * slot_count + slots + colours
                }
                Tonemap::STEM => image + 4 * pixels,
                _ => continue,
            };
            bytes.insert(pass.name, moved);
            let traced = match pass.name {
                Primary::STEM => pixels,
                Direct::STEM => irradiance_rays * pixels,
                Antialias::STEM => sample_count,
                Antialias::SHADOW_STEM => edge_rays,
                FormFactors::STEM => factor_rays * paths,
                _ => continue,
            };
            rays.insert(pass.name, traced);
        }
        (bytes, rays)
    }
}
