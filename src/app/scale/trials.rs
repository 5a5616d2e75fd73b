//! Cost of a scene at one size.

use std::sync::Arc;
use std::time::Instant;

use crate::app::args::DeviceArgs;
use crate::app::time::{lights::fitting, measure::Summary};
use crate::error::Result;
use crate::gpu::Context;
use crate::renderer::{FrameReport, Renderer, Work};
use crate::scene::{Quality, Scene};

/// Frames of each kind; the median counts.
const FRAMES: usize = 3;

/// Passes that trace shadow rays, whose time grows with the depth of the BVH.
const SHADOWS: [&str; 3] = ["direct", "shadow_edges", "form_factors"];

/// The varied quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Triangles,
    EntryPoints,
    CachePoints,
    Lights,
}

impl Quantity {
    /// In the order of the table.
    pub(super) const ALL: [Self; 4] = [Self::Triangles, Self::EntryPoints, Self::CachePoints, Self::Lights];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Triangles => "triangles",
            Self::EntryPoints => "entry points",
            Self::CachePoints => "cache points",
            Self::Lights => "lights",
        }
    }

    /// The quantity's value in `sizes`.
    pub(super) fn value_in(self, sizes: &Sizes) -> u32 {
        match self {
            Self::Triangles => sizes.triangles,
            Self::EntryPoints => sizes.entry_points,
            Self::CachePoints => sizes.cache_points,
            Self::Lights => sizes.lights,
        }
    }

    /// The scene with `size` of the quantity; triangles do not change here.
    pub(super) fn sized(self, scene: &Scene, size: u32) -> Scene {
        let mut scene = scene.clone();
        let Quality { entry_points, cache_points, .. } = &mut scene.quality;
        match self {
            Self::Triangles => {}
            Self::EntryPoints => *entry_points = size,
            Self::CachePoints => *cache_points = size,
            Self::Lights => scene.lights = fitting(&scene, &scene.lights, size as usize),
        }
        scene
    }
}

/// All sizes of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub(super) struct Sizes {
    pub(super) triangles: u32,
    pub(super) entry_points: u32,
    /// Requested number; the scene may need fewer.
    pub(super) cache_points: u32,
    pub(super) lights: u32,
}

impl Sizes {
    pub(super) fn from_scene(scene: &Scene) -> Self {
        let Quality { entry_points, cache_points, .. } = scene.quality;
        let (triangles, lights) = (scene.triangles.len() as u32, scene.lights.len() as u32);
        Self { triangles, entry_points, cache_points, lights }
    }
}

/// Cost of a trial. Frame times are medians, wall-clock unless stated otherwise.
#[derive(Clone, Debug, serde::Serialize)]
pub(super) struct Trial {
    /// The varied quantity's name.
    pub(super) quantity: &'static str,
    pub(super) sizes: Sizes,
    pub(super) precompute_s: f64,
    pub(super) first_frame_ms: f64,
    /// Frame after a light moved.
    pub(super) relit_frame_ms: f64,
    /// Device time of that frame without shadow rays.
    pub(super) relit_without_shadows_ms: f64,
    /// Frame after the camera moved.
    pub(super) view_frame_ms: f64,
    pub(super) memory_mb: f64,
    pub(super) largest_binding_mb: f64,
}

/// Precomputes and renders a scene.
pub(super) fn measure(
    scene: Scene,
    quantity: &'static str,
    context: &Arc<Context>,
    device_args: &DeviceArgs,
) -> Result<Trial> {
    let sizes = Sizes::from_scene(&scene);
    context.reset_memory_peak();
    let (start, compiled) = (Instant::now(), context.compile_time());
    let mut renderer = device_args.renderer(context, scene)?;
    // The first trial compiles the pipelines of all trials.
    let compiling = context.compile_time() - compiled;
    let precompute_s = start.elapsed().saturating_sub(compiling).as_secs_f64();
    let first_frame_ms = renderer.frame()?.frame_ms;
    let relit = frames(&mut renderer, Work::Light(0))?;
    let view = frames(&mut renderer, Work::View)?;
    let statistics = renderer.statistics()?;
    device_args.report_validation(context);
    let rest = |frame: &FrameReport| {
        let passes = frame.passes.iter().filter(|pass| !SHADOWS.contains(&pass.name));
        passes.map(|pass| pass.ms).sum::<f64>()
    };
    let on_the_clock =
        |frames: &[FrameReport]| Summary::from_times(frames.iter().map(|frame| frame.frame_ms)).median;
    Ok(Trial {
        quantity,
        sizes,
        precompute_s,
        first_frame_ms,
        relit_frame_ms: on_the_clock(&relit),
        relit_without_shadows_ms: Summary::from_times(relit.iter().map(rest)).median,
        view_frame_ms: on_the_clock(&view),
        memory_mb: statistics.peak_memory_bytes as f64 / 1e6,
        largest_binding_mb: statistics.largest_binding_bytes as f64 / 1e6,
    })
}

/// Times some frames after a warm-up frame.
fn frames(renderer: &mut Renderer, work: Work) -> Result<Vec<FrameReport>> {
    let mut frame = || {
        renderer.force(work);
        renderer.frame()
    };
    frame()?;
    (0..FRAMES).map(|_| frame()).collect()
}
