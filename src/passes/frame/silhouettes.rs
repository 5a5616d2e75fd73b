//! Maps of silhouettes: how near to a light the nearest edge is, in each direction, at which its
//! shadows may end. Points of one triangle see the light alike if no such edge is before them. In:
//! edges, a light. Out: its map.

use crate::error::Result;
use crate::gpu::barrier::TRANSFER_TO_COMPUTE;
use crate::gpu::{Buffer, Context, PassScope};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::{LightKernel, OneLight, SceneBuffers};
use crate::types::SilhouetteEdge;
use std::sync::Arc;

gpu_struct! {
    pub struct SilhouettesPush {
        pub edge_count: u32,
        /// Point samples of the light, with a map each.
        pub sample_count: u32,
        /// Row of the light.
        pub light: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[SilhouettesPush::LAYOUT];

/// The pipelines that draw maps, one for each kind of light.
pub struct Silhouettes {
    kernel: LightKernel,
}

impl Silhouettes {
    /// Stem of shader and timing.
    pub const STEM: &str = "silhouettes";

    /// Creates the pipelines.
    ///
    /// # Errors
    /// A Vulkan call failed.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        Ok(Self { kernel: LightKernel::new(context, Self::STEM, &[])? })
    }

    /// Allocates the maps of a light.
    ///
    /// # Errors
    /// The device lacks memory, or a Vulkan call failed.
    pub fn maps(context: &Arc<Context>, bytes: u64) -> Result<Buffer> {
        Buffer::storage(context, "silhouettes", bytes)
    }

    /// Draws the maps of a light, if it has any. Records into an open pass with a barrier between
    /// its own commands. The caller records a barrier to transfers before.
    pub fn record(&self, pass: &mut PassScope<'_>, scene: &SceneBuffers, light: OneLight<'_>) {
        let (Some(edges), Some(map)) = (&scene.silhouette_edges, light.silhouettes) else { return };
        let edge_count = (edges.bytes() / size_of::<SilhouetteEdge>() as u64) as u32;
        pass.fill_zero(map).barrier(TRANSFER_TO_COMPUTE);
        pass.dispatch(
            self.kernel.of(light),
            [edge_count * light.samples, 1, 1],
            &SilhouettesPush { edge_count, sample_count: light.samples, light: light.row },
            &[
                ("Nodes", &scene.nodes),
                ("Triangles", &scene.triangles),
                ("Lights", light.table),
                ("SilhouetteEdges", edges),
                ("Silhouettes", map),
                ("TruncatedLoops", &scene.truncated_loops),
            ],
        );
    }
}
