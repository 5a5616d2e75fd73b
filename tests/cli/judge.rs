//! `judge`, as scripts use it.

use super::{assert_refused, cube, json, lightpaths, listing, stderr, stdout};
use std::fs;

const STAGES: [&str; 6] = ["direct light", "records", "clusters", "gather rays", "the rest", "small"];

#[test]
fn a_judgement_names_each_stage_and_maps_the_picture() {
    let (folder, scene) = (tempfile::tempdir().unwrap(), cube());
    let scene = scene.path().join("cube.toml");
    // Few gather rays: they err most.
    let small = "--spp 64 --size 20x17 --set quality.entry_points=4000 --set quality.gather_rays=4 \
                 --set quality.cells=8 --set quality.cache_points=300";
    let arguments = format!("judge {} -o out --cache cache {small}", scene.display());
    let arguments: Vec<&str> = arguments.split_whitespace().collect();
    let output = lightpaths(&folder, &arguments).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(listing(&folder), ["cache", "out"]);
    let table = stdout(&output);
    assert!(table.starts_with("cube, 20x17, ") && table.ends_with("out/judge.svg\n"), "{table}");

    let document = json(&folder, "out/judge.json");
    let number = |row: &serde_json::Value, key: &str| row[key].as_f64().unwrap();
    let rows = document["stages"].as_array().unwrap();
    let names: Vec<&str> = rows.iter().map(|row| row["stage"].as_str().unwrap()).collect();
    assert_eq!(names, STAGES);
    assert!(STAGES.iter().all(|stage| table.contains(&format!("\n{stage} "))), "{table}");
    for key in ["blocks", "error"] {
        let all: f64 = rows.iter().map(|row| number(row, key)).sum();
        assert!((all - 1.0).abs() < 1e-9, "{key}: {all}");
    }
    let relmse = document["relmse"].as_f64().unwrap();
    assert!(relmse > 1e-4, "{relmse}");
    let removes: Vec<f64> = rows[..4].iter().map(|row| number(row, "removes")).collect();
    let whole = |row: &serde_json::Value| 1.0 - number(row, "relmse_without") / relmse;
    assert!((removes[0] - whole(&rows[0])).abs() < 1e-9);
    assert!((removes[2] + removes[3] - whole(&rows[3])).abs() < 1e-9);
    assert!(removes[3] > 0.5 && removes[3] > removes[2], "{removes:?}");
    assert_eq!(document["block_pixels"], 8);
    assert_eq!(document["reference_spp"], 64);

    let map = lightpaths::image::read(&folder.path().join("out/stages.png"), None).unwrap();
    assert_eq!(map.size, [20, 17]);
    let svg = fs::read_to_string(folder.path().join("out/judge.svg")).unwrap();
    assert_eq!(svg.matches("data:image/png;base64,").count(), 2);
    assert!(STAGES.iter().all(|stage| svg.contains(&format!(">{stage}: "))), "{svg}");

    // The references are kept, and the judgement is the same.
    let again = lightpaths(&folder, &arguments).output().unwrap();
    assert_eq!(stderr(&again).matches("from the cache").count(), 2, "{}", stderr(&again));
    assert_eq!(stdout(&again), table);
}

#[test]
fn wrong_arguments_are_refused_before_anything_is_made() {
    let folder = super::folder_with(&[("file", "")]);
    for (arguments, words) in [
        ("judge box", &["--output"][..]),
        ("judge no_such_scene -o out", &["no_such_scene"]),
        ("judge box -o file", &["file", "is not a folder"]),
        ("judge box -o out --spp 3", &["--spp"]),
    ] {
        let output = super::run(&folder, &arguments.split(' ').collect::<Vec<_>>());
        assert_refused(&output, 2, words);
        assert_eq!(listing(&folder), ["file"], "{arguments}");
    }
}
