//! The report: one self-contained page for phones and desktops, with light and dark backgrounds.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;

use super::format::{Shown, figure, seconds, significant};
use super::results::{Baseline, Results, Setting};
use super::settings::{self, FRONT_SERIES, PRESET};
use super::{heatmap, plots};
use crate::app::plot::escape;

/// The whole page.
pub(super) fn html(results: &Results, shown: &[Shown]) -> String {
    let name = escape(&results.scene.name);
    let sections = [
        header(results),
        pictures(shown),
        plot_section(results),
        front_table(results),
        baseline_table(results),
        stage_table(results),
        settings_table(results),
        method(results),
        commands(results),
    ];
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>Error against time: {name}</title>\n<style>\n{}</style>\n</head>\n<body>\n{}</body>\n</html>\n",
        include_str!("report.css"),
        sections.concat(),
    )
}

fn header(results: &Results) -> String {
    let Results { scene, machine, reference, .. } = results;
    let ours = &results.settings[0];
    let [width, height] = scene.size;
    let facts = [
        ("scene", format!("{}: {} triangles, lights: {}", scene.name, scene.triangles, scene.lights)),
        ("size", format!("{width}×{height} pixels")),
        ("settings", settings::arguments(&ours.quality)),
        ("device", format!("{}, {}", machine.device, machine.driver)),
        ("processor", format!("{}, {} logical cores", machine.cpu, machine.cores)),
        (
            "reference",
            format!(
                "{} with {} samples a pixel, {}{}; its own noise is {} relMSE",
                reference.method,
                reference.spp,
                seconds(reference.seconds),
                if reference.from_cache { " (from the cache)" } else { "" },
                figure(reference.noise_relmse),
            ),
        ),
        (
            "version",
            format!(
                "{}{}",
                results.version,
                if results.debug_build { ", a debug build: times mean little" } else { "" }
            ),
        ),
    ];
    let rows: String =
        facts.iter().map(|(label, value)| format!("<dt>{label}</dt><dd>{}</dd>\n", escape(value))).collect();
    format!(
        "<h1>Error against time: {}</h1>\n<p>At these settings a frame after a light moved takes <b>{}</b> and is off by <b>{}</b> \
         relMSE; the first picture stands after <b>{}</b>, precomputation included.</p>\n<dl>\n{rows}</dl>\n",
        escape(&scene.name),
        seconds(ours.relit_s()),
        figure(ours.error.relmse_debiased),
        seconds(ours.first_picture_s()),
    )
}

/// Pictures with captions and heat maps.
pub(super) fn pictures(shown: &[Shown]) -> String {
    let image = |png: &[u8], alt: &str| {
        format!("<img alt=\"{}\" src=\"data:image/png;base64,{}\">", escape(alt), STANDARD.encode(png))
    };
    let figures: String = shown
        .iter()
        .map(|shown| {
            let lines = shown.lines.iter().map(|line| escape(line)).collect::<Vec<_>>().join("<br>");
            let (title, picture) = (escape(&shown.title), image(&shown.png, &shown.title));
            format!("<figure>{picture}<figcaption><b>{title}</b>{lines}</figcaption></figure>\n")
        })
        .collect();
    let maps: String = shown
        .iter()
        .filter_map(|shown| shown.heatmap.as_ref().map(|map| (&shown.title, map)))
        .map(|(title, map)| {
            let map = image(map, &format!("FLIP error of {title}"));
            format!("<figure>{map}<figcaption><b>{}</b></figcaption></figure>\n", escape(title))
        })
        .collect();
    format!(
        "<h2 id=\"pictures\">Pictures</h2>\n<div class=\"pictures\">\n{figures}</div>\n\
         <h2 id=\"heatmaps\">Where they differ from the reference</h2>\n<p class=\"soft\">{}.</p>\n\
         <div class=\"pictures\">\n{maps}</div>\n",
        escape(heatmap::FLIP_SCALE),
    )
}

