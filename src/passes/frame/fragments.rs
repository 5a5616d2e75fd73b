//! Fragments: the samples of an edge pixel that see one surface. A light is found once for each. It
//! takes several samples of a fragment only if it differs from the light of the same surface at the
//! pixels around, or if a point sees only a part of it. In: edge pixels, their samples, pixels,
//! per-light irradiance buffers. Out: fragments; their light.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT};
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::passes::GrowsWith;
use crate::passes::frame::edges::{
    ALIKE, EDGE_GROUPS, EdgeCapacity, EdgeListPush, EdgeView, FRAGMENT_GROUPS, Fragment, FragmentMarkPush,
    MASKED, SAMPLE_STEP, SPREAD, contrast,
};
use crate::passes::frame::{light_sum::GROUP_VALUES, prefix_sum::PrefixSum};
use crate::passes::{LightKernel, OneLight};
use crate::types::PixelSurface;
use std::sync::Arc;

/// Byte offset, in the list of a light, of the size of a dispatch over eight fragments a workgroup.
const MIXED_GROUPS: u64 = 32;

/// The pipelines and the fragments of a camera.
pub struct Fragments {
    make: Pipeline,
    links: Pipeline,
    direct: LightKernel,
    mark: Pipeline,
    samples: LightKernel,
    prefix_sum: PrefixSum,
    /// Fragments that the most recent light may illuminate in part, in any order. While
    /// fragments are made, the buffer holds the prefix sum of their edge points.
    pub mixed: Buffer,
    /// Index of the first fragment of each edge pixel; then their number. While edges are found,
    /// the buffer holds the prefix sum of the edge marks in tile order.
    pub firsts: Buffer,
    /// For [`MASKED`] samples of a pixel each, a mask of those of each of its fragments.
    pub of_samples: Buffer,
    /// `Fragment`s, edge pixel by edge pixel.
    pub list: Buffer,
    /// `PixelSurface`s: a point of each fragment.
    pub surfaces: Buffer,
    /// `PixelSurface`s of the fragments whose surface no pixel's centre around shows.
    pub edge_points: Buffer,
    /// Dispatch size for workgroups of 64 edge points; their number.
    pub point_groups: Buffer,
}

