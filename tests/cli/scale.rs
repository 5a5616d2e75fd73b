//! `scale`, as scripts use it.

use super::{assert_refused, cube, json, layer::Layer, listing, stderr, stdout};
use std::fs;
use std::process::Command;
use tempfile::TempDir;

/// The cube at small settings.
fn scale(folder: &TempDir, cube: &TempDir, arguments: &str) -> Command {
    let scene = cube.path().join("cube.toml");
    let small =
        "--size 16x16 --set quality.entry_points=1000 --set quality.gather_rays=16 --set quality.cells=8";
    let arguments = format!("scale {} -o out {small} {arguments}", scene.display());
    super::lightpaths(folder, &arguments.split_whitespace().collect::<Vec<_>>())
}

#[test]
fn sizes_are_tried_each_by_itself_and_what_does_not_fit_is_told() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let mut command =
        scale(&folder, &cube, "--entry-points 1000,4000,300000 --cache-points 200,500 --lights 1,3");
    // Light paths of 300 000 entry points exceed this limit.
    let layer = Layer::new();
    layer.afflict(&mut command, "vkAllocateMemory:1+:MAX=12000000");
    let output = command.output().unwrap();
    let said = stderr(&output);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("its triangles are what they are"), "{said}");
    let document = json(&folder, "out/scale.json");
    let trials = document["trials"].as_array().unwrap();
    let of = |quantity: &str, key: &str| {
        let trials = trials.iter().filter(|trial| trial["quantity"] == quantity);
        trials.map(|trial| trial["sizes"][key].as_u64().unwrap()).collect::<Vec<_>>()
    };
    assert!(of("triangles", "triangles").is_empty());
    assert_eq!(of("entry points", "entry_points")[..2], [1_000, 4_000]);
    assert_eq!(of("cache points", "cache_points"), [200, 500]);
    assert_eq!(of("lights", "lights"), [1, 3]);
    for trial in trials {
        for figure in ["precompute_s", "first_frame_ms", "relit_frame_ms", "view_frame_ms", "memory_mb"] {
            assert!(trial[figure].as_f64().unwrap() > 0.0, "{figure} of {trial}");
        }
        assert!(trial["relit_without_shadows_ms"].as_f64() < trial["relit_frame_ms"].as_f64(), "{trial}");
    }
    let refused = document["refused"].as_array().unwrap();
    assert_eq!((trials.len(), refused.len()), (6, 1));
    let table = stdout(&output);
    for refusal in refused {
        let why = refusal["why"].as_str().unwrap();
        assert!(why.contains("quality.entry_points") && table.contains(why), "{why}");
    }
    assert!(table.contains("entry points") && table.contains("grow like"), "{table}");
    for stem in ["precompute", "first-frame", "light-moved", "without-shadows", "camera-moved", "memory"] {
        let plot = fs::read_to_string(folder.path().join(format!("out/{stem}.svg"))).unwrap();
        assert!(plot.contains("entry points, from 1000") && !plot.contains("NaN"), "{stem}");
    }
}

#[test]
fn nonsense_is_refused_before_anything_is_tried() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    for (arguments, reason) in [
        ("--lights 0", "--lights"),
        ("--entry-points 5,x", "--entry-points"),
        ("--triangles 10000", "model.0.triangles"),
    ] {
        let output = scale(&folder, &cube, arguments).output().unwrap();
        assert_refused(&output, 2, &[reason]);
    }
    assert!(listing(&folder).is_empty(), "{:?}", listing(&folder));
}