fn plot_section(results: &Results) -> String {
    let figures: String = plots::all(results)
        .into_iter()
        .map(|(_, plot)| {
            format!("<figure>{}<figcaption>{}</figcaption></figure>\n", plot.svg(""), escape(&plot.title))
        })
        .collect();
    format!(
        "<h2 id=\"plots\">Error against time</h2>\n<p>Both axes are logarithmic; down and to the left is better. A ring marks the \
         settings that no other beats in both time and error (the Pareto front). Hollow marks are extrapolated.</p>\n\
         <div class=\"plots\">\n{figures}</div>\n"
    )
}

const SETTING_HEAD: [&str; 15] = [
    "setting",
    "relMSE",
    "FLIP",
    "energy",
    "relit frame",
    "precompute",
    "first frame",
    "entry points",
    "cells",
    "cache points",
    "gather rays",
    "memory",
    "Ttot",
    "Tlight",
    "Tview",
];

fn setting_row(setting: &Setting) -> Vec<String> {
    let Setting { quality, error, ms, .. } = setting;
    let name = match setting.series {
        PRESET => format!("preset {}", quality.preset),
        FRONT_SERIES => "together".to_owned(),
        series => format!("{series} × {}", setting.factor),
    };
    let mark = if setting.is_on_pareto_front { " ◯" } else { "" };
    vec![
        name + mark,
        figure(error.relmse_debiased),
        format!("{:.4}", error.flip),
        percent(error.energy_ratio),
        seconds(setting.relit_s()),
        seconds(setting.precompute_s),
        seconds(1e-3 * setting.first_frame_ms),
        thousands(quality.entry_points),
        quality.cells.to_string(),
        thousands(quality.cache_points),
        quality.gather_rays.to_string(),
        format!("{:.0} MB", setting.memory_mb),
        seconds(1e-3 * ms.Ttot),
        seconds(1e-3 * ms.Tlight),
        seconds(1e-3 * ms.Tview),
    ]
}

fn front_table(results: &Results) -> String {
    let mut front: Vec<&Setting> = results.settings.iter().filter(|s| s.is_on_pareto_front).collect();
    front.sort_by(|a, b| a.relit_frame_ms.total_cmp(&b.relit_frame_ms));
    format!(
        "<h2 id=\"front\">The Pareto front</h2>\n<p>Settings that no other beats in both error and the time of a relit frame.</p>\n{}",
        table("Pareto front", 1, &SETTING_HEAD, front.into_iter().map(setting_row)),
    )
}

fn settings_table(results: &Results) -> String {
    format!(
        "<h2 id=\"settings\">All settings</h2>\n<p>◯ marks the Pareto front. Precompute, first and relit frame are wall-clock times; \
         Ttot (everything new), Tlight (a light moved) and Tview (the camera moved) are device times.</p>\n{}",
        table("All settings", 1, &SETTING_HEAD, results.settings.iter().map(setting_row)),
    )
}

fn baseline_table(results: &Results) -> String {
    let ours = &results.settings[0];
    let dash = || "–".to_owned();
    let row = |baseline: &Baseline| {
        let about = if baseline.is_extrapolated { "≥ " } else { "" };
        let error = baseline.error.as_ref();
        vec![
            baseline.method.to_owned(),
            baseline.at.label().to_owned(),
            format!("{about}{}", thousands(baseline.spp)),
            format!("{about}{}", seconds(baseline.seconds)),
            format!("{about}{}×", significant(baseline.times_ours)),
            error.map_or_else(dash, |error| figure(error.relmse_debiased)),
            error.map_or_else(dash, |error| format!("{:.1}×", error.relmse_debiased / ours.error.told())),
            error.map_or_else(dash, |error| format!("{:.4}", error.flip)),
            error.map_or_else(dash, |error| percent(error.energy_ratio)),
        ]
    };
    let own = |at: &str, time: f64| {
        let error = &ours.error;
        let figures = [
            figure(error.relmse_debiased),
            "1×".to_owned(),
            format!("{:.4}", error.flip),
            percent(error.energy_ratio),
        ];
        let mut row = vec!["light paths".to_owned(), at.to_owned(), dash(), seconds(time), "1×".to_owned()];
        row.extend(figures);
        row
    };
    let own =
        [own("one relit frame", ours.relit_s()), own("precompute and first frame", ours.first_picture_s())];
    let head = [
        "method",
        "compared at",
        "samples a pixel",
        "time",
        "of our time",
        "relMSE",
        "of our relMSE",
        "FLIP",
        "energy",
    ];
    format!(
        "<h2 id=\"baselines\">At equal time and at equal error</h2>\n<p>The path tracer and photon mapping take the same scene, \
         acceleration structure and device. Their times are those of sampling alone; at least one sample of each pixel is taken. At equal error \
         their time is set against a relit frame. ≥ marks what would have taken too long \
         and is extrapolated: as if the error went on to fall with 1/samples, which photon mapping, having a bias, does not quite reach.</p>\n{}",
        table("Baselines", 2, &head, own.into_iter().chain(results.baselines.iter().map(row))),
    )
}

