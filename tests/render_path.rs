//! `render --method path`, as scripts use it.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::fs;
use std::process::{Command, Output};

use common::channels;
use tempfile::TempDir;

fn render(folder: &TempDir, arguments: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.current_dir(folder.path()).args(["render", "box", "--method", "path", "--size", "24x16", "-q"]);
    let output = command.args(arguments.split(' ')).output().unwrap();
    assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

fn statistics(folder: &TempDir, name: &str) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.path().join(name)).unwrap()).unwrap()
}

#[test]
fn layers_add_up_and_runs_agree() {
    let folder = tempfile::tempdir().unwrap();
    let aovs = "--spp 9 --aov variance,direct,indirect,albedo,normal,depth";
    let output = render(&folder, &format!("-o a.exr {aovs} --validation"));
    assert_eq!(output.stderr, b"", "the validation layers are silent");
    render(&folder, &format!("-o b.exr {aovs}"));
    let [a, b] = ["a.exr", "b.exr"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b, "runs differ");

    let channels = channels(&folder.path().join("a.exr"));
    let names = "B G R albedo.B albedo.G albedo.R depth.Z direct.B direct.G direct.R indirect.B indirect.G indirect.R \
                 normal.X normal.Y normal.Z variance.B variance.G variance.R";
    assert_eq!(channels.keys().cloned().collect::<Vec<_>>().join(" "), names);
    let sum = |name: &str| channels[name].iter().map(|value| f64::from(*value)).sum::<f64>();
    for channel in ["R", "G", "B"] {
        let [beauty, direct, indirect] =
            ["", "direct.", "indirect."].map(|layer| &channels[&format!("{layer}{channel}")]);
        for ((beauty, direct), indirect) in beauty.iter().zip(direct).zip(indirect) {
            assert!((beauty - direct - indirect).abs() <= 1e-6 * beauty, "{beauty}, {direct}, {indirect}");
        }
        let [indirect, variance] = ["indirect.", "variance."].map(|layer| sum(&format!("{layer}{channel}")));
        assert!(indirect > 0.0 && variance > 0.0, "{indirect}, {variance}");
    }
}

#[test]
fn budgets_are_kept_and_stated() {
    let folder = tempfile::tempdir().unwrap();
    let words = render(&folder, "-o a.png --spp 6 --stats a.json --exposure 1");
    let words = String::from_utf8(words.stdout).unwrap();
    assert!(words.starts_with("a.png: 24x16, 6 samples a pixel in "), "{words}");
    let few = statistics(&folder, "a.json");
    assert_eq!((&few["spp"], &few["method"]), (&6.into(), &"path".into()));
    let number = |statistics: &serde_json::Value, key: &str| statistics[key].as_f64().unwrap();
    for key in ["seconds", "device_ms", "noise", "mrays_per_s", "memory_bytes"] {
        assert!(number(&few, key) > 0.0, "{key}");
    }
    // Each sample has a camera ray and mostly a shadow ray.
    assert!(number(&few, "rays") > 24.0 * 16.0 * 6.0);

    render(&folder, "-o b.png --stats b.json");
    assert_eq!(statistics(&folder, "b.json")["spp"], 64);
    assert!(number(&statistics(&folder, "b.json"), "noise") < number(&few, "noise"));
    render(&folder, "-o c.png --stats c.json --spp 1");
    assert_eq!(statistics(&folder, "c.json")["noise"], serde_json::Value::Null, "one sample tells nothing");

    render(&folder, "-o d.exr --stats d.json --seconds 0.5 --aov variance");
    let timed = statistics(&folder, "d.json");
    assert!(number(&timed, "spp") >= 4.0);
    // The first round includes compilation, so it may take longer.
    assert!(number(&timed, "seconds") > 0.25, "{timed}");
    render(&folder, "-o e.png --stats e.json --seconds 3600 --spp 5");
    assert_eq!(statistics(&folder, "e.json")["spp"], 5, "whichever comes first");
}
