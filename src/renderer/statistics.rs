//! Statistics of the precomputation: sizes and times.

use super::Statistics;
use crate::passes::precompute::cache_points::Placement;
use crate::passes::precompute::gather_rays::Hemisphere;
use crate::passes::precompute::path_orders::LightPaths;
use crate::scene::{Scene, Triangle, hvds::Hvds};
use crate::types::Surface;
use std::time::Instant;

/// Measures the time of each stage.
pub(super) struct Watch {
    pub(super) start: Instant,
    lap: Instant,
    pub(super) stages: Vec<(String, f64)>,
}

impl Watch {
    pub(super) fn start() -> Self {
        let now = Instant::now();
        Self { start: now, lap: now, stages: Vec::new() }
    }

    pub(super) fn lap(&mut self, stage: &str) {
        let now = Instant::now();
        self.stages.push((stage.into(), (now - self.lap).as_secs_f64()));
        self.lap = now;
    }
}

/// Adds the sizes of the results.
pub(super) fn note(
    statistics: &mut Statistics,
    scene: &Scene,
    surfaces: &[Surface],
    hvds: &Hvds,
    paths: &LightPaths,
    placement: &Placement,
    hemisphere: Hemisphere,
) {
    let active_area = |triangle: &Triangle, surface: &Surface| {
        let sides = [false, true].into_iter().filter(|&back| surface.side_is_active(back)).count();
        triangle.area_m2() * sides as f64
    };
    let active: f64 = scene.triangles.iter().zip(surfaces).map(|(t, s)| active_area(t, s)).sum();
    statistics
        .skipped
        .insert("unreachable surface sides (area)".into(), 1.0 - active / (2.0 * scene.area_m2()));
    let counts = [
        ("triangles", scene.triangles.len() as u64),
        ("entry points", paths.streams.len() as u64),
        ("path vertices", paths.steps.len() as u64),
        ("path vertices outside all clusters", paths.lost),
        ("clusters", u64::from(hvds.cluster_count())),
        ("base clusters", hvds.levels[0].len() as u64),
        ("cache points", placement.points.len() as u64),
        ("cache point candidates", placement.candidates),
        ("gather rays", placement.points.len() as u64 * u64::from(hemisphere.rays())),
    ];
    statistics.counts.extend(counts.map(|(name, value)| (name.to_owned(), value)));
}
