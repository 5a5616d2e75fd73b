//! The plots of a report.

use super::format::{figure, seconds};
use super::results::{Baseline, Occasion, Results, Setting};
use super::settings::{FRONT_SERIES, PRESET, QUANTITIES};
use crate::app::plot::{Plot, Point, Series};

/// File stems of the plots.
pub(super) const STEMS: [&str; 3] = ["error-frame", "error-first", "error-setting"];

/// File stem and plot of each.
pub(super) fn all(results: &Results) -> [(&'static str, Plot); 3] {
    let [frame, first, setting] = STEMS;
    [
        (frame, against_time(results, "time of a relit frame (s)", Setting::relit_s, true)),
        (first, against_time(results, "precomputation and first frame (s)", Setting::first_picture_s, false)),
        (setting, against_factor(results)),
    ]
}

fn against_time(results: &Results, x_label: &str, time: fn(&Setting) -> f64, ringed: bool) -> Plot {
    let point = |setting: &Setting| Point {
        x: time(setting),
        y: setting.error.told(),
        is_ringed: ringed && setting.is_on_pareto_front,
        is_hollow: false,
        says: says(setting, time(setting)),
    };
    let of =
        |kept: &dyn Fn(&Setting) -> bool| results.settings.iter().filter(|s| kept(s)).map(point).collect();
    let mut series = vec![
        Series {
            label: "light paths, settings that grow together".into(),
            points: of(&|s| [PRESET, FRONT_SERIES].contains(&s.series)),
            is_joined: true,
        },
        Series {
            label: "light paths, one setting varied".into(),
            points: of(&|s| QUANTITIES.contains(&s.series)),
            is_joined: false,
        },
    ];
    let mut methods: Vec<&str> = results.baselines.iter().map(|baseline| baseline.method).collect();
    methods.dedup();
    series.extend(methods.into_iter().map(|method| {
        let baselines = results.baselines.iter().filter(|baseline| baseline.method == method);
        let points = baselines.filter_map(|baseline| baseline_point(results, baseline)).collect();
        Series { label: method.into(), points, is_joined: true }
    }));
    Plot {
        title: format!("relMSE against {}", x_label.replace(" (s)", "")),
        x_label: x_label.into(),
        y_label: "relMSE".into(),
        series,
        level: Some((results.reference.noise_relmse, "noise of the reference".into())),
    }
}

fn baseline_point(results: &Results, baseline: &Baseline) -> Option<Point> {
    let x = baseline.seconds;
    let y = match (&baseline.error, baseline.at) {
        (Some(error), _) => error.told(),
        (None, Occasion::Error) => results.settings[0].error.told(),
        _ => return None,
    };
    let says = format!("{}, {}: {}, relMSE {}", baseline.method, baseline.at.label(), seconds(x), figure(y));
    Some(Point { x, y, is_ringed: false, is_hollow: baseline.is_extrapolated, says })
}

fn against_factor(results: &Results) -> Plot {
    let point = |setting: &Setting| Point {
        x: setting.factor,
        y: setting.error.told(),
        is_ringed: false,
        is_hollow: false,
        says: says(setting, setting.relit_s()),
    };
    let series = QUANTITIES.map(|quantity| Series {
        label: quantity.into(),
        points: results
            .settings
            .iter()
            .filter(|setting| [PRESET, quantity].contains(&setting.series))
            .map(point)
            .collect(),
        is_joined: true,
    });
    Plot {
        title: "relMSE as one setting is varied around the preset".into(),
        x_label: "setting, relative to the preset".into(),
        y_label: "relMSE".into(),
        series: series.into(),
        level: Some((results.reference.noise_relmse, "noise of the reference".into())),
    }
}

fn says(setting: &Setting, time: f64) -> String {
    let q = &setting.quality;
    format!(
        "{} entry points, {} cells, {} cache points, {} gather rays: {}, relMSE {}",
        q.entry_points,
        q.cells,
        q.cache_points,
        q.gather_rays,
        seconds(time),
        figure(setting.error.relmse_debiased)
    )
}
