//! Shafts: the possible occluders between a light and a batch of nearby points. [Haines 1991] In:
//! batches of points, a light. Out: for each batch the few nodes and triangles from which its
//! shadow rays start. Most points are lit, or hidden by few triangles, so that a ray tests a
//! handful of triangles instead of traversing the tree.

use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, PassScope, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::one_light::for_kinds;
use crate::passes::{OneLight, SceneBuffers};
use crate::types::LIGHT_AREA;
use bytemuck::Pod;
use glam::Vec3;
use std::sync::Arc;

/// Maximum number of points that share a shaft; mirrors `BATCH` in `glsl/include/shafts.glsl`.
pub const BATCH: u32 = 64;
/// Words of a shaft: the numbers of its triangles (bits 0–15) and nodes (16–31); triangles; and
/// from the end backwards, nodes.
pub const SHAFT_WORDS: u32 = 16;

// What a run of a kernel starts its rays from; as in `glsl/include/shaft_rays.glsl`.
const AT_TRIANGLES: u32 = 0;
const AT_NODES: u32 = 1;
const AT_ROOT: u32 = 2;

gpu_struct! {
    /// The origins of a batch's shadow rays.
    pub struct PointBatch {
        /// Bounds of the origins, metres; empty if `low` is above `high`.
        pub low: Vec3,
        /// Largest distance of the points' unit geometric normals from `normal`.
        pub spread: f32,
        /// Bounds of their origins, metres.
        pub high: Vec3,
        /// One of the normals.
        pub normal: Vec3,
    }
}

gpu_struct! {
    pub struct ShaftsPush {
        /// Row of the part of the light.
        pub light: u32,
        /// 1: rays start from the tree's root.
        pub traces_all: u32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[PointBatch::LAYOUT, ShaftsPush::LAYOUT];

/// The pipeline, batches of one kind of points, and their shafts to the most recent light.
pub struct Shafts {
    pipeline: Pipeline,
    /// `PointBatch`es, which the owner fills.
    pub batches: Buffer,
    /// [`SHAFT_WORDS`] a batch.
    pub roots: Buffer,
    /// Dispatch size of one workgroup for each batch with nodes; the number of these batches; their
    /// indices, in any order.
    pub list: Buffer,
    batch_count: u32,
}

/// A kernel that traces the shadow rays of batches, one workgroup a batch, for each kind of light.
pub struct ShaftKernel([Kernel; 4]);

enum Kernel {
    /// First the batches whose shafts hold only triangles, then the others.
    FromShafts { shallow: Pipeline, deep: Pipeline },
    /// All batches, without shafts.
    FromRoot(Pipeline),
}

impl ShaftKernel {
    /// Creates the pipelines of the shader with that stem.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>, stem: &'static str) -> Result<Self> {
        let of_kind = |kind| {
            let starts_at =
                |start| Pipeline::new(context, stem, &[("STARTS_AT", start), ("LIGHT_KIND", kind)]);
            // A shaft tells which points have no penumbra, and so spares the probes of area lights.
            Ok(if context.tuning().shafts || kind == LIGHT_AREA {
                Kernel::FromShafts { shallow: starts_at(AT_TRIANGLES)?, deep: starts_at(AT_NODES)? }
            } else {
                Kernel::FromRoot(starts_at(AT_ROOT)?)
            })
        };
        Ok(Self(for_kinds(of_kind)?))
    }

    fn of(&self, light: OneLight<'_>) -> &Kernel {
        &self.0[light.kind as usize]
    }

    /// Whether the rays to a light start from the roots of shafts.
    pub fn has_shafts(&self, light: OneLight<'_>) -> bool {
        matches!(self.of(light), Kernel::FromShafts { .. })
    }

    /// Traces the rays of `point_count` points in batches, whose shafts are known if there are any.
    /// Records into an open pass with barriers before and between its own dispatches.
    pub fn record<P: Pod>(
        &self,
        pass: &mut PassScope<'_>,
        light: OneLight<'_>,
        (shafts, point_count): (&Shafts, u32),
        push: &P,
        bindings: &[(&str, &Buffer)],
    ) {
        pass.barrier(COMPUTE_TO_INDIRECT);
        match self.of(light) {
            Kernel::FromShafts { shallow, deep } => {
                pass.dispatch(shallow, [point_count, 1, 1], push, bindings);
                pass.barrier(COMPUTE_TO_COMPUTE);
                pass.dispatch_indirect(deep, (&shafts.list, 0), push, bindings);
            }
            Kernel::FromRoot(kernel) => {
                pass.dispatch(kernel, [point_count, 1, 1], push, bindings);
            }
        }
    }
}

impl Shafts {
    /// Stem of shader and reference.
    pub const STEM: &str = "shafts";

    /// Allocates buffers for `batch_count` batches.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn new(context: &Arc<Context>, batch_count: u32) -> Result<Self> {
        let allocate =
            |name, bytes: usize| Buffer::storage(context, name, u64::from(batch_count) * bytes as u64);
        Ok(Self {
            pipeline: Pipeline::new(context, Self::STEM, &[])?,
            batches: allocate("point batches", size_of::<PointBatch>())?,
            roots: allocate("shaft roots", 4 * SHAFT_WORDS as usize)?,
            list: Buffer::storage(context, "shaft list", 4 * (4 + u64::from(batch_count)))?,
            batch_count,
        })
    }

    /// Invocations of a dispatch with a workgroup for each batch.
    pub fn point_count(&self) -> u32 {
        BATCH * self.batch_count
    }

    /// Finds the roots of all batches for a light. Records into an open pass. The caller records a
    /// barrier to transfers between two lights.
    pub fn record(&self, pass: &mut PassScope<'_>, scene: &SceneBuffers, light: OneLight<'_>) {
        pass.fill_zero(&self.list).barrier(TRANSFER_TO_COMPUTE);
        let push = ShaftsPush { light: light.row, traces_all: u32::from(light.traces_all) };
        pass.dispatch(&self.pipeline, [self.batch_count, 1, 1], &push, &self.bindings(scene, light));
    }

    fn bindings<'a>(
        &'a self,
        scene: &'a SceneBuffers,
        light: OneLight<'a>,
    ) -> [(&'static str, &'a Buffer); 6] {
        [
            ("Nodes", &scene.nodes),
            ("Triangles", &scene.triangles),
            ("Lights", light.table),
            ("PointBatches", &self.batches),
            ("ShaftRoots", &self.roots),
            ("ShaftList", &self.list),
        ]
    }
}
