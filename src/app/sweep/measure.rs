//! Cost and error of one setting of our method.

use std::sync::Arc;
use std::time::Instant;

use super::reference::Reference;
use super::results::{ErrorFigures, FrameTimes, Setting};
use super::settings::Trial;
use crate::app::args::DeviceArgs;
use crate::app::picture::refuse_non_finite;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::renderer::{FrameReport, Layer, Renderer, Work};
use crate::scene::Scene;

/// Frames timed after a light moved, for a median. No further frame starts after the time limit, in
/// seconds: long frames vary little.
const LIGHT_FRAMES: usize = 3;
const LIGHT_S: f64 = 1.0;
/// Frames timed after a camera movement, and from scratch: they vary little and cost more.
const OTHER_FRAMES: usize = 1;

/// A picture with its error figures.
pub(super) struct Judged {
    pub(super) pixels: Vec<[f32; 3]>,
    pub(super) error: ErrorFigures,
    /// FLIP error of each pixel.
    pub(super) flip: Vec<f64>,
}

/// The result of one setting.
pub(super) struct Measured {
    pub(super) setting: Setting,
    pub(super) picture: Judged,
    /// The renderer, with all results up to date.
    pub(super) renderer: Renderer,
}

/// Precomputes, renders and times one setting.
pub(super) fn measure(
    trial: Trial,
    scene: &Scene,
    reference: &Reference,
    context: &Arc<Context>,
    device_args: &DeviceArgs,
) -> Result<Measured> {
    let Trial { series, factor, quality } = trial;
    context.reset_memory_peak();
    let scene = Scene { quality: quality.clone(), ..scene.clone() };
    let (start, compiled) = (Instant::now(), context.compile_time());
    let mut renderer = Renderer::new(context, scene, device_args.progress().as_mut())?;
    // The first trial compiles the pipelines of all trials.
    let compiling = context.compile_time() - compiled;
    let precompute_s = start.elapsed().saturating_sub(compiling).as_secs_f64();
    let first_frame_ms = renderer.frame()?.frame_ms;

    let frames = |renderer: &mut Renderer, work, count: usize| {
        let start = Instant::now();
        let mut timed = Vec::new();
        while timed.is_empty() || timed.len() < count && start.elapsed().as_secs_f64() < LIGHT_S {
            renderer.force(work);
            timed.push(renderer.frame()?);
        }
        Ok::<_, Error>(timed)
    };
    let [whole, view] = [
        frames(&mut renderer, Work::Everything, OTHER_FRAMES)?,
        frames(&mut renderer, Work::View, OTHER_FRAMES)?,
    ];
    // A view that changes has no own records.
    let start = Instant::now();
    if renderer.refine()? > 0 {
        renderer.frame()?;
    }
    let first_frame_ms = first_frame_ms + 1e3 * start.elapsed().as_secs_f64();
    let light = frames(&mut renderer, Work::Light(0), LIGHT_FRAMES)?;
    let picture = judge(renderer.layer(Layer::Beauty)?, Some(&renderer.layer(Layer::Indirect)?), reference)?;
    let memory_mb = renderer.statistics()?.peak_memory_bytes as f64 / 1e6;
    device_args.report_validation(context);
    let device = |frames: &[FrameReport]| {
        median(frames.iter().map(|frame| frame.passes.iter().map(|pass| pass.ms).sum::<f64>()))
    };
    let setting = Setting {
        series,
        factor,
        quality,
        precompute_s,
        first_frame_ms,
        relit_frame_ms: median(light.iter().map(|frame| frame.frame_ms)),
        ms: FrameTimes {
            Tdi: median(whole.iter().map(|frame| frame.columns.Tdi)),
            Ttot: device(&whole),
            Tlight: device(&light),
            Tview: device(&view),
        },
        memory_mb,
        error: picture.error,
        is_on_pareto_front: false,
    };
    Ok(Measured { setting, picture, renderer })
}

/// Compares a picture with the reference.
pub(super) fn judge(
    pixels: Vec<[f32; 3]>,
    indirect: Option<&[[f32; 3]]>,
    reference: &Reference,
) -> Result<Judged> {
    refuse_non_finite(reference.size(), &pixels)?;
    let (error, flip) = reference.judge().judge(&pixels, indirect);
    Ok(Judged { pixels, error, flip })
}

/// Median of at least one value; of an even count, the mean of the middle two.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians() {
        assert_eq!(median([3.0, 1.0, 2.0].into_iter()), 2.0);
        assert_eq!(median([4.0, 1.0].into_iter()), 2.5);
        assert_eq!(median([7.0].into_iter()), 7.0);
    }
}
