//! Clearances: the distance from candidate cache points to the nearest visible surface, and their
//! nearest occluder plane. [Tabellion §4] In: candidates. Out: metres and a plane, for each.

use super::gather_rays::Hemisphere;
use super::{Chunks, Progress};
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::{SceneBuffers, loop_limit};
use crate::types::CachePoint;
use glam::Vec3;
use std::sync::{Arc, Mutex, PoisonError};

gpu_struct! {
    /// Clearance of a candidate.
    pub struct Clearance {
        /// Distance to the nearest surface that its rays see, metres; negative if that is the
        /// inside of a solid.
        pub distance: f32,
        /// Plane of that surface, as in `CachePoint`, if it faces 45° or more away from the
        /// candidate's; else zero.
        pub occluder: Vec3,
    }
}

impl Clearance {
    /// Whether truncated loops left it undetermined.
    fn is_unknown(&self) -> bool {
        self.distance == -2.0
    }
}

gpu_struct! {
    pub struct ClearancePush {
        /// Candidates in the dispatch.
        pub candidate_count: u32,
        /// Seed of all decisions.
        pub seed: u32,
        /// Clearance where no ray hits, metres.
        pub scene_size: f32,
    }
}

/// Layouts of the structs shared with the shader.
pub const LAYOUTS: &[Layout] = &[Clearance::LAYOUT, ClearancePush::LAYOUT];

/// Stem of shader, reference and timing.
pub const STEM: &str = "clearance";

/// Candidates of the first dispatch: few, because their duration is not known yet.
const FIRST: u32 = 256;
const CLEARANCE_RAYS: u32 = 64;

/// Device side: clearances of candidates.
pub(super) struct ClearanceProbe {
    context: Arc<Context>,
    pipeline: Pipeline,
    candidates: Buffer,
    clearances: Buffer,
    /// Size of the dispatches, from the durations of earlier ones.
    chunks: Mutex<Chunks>,
    scene_size: f32,
    seed: u32,
}

impl ClearanceProbe {
    /// Maximum number of candidates of one dispatch.
    const LIMIT: u32 = 1 << 15;

    pub(super) fn new(context: &Arc<Context>, scene_size: f32, seed: u32) -> Result<Self> {
        let [rings, sectors] = Hemisphere::new(CLEARANCE_RAYS).constants();
        let constants = [rings, sectors];
        let bindable = context.limits().storage_range_bytes / size_of::<CachePoint>() as u64;
        let limit = bindable.clamp(1, Self::LIMIT.into()) as u32;
        Ok(Self {
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &constants)?,
            candidates: Buffer::storage(
                context,
                "candidates",
                u64::from(limit) * size_of::<CachePoint>() as u64,
            )?,
            clearances: Buffer::storage(
                context,
                "clearances",
                u64::from(limit) * size_of::<Clearance>() as u64,
            )?,
            chunks: Mutex::new(Chunks::new(FIRST, limit)),
            scene_size,
            seed,
        })
    }

    pub(super) fn measure(
        &self,
        scene: &SceneBuffers,
        candidates: &[CachePoint],
        mut progress: Option<&mut dyn Progress>,
    ) -> Result<Vec<Clearance>> {
        let mut measured = Vec::with_capacity(candidates.len());
        let mut chunks = self.chunks.lock().unwrap_or_else(PoisonError::into_inner);
        chunks.run(candidates.len() as u32, |first, count| {
            self.candidates.write(&candidates[first as usize..(first + count) as usize])?;
            let push = ClearancePush { candidate_count: count, seed: self.seed, scene_size: self.scene_size };
            let ((), timings) = self.context.run(|rec| {
                rec.pass(STEM).dispatch(
                    &self.pipeline,
                    [count * self.pipeline.local_size()[0], 1, 1],
                    &push,
                    &[
                        ("Nodes", &scene.nodes),
                        ("Triangles", &scene.triangles),
                        ("Surfaces", &scene.surfaces),
                        ("Candidates", &self.candidates),
                        ("Clearances", &self.clearances),
                    ],
                );
            })?;
            measured.extend(self.clearances.read_range::<Clearance>(0, count as usize)?);
            loop_limit::refuse(measured[first as usize..].iter().any(Clearance::is_unknown), STEM, 0)?;
            if let Some(progress) = &mut progress {
                progress.advance(u64::from(first + count));
            }
            Ok(timings[0].ms)
        })?;
        Ok(measured)
    }
}
