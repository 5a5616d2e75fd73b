//! Clearances: the distance from candidate cache points to the nearest visible surface, and their
//! nearest occluder plane. [Tabellion §4] In: candidates. Out: metres and a plane, for each.

use crate::cpu::hemisphere::{Strata, frame};
use crate::cpu::sampling::hash_pair;
use crate::error::Result;
use crate::gpu::barrier::{COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE};
use crate::gpu::{Buffer, Context, HostBlock, HostUpload, Pipeline};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::precompute::geometry::Geometry;
use crate::passes::precompute::kept::{Kept, names::name_of_point};
use crate::passes::precompute::{Chunks, Progress, advance, each_part};
use crate::passes::{SceneBuffers, loop_limit};
use crate::types::CachePoint;
use glam::Vec3;
use std::sync::{Arc, Mutex, PoisonError};

gpu_struct! {
    /// Clearance of a candidate.
    pub struct Clearance {
        /// Distance to the nearest surface that its rays see, metres; negative if that surface, or
        /// most that they see, is the inside of a solid.
        pub distance: f32,
        /// Plane of that surface, as in `CachePoint`, if it faces 45° or more away from the
        /// candidate's; else zero.
        pub occluder: Vec3,
        /// Rays to any distance that meet inner sides, less rays that meet others.
        pub inner: i32,
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
        /// Bits of a side that name it.
        pub side_bits: u32,
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
/// Rays that find every hit, however far, and the stride from each to the next, as in the shader.
const PROBES: u32 = 8;
const STRIDE: u32 = 11;

/// Device side: clearances of candidates.
pub(in crate::passes::precompute) struct ClearanceProbe<'a> {
    context: Arc<Context>,
    /// Of the precomputation before.
    kept: Option<&'a Kept>,
    pipeline: Pipeline,
    candidates: Buffer,
    clearances: Buffer,
    from_host: HostUpload,
    to_host: HostBlock,
    /// Size of the dispatches, from the durations of earlier ones.
    chunks: Mutex<Chunks>,
    scene_size: f32,
    side_bits: u32,
    seed: u32,
}

impl<'a> ClearanceProbe<'a> {
    /// Maximum number of candidates of one dispatch.
    const LIMIT: u32 = 1 << 15;

    pub(in crate::passes::precompute) fn new(
        context: &Arc<Context>,
        geometry: &Geometry<'_>,
        (seed, kept): (u32, Option<&'a Kept>),
    ) -> Result<Self> {
        let [rings, sectors] = Hemisphere::new(CLEARANCE_RAYS).constants();
        let constants = [rings, sectors];
        let bindable = context.limits().storage_range_bytes / size_of::<CachePoint>() as u64;
        let limit = bindable.clamp(1, Self::LIMIT.into()) as u32;
        let buffer = |name, bytes: usize| Buffer::storage(context, name, u64::from(limit) * bytes as u64);
        let candidates = buffer("candidates", size_of::<CachePoint>())?;
        let clearances = buffer("clearances", size_of::<Clearance>())?;
        Ok(Self {
            kept,
            context: context.clone(),
            pipeline: Pipeline::new(context, STEM, &constants)?,
            from_host: HostUpload::of(context, "candidates on the host", &candidates)?,
            to_host: HostBlock::of(context, "clearances on the host", &clearances)?,
            candidates,
            clearances,
            chunks: Mutex::new(Chunks::new(FIRST, limit)),
            scene_size: geometry.scene_size,
            side_bits: geometry.naming.side_bits(),
            seed,
        })
    }

    pub(in crate::passes::precompute) fn measure(
        &self,
        scene: &SceneBuffers,
        candidates: &[CachePoint],
        progress: Option<&mut dyn Progress>,
    ) -> Result<Vec<Clearance>> {
        let measure = |candidates: &[CachePoint]| self.trace(scene, candidates, progress);
        let Some(kept) = self.kept else { return measure(candidates) };
        let is_kept = |candidate: &CachePoint, clearance: &Clearance| {
            let place = candidate.position;
            // Each probe counts one up or down. Enough of them must be as they were.
            let changed = || 2 * kept.meeting(place, self.probes(candidate));
            clearance.distance >= 0.0
                && kept.is_clear([place; 2], clearance.distance)
                && clearance.inner + changed() <= 0
        };
        kept.all("clearances", candidates, name_of_point, is_kept, measure)
    }

    /// Directions of the rays that find every hit.
    fn probes(&self, candidate: &CachePoint) -> impl Iterator<Item = Vec3> + use<> {
        let Hemisphere { rings, sectors } = Hemisphere::new(CLEARANCE_RAYS);
        let strata = Strata { rings, sectors };
        let [x, y, z] = candidate.position.to_array().map(f32::to_bits);
        let name = hash_pair(x, hash_pair(y, hash_pair(z, candidate.side & self.side_bits)));
        let (frame, seed) = (frame(candidate.normal), self.seed);
        let ray = move |number: u32| number * STRIDE % CLEARANCE_RAYS;
        (0..PROBES).map(move |number| (frame * strata.direction(ray(number), name, seed)).as_vec3())
    }

    fn trace(
        &self,
        scene: &SceneBuffers,
        candidates: &[CachePoint],
        mut progress: Option<&mut dyn Progress>,
    ) -> Result<Vec<Clearance>> {
        let mut measured = Vec::with_capacity(candidates.len());
        let mut chunks = self.chunks.lock().unwrap_or_else(PoisonError::into_inner);
        chunks.run_batches(candidates.len() as u32, |first, parts| {
            let count = parts.last().map_or(0, |part| part.end);
            self.from_host.write(&candidates[first as usize..(first + count) as usize]);
            let &Self { seed, scene_size, side_bits, .. } = self;
            let ((), timings) = self.context.run(|rec| {
                each_part(rec, parts, |rec, part| {
                    let candidate_count = part.end - part.start;
                    rec.copy_from_host::<CachePoint>(&self.from_host, part.clone(), &self.candidates);
                    rec.barrier(TRANSFER_TO_COMPUTE);
                    rec.pass(STEM).dispatch(
                        &self.pipeline,
                        [candidate_count * self.pipeline.local_size()[0], 1, 1],
                        &ClearancePush { candidate_count, seed, side_bits, scene_size },
                        &[
                            ("Nodes", &scene.nodes),
                            ("Triangles", &scene.triangles),
                            ("Surfaces", &scene.surfaces),
                            ("Candidates", &self.candidates),
                            ("Clearances", &self.clearances),
                        ],
                    );
                    rec.barrier(COMPUTE_TO_TRANSFER);
                    rec.copy_elements_to_host::<Clearance>(&self.clearances, &self.to_host, part);
                });
            })?;
            measured.extend(self.to_host.read::<Clearance>(count as usize));
            loop_limit::refuse(measured[first as usize..].iter().any(Clearance::is_unknown), STEM, 0)?;
            if let Some(progress) = &mut progress {
                advance(&mut **progress, u64::from(first + count))?;
            }
            Ok(timings)
        })?;
        Ok(measured)
    }
}
