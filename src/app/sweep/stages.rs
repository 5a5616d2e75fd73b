//! Error of each stage: the preset's picture with one exact stage at a time.

use super::reference::Reference;
use super::results::StageError;
use crate::app::args::DeviceArgs;
use crate::error::Result;
use crate::gpu::Context;
use crate::metrics;
use crate::renderer::{Exact, Layer, Renderer, Stage};

/// Stages and the table's names of their references.
const STAGES: [(&str, Stage); 3] = [
    ("exact radiance at the gather hits", Stage::Clusters),
    ("exact gather at the cache points", Stage::Gather),
    ("gather at every pixel", Stage::Splat),
];

/// Factor of the edge samples in the last row, and the scene file's limit.
const EDGE_SAMPLES: u32 = 4;
const EDGE_SAMPLES_MAX: u32 = 256;

/// The whole error, then the remaining error with each stage exact. Changes the
/// renderer's edge samples.
pub(super) fn measure(
    context: &Context,
    renderer: &mut Renderer,
    reference: &Reference,
    device_args: &DeviceArgs,
) -> Result<Vec<StageError>> {
    let mut whole = f64::NAN;
    let mut row = |name: &str, halves: [Vec<[f32; 3]>; 2]| {
        let noise_relmse = metrics::half_noise([&halves[0], &halves[1]]);
        let relmse = relmse(&halves, reference) - noise_relmse;
        if whole.is_nan() {
            whole = relmse;
        }
        let share = if whole > 0.0 { 1.0 - relmse / whole } else { 0.0 };
        device_args.say(&format!("{name}: relMSE {relmse:.2e}"));
        StageError { name: name.to_owned(), relmse, noise_relmse, share }
    };

    device_args.say("which stage errs");
    let beauty = renderer.layer(Layer::Beauty)?;
    let mut rows = vec![row("the whole", [beauty.clone(), beauty])];
    for (name, stage) in STAGES {
        let half = |sequence| renderer.layer_with_exact(Exact { stage, samples: 1, sequence }, Layer::Beauty);
        let first = half(0)?;
        let second = if stage == Stage::Splat { first.clone() } else { half(1)? };
        rows.push(row(name, [first, second]));
    }
    renderer
        .set_edge_samples((EDGE_SAMPLES * renderer.scene().quality.edge_samples).min(EDGE_SAMPLES_MAX))?;
    renderer.frame()?;
    if renderer.refine()? > 0 {
        renderer.frame()?;
    }
    let beauty = renderer.layer(Layer::Beauty)?;
    rows.push(row("four times the edge samples", [beauty.clone(), beauty]));
    device_args.report_validation(context);
    Ok(rows)
}

/// relMSE of the mean of two halves, without the reference's noise.
fn relmse([a, b]: &[Vec<[f32; 3]>; 2], reference: &Reference) -> f64 {
    let mean = a.iter().zip(b).map(|(a, b)| std::array::from_fn(|c| 0.5 * (a[c] + b[c])));
    reference.judge().debiased_relmse(&mean.collect::<Vec<_>>()).mean
}
