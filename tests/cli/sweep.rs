//! `sweep`, as scripts use it.

use super::{assert_refused, cube, json, listing, stderr, stdout};
use std::fs;
use std::path::PathBuf;
use std::process::Output;
use tempfile::TempDir;

/// Runs `sweep` or `figures` at small settings in `folder`, which also holds the cache.
fn small(command: &str, out: &str, folder: &TempDir, scene: &TempDir) -> Output {
    let scene = scene.path().join("cube.toml");
    let small = "--spp 8 --size 16x16 --set quality.entry_points=1000 --set quality.gather_rays=16 --set quality.cells=8 \
                 --set quality.cache_points=300";
    let arguments = format!("{command} {} -o {out} --cache cache {small}", scene.display());
    super::lightpaths(folder, &arguments.split_whitespace().collect::<Vec<_>>()).output().unwrap()
}

fn references(folder: &TempDir) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder.path().join("cache")).unwrap();
    entries.map(|entry| entry.unwrap().path()).collect()
}

/// Asserts that the pages refer to no other files.
fn check_figures(folder: &TempDir, output: &Output) {
    assert!(output.status.success(), "{}", stderr(output));
    assert_eq!(stdout(output), "figures/figure-cube.html\n");
    let html = fs::read_to_string(folder.path().join("figures/figure-cube.html")).unwrap();
    for title in ["Direct illumination only", "Photon mapping", "Our method", "Pure Monte Carlo", "Reference"]
    {
        assert!(html.contains(&format!("<b>{title}</b>")), "{title}");
        let name = format!("figures/figure-cube-{}.png", title.to_lowercase().replace(' ', "-"));
        let picture = lightpaths::image::read(&folder.path().join(name), None).unwrap();
        assert_eq!(picture.size, [16, 16]);
    }
    assert_eq!(html.matches("relMSE").count(), 5, "an error under each, the noise under the reference");
    assert!(!html.contains("http") && html.contains("data:image/png;base64,"));
    assert_eq!(listing(folder), ["cache", "figures"]);
}

/// Figures and sweeps use the same stored reference.
#[test]
fn figures_and_sweeps_write_what_they_promise_and_keep_their_reference() {
    let (folder, scene) = (tempfile::tempdir().unwrap(), cube());
    check_figures(&folder, &small("figures", "figures", &folder, &scene));
    // A damaged reference is reported and replaced by an equal one.
    let [kept] = references(&folder).try_into().unwrap();
    let whole = fs::read(&kept).unwrap();
    fs::write(&kept, &whole[..whole.len() / 2]).unwrap();
    let output = small("sweep", "out/new", &folder, &scene);
    assert!(stderr(&output).contains("made anew"), "{}", stderr(&output));
    let pixels = |file: &[u8]| file[file.iter().position(|&byte| byte == b'\n').unwrap()..].to_vec();
    assert!(pixels(&fs::read(&kept).unwrap()) == pixels(&whole), "the same samples give the same bytes");
    check_sweep(&folder, &output);
}

fn check_sweep(folder: &TempDir, output: &Output) {
    assert!(output.status.success(), "{}", stderr(output));
    assert_eq!(stdout(output).trim_end(), "out/new/report.html");
    assert_eq!(listing(folder), ["cache", "figures", "out"]);
    let out = folder.path().join("out/new");
    for name in ["report.html", "error-frame.svg", "error-first.svg", "error-setting.svg", "reference.png"] {
        assert!(fs::metadata(out.join(name)).unwrap().len() > 100, "{name}");
    }
    for stem in ["direct-only", "photon-mapping", "light-paths", "path-tracing"] {
        for name in [format!("{stem}.png"), format!("{stem}-flip.png")] {
            assert_eq!(lightpaths::image::read(&out.join(&name), None).unwrap().size, [16, 16], "{name}");
        }
    }
    assert!(
        fs::read_dir(&out).unwrap().all(|e| !e.unwrap().file_name().to_string_lossy().ends_with(".part"))
    );

    check_document(&json(folder, "out/new/sweep.json"));
}

fn check_document(document: &serde_json::Value) {
    let settings = document["settings"].as_array().unwrap();
    assert_eq!(settings[0]["series"], "preset");
    for series in ["entry points", "cells", "cache points", "gather rays", "front"] {
        assert!(settings.iter().any(|setting| setting["series"] == series), "{series}");
    }
    for setting in settings {
        assert!(
            setting["precompute_s"].as_f64().unwrap() > 0.0
                && setting["relit_frame_ms"].as_f64().unwrap() > 0.0
        );
        assert!(setting["error"]["relmse"].as_f64().unwrap() > 0.0);
        assert!(
            setting["ms"]["Tlight"].as_f64().unwrap() > 0.0 && setting["memory_mb"].as_f64().unwrap() > 0.0
        );
    }
    assert!(settings.iter().any(|setting| setting["is_on_pareto_front"] == true));
    let baselines = document["rivals"].as_array().unwrap();
    for method in ["path tracing", "photon mapping"] {
        for at in ["equal_time_relit", "equal_time_first", "equal_error"] {
            assert!(
                baselines.iter().any(|baseline| baseline["method"] == method && baseline["at"] == at),
                "{method} {at}"
            );
        }
    }
    let stages = document["stages"].as_array().unwrap();
    let names: Vec<_> = stages.iter().map(|stage| stage["name"].as_str().unwrap()).collect();
    assert_eq!(names.len(), 5, "{names:?}");
    assert_eq!(stages[0]["share"], 0.0, "the whole comes first");
    for stage in stages {
        let [relmse, noise, fraction] =
            ["relmse", "noise_relmse", "share"].map(|key| stage[key].as_f64().unwrap());
        assert!(relmse.abs() < 1.0 && fraction <= 2.0, "{stage}");
        // Only path tracing is noisy.
        assert_eq!(noise > 0.0, stage["name"].as_str().unwrap().contains("exact"), "{stage}");
    }
    assert_eq!(document["reference"]["spp"], 8);
    assert_eq!(document["reference"]["from_cache"], false);
    assert!(document["reference"]["noise_relmse"].as_f64().unwrap() > 0.0);
}

#[test]
fn wrong_arguments_are_refused_before_anything_is_made() {
    let folder = super::folder_with(&[("file", "")]);
    for (arguments, words) in [
        ("sweep box", &["--output"][..]),
        ("figures", &["--output"]),
        ("figures box box -o out", &["two scenes", "box"]),
        ("sweep no_such_scene -o out", &["no_such_scene"]),
        ("sweep box -o file", &["file", "is not a folder"]),
        ("sweep box -o out --spp 3", &["--spp"]),
        ("sweep box -o out --seconds 0", &["--seconds"]),
        ("sweep box -o out --device nobody", &["nobody"]),
    ] {
        let output = super::run(&folder, &arguments.split(' ').collect::<Vec<_>>());
        assert_refused(&output, if words[0] == "nobody" { 3 } else { 2 }, words);
        assert_eq!(listing(&folder), ["file"], "{arguments}");
    }
}