impl Fragments {
    /// Allocates buffers for an image of `places` positions in tile order.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, places: u32, capacity: EdgeCapacity) -> Result<Self> {
        let alike = ("ALIKE", ALIKE.to_bits());
        let stored = |name, count: u32, bytes: usize| {
            Buffer::storage(context, GrowsWith::Pixels.named(name), u64::from(count) * bytes as u64)
        };
        let count = capacity.fragments.max(1);
        Ok(Self {
            make: Pipeline::new(context, "fragments", &[alike, ("GROUP_POINTS", GROUP_VALUES)])?,
            links: Pipeline::new(context, "fragment_links", &[alike])?,
            direct: LightKernel::new(context, "fragment_direct", &[])?,
            mark: Pipeline::new(context, "fragment_mark", &[])?,
            samples: LightKernel::new(context, "fragment_samples", &[("SPREAD", SPREAD.to_bits())])?,
            prefix_sum: PrefixSum::new(context, places.max(count))?,
            mixed: stored("mixed fragments", count + 1, size_of::<u32>())?,
            firsts: stored("first fragments", places + 1, size_of::<u32>())?,
            of_samples: stored("fragments of samples", masks(places, capacity), size_of::<[u32; 4]>())?,
            list: stored("fragments", count, size_of::<Fragment>())?,
            surfaces: stored("fragment surfaces", count, size_of::<PixelSurface>())?,
            edge_points: stored("edge points", capacity.points.max(1), size_of::<PixelSurface>())?,
            point_groups: Buffer::from_slice(
                context,
                GrowsWith::Pixels.named("edge point groups"),
                &[0_u32; 4],
            )?,
        })
    }

    /// Sets what the numbers of fragments and points are counted in to zero. Transfers.
    pub(super) fn clear(&self, pass: &mut PassScope<'_>) {
        pass.fill_zero(&self.firsts);
        pass.fill_zero(&self.mixed);
        // A view without fragments has no workgroup that counts their points.
        pass.fill_zero(&self.point_groups);
    }

    /// Makes the fragments of the edge pixels, whose samples and numbers of fragments are known.
    /// Records into an open pass with barriers between its own dispatches.
    pub(super) fn record(&self, pass: &mut PassScope<'_>, edges: &EdgeView<'_>) {
        let EdgeView { scene, view, pixels, .. } = *edges;
        let pixel_count = view.width * view.height;
        let of_scene =
            [("Nodes", &scene.nodes), ("Triangles", &scene.triangles), ("Surfaces", &scene.surfaces)];
        let places = edges.places();
        self.prefix_sum.record(pass, &self.firsts, places);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch_indirect(
            &self.make,
            (edges.groups, EDGE_GROUPS),
            &edges.samples_push(),
            &with(
                of_scene,
                &[
                    ("Pixels", pixels),
                    ("EdgeNumbers", edges.numbers),
                    ("EdgePixels", edges.edge_pixels),
                    ("EdgeSamples", edges.samples),
                    ("SampleMasks", &self.of_samples),
                    ("FragmentFirsts", &self.firsts),
                    ("Fragments", &self.list),
                    ("FragmentSurfaces", &self.surfaces),
                    ("PointNumbers", &self.mixed),
                    ("EdgeGroups", edges.groups),
                    ("TruncatedLoops", &scene.truncated_loops),
                ],
            ),
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record(pass, &self.mixed, edges.capacity.fragments);
        pass.barrier(COMPUTE_TO_INDIRECT);
        pass.dispatch_indirect(
            &self.links,
            (edges.groups, FRAGMENT_GROUPS),
            &EdgeListPush { width: view.width, pixel_count, capacity: edges.capacity },
            &[
                ("Surfaces", &scene.surfaces),
                ("EdgeNumbers", edges.numbers),
                ("EdgePixels", edges.edge_pixels),
                ("FragmentFirsts", &self.firsts),
                ("Fragments", &self.list),
                ("FragmentSurfaces", &self.surfaces),
                ("PointNumbers", &self.mixed),
                ("EdgeGroups", edges.groups),
                ("EdgePoints", &self.edge_points),
                ("PointGroups", &self.point_groups),
            ],
        );
    }

    /// Finds the light of each fragment at its point, and lists the mixed ones in `groups`, of
    /// `Antialias::groups`, which is zero before. Records into an open pass
    /// with barriers between its own dispatches.
    pub(super) fn record_light(
        &self,
        pass: &mut PassScope<'_>,
        edges: &EdgeView<'_>,
        light: OneLight<'_>,
        (irradiance, groups): (&Buffer, &Buffer),
    ) {
        let scene = edges.scene;
        let bindings = edges.traced(
            light,
            &[
                ("FragmentSurfaces", &self.surfaces),
                ("EdgeGroups", edges.groups),
                ("LightIrradiance", irradiance),
                light.map(),
                ("RayCount", &scene.ray_counts[1]),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
        for (part, span) in light.parts().flat_map(|part| part.spans().map(move |span| (part, span))) {
            let push = edges.light_push(part, span);
            let all = (edges.groups, FRAGMENT_GROUPS);
            pass.dispatch_indirect(self.direct.of(part), all, &push, &bindings);
            pass.barrier(COMPUTE_TO_COMPUTE);
        }
        let [width, height] = [edges.view.width, edges.view.height];
        pass.dispatch_indirect(
            &self.mark,
            (edges.groups, FRAGMENT_GROUPS),
            &FragmentMarkPush {
                width,
                height,
                light_samples: edges.capacity.light_samples,
                contrast: contrast(light),
            },
            &[
                ("EdgeNumbers", edges.numbers),
                ("EdgePixels", edges.edge_pixels),
                ("FragmentFirsts", &self.firsts),
                ("Fragments", &self.list),
                ("EdgeGroups", edges.groups),
                ("LightIrradiance", irradiance),
                ("MixedFragments", &self.mixed),
                ("ShadowGroups", groups),
            ],
        );
    }

    /// Averages the light over samples of the mixed fragments. Records as
    /// [`Self::record_light`]; the caller records a barrier to indirect dispatches before.
    pub(super) fn record_mixed(
        &self,
        pass: &mut PassScope<'_>,
        edges: &EdgeView<'_>,
        light: OneLight<'_>,
        (irradiance, groups): (&Buffer, &Buffer),
    ) {
        let scene = edges.scene;
        let bindings = edges.traced(
            light,
            &[
                ("EdgeNumbers", edges.numbers),
                ("EdgePixels", edges.edge_pixels),
                ("EdgeSamples", edges.samples),
                ("SampleMasks", &self.of_samples),
                ("FragmentFirsts", &self.firsts),
                ("Fragments", &self.list),
                ("ShadowGroups", groups),
                ("MixedFragments", &self.mixed),
                ("LightIrradiance", irradiance),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
        for (part, span) in light.parts().flat_map(|part| part.point_spans().map(move |span| (part, span))) {
            if part.adds || span.0 > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            let push = edges.light_push(part, span);
            pass.dispatch_indirect(self.samples.of(part), (groups, MIXED_GROUPS), &push, &bindings);
        }
    }
}

/// Capacity for masks. Pixels have fewer samples where there are too many edges.
fn masks(places: u32, capacity: EdgeCapacity) -> u32 {
    let pixels = places.min(capacity.samples / SAMPLE_STEP);
    // Samples whose number is no multiple of MASKED need up to 64 / 40 as many.
    pixels.max((u64::from(capacity.samples) * 8 / (5 * u64::from(MASKED))) as u32).max(1)
}

/// Bindings of the scene, then others.
fn with<'a>(
    scene: [(&'static str, &'a Buffer); 3],
    others: &[(&'static str, &'a Buffer)],
) -> Vec<(&'static str, &'a Buffer)> {
    [&scene, others].concat()
}
