//! Pass cost model: bytes and rays that each pass needs at least, from the sizes of its inputs.

use super::Renderer;
use super::pass_sizes::{Cost, Sizes};
use super::passes;
use super::plan::FramePlan;
use super::report::FrameCounts;
use crate::cpu::antialias::samples_per_edge;
use crate::gpu::{Buffer, PassTiming};
use crate::passes::OneLight;
use crate::passes::frame::{
    antialias::{EdgeCapacity, Fragment},
    bright::Bright,
    gather::Gather,
    hvds::LightFlux,
    near_field::NearField,
};
use crate::types::PixelSurface;
use std::collections::BTreeMap;

/// Sets of points in [`FrameCounters::rays`](super::counters::FrameCounters::rays).
const PIXEL_RAYS: usize = 0;
const FRAGMENT_RAYS: usize = 1;
const FACTOR_RAYS: usize = 2;

type Account = BTreeMap<&'static str, u64>;

impl Sizes {
    /// Sizes of a frame with this plan that ran `passes`.
    fn new(renderer: &Renderer, plan: &FramePlan, passes: &[PassTiming]) -> Self {
        let Renderer { lights, transport, image, splat, dirty, .. } = renderer;
        let [traced, moved] = [lights.planned_irradiances(plan), lights.planned_factors(plan)];
        let edges = renderer.world.buffers.silhouette_edges.as_ref().map_or(0, Buffer::bytes);
        let drawn = moved.iter().filter(|(light, _)| light.has_silhouettes());
        let [edge_sample_count, edge_rays] = edge_counts(renderer, &traced);
        let fragment_count = u64::from(renderer.counters.fragments());
        // Passes of the same name share one entry, which is their mean: gather passes ahead of the
        // frame's own, again in narrow cavities, and the rest.
        let ran = |stem: &str| passes.iter().filter(|pass| pass.name == stem).count().max(1) as u64;
        let set = transport.live_sets.of(plan.is_whole);
        let again = || transport.extra_iterations(set);
        let ahead = set.source_count + again().map(|again| again.1).sum::<u32>();
        let ahead = if ran(Gather::STEM) > 1 { ahead } else { 0 };
        let patch_counts = again().map(|again| again.2).chain([set.near_field.patch_count()]);
        let [width, height] = image.size();
        let pixels = u64::from(width) * u64::from(height);
        let [steps, steps_once] = transport.path_scan.step_bytes();
        let [record_tree, weights] = splat.list_bytes();
        Self {
            pixels,
            points: pixels + fragment_count,
            lights: lights.irradiances().len() as u64,
            paths: u64::from(transport.form_factors.point_count()),
            record_count: u64::from(transport.gather.point_count().max(1)),
            gathered: u64::from(dirty.records.gathered + ahead) / ran(Gather::STEM),
            bright_rays: transport
                .bright
                .as_ref()
                .filter(|_| renderer.counters.bright_clusters() > 0)
                .map(|bright| u64::from(dirty.records.gathered) * u64::from(bright.ray_count())),
            planned_irradiances: traced.len() as u64,
            pixel_rays: rays(renderer, &traced, pixels, PIXEL_RAYS),
            planned_factors: moved.len() as u64,
            factor_rays: rays(renderer, &moved, transport.form_factors.point_count().into(), FACTOR_RAYS),
            silhouettes: drawn.map(|(light, _)| edges + light.map_bytes()).sum(),
            planned_clusters: lights.planned_clusters(plan).len() as u64,
            fragment_count,
            edge_rays,
            edge_samples: 4 * edge_sample_count,
            fragments: fragment_count * (size_of::<Fragment>() + size_of::<PixelSurface>()) as u64,
            surface: image.primary.pixels.bytes(),
            image: 12 * pixels,
            pixel_colours: image.pixel_colours.of_pixels.bytes(),
            edge_colours: image.pixel_colours.of_edges.bytes(),
            steps,
            steps_once,
            contributions: transport.path_scan.contributions.bytes(),
            first_bounce: if transport.gloss.is_some() { 4 + 12 } else { 4 },
            light_flux: size_of::<LightFlux>() as u64 * u64::from(transport.pyramid.base_count()),
            clusters: transport.pyramid.irradiance.bytes(),
            watched: transport.bright.as_ref().map_or(0, Bright::watched_bytes),
            near_field: set.near_field.bytes(patch_counts) / ran(NearField::STEM),
            records: transport.gather.records.bytes(),
            cache_points: transport.gather.cache_points.bytes(),
            merged_rays: transport.gather.merged_rays.bytes(),
            neighbours: transport.blend.list_bytes(),
            record_tree,
            weights,
            marked_weights: u64::from(dirty.records.marked_view) * weights,
        }
    }
}

