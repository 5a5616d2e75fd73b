//! Growth of time and memory: a table, scaling exponents, plots.

use std::fmt::Write;

use super::trials::{Quantity, Trial};
use super::{Results, TooLarge};
use crate::app::plot::{Plot, Point, Series};

/// A measured quantity of a trial.
struct Measure {
    /// File stem of its plot.
    stem: &'static str,
    head: &'static str,
    of: fn(&Trial) -> f64,
}

const MEASURES: [Measure; 6] = [
    Measure { stem: "precompute", head: "precompute s", of: |trial| trial.precompute_s },
    Measure { stem: "first-frame", head: "first frame ms", of: |trial| trial.first_frame_ms },
    Measure { stem: "light-moved", head: "light moved ms", of: |trial| trial.relit_frame_ms },
    Measure { stem: "without-shadows", head: "less shadows ms", of: |trial| trial.relit_without_shadows_ms },
    Measure { stem: "camera-moved", head: "camera moved ms", of: |trial| trial.view_frame_ms },
    Measure { stem: "memory", head: "memory MB", of: |trial| trial.memory_mb },
];

/// Trials of one quantity.
fn of(trials: &[Trial], quantity: Quantity) -> Vec<&Trial> {
    trials.iter().filter(|trial| trial.quantity == quantity.name()).collect()
}

/// The table, followed by the scaling exponents.
pub(super) fn text(results: &Results) -> String {
    let Results { scene, size: [width, height], preset, device, trials, refused, .. } = results;
    let mut text =
        format!("{scene}, {width}x{height}, preset {preset}, {device}\n\n{:<14}{:>11}", "", "size");
    MEASURES.iter().for_each(|measure| put(&mut text, format_args!("{:>17}", measure.head)));
    text.push('\n');
    for quantity in Quantity::ALL {
        let found = of(trials, quantity);
        for trial in &found {
            put(&mut text, format_args!("{:<14}{:>11}", quantity.name(), quantity.value_in(&trial.sizes)));
            for measure in &MEASURES {
                put(&mut text, format_args!("{:>17}", three((measure.of)(trial))));
            }
            text.push('\n');
        }
        if let Some(powers) = MEASURES.iter().map(|measure| power(&found, quantity, measure.of)).collect() {
            let powers: Vec<f64> = powers;
            put(&mut text, format_args!("{:<14}{:>11}", "  grow like", "n to the"));
            powers.iter().for_each(|power| put(&mut text, format_args!("{power:>17.2}")));
            text.push('\n');
        }
    }
    for TooLarge { quantity, size, why } in refused {
        put(&mut text, format_args!("{quantity} {size}: {why}\n"));
    }
    text
}

/// Scaling exponent of a measure, by least squares of the logarithms. `None` for fewer
/// than two sizes.
fn power(trials: &[&Trial], quantity: Quantity, measure: fn(&Trial) -> f64) -> Option<f64> {
    let places: Vec<[f64; 2]> = trials
        .iter()
        .map(|trial| [f64::from(quantity.value_in(&trial.sizes)).ln(), measure(trial).ln()])
        .collect();
    let count = places.len() as f64;
    let mean = |axis: usize| places.iter().map(|place| place[axis]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let spread: f64 = places.iter().map(|place| (place[0] - x).powi(2)).sum();
    let slope = places.iter().map(|place| (place[0] - x) * (place[1] - y)).sum::<f64>() / spread;
    slope.is_finite().then_some(slope)
}

/// Whether a plot has that file name.
pub(super) fn is_plot(name: &str) -> bool {
    MEASURES.iter().any(|measure| name.strip_suffix(".svg") == Some(measure.stem))
}

/// File stem and plot of each measure: the quantities relative to their smallest size.
pub(super) fn plots(trials: &[Trial]) -> [(&'static str, Plot); MEASURES.len()] {
    std::array::from_fn(|index| {
        let Measure { stem, head, of: measure } = MEASURES[index];
        let series = Quantity::ALL.map(|quantity| {
            let found = of(trials, quantity);
            let least = found.iter().map(|trial| quantity.value_in(&trial.sizes)).min().unwrap_or(1);
            let point = |trial: &&Trial| {
                let (size, y) = (quantity.value_in(&trial.sizes), measure(trial));
                Point {
                    x: f64::from(size) / f64::from(least),
                    y,
                    is_ringed: false,
                    is_hollow: false,
                    says: format!("{size} {}: {} ({head})", quantity.name(), three(y)),
                }
            };
            let label = format!("{}, from {least}", quantity.name());
            Series { label, points: found.iter().map(point).collect(), is_joined: true }
        });
        let plot = Plot {
            title: format!("{head} against sizes"),
            x_label: "size, relative to the smallest".into(),
            y_label: head.into(),
            series: series.into_iter().filter(|series| !series.points.is_empty()).collect(),
            level: None,
        };
        (stem, plot)
    })
}

fn three(value: f64) -> String {
    let decimals = (2 - value.abs().max(0.001).log10().floor() as i32).clamp(0, 3) as usize;
    format!("{value:.decimals$}")
}

fn put(text: &mut String, arguments: std::fmt::Arguments) {
    text.write_fmt(arguments).expect("writing to a string cannot fail");
}

#[cfg(test)]
mod tests {
    use super::super::trials::Sizes;
    use super::*;

    fn trial(entry_points: u32) -> Trial {
        let cost = f64::from(entry_points);
        Trial {
            quantity: "entry points",
            sizes: Sizes { triangles: 9, entry_points, cache_points: 8, lights: 1 },
            precompute_s: 3e-5 * cost,
            first_frame_ms: cost.sqrt(),
            relit_frame_ms: 7.0,
            relit_without_shadows_ms: 5.0,
            view_frame_ms: 6.0,
            memory_mb: 2.0 * cost,
            largest_binding_mb: cost,
        }
    }

    fn results(sizes: &[u32]) -> Results {
        Results {
            version: "1",
            debug_build: false,
            scene: "room".to_owned(),
            preset: "draft",
            size: [4, 3],
            device: "some".to_owned(),
            driver: "some".to_owned(),
            trials: sizes.iter().copied().map(trial).collect(),
            refused: vec![TooLarge { quantity: "lights", size: 256, why: "no room".to_owned() }],
        }
    }

    #[test]
    fn powers_are_found_and_told() {
        let results = results(&[1_000, 10_000, 100_000]);
        let found: Vec<&Trial> = results.trials.iter().collect();
        let powers = MEASURES.map(|measure| power(&found, Quantity::EntryPoints, measure.of).unwrap());
        for (power, expected) in powers.into_iter().zip([1.0, 0.5, 0.0, 0.0, 0.0, 1.0]) {
            assert!((power - expected).abs() < 1e-9, "{powers:?}");
        }
        let text = text(&results);
        assert!(text.contains("grow like") && text.ends_with("lights 256: no room\n"), "{text}");
    }

    #[test]
    fn one_size_has_no_power_and_still_a_plot() {
        let results = results(&[1_000]);
        assert!(!text(&results).contains("grow like"));
        for (stem, plot) in plots(&results.trials) {
            assert!(plot.series.len() == 1 && !plot.file().contains("NaN"), "{stem}");
        }
    }

    #[test]
    fn figures_have_three_digits() {
        assert_eq!([0.0123, 1.234, 45.67, 1234.5].map(three), ["0.012", "1.23", "45.7", "1234"]);
    }
}
