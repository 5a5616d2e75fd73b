//! Methods that add samples until a budget is spent.

use std::time::{Duration, Instant};

use super::Rendered;
use super::layers::{self, Aov, layer};
use crate::app::args::device_label;
use crate::error::Result;
use crate::reference::{FirstHits, Progressive};
use crate::renderer::Progress;

/// Default samples of a pixel, without `--spp` and `--seconds`.
const DEFAULT_SPP: u32 = 64;
/// Time between two checks of the clock, seconds.
const ROUND_S: f64 = 1.0;
/// Most samples of a round: more do not make it faster.
const ROUND_SAMPLES: f64 = 64.0;
/// Fewest samples of a round: two for each half, which the variance estimate needs.
const MIN_ROUND: u32 = 4;

/// Limits of the work; the first one reached ends it.
#[derive(Clone, Copy, Debug)]
pub(in crate::app) struct Budget {
    /// Samples of each pixel.
    pub(in crate::app) spp: Option<u32>,
    /// Wall-clock time, seconds.
    pub(in crate::app) seconds: Option<f32>,
}

/// Spends the budget and reads the picture.
pub(super) fn render(
    mut renderer: impl Progressive,
    method: &str,
    budget: Budget,
    aovs: &[Aov],
    progress: &mut dyn Progress,
) -> Result<Rendered> {
    // The variance needs a few samples, however long they take.
    let has_deadline = !aovs.contains(&Aov::Variance);
    let allowed = budget.seconds.filter(|_| has_deadline).and_then(|s| Duration::try_from_secs_f32(s).ok());
    renderer.set_deadline(allowed.and_then(|allowed| Instant::now().checked_add(allowed)));
    let seconds = spend(&mut renderer, budget, progress)?;
    let picture = renderer.picture()?;
    let hits =
        match aovs.iter().any(|aov| matches!(aov, Aov::Albedo | Aov::Normal | Aov::Position | Aov::Depth)) {
            true => renderer.traced_scene().first_hits()?,
            false => FirstHits::default(),
        };
    let mut layers = vec![layer(None, picture.beauty.clone())];
    for &aov in aovs.iter().filter(|aov| !aov.is_covered()) {
        let pixels = match aov {
            Aov::Direct => picture.direct.clone(),
            Aov::Indirect => picture.indirect.clone(),
            Aov::Albedo => hits.albedo.clone(),
            Aov::Normal => hits.normal.clone(),
            Aov::Depth => hits.depth.clone(),
            Aov::Position => {
                let scene = &renderer.traced_scene().scene;
                scene.layer_in_file(hits.position.clone(), &hits.normal)
            }
            Aov::Variance => renderer.variance()?,
            Aov::Alpha | Aov::Cryptomatte | Aov::Irradiance | Aov::Error | Aov::Lights | Aov::All => {
                unreachable!("refused, or made below")
            }
        };
        layers.push(layer(Some(aov), pixels));
    }
    let traced = renderer.traced_scene();
    let attributes = layers::add_covered(&mut layers, aovs, &traced.scene, || traced.coverage())?;
    let noise = renderer.noise()?;
    let stated = noise.map_or_else(String::new, |noise| format!("noise {noise:.1e} relMSE, "));
    let label = device_label(&renderer.traced_scene().context);
    Ok(Rendered {
        size: picture.size,
        warnings: Vec::new(),
        relit_ms: None,
        display: Vec::new(),
        layers,
        attributes,
        line: format!("{} samples a pixel in {seconds:.2} s, {stated}{label}", renderer.samples()),
        document: document(&renderer, method, seconds, noise)?,
    })
}

/// Adds samples until the budget is spent. Returns the wall-clock time, seconds.
pub(in crate::app) fn spend(
    renderer: &mut dyn Progressive,
    budget: Budget,
    progress: &mut dyn Progress,
) -> Result<f64> {
    let goal = match (budget.spp, budget.seconds) {
        (Some(spp), _) => spp,
        (None, None) => DEFAULT_SPP,
        (None, Some(_)) => u32::MAX,
    };
    let allowed = budget.seconds.map_or(f64::INFINITY, f64::from);
    progress.stage("samples", 1000);
    let start = Instant::now();
    let (mut elapsed, mut sample_s) = (0.0, 0.0);
    // A sample that would end too late starts if most of it fits.
    while renderer.samples() < goal && elapsed + 0.5 * sample_s < allowed {
        let fitting = ROUND_S.min(allowed - elapsed) / sample_s;
        let round = if sample_s > 0.0 { fitting.min(ROUND_SAMPLES) as u32 & !1 } else { MIN_ROUND };
        let round = round.clamp(MIN_ROUND, ROUND_SAMPLES as u32).min(goal - renderer.samples());
        renderer.add_samples(round)?;
        let now = start.elapsed().as_secs_f64();
        // Time of the last round: the first one contains pipeline compilation.
        (sample_s, elapsed) = ((now - elapsed) / f64::from(round), now);
        let done = (elapsed / allowed).max(f64::from(renderer.samples()) / f64::from(goal));
        progress.advance((1000.0 * done) as u64);
    }
    progress.finish();
    Ok(elapsed)
}

/// The JSON document of `--stats`.
fn document(
    renderer: &impl Progressive,
    method: &str,
    seconds: f64,
    noise: Option<f64>,
) -> Result<serde_json::Value> {
    let scene = renderer.traced_scene();
    let rays = renderer.rays()?;
    let device_ms = renderer.device_ms();
    Ok(serde_json::json!({
        "device": {"name": scene.context.name(), "driver": scene.context.driver()},
        "scene": scene.scene.name,
        "triangles": scene.scene.triangles.len(),
        "size": scene.size(),
        "method": method,
        "spp": renderer.samples(),
        "seconds": seconds,
        "device_ms": device_ms,
        "rays": rays,
        "mrays_per_s": rays.map(|rays| rays as f64 / device_ms.max(1e-9) / 1e3),
        "noise": noise,
        "memory_bytes": scene.context.memory().peak_bytes,
    }))
}
