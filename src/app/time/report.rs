//! The tables of `time`, as text and as JSON.

use std::collections::BTreeMap;

use serde_json::{Map, Value, json};

use super::Timed;
use super::bandwidth::CopyRates;
use super::edit_tables;
use super::floors::Limits;
use super::measure::{PassSummary, STAGES, Summary};
use super::moved::Moved;
use super::paper::{self, COLUMNS, LIGHT_COUNTS};
use super::predict::AssumedRates;
use super::rates::Rates;
use super::text::{line, megabytes, milliseconds};
use crate::app::args::device_label;
use crate::gpu::{Context, TuningSource};

/// The lines above all tables.
pub(super) fn header(context: &Context, copies: &CopyRates) -> String {
    let rates = [
        ("copies ", copies.device),
        ("a kernel ", copies.kernel_texels),
        ("word by word ", copies.kernel_words),
    ];
    let rates = rates.iter().filter_map(|(what, gbps)| gbps.map(|gbps| format!(", {what}{gbps:.1} GB/s")));
    let (device, driver, tuned) = (device_label(context), context.driver(), context.tuned());
    format!("{device}, {driver}{}\ntuning: {tuned}\n", rates.collect::<String>())
}

/// The tables of one scene.
pub(super) fn table(timed: &Timed, copy_gbps: Option<f64>, predict: Option<&AssumedRates>) -> String {
    let Timed { name, triangles, size: [width, height], .. } = timed;
    let energy = timed.energy.say();
    let mut text = format!("\n{name}: {triangles} triangles, {width}x{height}, energy {energy}\n\n");
    columns(&mut text, timed);
    precompute(&mut text, timed);
    timed.moved.iter().for_each(|moved| moved.write(&mut text));
    timed.refined.iter().for_each(|refined| refined.write(&mut text));
    rays(&mut text, timed);
    passes(&mut text, timed, copy_gbps);
    counts(&mut text, timed);
    text += &edit_tables::costs(&timed.measurement.edits);
    if let Some(rates) = predict {
        text += &edit_tables::prediction(&timed.measurement.edits, rates);
    }
    text
}

fn columns(text: &mut String, timed: &Timed) {
    let mut row = |label: &str, cells: &mut dyn Iterator<Item = String>| {
        let cells: String = cells.map(|cell| format!("{cell:>9}")).collect();
        line(text, format_args!("{label:<16}{cells}"));
    };
    row("ms", &mut COLUMNS.iter().map(|&name| name.to_owned()));
    let ours = timed.measurement.columns;
    let paper = paper::row(&timed.name);
    if let Some(paper) = paper {
        row(&format!("paper's {}", paper.label), &mut paper.ms.iter().map(|ms| format!("{ms:.0}")));
    }
    let mut ours_by = |label: &str, pick: fn(&Summary) -> f64| {
        row(label, &mut ours.iter().map(|summary| milliseconds(pick(summary))));
    };
    ours_by("here, median", |summary| summary.median);
    ours_by("p10", |summary| summary.p10);
    ours_by("p90", |summary| summary.p90);
    ours_by("min", |summary| summary.min);
    let blank = std::iter::repeat_n(String::new(), STAGES);
    let wall = timed.measurement.wall.iter().map(|summary| milliseconds(summary.median));
    row("on the clock", &mut blank.clone().chain(wall));
    // Passes wait only for their data, as in `render`, `film` and the window.
    let free = timed.measurement.free.iter().map(|summary| milliseconds(summary.median));
    row("without waits", &mut blank.clone().chain(free));
    let free_wall = timed.measurement.free_wall.iter().map(|summary| milliseconds(summary.median));
    row("on the clock", &mut blank.chain(free_wall));
    if let Some(paper) = paper {
        let ratios = paper.ms.iter().zip(&ours).map(|(paper, ours)| ratio(*paper, ours.median));
        row("times faster", &mut ratios.map(|ratio| ratio.map_or("-".to_owned(), |r| format!("{r:.2}"))));
    }
}

