//! Form factors of the sky without its bright spots. Rays of entry points that leave the scene are
//! found once; a new rotation or brightness traces nothing. [Yue §3] In: entry points, the table of
//! a sky. Out: form factors per unit emission, sr, and beams at glossy entry points.

use crate::error::Result;
use crate::gpu::barrier::COMPUTE_TO_COMPUTE;
use crate::gpu::{Buffer, Chunk, Context, PassScope, Pipeline, SplitBuffer};
use crate::layout::{GpuStruct, Layout, gpu_struct};
use crate::passes::one_light::SKY_BEAMS;
use crate::passes::precompute::Chunks;
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::{GrowsWith, OneLight, SceneBuffers};
use std::sync::Arc;

gpu_struct! {
    /// Push constants of `sky_visibility`.
    pub struct SkyVisibilityPush {
        /// First word of the dispatch in the bound buffer.
        pub first_word: u32,
        /// Words of the dispatch.
        pub word_count: u32,
        /// Sets of bits of an entry point: 1, or 3 if panes have colours.
        pub channels: u32,
        /// Seed of the rays.
        pub seed: u32,
    }
}

gpu_struct! {
    /// Push constants of `sky_factors`.
    pub struct SkyFactorsPush {
        /// First index of the bound buffer of the entry points.
        pub first_point: u32,
        /// Entry points in the bound buffer.
        pub point_count: u32,
        /// First word of the sky's table in the table of lights.
        pub first_radiance: u32,
        /// Side of the sky's table.
        pub side: u32,
        /// Sets of visible rays of an entry point.
        pub channels: u32,
        /// The set for the light.
        pub channel: u32,
        /// Seed of the rays.
        pub seed: u32,
    }
}

gpu_struct! {
    /// Push constants of `sky_beams`.
    pub struct SkyBeamsPush {
        /// Entry points that may be glossy.
        pub entry_count: u32,
        /// All beams of an entry point.
        pub beam_count: u32,
        /// First beam of the sky.
        pub first_beam: u32,
        /// First index of the bound buffer of the visible rays.
        pub first_point: u32,
        /// Entry points in the bound buffer.
        pub point_count: u32,
        /// First word of the sky's table in the table of lights.
        pub first_radiance: u32,
        /// Side of the sky's table.
        pub side: u32,
        /// Sets of visible rays of an entry point.
        pub channels: u32,
        /// The set for the light.
        pub channel: u32,
        /// Seed of the rays.
        pub seed: u32,
    }
}

/// Layouts of the structs shared with the shaders.
pub const LAYOUTS: &[Layout] = &[SkyVisibilityPush::LAYOUT, SkyFactorsPush::LAYOUT, SkyBeamsPush::LAYOUT];

/// Rays of an entry point: a multiple of 32.
pub const SKY_RAYS: u32 = 64;
const WORDS: u32 = SKY_RAYS / 32;
const _: () = assert!(SKY_RAYS.is_multiple_of(32) && SKY_RAYS == 4 * SKY_BEAMS);

/// Seed of the rays' directions.
pub const SKY_SEED: u32 = 0x51c7_5eed;

/// Stem of the shader that traces the rays.
pub const VISIBILITY_STEM: &str = "sky_visibility";

/// The pipelines, and a bit for each ray of each entry point: whether it leaves the scene.
pub struct SkyFactors {
    factors: Pipeline,
    beams: Pipeline,
    /// Sets of [`WORDS`] words an entry point, for each chunk of the entry points.
    visible: Vec<Buffer>,
    /// Random stream index of each entry point, in the same chunks.
    streams: Vec<Buffer>,
    /// Sets of an entry point: 1, or 3 if panes have colours.
    channels: u32,
}

