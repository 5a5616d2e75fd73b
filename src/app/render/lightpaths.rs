//! Renders one frame with the method `lightpaths` or `direct`.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use super::layers::{self, Aov, layer};
use super::{ExactStage, Rendered};
use crate::app::args::{DeviceArgs, device_label};
use crate::app::capture;
use crate::error::Result;
use crate::gpu::Context;
use crate::renderer::{Exact, FrameReport, Layer, Renderer, Stage, Statistics, Store, Work};
use crate::scene::Scene;

/// Paths per stratum of a cache point's hemisphere if path tracing replaces a stage.
const EXACT_SAMPLES: u32 = 4;

/// Frames after a moved light. Their median is stated, so that the first, which compiles, has no
/// influence on it.
pub(super) const RELIT_FRAMES: usize = 5;

/// Options of the frame.
#[derive(Clone, Copy)]
pub(super) struct Job<'a> {
    /// Whether light paths are traced.
    pub(super) with_indirect: bool,
    pub(super) aovs: &'a [Aov],
    /// Stage that its exact reference replaces.
    pub(super) exact: Option<ExactStage>,
    /// Disables the culling of work that cannot change the picture.
    pub(super) no_skip: bool,
    /// Passes wait for each other, so that statistics and captures show them one by one.
    pub(super) times_passes: bool,
    /// File name template for a RenderDoc capture.
    pub(super) capture: Option<&'a Path>,
    /// Store of light paths.
    pub(super) store: Option<&'a Store>,
    /// Frames to time after the light has moved.
    pub(super) relit_frames: usize,
}

/// Precomputes and renders one frame.
pub(super) fn render(
    context: &Arc<Context>,
    mut scene: Scene,
    job: &Job<'_>,
    device_args: &DeviceArgs,
) -> Result<Rendered> {
    let Job { with_indirect, aovs, exact, no_skip, times_passes, capture, store, relit_frames } = *job;
    let capture = capture.map(capture::attach).transpose()?;
    if !with_indirect {
        // Direct light alone needs no light paths and no records.
        (scene.quality.entry_points, scene.quality.cache_points) = (0, 0);
    }
    let (mut renderer, warnings) = device_args.renderer_with_warnings(store, context, scene)?;
    renderer.set_skipping(!no_skip);
    renderer.set_serialised(times_passes);
    let frame = match capture {
        Some(capture) => {
            let (frame, file) = capture.frame(|| renderer.frame())?;
            device_args.say(&format!("captured to {}", file.display()));
            frame
        }
        None => renderer.frame()?,
    };
    let start = Instant::now();
    let own_records = renderer.refine()?;
    if own_records > 0 {
        renderer.frame()?;
    }
    let refined_s = start.elapsed().as_secs_f64();

    let find = |source: Layer| match exact.filter(|_| matches!(source, Layer::Beauty | Layer::Indirect)) {
        None => renderer.layer(source),
        Some(stage) => {
            let stage = match stage {
                ExactStage::Splat => Stage::Splat,
                ExactStage::Clusters => Stage::Clusters,
                ExactStage::Gather => Stage::Gather,
            };
            renderer.layer_with_exact(Exact { stage, samples: EXACT_SAMPLES, sequence: 0 }, source)
        }
    };
    let mut layers = vec![layer(None, find(Layer::Beauty)?)];
    for &aov in aovs.iter().filter(|aov| !matches!(aov, Aov::Error | Aov::Lights) && !aov.is_covered()) {
        let source = match aov {
            Aov::Direct => Layer::Direct,
            Aov::Indirect => Layer::Indirect,
            Aov::Irradiance => Layer::Irradiance,
            Aov::Albedo => Layer::Albedo,
            Aov::Position => Layer::Position,
            Aov::Normal => Layer::Normal,
            Aov::Depth => Layer::Depth,
            Aov::Alpha | Aov::Cryptomatte | Aov::Variance | Aov::Error | Aov::Lights | Aov::All => {
                unreachable!("refused, or made below")
            }
        };
        let pixels = match source {
            Layer::Position => renderer.positions_in_file()?,
            source => find(source)?,
        };
        layers.push(layer(Some(aov), pixels));
    }
    let attributes = layers::add_covered(&mut layers, aovs, renderer.scene(), || renderer.coverage())?;
    let statistics = renderer.statistics()?;
    let relit_ms = relit_ms(&mut renderer, relit_frames)?;
    let mut document = document(context, &renderer, &frame, &statistics);
    document["own_records"] = serde_json::json!({"count": own_records, "seconds": refined_s});
    let refined = match own_records {
        0 => String::new(),
        count => format!("{count} own records in {refined_s:.2} s, "),
    };
    if aovs.contains(&Aov::Lights) {
        layers.extend(layers::of_lights(&mut renderer)?);
    }
    Ok(Rendered {
        warnings,
        relit_ms,
        size: renderer.size(),
        display: Vec::new(),
        layers,
        attributes,
        line: format!(
            "precompute {:.2} s, frame {:.1} ms, {refined}{}",
            statistics.precompute_s,
            frame.frame_ms,
            device_label(context)
        ),
        document,
    })
}

/// Median time of a frame after the first light has moved, ms; of a whole frame if there is no
/// light. `None` without frames.
fn relit_ms(renderer: &mut Renderer, frames: usize) -> Result<Option<f64>> {
    renderer.set_serialised(false);
    let work = if renderer.scene().lights.is_empty() { Work::Everything } else { Work::Light(0) };
    let mut timed = Vec::with_capacity(frames);
    for _ in 0..frames {
        renderer.force(work);
        timed.push(renderer.frame()?.frame_ms);
    }
    timed.sort_by(f64::total_cmp);
    Ok(timed.get(frames / 2).copied())
}

/// The JSON document of `--stats`.
fn document(
    context: &Context,
    renderer: &Renderer,
    frame: &FrameReport,
    made: &Statistics,
) -> serde_json::Value {
    let passes = frame.passes.iter().map(|pass| {
        serde_json::json!({
            "name": pass.name, "ms": pass.ms, "overlapped": pass.overlapped,
            "bytes": frame.bytes.get(pass.name), "rays": frame.rays.get(pass.name),
        })
    });
    serde_json::json!({
        "device": {"name": context.name(), "driver": context.driver()},
        "scene": renderer.scene().name,
        "triangles": renderer.scene().triangles.len(),
        "size": renderer.size(),
        "quality": renderer.scene().quality,
        "renderer": made,
        "frame": {"ms": frame.frame_ms, "pipelines_ms": frame.pipelines_ms, "passes": passes.collect::<Vec<_>>()},
    })
}
