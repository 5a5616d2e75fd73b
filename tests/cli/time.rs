//! The paper's tables and figures, as scripts use them.

use std::sync::LazyLock;

use super::{json, run, stderr, stdout};

/// Output of `time` for the Box, and its document, with enough light paths for the right energy.
struct Timed {
    stdout: String,
    stderr: String,
    document: serde_json::Value,
}

static TIMED: LazyLock<Timed> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let small = "time box --frames 2 --lights 1,8,3,2,4 --predict gbps=2,us=50 --json t.json --size 32x32 --set quality.entry_points=10000 \
                 --set quality.gather_rays=64 --set quality.cache_points=5000";
    let output = run(&folder, &small.split_whitespace().collect::<Vec<_>>());
    assert!(output.status.success(), "{}", stderr(&output));
    Timed { stdout: stdout(&output), stderr: stderr(&output), document: json(&folder, "t.json") }
});

#[test]
fn the_tables_stand_beside_the_papers() {
    let text = TIMED.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    let tables = &text[text.find("Table 1: scenes").unwrap()..];
    for words in [
        "paper's Box 2914 512x512 1920 9.20 165",
        "paper's Box 6.00 11.0 11.0 5.00 76.0 109 109 87.0 1271",
        "1 light 2 lights 3 lights 4 lights 8 lights 1 to 8",
        "paper's Box 9.10 8.60 - 8.20 7.20 -21 %",
    ] {
        assert!(tables.contains(words), "{words} in {tables}");
    }
    assert_eq!(tables.matches("here / paper").count(), 3);
    let document = &TIMED.document;
    floors_follow_from_what_was_measured(document);
    assert!(
        text.contains("Mrays/s camera reflected to light pairs device") && text.contains("sum of floors")
    );
    let energy = &document["scenes"][0]["energy"];
    assert!((energy["ratio"].as_f64().unwrap() - 1.0).abs() < 0.02 && energy["spp"].as_u64().unwrap() > 4);
    assert!(energy["noise"].as_f64().unwrap() <= 0.002, "{energy}");
}

#[test]
fn own_records_are_timed_apart() {
    let own = &TIMED.document["scenes"][0]["own_records"];
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or_else(|| panic!("{own}"));
    assert!(number(&own["count"]) > 0.0 && number(&own["seconds"]) > 0.0);
    assert!(["without_ms", "with_ms"].iter().all(|key| number(&own[key]["median"]) > 0.0));
    let line = format!("own records: {}, once a view, in ", own["count"]);
    assert!(TIMED.stdout.contains(&line) && TIMED.stdout.contains("Tlight with them "), "{line}");
}

/// A pass takes at least the time of its bytes at the copy rate, and of its rays at their rate.
fn floors_follow_from_what_was_measured(document: &serde_json::Value) {
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or_else(|| panic!("{value} is no number"));
    let (copy_gbps, scene) = (number(&document["copy_gbps"]), &document["scenes"][0]);
    let rates = &scene["mrays_per_s"];
    for kind in ["closest_coherent", "closest_incoherent", "any_coherent", "any_incoherent"] {
        assert!(number(&rates["device"][kind]) > 0.0, "{kind}");
        assert_eq!(rates["host"][kind].is_number(), document["device"]["cpu"] == true, "{kind}");
    }
    let (mut sums, mut with_rays) = ([0.0; 2], Vec::new());
    for pass in scene["passes"].as_array().unwrap() {
        let (name, ms) = (pass["name"].as_str().unwrap(), number(&pass["ms"]));
        let bytes_ms = number(&pass["bytes"]) / (1e6 * copy_gbps);
        let is_closest = name == "primary";
        let rate = &rates["device"][if is_closest { "closest_coherent" } else { "any_coherent" }];
        let rays_ms = pass["mrays_per_s"].as_f64().map_or(0.0, |mrays| mrays * ms / number(rate));
        if rays_ms > 0.0 {
            with_rays.push(name);
        }
        let floor = bytes_ms.max(rays_ms);
        assert!(floor > 0.0, "{pass}");
        assert!((number(&pass["floor_ms"]) / floor - 1.0).abs() < 1e-9, "{pass}");
        assert!((number(&pass["share_of_floor"]) * ms / floor - 1.0).abs() < 1e-9, "{pass}");
        sums = [sums[0] + floor, sums[1] + ms];
    }
    assert_eq!(with_rays, ["primary", "direct", "shadow_edges", "form_factors"]);
    for (key, sum) in [("floors_ms", sums[0]), ("floored_ms", sums[1])] {
        assert!((number(&scene[key]) / sum - 1.0).abs() < 1e-9, "{key}");
    }
}

