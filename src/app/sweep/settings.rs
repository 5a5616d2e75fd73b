//! The settings of a sweep, relative to a preset. To tune the front, edit [`FRONT`].

use crate::scene::Quality;

/// Factors of each quantity that is varied alone.
const ALONE: [f64; 3] = [0.25, 0.5, 2.0];

/// Factors of cells, which must be powers of two.
const CELLS_ALONE: [f64; 3] = [0.25, 0.5, 2.0];

/// A setting on the front.
struct Step {
    /// Factors of entry points, cells, cache points and gather rays.
    factors: [f64; 4],
    /// Extra gather iterations, if the preset has fewer.
    gap_rounds: u32,
    /// Samples of edge pixels, if the preset has fewer.
    edge_samples: u32,
}

impl Step {
    const fn new(factors: [f64; 4], gap_rounds: u32, edge_samples: u32) -> Self {
        Self { factors, gap_rounds, edge_samples }
    }

    fn of(&self, preset: &Quality) -> Quality {
        Quality {
            gap_rounds: preset.gap_rounds.max(self.gap_rounds),
            edge_samples: preset.edge_samples.max(self.edge_samples),
            ..scaled(preset, self.factors)
        }
    }
}

/// The front from coarse to fine, with the preset as one step. With finer paths and cells, the
/// remaining error is light in narrow cavities and shadows, and finally edges.
const FRONT: [Step; 4] = [
    Step::new([1.0 / 16.0, 0.5, 0.25, 0.25], 0, 0),
    Step::new([1.0 / 4.0, 0.5, 0.5, 0.5], 0, 0),
    Step::new([2.0, 1.0, 1.5, 1.5], 2, 0),
    Step::new([4.0, 2.0, 3.0, 3.0], 4, 64),
];

/// Series of the preset itself.
pub(super) const PRESET: &str = "preset";
/// Series of the settings on the front.
pub(super) const FRONT_SERIES: &str = "front";
/// Names of the quantities, in the order of [`FRONT`].
pub(super) const QUANTITIES: [&str; 4] = ["entry points", "cells", "cache points", "gather rays"];

/// A setting to measure.
#[derive(Debug)]
pub(super) struct Trial {
    pub(super) series: &'static str,
    pub(super) factor: f64,
    pub(super) quality: Quality,
}

/// The preset, then each quantity alone, then the front. Equal settings are measured once.
pub(super) fn trials(preset: &Quality) -> Vec<Trial> {
    let mut trials = vec![Trial { series: PRESET, factor: 1.0, quality: preset.clone() }];
    let mut add = |series, factor, quality: Quality| {
        if trials.iter().all(|trial| trial.quality != quality) {
            trials.push(Trial { series, factor, quality });
        }
    };
    for (index, series) in QUANTITIES.into_iter().enumerate() {
        for factor in if series == "cells" { CELLS_ALONE } else { ALONE } {
            let mut factors = [1.0; 4];
            factors[index] = factor;
            add(series, factor, scaled(preset, factors));
        }
    }
    for step in FRONT {
        add(FRONT_SERIES, step.factors[0], step.of(preset));
    }
    trials
}

/// The preset and the settings on the front, from coarse to fine, and one between each two.
pub(in crate::app) fn coarse_to_fine(preset: &Quality) -> Vec<Quality> {
    let mut front: Vec<Quality> = FRONT.iter().map(|step| step.of(preset)).collect();
    let finer = FRONT.iter().position(|step| step.factors[0] > 1.0).unwrap_or(FRONT.len());
    front.insert(finer, preset.clone());
    let between = front.windows(2).map(|pair| between(&pair[0], &pair[1]));
    let mut steps: Vec<Quality> = front.iter().cloned().zip(between).flat_map(<[_; 2]>::from).collect();
    steps.extend(front.pop());
    steps.dedup();
    steps
}

/// The geometric mean of two settings, with the cells of the finer one: these remove more error in
/// the public atrium (1.6 to 1.2·10⁻²) and in a curtain's folds (1.1·10⁻² to 8·10⁻³).
fn between(coarse: &Quality, fine: &Quality) -> Quality {
    let mean = |a: u32, b: u32| (f64::from(a) * f64::from(b)).sqrt().round() as u32;
    let rings = (f64::from(mean(coarse.gather_rays, fine.gather_rays)) / 4.0).sqrt().round() as u32;
    Quality {
        entry_points: mean(coarse.entry_points, fine.entry_points),
        cache_points: mean(coarse.cache_points, fine.cache_points),
        gather_rays: 4 * rings * rings,
        gap_rounds: coarse.gap_rounds.midpoint(fine.gap_rounds),
        edge_samples: mean(coarse.edge_samples, fine.edge_samples),
        ..fine.clone()
    }
}

