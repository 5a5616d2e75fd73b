//! The paper's three tables for all scenes, with the paper's numbers and the ratios.

use std::fmt::Write;

use super::Timed;
use super::measure::STAGES;
use super::paper::{self, COLUMNS, LIGHT_COUNTS, PaperRow};

/// Tables 1, 2 and 3.
pub(super) fn tables(scenes: &[Timed]) -> String {
    [table_1(scenes), table_2(scenes), table_3(scenes)].concat()
}

fn table_1(scenes: &[Timed]) -> String {
    let mut text = "\nTable 1: scenes\n".to_owned();
    let head = ["triangles", "image size", "precompute s", "frames/s", "memory MB"];
    row(&mut text, "", head.map(str::to_owned));
    for timed in scenes {
        let facts = facts(timed);
        let size = |[width, height]: [u32; 2]| format!("{width}x{height}");
        let cells = |triangles: u32, dimensions, facts: [f64; 3]| {
            let [precompute, fps, memory] = facts.map(number);
            [triangles.to_string(), size(dimensions), precompute, fps, memory]
        };
        row(&mut text, &timed.name, cells(timed.triangles as u32, timed.size, facts));
        if let Some(paper) = paper::row(&timed.name) {
            let theirs = [60.0 * paper.precompute_minutes, paper.fps, paper.memory_mb];
            row(&mut text, &label(paper), cells(paper.triangles, paper.size, theirs));
            let ratios = std::array::from_fn::<_, 3, _>(|i| ratio(facts[i], theirs[i]));
            let [precompute, fps, memory] = ratios;
            row(&mut text, RATIO, [String::new(), String::new(), precompute, fps, memory]);
        }
    }
    text
}

/// Seconds of precomputation, frames per second with everything stale, 10⁶ bytes of device memory.
fn facts(timed: &Timed) -> [f64; 3] {
    let statistics = &timed.statistics;
    let frame_ms = timed.measurement.wall[0].median;
    [statistics.precompute_s, 1000.0 / frame_ms, statistics.peak_memory_bytes as f64 / 1e6]
}

fn table_2(scenes: &[Timed]) -> String {
    let mut text = "\nTable 2: milliseconds of device time, medians\n".to_owned();
    row(&mut text, "", COLUMNS.map(str::to_owned));
    for timed in scenes {
        let ours = timed.measurement.columns.map(|summary| summary.median);
        row(&mut text, &timed.name, ours.map(number));
        if let Some(paper) = paper::row(&timed.name) {
            row(&mut text, &label(paper), paper.ms.map(number));
            row(&mut text, RATIO, std::array::from_fn::<_, 9, _>(|i| ratio(ours[i], paper.ms[i])));
        }
    }
    debug_assert_eq!(COLUMNS.len(), STAGES + 4);
    text
}

fn table_3(scenes: &[Timed]) -> String {
    let mut text = "\nTable 3: frames a second by the number of lights, one of which moves\n".to_owned();
    let mut counts: Vec<u32> = scenes.iter().flat_map(|timed| timed.relit.keys().copied()).collect();
    counts.extend(LIGHT_COUNTS);
    counts.sort_unstable();
    counts.dedup();
    let head = counts.iter().map(|&count| format!("{count} {}", if count == 1 { "light" } else { "lights" }));
    row(&mut text, "", head.chain(["1 to 8".to_owned()]));
    for timed in scenes {
        let ours = |count: u32| timed.relit.get(&count).map(|relit| relit.fps);
        row(&mut text, &timed.name, cells(&counts, ours));
        if let Some(paper) = paper::row(&timed.name) {
            let theirs = |count: u32| {
                let index = LIGHT_COUNTS.iter().position(|known| *known == count)?;
                Some(paper.fps_by_lights[index])
            };
            row(&mut text, &label(paper), cells(&counts, theirs));
            let ratios = counts.iter().map(|&count| match (ours(count), theirs(count)) {
                (Some(ours), Some(theirs)) => ratio(ours, theirs),
                _ => "-".to_owned(),
            });
            row(&mut text, RATIO, ratios);
        }
    }
    text
}

/// Frames per second by number of lights, and their change from one light to eight.
fn cells(counts: &[u32], fps: impl Fn(u32) -> Option<f64>) -> Vec<String> {
    let change = fps(1).zip(fps(8)).map(|(one, eight)| format!("{:+.0} %", 100.0 * (eight / one - 1.0)));
    let or_dash = |cell: Option<String>| cell.unwrap_or_else(|| "-".to_owned());
    let cells = counts.iter().map(|&count| or_dash(fps(count).map(number)));
    cells.chain([or_dash(change)]).collect()
}

/// Label of the rows with the ratio of ours to the paper's.
const RATIO: &str = "  here / paper";

fn label(paper: &PaperRow) -> String {
    format!("  paper's {}", paper.label)
}

fn row(text: &mut String, label: &str, cells: impl IntoIterator<Item = String>) {
    let cells: String = cells.into_iter().map(|cell| format!("{cell:>13}")).collect();
    writeln!(text, "{label:<16}{}", cells.trim_end()).expect("writing to a string cannot fail");
}

/// Three or four significant digits.
fn number(value: f64) -> String {
    let decimals = match value.abs() {
        0.0..10.0 => 2,
        10.0..100.0 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

fn ratio(ours: f64, theirs: f64) -> String {
    let ratio = ours / theirs;
    if ratio < 0.1 { format!("{ratio:.4}") } else { number(ratio) }
}