fn precompute(text: &mut String, timed: &Timed) {
    let statistics = &timed.statistics;
    let stages = statistics.precompute_stages.iter().map(|(name, seconds)| format!("{name} {seconds:.2}"));
    let stages = stages.collect::<Vec<_>>().join(", ");
    let own = timed.lights;
    line(text, format_args!("\none of some lights moves (the scene has {own} of its own)"));
    let mut row = |label: &str, cells: &mut dyn Iterator<Item = String>| {
        let cells: String = cells.map(|cell| format!("{cell:>9}")).collect();
        line(text, format_args!("{label:<16}{cells}"));
    };
    row("lights", &mut timed.relit.keys().map(u32::to_string));
    row("fps", &mut timed.relit.values().map(|relit| format!("{:.1}", relit.fps)));
    row("device ms", &mut timed.relit.values().map(|relit| milliseconds(relit.device_ms.median)));
    row("its colour, ms", &mut timed.relit.values().map(|relit| milliseconds(relit.colour_ms.median)));
    let percent = |summary: &Summary, of: fn(&Summary) -> f64| format!("{:.1} %", 100.0 * of(summary));
    row("against first", &mut timed.relit.values().map(|relit| percent(&relit.ratio, |ratio| ratio.median)));
    row("p10", &mut timed.relit.values().map(|relit| percent(&relit.ratio, |ratio| ratio.p10)));
    row("p90", &mut timed.relit.values().map(|relit| percent(&relit.ratio, |ratio| ratio.p90)));
    row(
        "colour/move",
        &mut timed.relit.values().map(|relit| percent(&relit.colour_ratio, |ratio| ratio.median)),
    );
    row("unchanged", &mut timed.relit.values().map(|relit| format!("{:.1} %", 100.0 * relit.unchanged)));
    line(text, format_args!(""));
    line(text, format_args!("precompute {:.2} s ({stages})", statistics.precompute_s));
    line(
        text,
        format_args!(
            "device memory {:.1} MB, at most {:.1} MB, largest binding {:.1} MB\n",
            megabytes(statistics.memory_bytes),
            megabytes(statistics.peak_memory_bytes),
            megabytes(statistics.largest_binding_bytes),
        ),
    );
}

/// Ray rates in the scene.
fn rays(text: &mut String, timed: &Timed) {
    let head = ["camera", "reflected", "to light", "pairs"].map(|head| format!("{head:>11}")).concat();
    line(text, format_args!("{:<16}{head}", "Mrays/s"));
    let mut row = |label: &str, rates: &Rates| {
        let rates =
            [rates.closest_coherent, rates.closest_incoherent, rates.any_coherent, rates.any_incoherent];
        let cells = rates.map(|rate| rate.map_or("-".to_owned(), |rate| format!("{rate:.2}")));
        line(text, format_args!("{label:<16}{}", cells.map(|cell| format!("{cell:>11}")).concat()));
    };
    row("device", &timed.rays.device);
    if let Some(host) = &timed.rays.host {
        row("obvhs, same CPU", host);
    }
    line(text, format_args!(""));
}

fn passes(text: &mut String, timed: &Timed, copy_gbps: Option<f64>) {
    let limits = Limits { copy_gbps, rays: &timed.rays };
    let head = ["ms", "p10", "p90", "MB", "GB/s", "of copy", "Mrays/s", "floor ms", "of floor"];
    let head: String = head.iter().map(|head| format!("{head:>9}")).collect();
    line(text, format_args!("{:<16}{head}", "pass"));
    let or_dash = |value: Option<f64>, unit: &str| {
        value.map_or_else(|| format!("{:>9}", "-"), |value| format!("{:>9}", format!("{value:.1}{unit}")))
    };
    for pass in &timed.measurement.passes {
        line(
            text,
            format_args!(
                "{:<16}{:>9}{:>9}{:>9}{:>9.1}{}{}{}{:>9}{}{}",
                pass.name,
                milliseconds(pass.ms.median),
                milliseconds(pass.ms.p10),
                milliseconds(pass.ms.p90),
                megabytes(pass.bytes),
                or_dash(pass.gbps(), ""),
                or_dash(share_of_copy(pass, copy_gbps).map(|fraction| 100.0 * fraction), " %"),
                or_dash(pass.mrays_per_s(), ""),
                limits.floor_ms(pass).map_or("-".to_owned(), milliseconds),
                or_dash(limits.fraction(pass).map(|fraction| 100.0 * fraction), " %"),
                if pass.overlapped { "  overlapped" } else { "" },
            ),
        );
    }
    let [floors, known] = limits.sums_ms(&timed.measurement.passes);
    let fraction =
        ratio(100.0 * floors, known).map_or(String::new(), |fraction| format!(" ({fraction:.1} %)"));
    let of_which = format!(
        "sum of floors {} ms, of {} ms that these passes take{fraction}",
        milliseconds(floors),
        milliseconds(known)
    );
    line(text, format_args!("{of_which}"));
    let [device, wall] =
        [timed.measurement.columns[STAGES], timed.measurement.wall[0]].map(|whole| whole.median);
    line(text, format_args!("{:<16}{:>9}", "outside passes", milliseconds(wall - device)));
}

fn counts(text: &mut String, timed: &Timed) {
    for (what, fraction) in &timed.statistics.skipped {
        line(text, format_args!("skipped: {what} {:.1} %", 100.0 * fraction));
    }
    for (what, fraction) in &timed.statistics.removed {
        line(text, format_args!("removed by bounds: {what} {:.4} %", 100.0 * fraction));
    }
    let step = timed.measurement.step_records;
    line(text, format_args!("counted: records that a step of the camera needs besides {step:.0}"));
    for (what, count) in &timed.statistics.counts {
        line(text, format_args!("counted: {what} {count}"));
    }
}