fn stage_table(results: &Results) -> String {
    let row = |stage: &super::results::StageError| {
        let share = format!("{:.1} %", 100.0 * stage.share);
        vec![escape(&stage.name), figure(stage.relmse), figure(stage.noise_relmse), share]
    };
    format!(
        "<h2 id=\"stages\">Which stage errs</h2>\n<p>The preset's picture with one stage replaced by its exact reference: the error that \
         is left, the reference's own noise (from two independent halves; already taken off), and the share of the whole error that has \
         gone. A share below zero: the stage's error made up for another's. Shares need not add up.</p>\n{}",
        table(
            "Stages",
            1,
            &["exact", "relMSE", "reference's noise", "share"],
            results.stages.iter().map(row)
        )
    )
}

fn method(results: &Results) -> String {
    let noise = figure(results.reference.noise_relmse);
    format!(
        "<h2 id=\"method\">How it was measured</h2>\n<p>relMSE is the mean over pixels and channels of (v−r)²/(r+0.01)². The reference \
         comes in two independent halves a and b; its noise, {noise}, is the mean of ((a−b)/2)²/(r+0.01)². The relMSE shown is \
         the mean of (v−a)(v−b)/(s+0.01)², from which that noise cancels; s is our picture at the preset, which has none: with r the noise \
         stays in the denominator and hides what is below a quarter of it. A figure far below the noise can be \
         negative; plots show none below three times its own standard error. FLIP is LDR-FLIP at 67 pixels a degree of the tone-mapped pictures, the reference's noise \
         included. Energy is the ratio of the pictures' sums.</p>\n"
    )
}

fn commands(results: &Results) -> String {
    let lines: Vec<String> = results.commands.iter().map(|command| escape(command)).collect();
    format!("<h2 id=\"commands\">Commands</h2>\n<pre>{}</pre>\n", lines.join("\n"))
}

/// A table that scrolls in its own box; the first `text_columns` columns hold text.
fn table(label: &str, text_columns: usize, head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let class = |column: usize| if column < text_columns { " class=\"text\"" } else { "" };
    let head = head.iter().enumerate();
    let head: String = head.map(|(i, cell)| format!("<th scope=\"col\"{}>{cell}</th>", class(i))).collect();
    let row = |cells: Vec<String>| {
        let cells = cells.iter().enumerate();
        let cells: String = cells.map(|(i, cell)| format!("<td{}>{cell}</td>", class(i))).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let body: String = rows.map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{label}\">\n<table>\n<thead><tr>{head}</tr></thead>\n\
         <tbody>\n{body}</tbody>\n</table>\n</div>\n"
    )
}

/// Formats 400000 as "400 000", with blanks that do not break.
fn thousands(value: u32) -> String {
    let digits = value.to_string();
    let groups: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    groups.join("\u{a0}")
}

fn percent(energy_ratio: f64) -> String {
    format!("{:+.2} %", 100.0 * (energy_ratio - 1.0))
}
