//! `compare`, as scripts use it.

use super::{assert_refused, folder_with, listing, run, stderr, stdout};
use lightpaths::image::{ExrLayer, write_exr, write_png};
use std::fs::File;
use tempfile::TempDir;

const RGB: &[&str] = &["R", "G", "B"];
const SIZE: [u32; 2] = [12, 9];

/// An image of one value, with layers `double` (twice the value) and `variance`.
fn exr(folder: &TempDir, name: &str, value: f32, variance: f32) {
    let [plain, double, variance] = [value, 2.0 * value, variance].map(|value| vec![[value; 3]; 108]);
    let layers = [
        ExrLayer { name: "", channels: RGB, pixels: &plain },
        ExrLayer { name: "double", channels: RGB, pixels: &double },
        ExrLayer { name: "variance", channels: RGB, pixels: &variance },
    ];
    write_exr(File::create(folder.path().join(name)).unwrap(), SIZE, &layers).unwrap();
}

fn images() -> TempDir {
    let folder = folder_with(&[("text.exr", "no image")]);
    exr(&folder, "a.exr", 0.74, 0.01);
    exr(&folder, "b.exr", 0.49, 0.0);
    let mut odd = vec![[0.5f32; 3]; 108];
    odd[12 * 2 + 7] = [0.0, f32::NAN, 1.0];
    let layer = [ExrLayer { name: "", channels: RGB, pixels: &odd }];
    write_exr(File::create(folder.path().join("odd.exr")).unwrap(), SIZE, &layer).unwrap();
    let png = |name: &str, size: [u32; 2], code: u8| {
        let pixels = vec![[code; 4]; (size[0] * size[1]) as usize];
        write_png(File::create(folder.path().join(name)).unwrap(), size, &pixels).unwrap();
    };
    png("white.png", SIZE, 255);
    png("black.png", SIZE, 0);
    png("small.png", [9, 12], 0);
    folder
}

