//! One frame of the renderer: the method lightpaths, and direct light alone.

use std::sync::Arc;

use super::{Aov, Rendered, layer};
use crate::app::args::{DeviceArgs, device_label};
use crate::error::Result;
use crate::gpu::Context;
use crate::renderer::{Edit, FrameReport, Layer, Renderer, Statistics};
use crate::scene::Scene;

/// Precomputes and renders one frame; `with_indirect` says whether light paths are traced.
pub(super) fn render(
    context: &Arc<Context>,
    mut scene: Scene,
    with_indirect: bool,
    aovs: &[Aov],
    exposure_stops: f32,
    device_args: &DeviceArgs,
) -> Result<Rendered> {
    if !with_indirect {
        // Without paths and records there is nothing to precompute, and no indirect light.
        (scene.quality.entry_points, scene.quality.cache_points) = (0, 0);
    }
    let mut renderer = Renderer::new(context, scene, device_args.progress().as_mut())?;
    renderer.set_exposure(exposure_stops);
    let frame = renderer.frame(Edit::Everything)?;

    let mut layers = vec![layer(None, renderer.layer(Layer::Beauty)?)];
    for &aov in aovs {
        let source = match aov {
            Aov::Direct => Layer::Direct,
            Aov::Indirect => Layer::Indirect,
            Aov::Albedo => Layer::Albedo,
            Aov::Normal => Layer::Normal,
            Aov::Depth => Layer::Depth,
            Aov::Variance => unreachable!("refused before anything is rendered"),
        };
        layers.push(layer(Some(aov), renderer.layer(source)?));
    }
    let statistics = renderer.statistics()?;
    Ok(Rendered {
        size: renderer.size(),
        display: renderer.display()?,
        layers,
        line: format!(
            "precompute {:.2} s, frame {:.1} ms, {}",
            statistics.precompute_s,
            frame.frame_ms,
            device_label(context)
        ),
        document: document(context, &renderer, &frame, &statistics),
    })
}

/// What `--stats` writes.
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
        "frame": {"ms": frame.frame_ms, "passes": passes.collect::<Vec<_>>()},
    })
}