impl SkyFactors {
    /// Traces the rays of all entry points. Each has a random stream index, in `streams`.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn new(
        context: &Arc<Context>,
        scene: &SceneBuffers,
        entry_points: &SplitBuffer,
        streams: &[u32],
    ) -> Result<Self> {
        let hemisphere = Hemisphere::new(SKY_RAYS).constants();
        let trace = Pipeline::new(context, VISIBILITY_STEM, &hemisphere)?;
        let own = |chunk: &Chunk| &streams[chunk.items.start as usize..chunk.items.end as usize];
        let name = GrowsWith::EntryPoints.named("streams of paths");
        let streams = entry_points.iter().map(|chunk| Buffer::from_slice(context, name, own(chunk)));
        let streams = streams.collect::<Result<Vec<_>>>()?;
        let chunks = entry_points.iter().zip(&streams);
        let visible = chunks.map(|(chunk, streams)| visible_rays(context, scene, &trace, (chunk, streams)));
        Ok(Self {
            factors: Pipeline::new(context, "sky_factors", &hemisphere)?,
            beams: Pipeline::new(context, "sky_beams", &hemisphere)?,
            visible: visible.collect::<Result<_>>()?,
            streams,
            channels: scene.light_channels,
        })
    }

    /// Fills the form factors of a sky. Records into an open pass between barriers of the caller.
    /// Does nothing for other lights.
    pub fn record(
        &self,
        pass: &mut PassScope<'_>,
        scene: &SceneBuffers,
        light: OneLight<'_>,
        entry_points: &SplitBuffer,
        factors: &Buffer,
    ) {
        let Some(table) = light.sky else { return };
        for ((chunk, visible), streams) in entry_points.iter().zip(&self.visible).zip(&self.streams) {
            if chunk.items.start > 0 {
                pass.barrier(COMPUTE_TO_COMPUTE);
            }
            let point_count = chunk.items.len() as u32;
            pass.dispatch(
                &self.factors,
                [point_count, 1, 1],
                &SkyFactorsPush {
                    first_point: chunk.items.start,
                    point_count,
                    first_radiance: table.first_word,
                    side: table.side,
                    channels: self.channels,
                    channel: light.channel.unwrap_or(0),
                    seed: SKY_SEED,
                },
                &[
                    ("Surfaces", &scene.surfaces),
                    ("Lights", light.table),
                    ("EntryPoints", &chunk.buffer),
                    ("PathStreams", streams),
                    ("VisibleSky", visible),
                    ("FormFactors", factors),
                ],
            );
        }
    }

    /// Writes the beams of a sky at the glossy entry points `entries`, after those of its parts.
    /// Does nothing for other lights.
    pub fn record_beams(
        &self,
        pass: &mut PassScope<'_>,
        light: OneLight<'_>,
        entry_points: &SplitBuffer,
        (entries, entry_count): (&Buffer, u32),
        beams: &Buffer,
    ) {
        let Some(table) = light.sky else { return };
        for ((chunk, visible), streams) in entry_points.iter().zip(&self.visible).zip(&self.streams) {
            pass.barrier(COMPUTE_TO_COMPUTE);
            pass.dispatch(
                &self.beams,
                [entry_count * SKY_BEAMS, 1, 1],
                &SkyBeamsPush {
                    entry_count,
                    beam_count: light.beam_count(),
                    first_beam: light.part_beams(),
                    first_point: chunk.items.start,
                    point_count: chunk.items.len() as u32,
                    first_radiance: table.first_word,
                    side: table.side,
                    channels: self.channels,
                    channel: light.channel.unwrap_or(0),
                    seed: SKY_SEED,
                },
                &[
                    ("Lights", light.table),
                    ("GlossEntries", entries),
                    ("PathStreams", streams),
                    ("VisibleSky", visible),
                    ("GlossBeams", beams),
                ],
            );
        }
    }
}

/// Traces the rays of one chunk of the entry points.
fn visible_rays(
    context: &Arc<Context>,
    scene: &SceneBuffers,
    trace: &Pipeline,
    (chunk, streams): (&Chunk, &Buffer),
) -> Result<Buffer> {
    let channels = scene.light_channels;
    let words = WORDS * channels * chunk.items.len() as u32;
    let visible =
        Buffer::storage(context, GrowsWith::EntryPoints.named("visible sky"), 4 * u64::from(words.max(1)))?;
    Chunks::new(1 << 12, words.max(1)).run(words, |first_word, word_count| {
        let push = SkyVisibilityPush { first_word, word_count, channels, seed: SKY_SEED };
        let ((), timings) = context.run(|rec| {
            rec.pass(VISIBILITY_STEM).dispatch(
                trace,
                [word_count, 1, 1],
                &push,
                &[
                    ("Nodes", &scene.nodes),
                    ("Triangles", &scene.triangles),
                    ("Surfaces", &scene.surfaces),
                    ("EntryPoints", &chunk.buffer),
                    ("PathStreams", streams),
                    ("VisibleSky", &visible),
                    ("TruncatedLoops", &scene.truncated_loops),
                ],
            );
        })?;
        Ok(timings[0].ms)
    })?;
    scene.refuse_truncated_loops(VISIBILITY_STEM, 0)?;
    Ok(visible)
}
