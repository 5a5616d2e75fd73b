//! Time from a move of a model to the picture, and what of the light paths is kept.

use std::collections::BTreeMap;
use std::sync::Arc;

use serde_json::{Value, json};

use super::measure::Summary;
use super::text::{line, milliseconds};
use crate::error::Result;
use crate::gpu::Context;
use crate::renderer::{Kept, Renderer, Silent};
use crate::scene::Scene;

/// Distance of the move, in longest sides of the model.
const STEP: f32 = 0.05;
/// Timed moves, after one that is not.
const MOVES: usize = 4;

/// Results of the move of a scene's first model that can move.
pub(super) struct Moved {
    /// Distance of the move, metres.
    distance_m: f32,
    /// From the loaded scene to its picture, milliseconds: the first time, and after a move.
    first_ms: f64,
    ms: Summary,
    /// Seconds of each stage of the precomputation: the first time, and after the last move.
    stages_s: Vec<(String, [f64; 2])>,
    /// Numbers of kept results after the last move, and of all.
    kept: BTreeMap<String, [u64; 2]>,
}

/// Moves a model to and fro. `None` if none can move. `scene`: as loaded.
pub(super) fn measure(context: &Arc<Context>, scene: &Scene) -> Result<Option<Moved>> {
    let models = scene.model_is_movable.iter().zip(&scene.model_boxes).zip(&scene.model_objects);
    let mut movable =
        models.filter_map(|((is_movable, bounds), objects)| Some((bounds.filter(|_| *is_movable)?, objects)));
    let Some(([low, high], objects)) = movable.next() else { return Ok(None) };
    let (from, to) = scene.bounds();
    // Towards the middle, so that it stays within the bounds.
    let side = (0.5 * (from + to) - 0.5 * (low + high)).x.signum();
    let distance_m = STEP * (high - low).max_element();
    let mut aside = scene.clone();
    for triangle in aside.triangles.iter_mut().filter(|triangle| objects.contains(&triangle.object)) {
        triangle.positions.iter_mut().for_each(|corner| corner.x += side * distance_m);
    }
    let mut kept = Kept::default();
    let mut times = Vec::new();
    let mut stages: Vec<Vec<(String, f64)>> = Vec::new();
    let mut kept_results = BTreeMap::new();
    for round in 0..MOVES + 2 {
        let scene = if round % 2 == 0 { scene } else { &aside };
        let mut renderer = Renderer::new_keeping(context, scene.clone(), &mut kept, &mut Silent)?;
        let frame = renderer.frame()?;
        let statistics = renderer.statistics()?;
        times.push(1e3 * statistics.precompute_s + frame.frame_ms);
        stages.push(statistics.precompute_stages);
        kept_results = statistics.kept;
    }
    let [first, .., last] = &stages[..] else { return Ok(None) };
    let pairs = first.iter().zip(last).map(|((name, first), (_, last))| (name.clone(), [*first, *last]));
    Ok(Some(Moved {
        distance_m,
        first_ms: times[0],
        ms: Summary::from_times(times[2..].iter().copied()),
        stages_s: pairs.collect(),
        kept: kept_results,
    }))
}

impl Moved {
    /// Adds the table.
    pub(super) fn write(&self, text: &mut String) {
        let Self { distance_m, first_ms, ms, .. } = self;
        line(text, format_args!("\na model moves by {:.0} mm", 1e3 * distance_m));
        let [moved, p10, p90, first] = [ms.median, ms.p10, ms.p90, *first_ms].map(milliseconds);
        line(
            text,
            format_args!(
                "Tmove {moved} ms (p10 {p10}, p90 {p90}), {:.1} % of {first} at first",
                100.0 * ms.median / first_ms
            ),
        );
        let stages =
            self.stages_s.iter().map(|(name, [first, moved])| format!("{name} {first:.2} → {moved:.2}"));
        line(text, format_args!("in s: {}", stages.collect::<Vec<_>>().join(", ")));
        let kept = self.kept.iter().map(|(kind, [kept, all])| format!("{kind} {kept} of {all}"));
        line(text, format_args!("kept: {}", kept.collect::<Vec<_>>().join(", ")));
    }

    /// The same for the JSON document.
    pub(super) fn json(&self) -> Value {
        let stages = self
            .stages_s
            .iter()
            .map(|(name, [first, moved])| json!({"name": name, "first": first, "moved": moved}));
        json!({"distance_m": self.distance_m, "first_ms": self.first_ms, "Tmove": self.ms, "stages_s": stages.collect::<Vec<_>>(), "kept": self.kept})
    }
}