fn figures(folder: &TempDir, arguments: &str) -> serde_json::Value {
    let arguments = format!("compare --json {arguments}");
    let output = run(folder, &arguments.split(' ').collect::<Vec<_>>());
    assert!(output.status.success(), "{arguments}: {}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[track_caller]
fn assert_close(value: &serde_json::Value, expected: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() < 1e-5 * expected.max(1e-9), "{value}, expected {expected}");
}

#[test]
fn figures_are_the_closed_forms() {
    let folder = images();
    let same = figures(&folder, "a.exr a.exr");
    assert_eq!(
        same,
        serde_json::json!({"relmse": 0.0, "rmse": 0.0, "smape": 0.0, "flip": 0.0, "energy_ratio": 1.0})
    );
    let apart = figures(&folder, "a.exr b.exr");
    assert_close(&apart["relmse"], 0.25);
    assert_close(&apart["rmse"], 0.25);
    assert_close(&apart["smape"], 0.25 / 0.615);
    assert_close(&apart["energy_ratio"], 0.74 / 0.49);
    assert!(apart["flip"].as_f64().unwrap() > 0.05);
    assert_close(&figures(&folder, "a.exr b.exr --layer double")["rmse"], 0.5);
    assert_close(&figures(&folder, "a.exr b.exr --reference-layer double")["rmse"], 0.24);
    // Black against white, as in FLIP's own tests; the exposure of an EXR does not apply.
    let codes = figures(&folder, "white.png black.png --exposure 3");
    assert!((codes["flip"].as_f64().unwrap() - 0.9674).abs() < 1e-4 && codes["rmse"] == 1.0);
    // The automatic exposure is the reference's.
    let automatic = run(&folder, &["compare", "a.exr", "b.exr", "--json", "--exposure", "auto"]);
    let stops = stderr(&automatic).trim().rsplit(' ').next().unwrap().to_owned();
    let fixed = run(&folder, &["compare", "a.exr", "b.exr", "--json", "--exposure", &stops]);
    assert_eq!(stdout(&automatic), stdout(&fixed));
    assert!(codes["energy_ratio"].is_null(), "there is no number for it");
}

#[test]
fn the_text_names_every_figure_and_keeps_order() {
    let folder = images();
    let output = run(&folder, &["compare", "a.exr", "b.exr"]);
    let text = stdout(&output);
    let names: Vec<&str> = text.lines().map(|line| line[..14].trim()).collect();
    assert_eq!(names, ["relMSE", "RMSE", "SMAPE", "FLIP", "energy ratio"]);
    assert!(text.starts_with("relMSE        2.5000e-1\n"), "{text}");
    assert_eq!(stderr(&output), "");
}

#[test]
fn noise_is_taken_into_account_where_stated() {
    let folder = images();
    let test = figures(&folder, "a.exr b.exr --z-test");
    assert_close(&test["z_mean"], 2.5);
    assert_close(&test["z_rms"], 2.5);
    assert_eq!((&test["z_fraction_above_3"], &test["z_count"]), (&0.0.into(), &324.into()));
    let far = figures(&folder, "a.exr b.exr --z-test --variance-layer variance --layer double");
    assert_close(&far["z_mean"], 5.0);
    assert_eq!(far["z_fraction_above_3"], 1.0);
}

#[test]
fn a_bound_decides_the_exit_code() {
    let folder = images();
    let bounded = |bound: &str| run(&folder, &["compare", "a.exr", "b.exr", "--max-relmse", bound]);
    assert_eq!(bounded("0.26").status.code(), Some(0));
    let above = bounded("0.24");
    assert_eq!(above.status.code(), Some(1));
    assert!(stdout(&above).contains("relMSE"), "the figures are printed all the same");
    assert!(stderr(&above).lines().count() == 1 && stderr(&above).contains("--max-relmse"));
}

#[test]
fn heat_maps_are_images_of_that_size() {
    let folder = images();
    for (of, word) in [("flip", "magma"), ("relative", "viridis")] {
        let name = format!("{of}.png");
        let output =
            run(&folder, &["compare", "a.exr", "b.exr", "--json", "--heatmap", &name, "--heatmap-of", of]);
        assert!(output.status.success() && stderr(&output).contains(word), "{}", stderr(&output));
        let picture = lightpaths::image::read(&folder.path().join(&name), None).unwrap();
        assert_eq!(picture.size, SIZE);
        assert!(picture.pixels.iter().all(|pixel| *pixel == picture.pixels[0]));
    }
    let [flip, relative] =
        ["flip.png", "relative.png"].map(|name| std::fs::read(folder.path().join(name)).unwrap());
    assert_ne!(flip, relative);
}

#[test]
fn wrong_inputs_are_refused_and_named() {
    let folder = images();
    let before = listing(&folder);
    for (arguments, words) in [
        ("a.exr", &["REFERENCE"][..]),
        ("a.exr none.exr", &["none.exr", "cannot be read"]),
        ("text.exr a.exr", &["text.exr", "neither an EXR nor a PNG"]),
        ("odd.exr a.exr", &["odd.exr", "(7, 2)", "not finite"]),
        ("a.exr odd.exr", &["odd.exr", "(7, 2)"]),
        ("small.png black.png", &["9x12", "12x9", "black.png"]),
        ("a.exr b.exr --layer direct", &["a.exr", "`direct`", "`double`"]),
        ("a.exr b.exr --reference-layer direct", &["b.exr", "`direct`"]),
        ("a.exr white.png --layer double", &["white.png", "no layers"]),
        ("a.exr white.png --z-test", &["white.png", "no layers"]),
        ("a.exr b.exr --variance-layer double", &["--z-test"]),
        ("a.exr b.exr --heatmap-of flip", &["--heatmap"]),
        ("a.exr b.exr --heatmap missing/h.png", &["missing/h.png"]),
        ("a.exr b.exr --max-relmse nan", &["--max-relmse"]),
        ("a.exr b.exr --max-relmse -1", &["-1"]),
    ] {
        let arguments: Vec<&str> = ["compare"].into_iter().chain(arguments.split(' ')).collect();
        assert_refused(&run(&folder, &arguments), 2, words);
        assert_eq!(listing(&folder), before, "{arguments:?}");
    }
}

/// A file of 4×3 pixels with a shifted data window in a display window of 12×9.
fn exr_at(folder: &TempDir, name: &str, display: [i32; 2], [x, y]: [i32; 2]) {
    use exr::prelude::*;
    let channel = |name: &str| AnyChannel::new(name, FlatSamples::F32((0..12).map(|i| i as f32).collect()));
    let channels = AnyChannels::sort(["R", "G", "B"].map(channel).into_iter().collect());
    let attributes = LayerAttributes { layer_position: Vec2(x, y), ..LayerAttributes::default() };
    let layer = Layer::new(Vec2(4, 3), attributes, Encoding::FAST_LOSSLESS, channels);
    let window = IntegerBounds::new(Vec2(display[0], display[1]), Vec2(12, 9));
    let image = Image::from_layers(ImageAttributes::new(window), vec![layer]);
    image.write().to_file(folder.path().join(name)).unwrap();
}

#[test]
fn pixels_of_an_exr_are_compared_where_they_lie() {
    let folder = images();
    exr_at(&folder, "left.exr", [0, 0], [1, 1]);
    exr_at(&folder, "right.exr", [0, 0], [5, 1]);
    exr_at(&folder, "same.exr", [0, 0], [1, 1]);
    exr_at(&folder, "moved.exr", [3, 0], [4, 1]);
    exr_at(&folder, "outside.exr", [0, 0], [40, 1]);
    assert_eq!(figures(&folder, "left.exr same.exr")["rmse"], 0.0);
    // Each is where the other is black: the mean square is that of 0..12 twice, over 108 pixels.
    let squares = f64::from((0..12).map(|i| i * i).sum::<i32>());
    assert_close(&figures(&folder, "left.exr right.exr")["rmse"], (2.0 * squares / 108.0).sqrt());
    let refused = |arguments: &str, words: &[&str]| {
        let arguments = format!("compare {arguments}");
        assert_refused(&run(&folder, &arguments.split(' ').collect::<Vec<_>>()), 2, words);
    };
    refused("left.exr moved.exr", &["left.exr", "moved.exr", "display window", "(3, 0)"]);
    refused("left.exr outside.exr", &["outside.exr", "outside of its display window"]);
}
