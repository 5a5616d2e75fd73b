//! The glossy pixels of a view, and their samples: the surface that each sees, and the part of the
//! pixel for which it stands. In: pixels and fragments. Out: samples, pixel by pixel.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::frame::antialias::{EdgeCapacity, SeenFragments};
use crate::passes::frame::gloss_records::BroadLobes;
use crate::passes::frame::prefix_sum::PrefixSum;
use crate::passes::{GrowsWith, SceneBuffers};
use crate::types::{PixelSurface, View};
use glam::Vec3;
use std::sync::Arc;

gpu_struct! {
    /// The part of a pixel for which a sample stands.
    pub struct GlossPart {
        /// Turn of the mirror direction, a unit vector, from the sample to the right border.
        pub across: Vec3,
        /// To the lower border.
        pub down: Vec3,
        /// In the mean over the pixel.
        pub weight: f32,
    }
}

gpu_struct! {
    /// How many samples glossy pixels have.
    pub struct GlossSampling {
        /// Samples of a pixel at most.
        pub max_samples: u32,
        /// Capacity of the list of samples.
        pub capacity: u32,
        /// Number of invocations that place them.
        pub stride: u32,
        /// Seed of all decisions.
        pub seed: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_mark`.
    pub struct GlossMarkPush {
        /// Capacity for samples of edge pixels.
        pub edge_capacity: EdgeCapacity,
        /// Pixels of the image.
        pub pixel_count: u32,
        /// Exponents of broad lobes ([`super::gloss_records::BroadLobes::packed`]).
        pub broad_exponents: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_list`.
    pub struct GlossListPush {
        /// Pixels of the image.
        pub pixel_count: u32,
    }
}

gpu_struct! {
    /// Push constants of `gloss_samples`.
    pub struct GlossSamplesPush {
        pub view: View,
        /// Capacity for samples of edge pixels.
        pub edge_capacity: EdgeCapacity,
        pub sampling: GlossSampling,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[
    GlossPart::LAYOUT,
    GlossSampling::LAYOUT,
    GlossMarkPush::LAYOUT,
    GlossListPush::LAYOUT,
    GlossSamplesPush::LAYOUT,
];

/// The pipelines, the glossy pixels of the view and their samples.
pub struct GlossSamples {
    mark: Pipeline,
    list: Pipeline,
    place: Pipeline,
    prefix_sum: PrefixSum,
    pixel_count: u32,
    /// Number of pixels with rays before each pixel; then all of these and the other glossy ones
    /// before each; and all.
    pub(super) offsets: Buffer,
    /// Indices of the glossy pixels: those with rays, then the others.
    pub(super) pixels: Buffer,
    /// `PixelSurface`s, pixel by pixel.
    pub surfaces: Buffer,
    /// `GlossPart` of each sample.
    pub parts: Buffer,
}

impl GlossSamples {
    /// Allocates buffers for an image of `pixel_count` pixels with `capacity` samples in all.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub(super) fn new(context: &Arc<Context>, pixel_count: u32, capacity: u32) -> Result<Self> {
        let allocate = |name, count: u32, bytes: usize| {
            Buffer::storage(context, GrowsWith::Pixels.named(name), u64::from(count) * bytes as u64)
        };
        let room = capacity.max(1);
        Ok(Self {
            mark: Pipeline::new(context, "gloss_mark", &[])?,
            list: Pipeline::new(context, "gloss_list", &[])?,
            place: Pipeline::new(context, "gloss_samples", &[])?,
            prefix_sum: PrefixSum::new(context, 2 * pixel_count)?,
            pixel_count,
            offsets: allocate("gloss offsets", 2 * pixel_count + 1, size_of::<u32>())?,
            pixels: allocate("gloss pixels", pixel_count, size_of::<u32>())?,
            surfaces: allocate("gloss samples", room, size_of::<PixelSurface>())?,
            parts: allocate("gloss parts", room, size_of::<GlossPart>())?,
        })
    }

    /// Finds the glossy pixels, clears the `radiance` of all pixels, and places samples. Records
    /// into an open pass with barriers between its own dispatches.
    pub(super) fn record(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        (seen, view): (SeenFragments<'_>, &View),
        (sampling, broad): (GlossSampling, BroadLobes),
        radiance: &Buffer,
    ) {
        let pixel_count = self.pixel_count;
        let SeenFragments { pixels, antialias } = seen;
        let (edge_capacity, fragments) = (antialias.capacity, &antialias.fragments);
        pass.dispatch(
            &self.mark,
            [pixel_count, 1, 1],
            &GlossMarkPush { edge_capacity, pixel_count, broad_exponents: broad.packed() },
            &[
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Pixels", pixels),
                ("EdgeNumbers", &antialias.numbers),
                ("FragmentFirsts", &fragments.firsts),
                ("FragmentSurfaces", &fragments.surfaces),
                ("GlossOffsets", &self.offsets),
                ("GlossRadiance", radiance),
            ],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        self.prefix_sum.record(pass, &self.offsets, 2 * pixel_count);
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.list,
            [2 * pixel_count, 1, 1],
            &GlossListPush { pixel_count },
            &[("GlossOffsets", &self.offsets), ("GlossPixels", &self.pixels)],
        );
        pass.barrier(COMPUTE_TO_COMPUTE);
        pass.dispatch(
            &self.place,
            [sampling.stride, 1, 1],
            &GlossSamplesPush { view: *view, edge_capacity, sampling },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Surfaces", &scene.surfaces),
                ("Materials", &scene.materials),
                ("Pixels", pixels),
                ("EdgeNumbers", &antialias.numbers),
                ("EdgeSamples", &antialias.edge_samples),
                ("SampleMasks", &fragments.of_samples),
                ("FragmentFirsts", &fragments.firsts),
                ("Fragments", &fragments.list),
                ("FragmentSurfaces", &fragments.surfaces),
                ("GlossOffsets", &self.offsets),
                ("GlossPixels", &self.pixels),
                ("GlossSamples", &self.surfaces),
                ("GlossParts", &self.parts),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
    }

    /// The glossy pixels of the last view: those with rays, then the others.
    ///
    /// # Errors
    /// The device failed.
    pub fn listed(&self) -> Result<Vec<u32>> {
        self.pixels.read_range(0, self.count()? as usize)
    }

    /// Returns the number of glossy pixels of the last view.
    ///
    /// # Errors
    /// The device failed.
    pub fn count(&self) -> Result<u32> {
        Ok(self.offsets.read_range::<u32>(2 * self.pixel_count as usize, 1)?[0])
    }
}
