//! The stated error of a picture, and settings that are chosen for it.

use super::{channels, json, listing, render, run, stderr, stdout};

/// Settings around which the steps are small.
const SMALL: [&str; 8] = [
    "--set",
    "quality.cache_points=200",
    "--set",
    "quality.gather_rays=16",
    "--set",
    "quality.cells=8",
    "--set",
    "quality.edge_samples=0",
];

#[test]
fn the_layer_error_holds_the_error_that_a_long_reference_finds() {
    let folder = tempfile::tempdir().unwrap();
    let output =
        render(&folder, &["-o", "a.exr", "--aov", "error,direct", "--spp", "256", "--stats", "s.json"]);
    assert!(stdout(&output).contains("relMSE ") && stdout(&output).contains("(256 samples a pixel)"));
    let layers = channels(&folder.path().join("a.exr"));
    let map = &layers["error.Y"];
    assert_eq!((map.len(), layers.len()), (32 * 32, 7));
    let stated = json(&folder, "s.json")["error"].clone();
    let [relmse, uncertainty] = ["relmse", "uncertainty"].map(|key| stated[key].as_f64().unwrap());
    assert_eq!(stated["spp"], 256);
    let mean = map.iter().map(|&error| f64::from(error).powi(2)).sum::<f64>() / map.len() as f64;
    // Estimates below 0 count as 0 in the map, which raises its mean.
    assert!(mean >= 0.999 * relmse && mean < 1.5 * relmse, "{mean} {relmse}");

    let reference = ["-o", "r.exr", "--method", "path", "--spp", "1024", "--set", "quality.seed=5"];
    render(&folder, &reference);
    let reference = channels(&folder.path().join("r.exr"));
    let squares = ["R", "G", "B"].map(|channel| {
        let pairs = layers[channel].iter().zip(&reference[channel]);
        pairs.map(|(&v, &r)| (f64::from(v - r) / (f64::from(v) + 0.01)).powi(2)).sum::<f64>()
    });
    let found = squares.iter().sum::<f64>() / (3 * map.len()) as f64;
    assert!(
        (found - relmse).abs() < 4.0 * uncertainty + 0.1 * found,
        "{found}, stated {relmse} ± {uncertainty}"
    );
}

#[test]
fn settings_are_chosen_by_error_and_time() {
    let folder = tempfile::tempdir().unwrap();
    let with = |more: &[&'static str]| [&SMALL[..], more].concat();
    // Anything is good enough: the coarsest settings.
    render(&folder, &with(&["-o", "a.png", "--target-error", "1e9", "--spp", "4", "--stats", "a.json"]));
    let target = json(&folder, "a.json")["target"].clone();
    assert_eq!((target["tried"].as_array().unwrap().len(), &target["taken"]), (1, &0.into()));
    // Any time is short enough: the finest settings, which are the usual picture of those.
    render(&folder, &with(&["-o", "b.exr", "--target-ms", "1e9", "--stats", "b.json"]));
    let target = json(&folder, "b.json")["target"].clone();
    let last = target["tried"].as_array().unwrap().last().unwrap().clone();
    assert!(last["frame_ms"].as_f64().unwrap() > 0.0);
    let settings = last["settings"].as_str().unwrap();
    assert!(settings.ends_with("--set quality.edge_samples=64"), "{settings}");
    let arguments = ["-o", "c.exr"].into_iter().chain(settings.split(' ')).collect::<Vec<_>>();
    render(&folder, &arguments);
    let [b, c] = ["b.exr", "c.exr"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert!(b == c, "the chosen settings, named, give the same picture");
}

#[test]
fn what_cannot_be_reached_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let scene = ["render", "box", "--size", "32x32", "--set", "quality.entry_points=2000", "-o", "a.png"];
    for (wish, word) in [("--target-error", "the best is --preset"), ("--target-ms", "are too slow")] {
        let output = run(&folder, &[&scene[..], &SMALL, &[wish, "1e-9"]].concat());
        assert_eq!(output.status.code(), Some(1));
        let line = stderr(&output);
        let line = line.lines().last().unwrap();
        assert!(line.contains("is not reached") && line.contains(word), "{line}");
        assert!(line.contains("nothing was written") && listing(&folder).is_empty());
    }
}