/// Number of shadow rays to these lights from one of three sets of points: one for each sample of a
/// light unless the device counts them.
fn rays(renderer: &Renderer, traced: &[(OneLight<'_>, &Buffer)], points: u64, set: usize) -> u64 {
    if renderer.context.tuning().finds_alike {
        return renderer.counters.rays()[set].into();
    }
    traced.iter().map(|(light, _)| u64::from(light.sample_count()) * points).sum()
}

/// Numbers of edge samples, and of shadow rays: from each fragment, from the samples of mixed ones,
/// and from those of pixels at shadow edges.
fn edge_counts(renderer: &Renderer, traced: &[(OneLight<'_>, &Buffer)]) -> [u64; 2] {
    let EdgeCapacity { light_samples, samples, fragments, .. } = renderer.image.antialias.capacity;
    let (edges, fragment_count) = (renderer.counters.edge_pixels(), renderer.counters.fragments());
    let of_edge = samples_per_edge(edges, light_samples, [samples, fragments]);
    let rays = traced.iter().map(|(light, _)| {
        let averaged = renderer.lights.mixed_samples(*light)
            + u64::from(light_samples) * u64::from(renderer.lights.shadow_edges(*light));
        u64::from(light.part_count * light.point_samples()) * averaged
    });
    let of_points = self::rays(renderer, traced, fragment_count.into(), FRAGMENT_RAYS);
    [u64::from(of_edge) * u64::from(edges), of_points + rays.sum::<u64>()]
}

#[doc(hidden)]
impl Renderer {
    /// Bytes and rays of the passes that ran.
    pub(super) fn costs(&self, plan: &FramePlan, passes: &[PassTiming]) -> (Account, Account) {
        let sizes = Sizes::new(self, plan, passes);
        let costs =
            passes.iter().filter_map(|pass| Some((pass.name, passes::named(pass.name).cost?(&sizes))));
        let costs: BTreeMap<&'static str, Cost> = costs.collect();
        let rays = costs.iter().filter_map(|(name, cost)| Some((*name, cost.rays?)));
        (costs.iter().map(|(name, cost)| (*name, cost.bytes)).collect(), rays.collect())
    }

    /// Numbers of items of a frame with this plan, which is done.
    pub(super) fn frame_counts(&self, plan: &FramePlan) -> FrameCounts {
        let Self { lights, counters, .. } = self;
        let traced = lights.planned_irradiances(plan);
        let sum = |count: &dyn Fn(OneLight<'_>) -> u32| {
            traced.iter().map(|(light, _)| u64::from(count(*light))).sum()
        };
        FrameCounts {
            edge_pixels: counters.edge_pixels().into(),
            fragments: counters.fragments().into(),
            edge_points: counters.edge_points().into(),
            mixed_fragments: sum(&|light| lights.mixed_fragments(light)),
            shadow_edges: sum(&|light| lights.shadow_edges(light)),
            spared_rays: if plan.traces_shadows() { counters.spared_rays() } else { 0 },
            weighed_records: counters.splat().weighed.into(),
            splat_weights: counters.splat().weights.into(),
        }
    }
}
