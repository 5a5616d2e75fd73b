//! Tables of what frames cost without a clock, and of predicted times.

use serde_json::{Map, Value, json};

use super::edit_costs::{EditCost, PassCost, is_closest};
use super::predict::AssumedRates;
use super::text::{line, megabytes, milliseconds};

/// The table of counts, a column for each edit.
pub(super) fn costs(edits: &[EditCost]) -> String {
    let mut text = String::new();
    head(&mut text, "counted", edits);
    let mut row = |label: &str, count: &dyn Fn(&EditCost) -> u64| {
        cells(&mut text, label, edits.iter().map(|edit| count(edit).to_string()));
    };
    row("submissions", &|edit| edit.commands.submissions);
    row("dispatches", &|edit| edit.commands.dispatches);
    row("barriers", &|edit| edit.commands.barriers);
    row("  without waits", &|edit| edit.free_barriers);
    row("bytes read back", &|edit| edit.commands.read_back_bytes);
    row("camera rays", &|edit| edit.rays()[0]);
    row("shadow rays", &|edit| edit.rays()[1]);
    for pass in names(edits, |pass| pass.rays > 0 && !is_closest(pass.name)) {
        row(&format!("  {pass}"), &|edit| {
            edit.passes.iter().find(|cost| cost.name == pass).map_or(0, |cost| cost.rays)
        });
    }
    row("edge pixels", &|edit| edit.counts.edge_pixels);
    row("fragments", &|edit| edit.counts.fragments);
    row("edge points", &|edit| edit.counts.edge_points);
    row("mixed fragments", &|edit| edit.counts.mixed_fragments);
    row("shadow edges", &|edit| edit.counts.shadow_edges);
    row("spared rays", &|edit| edit.counts.spared_rays);
    row("records weighed", &|edit| edit.counts.weighed_records);
    row("splat weights", &|edit| edit.counts.splat_weights);
    row("gathered", &|edit| edit.gathered.into());
    cells(&mut text, "MB", edits.iter().map(|edit| format!("{:.1}", megabytes(edit.bytes()))));
    text
}

/// The table of predicted times, a column for each edit.
pub(super) fn prediction(edits: &[EditCost], rates: &AssumedRates) -> String {
    let AssumedRates { gbps, grays, us } = rates;
    let mut text =
        format!("\npredicted at {gbps} GB/s, {grays} Grays/s, {us} us for each dispatch with its barrier\n");
    head(&mut text, "ms", edits);
    for pass in names(edits, |_| true) {
        let times = edits.iter().map(|edit| {
            let cost = edit.passes.iter().find(|cost| cost.name == pass);
            cost.map_or("-".to_owned(), |cost| milliseconds(rates.pass_ms(cost)))
        });
        cells(&mut text, pass, times);
    }
    cells(&mut text, "sum", edits.iter().map(|edit| milliseconds(rates.edit_ms(edit))));
    cells(&mut text, "without waits", edits.iter().map(|edit| milliseconds(rates.free_ms(edit))));
    text
}

/// The counts of each edit, by its name. With predicted times if there are rates.
pub(super) fn json(edits: &[EditCost], rates: Option<&AssumedRates>) -> Map<String, Value> {
    edits.iter().map(|edit| (edit.name.to_owned(), edit_json(edit, rates))).collect()
}

fn edit_json(edit: &EditCost, rates: Option<&AssumedRates>) -> Value {
    let [camera, shadow] = edit.rays();
    let passes = edit.passes.iter().map(|pass| {
        let PassCost { name, dispatches, barriers, bytes, rays } = pass;
        json!({
            "name": name, "dispatches": dispatches, "barriers": barriers, "bytes": bytes, "rays": rays,
            "predicted_ms": rates.map(|rates| rates.pass_ms(pass)),
        })
    });
    json!({
        "submissions": edit.commands.submissions,
        "dispatches": edit.commands.dispatches,
        "barriers": edit.commands.barriers,
        "free_barriers": edit.free_barriers,
        "read_back_bytes": edit.commands.read_back_bytes,
        "rays": {"camera": camera, "shadow": shadow},
        "bytes": edit.bytes(),
        "gathered": edit.gathered,
        "counts": edit.counts,
        "predicted_ms": rates.map(|rates| rates.edit_ms(edit)),
        "predicted_free_ms": rates.map(|rates| rates.free_ms(edit)),
        "passes": passes.collect::<Vec<_>>(),
    })
}

/// Names of the passes of all edits that satisfy `is_listed`, in the order in which they begin in
/// the first edit that has them.
fn names(edits: &[EditCost], is_listed: impl Fn(&PassCost) -> bool) -> Vec<&'static str> {
    let mut names = Vec::new();
    for pass in edits.iter().flat_map(|edit| &edit.passes).filter(|pass| is_listed(pass)) {
        if !names.contains(&pass.name) {
            names.push(pass.name);
        }
    }
    names
}

fn head(text: &mut String, label: &str, edits: &[EditCost]) {
    line(text, format_args!(""));
    cells(text, label, edits.iter().map(|edit| edit.name.to_owned()));
}

fn cells(text: &mut String, label: &str, cells: impl Iterator<Item = String>) {
    let cells: String = cells.map(|cell| format!("{cell:>11}")).collect();
    line(text, format_args!("{label:<16}{cells}"));
}