#[test]
fn counts_of_edits_and_predicted_times_add_up() {
    let document = &TIMED.document;
    assert_eq!(document["assumed_rates"], serde_json::json!({"gbps": 2.0, "grays": 1.5, "us": 50.0}));
    let edits = document["scenes"][0]["edits"].as_object().unwrap();
    let mut names: Vec<&str> = edits.keys().map(String::as_str).collect();
    names.sort_unstable();
    assert_eq!(names, ["Tlight", "Tmat", "Ttot", "Tview", "colour", "idle"]);
    for (name, edit) in edits {
        let sum = |key: &str| -> f64 {
            let passes = edit["passes"].as_array().unwrap();
            passes.iter().map(|pass| pass[key].as_f64().unwrap()).sum()
        };
        for key in ["dispatches", "barriers", "bytes"] {
            assert_eq!(edit[key].as_f64().unwrap(), sum(key), "{name}: {key}");
        }
        let rays = ["camera", "shadow"].map(|kind| edit["rays"][kind].as_f64().unwrap());
        assert_eq!(rays[0] + rays[1], sum("rays"), "{name}");
        assert_eq!([&edit["submissions"], &edit["read_back_bytes"]], [1, 0], "{name}");
        // Two bytes a nanosecond; no pass of this small picture takes longer for its rays.
        let work_ms = sum("bytes") / 2e6;
        let of_barriers = |barriers: &serde_json::Value| work_ms + 0.05 * barriers.as_f64().unwrap();
        let close = |key: &str, ms: f64| (edit[key].as_f64().unwrap() / ms - 1.0).abs() < 1e-9;
        assert!(close("predicted_free_ms", of_barriers(&edit["free_barriers"])), "{name}: {edit}");
        assert!(close("predicted_ms", sum("predicted_ms")), "{name}: {edit}");
        assert!(sum("predicted_ms") >= of_barriers(&edit["dispatches"]), "{name}: {edit}");
    }
    let rays = |name: &str, kind: &str| &edits[name]["rays"][kind];
    assert_eq!([rays("Ttot", "camera"), rays("Tlight", "camera")], [32 * 32, 0]);
    assert!(*rays("Tlight", "shadow") == *rays("Ttot", "shadow") && *rays("Tmat", "shadow") == 0);
    assert_eq!(edits["colour"]["dispatches"], 3);
    let text = TIMED.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    for words in [
        "counted Ttot Tlight Tview Tmat colour idle submissions 1 1 1 1 1 1 dispatches",
        "camera rays 1024 0 1024 0 0 0",
        "predicted at 2 GB/s, 1.5 Grays/s, 50 us for each dispatch with its barrier",
    ] {
        assert!(text.contains(words), "{words} in {text}");
    }
}

#[test]
fn times_of_a_wrong_picture_are_not_printed() {
    let folder = tempfile::tempdir().unwrap();
    // Three light paths give a wrong energy.
    let few = "time box --frames 1 --lights 1 --size 32x32 --set quality.entry_points=3 --set quality.gather_rays=16 --set quality.cache_points=500 --set quality.cells=8 -q";
    let output = run(&folder, &few.split(' ').chain(["--json", "t.json"]).collect::<Vec<_>>());
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("box: the picture's energy is "), "{}", stderr(&output));
    assert!(!stdout(&output).contains("Tdi") && !stdout(&output).contains("Table"), "{}", stdout(&output));
    assert_eq!(json(&folder, "t.json")["scenes"], serde_json::json!([]));
}

#[test]
fn the_tables_and_the_promised_keys_are_there() {
    for word in ["Tdi", "Tlpe", "Thvds", "Tfg", "Tsplat", "Ttot", "Tlight", "Tview", "Tmat", "paper", "1271"]
    {
        assert!(TIMED.stdout.contains(word), "{word}");
    }
    assert_eq!(TIMED.stderr.contains("debug build"), cfg!(debug_assertions));

    let document = &TIMED.document;
    assert!(document["copy_gbps"].as_f64().unwrap() > 0.0);
    for unit in ["texels", "words"] {
        assert!(document["kernel_copy_gbps"][unit].as_f64().unwrap() > 0.0, "{unit}");
    }
    assert!(document["device"]["name"].is_string() && document["device"]["driver"].is_string());
    let scene = &document["scenes"][0];
    assert_eq!(scene["name"], "box");
    assert_eq!(scene["size"], serde_json::json!([32, 32]));
    assert_eq!(scene["triangles"], 2914);
    for key in ["precompute_s", "memory_mb"] {
        assert!(scene[key].as_f64().unwrap() > 0.0, "{key}");
    }
    for column in ["Tdi", "Tlpe", "Thvds", "Tfg", "Tsplat", "Ttot", "Tlight", "Tview", "Tmat"] {
        assert!(scene["ms"][column].as_f64().unwrap() >= 0.0, "{column}");
    }
    assert!(scene["ms"]["Ttot"].as_f64().unwrap() > 0.0);
    for (count, unchanged) in [("1", 0.0), ("2", 0.5), ("4", 0.75), ("8", 0.875)] {
        assert!(scene["fps_by_lights"][count].as_f64().unwrap() > 0.0, "{count} lights");
        assert_eq!(scene["by_lights"][count]["unchanged"], unchanged);
    }
    assert!(scene["skipped"].is_object());
    assert_eq!(scene["removed"].as_object().unwrap().len(), 2);
    let passes = scene["passes"].as_array().unwrap();
    assert!(!passes.is_empty());
    for pass in passes {
        for key in ["name", "ms", "bytes", "gbps", "share_of_copy", "mrays_per_s"] {
            assert!(pass.get(key).is_some(), "{key} in {pass}");
        }
    }
}