/// The JSON document for scripts.
pub(super) fn json(
    context: &Context,
    copies: &CopyRates,
    scenes: &[Timed],
    predict: Option<&AssumedRates>,
) -> Value {
    let scenes = scenes.iter().map(|timed| scene_json(timed, copies.device, predict));
    json!({
        "device": {"name": context.name(), "driver": context.driver(), "cpu": context.is_cpu()},
        "tuning": tuning_json(context),
        "version": env!("CARGO_PKG_VERSION"),
        "debug_build": cfg!(debug_assertions),
        "copy_gbps": copies.device,
        "assumed_rates": predict,
        "kernel_copy_gbps": {"texels": copies.kernel_texels, "words": copies.kernel_words},
        "scenes": scenes.collect::<Vec<_>>(),
    })
}

fn tuning_json(context: &Context) -> Map<String, Value> {
    let values = context.tuned().values();
    let value = |value: u32, source: TuningSource| json!({"value": value, "from": source.name()});
    values.map(|(choice, number, source)| (choice.name.to_owned(), value(number, source))).collect()
}

fn scene_json(timed: &Timed, copy_gbps: Option<f64>, predict: Option<&AssumedRates>) -> Value {
    let named = || COLUMNS.iter().zip(&timed.measurement.columns);
    let ms: Map<String, Value> = named().map(|(name, s)| (name.to_string(), s.median.into())).collect();
    let spread_ms: BTreeMap<&str, &Summary> = named().map(|(name, summary)| (*name, summary)).collect();
    let of_edits = |summaries: &[Summary]| -> BTreeMap<&str, Summary> {
        COLUMNS[STAGES..].iter().copied().zip(summaries.iter().copied()).collect()
    };
    let wall_ms = of_edits(&timed.measurement.wall);
    let limits = Limits { copy_gbps, rays: &timed.rays };
    let [floors_ms, floored_ms] = limits.sums_ms(&timed.measurement.passes);
    let passes = timed.measurement.passes.iter().map(|pass| {
        json!({
            "name": pass.name, "ms": pass.ms.median, "spread_ms": pass.ms, "overlapped": pass.overlapped,
            "bytes": pass.bytes, "gbps": pass.gbps(), "share_of_copy": share_of_copy(pass, copy_gbps),
            "mrays_per_s": pass.mrays_per_s(), "floor_ms": limits.floor_ms(pass), "share_of_floor": limits.fraction(pass),
        })
    });
    // Light counts that were not timed stay in the document, as null.
    let mut fps_by_lights: Map<String, Value> =
        LIGHT_COUNTS.iter().map(|count| (count.to_string(), Value::Null)).collect();
    fps_by_lights.extend(timed.relit.iter().map(|(count, relit)| (count.to_string(), relit.fps.into())));
    let relit = timed.relit.iter().map(|(count, relit)| {
        let relit = json!({"ms": relit.device_ms, "colour_ms": relit.colour_ms, "unchanged": relit.unchanged,
                "ratio": relit.ratio, "colour_ratio": relit.colour_ratio});
        (count.to_string(), relit)
    });
    let statistics = &timed.statistics;
    json!({
        "name": timed.name,
        "triangles": timed.triangles,
        "size": timed.size,
        "precompute_s": statistics.precompute_s,
        "precompute_stages_s": statistics.precompute_stages,
        "memory_mb": megabytes(statistics.peak_memory_bytes),
        "largest_binding_mb": megabytes(statistics.largest_binding_bytes),
        "ms": ms,
        "spread_ms": spread_ms,
        "wall_ms": wall_ms,
        "free_ms": of_edits(&timed.measurement.free),
        "free_wall_ms": of_edits(&timed.measurement.free_wall),
        "settled": timed.measurement.settled,
        "step_records": timed.measurement.step_records,
        "fps_by_lights": fps_by_lights,
        "by_lights": relit.collect::<Map<String, Value>>(),
        "scene_lights": timed.lights,
        "moved": timed.moved.as_ref().map(Moved::json),
        "own_records": timed.refined,
        "energy": timed.energy,
        "mrays_per_s": timed.rays,
        "floors_ms": floors_ms,
        "floored_ms": floored_ms,
        "passes": passes.collect::<Vec<_>>(),
        "edits": edit_tables::json(&timed.measurement.edits, predict),
        "skipped": statistics.skipped,
        "removed": statistics.removed,
        "counts": statistics.counts,
    })
}

fn share_of_copy(pass: &PassSummary, copy_gbps: Option<f64>) -> Option<f64> {
    ratio(pass.gbps()?, copy_gbps?)
}

fn ratio(numerator: f64, denominator: f64) -> Option<f64> {
    (denominator > 0.0).then(|| numerator / denominator)
}