/// The preset with entry points, cells, cache points and gather rays multiplied, each clamped
/// to its range.
fn scaled(preset: &Quality, [entry_points, cells, cache_points, gather_rays]: [f64; 4]) -> Quality {
    let scale = |value: u32, factor: f64, least: u32, most: u32| {
        ((f64::from(value) * factor).round() as u32).clamp(least, most)
    };
    let rings = (f64::from(preset.gather_rays) * gather_rays / 4.0).sqrt().round().clamp(1.0, 128.0) as u32;
    Quality {
        entry_points: scale(preset.entry_points, entry_points, 1, 1 << 24),
        cells: scale(preset.cells, cells, 8, 256).next_power_of_two(),
        cache_points: scale(preset.cache_points, cache_points, 1, 1_000_000),
        gather_rays: 4 * rings * rings,
        ..preset.clone()
    }
}

/// The arguments that change the preset to `quality`.
pub(in crate::app) fn arguments(quality: &Quality) -> String {
    let preset = Quality::preset(quality.preset).unwrap_or_default();
    let pairs = [
        ("entry_points", quality.entry_points, preset.entry_points),
        ("cells", quality.cells, preset.cells),
        ("cache_points", quality.cache_points, preset.cache_points),
        ("gather_rays", quality.gather_rays, preset.gather_rays),
        ("gap_rounds", quality.gap_rounds, preset.gap_rounds),
        ("edge_samples", quality.edge_samples, preset.edge_samples),
        ("seed", quality.seed, preset.seed),
    ];
    let changed = pairs.into_iter().filter(|(_, value, preset)| value != preset);
    let sets: String = changed.map(|(key, value, _)| format!(" --set quality.{key}={value}")).collect();
    format!("--preset {}{sets}", quality.preset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_setting_is_allowed_and_none_is_tried_twice() {
        for name in Quality::PRESETS {
            let preset = Quality::preset(name).unwrap();
            let trials = trials(&preset);
            assert_eq!((trials[0].series, &trials[0].quality), (PRESET, &preset));
            for (index, Trial { quality, series, .. }) in trials.iter().enumerate() {
                let rings = (quality.gather_rays / 4).isqrt();
                assert_eq!(quality.gather_rays, 4 * rings * rings);
                assert!(quality.cells.is_power_of_two() && (8..=256).contains(&quality.cells));
                assert!(trials[..index].iter().all(|trial| trial.quality != *quality), "{series}");
            }
            for series in QUANTITIES {
                assert!(
                    trials.iter().filter(|trial| trial.series == series).count() >= 2,
                    "{name}: {series}"
                );
            }
        }
    }

    #[test]
    fn one_quantity_is_varied_at_a_time() {
        let preset = Quality::PAPER;
        for trial in trials(&preset) {
            let (q, p) = (&trial.quality, &preset);
            let changed = [
                q.entry_points != p.entry_points,
                q.cells != p.cells,
                q.cache_points != p.cache_points,
                q.gather_rays != p.gather_rays,
            ];
            if let Some(index) = QUANTITIES.iter().position(|series| *series == trial.series) {
                assert!((0..4).all(|other| changed[other] == (other == index)), "{trial:?}");
            }
        }
    }

    #[test]
    fn the_front_grows_in_everything_and_ends_where_gaps_and_edges_are_resolved() {
        for name in Quality::PRESETS {
            let preset = Quality::preset(name).unwrap();
            let front = coarse_to_fine(&preset);
            assert_eq!((front.len(), &front[4]), (9, &preset));
            let numbers = |q: &Quality| {
                [q.entry_points, q.cells, q.cache_points, q.gather_rays, q.gap_rounds, q.edge_samples]
            };
            for pair in front.windows(2) {
                assert!(numbers(&pair[0]).iter().zip(numbers(&pair[1])).all(|(a, b)| *a <= b), "{pair:?}");
            }
            assert_eq!((front[8].gap_rounds, front[8].edge_samples), (4, 64));
            assert!(arguments(&front[8]).contains(" --set quality.gap_rounds=4"));
        }
        let end = arguments(&FRONT[3].of(&Quality::PAPER));
        assert!(end.ends_with(" --set quality.edge_samples=64"), "{end}");
    }

    #[test]
    fn no_setting_is_repeated() {
        let least = Quality { entry_points: 1, cells: 8, cache_points: 1, gather_rays: 4, ..Quality::DRAFT };
        let steps = coarse_to_fine(&least);
        assert!(steps.windows(2).all(|pair| pair[0] != pair[1]) && steps[0] == least, "{steps:?}");
    }

    #[test]
    fn arguments_name_what_differs_from_the_preset() {
        let quality = Quality { entry_points: 7, ..Quality::DRAFT };
        assert_eq!(arguments(&quality), "--preset draft --set quality.entry_points=7");
        assert_eq!(arguments(&Quality::HIGH), "--preset high");
    }
}
