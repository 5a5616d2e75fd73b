//! Tests of the report and its data.

use super::format::{Shown, seconds};
use super::plots;
use super::report::html;
use super::results::{
    Baseline, ErrorFigures, FrameTimes, Machine, Occasion, ReferenceFacts, Results, SceneFacts, Setting,
    StageError, mark_pareto_front,
};
use super::settings::trials;
use crate::scene::Quality;

fn error(relmse: f64) -> ErrorFigures {
    ErrorFigures {
        relmse: relmse + 1e-3,
        relmse_debiased: relmse,
        relmse_standard_error: 1e-5,
        relmse_indirect: None,
        rmse: 0.1,
        smape: 0.1,
        flip: 0.0123,
        energy_ratio: 1.001,
    }
}

fn results() -> Results {
    let reference = ReferenceFacts {
        method: "path tracing",
        spp: 64,
        seconds: 3.0,
        noise_relmse: 1e-3,
        from_cache: true,
    };
    let setting = |(index, trial): (usize, super::settings::Trial)| Setting {
        series: trial.series,
        factor: trial.factor,
        quality: trial.quality,
        precompute_s: 1.0 + index as f64,
        first_frame_ms: 300.0,
        relit_frame_ms: 10.0 + index as f64,
        ms: FrameTimes { Tdi: 1.0, Ttot: 200.0, Tlight: 9.0, Tview: 50.0 },
        memory_mb: 100.0,
        error: error(0.1 / (1.0 + index as f64)),
        is_on_pareto_front: false,
    };
    let mut settings: Vec<Setting> = trials(&Quality::DRAFT).into_iter().enumerate().map(setting).collect();
    // Slower and worse than the first setting.
    settings[3].error = error(0.2);
    mark_pareto_front(&mut settings);
    let baseline = |at, error: Option<ErrorFigures>, seconds: f64| Baseline {
        method: "path tracing",
        at,
        spp: 1234,
        seconds,
        times_ours: seconds,
        is_extrapolated: error.is_none(),
        error,
    };
    Results {
        version: "1.2.3",
        debug_build: false,
        machine: Machine {
            device: "a device".into(),
            driver: "a driver".into(),
            cpu: "a CPU".into(),
            cores: 2,
        },
        commands: vec!["lightpaths sweep 'a & b' -o out".into()],
        scene: SceneFacts {
            name: "<script>box</script>".into(),
            triangles: 12,
            lights: 1,
            size: [4, 4],
            preset: "draft",
        },
        reference,
        settings,
        baselines: vec![
            baseline(Occasion::RelitFrameTime, Some(error(0.5)), 0.01),
            baseline(Occasion::FirstPictureTime, Some(error(0.05)), 1.3),
            baseline(Occasion::Error, None, 9876.0),
        ],
        stages: vec![StageError { name: "splat".into(), relmse: 2e-3, noise_relmse: 1e-6, share: 0.25 }],
    }
}

fn page() -> String {
    let shown = ["Direct only", "Light paths"].map(|title| Shown {
        title: title.into(),
        lines: vec!["1 s".into(), "relMSE 1e-3".into()],
        png: b"\x89PNG".to_vec(),
        heatmap: Some(b"\x89PNG".to_vec()),
    });
    html(&results(), &shown)
}

#[test]
fn the_page_holds_every_section_and_needs_nothing_else() {
    let page = page();
    for id in
        ["pictures", "heatmaps", "plots", "front", "baselines", "stages", "settings", "method", "commands"]
    {
        assert!(page.contains(&format!("<h2 id=\"{id}\">")), "{id}");
    }
    for word in [
        "a device",
        "a driver",
        "a CPU",
        "64 samples",
        "1.0e-3",
        "'a &amp; b'",
        "splat",
        "25.0 %",
        "≥ 1\u{a0}234",
    ] {
        assert!(page.contains(word), "{word}");
    }
    assert!(page.contains("2.74\u{a0}h"), "long times are told in hours");
    for outside in ["http:", "https:", "<script", "<link", "@import", "url("] {
        assert!(!page.contains(outside), "{outside}");
    }
    assert!(page.contains("src=\"data:image/png;base64,iVBORw==\""));
}

#[test]
fn tags_are_closed_in_order_and_images_say_what_they_show() {
    let page = page();
    let mut open: Vec<&str> = Vec::new();
    for tag in page.split('<').skip(1) {
        let (tag, _) = tag.split_once('>').expect("every tag ends");
        let name = tag.split([' ', '/']).find(|part| !part.is_empty()).unwrap();
        let is_void = ["!DOCTYPE", "meta", "img", "br"].contains(&name) || tag.ends_with('/');
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "in <{tag}>");
        } else if !is_void {
            open.push(name);
        }
        assert!(name != "img" || tag.contains("alt=\""), "{tag}");
        assert!(tag.starts_with('/') || name != "svg" || tag.contains("aria-label=\""), "{tag}");
    }
    assert_eq!(open, Vec::<&str>::new());
    assert_eq!(page.matches("<img").count(), 4);
    assert_eq!(page.matches("<svg").count(), 3);
}

#[test]
fn only_settings_that_none_beats_are_on_the_front() {
    let settings = results().settings;
    let front: Vec<bool> = settings.iter().map(|setting| setting.is_on_pareto_front).collect();
    assert!(!front[3] && front.iter().filter(|on| !**on).count() == 1, "{front:?}");
}

#[test]
fn what_the_noise_hides_is_not_told() {
    assert_eq!(error(0.5).told(), 0.5);
    assert!((error(-1e-5).told() - 3e-5).abs() < 1e-15);
}

#[test]
fn plots_show_each_method_and_every_setting() {
    let results = results();
    let plots = plots::all(&results);
    let labels: Vec<&str> = plots[0].1.series.iter().map(|series| series.label.as_str()).collect();
    assert_eq!(labels.last(), Some(&"path tracing"));
    let points =
        |plot: &crate::app::plot::Plot| plot.series.iter().map(|series| series.points.len()).sum::<usize>();
    // The baseline without a picture is a hollow point at our error.
    assert_eq!(points(&plots[0].1), results.settings.len() + 3);
    assert_eq!(plots[0].1.series[2].points.iter().filter(|point| point.is_hollow).count(), 1);
    assert_eq!(plots[2].1.series.len(), 4);
}

#[test]
fn times_have_the_unit_that_suits_them() {
    let told = [2e-5, 0.0123, 1.5, 90.0, 600.0, 7200.0].map(|time| seconds(time).replace('\u{a0}', " "));
    assert_eq!(told, ["0.02 ms", "12.3 ms", "1.50 s", "90.0 s", "10.0 min", "2.00 h"]);
}
