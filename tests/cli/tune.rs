//! Values that are tuned for the device: given, measured, stored, ignored.

use super::{SMALL, assert_refused, common, cube, json, lightpaths, listing, run, stderr, stdout};
use serde_json::json;
use std::fs;
use std::path::PathBuf;
use std::process::Output;
use tempfile::TempDir;

const CHOICES: [&str; 7] =
    ["finds_alike", "shafts", "record_lanes", "waiting_group", "scan_group", "strip", "slices"];

/// A folder with the cube, and another for stored tuning.
struct World {
    cube: TempDir,
    store: TempDir,
}

impl World {
    fn new() -> Self {
        Self { cube: cube(), store: tempfile::tempdir().unwrap() }
    }

    fn run(&self, arguments: &[&str]) -> Output {
        lightpaths(&self.cube, arguments).env("LIGHTPATHS_TUNING", self.store.path()).output().unwrap()
    }

    /// Standard output of a command that succeeds without a warning.
    fn stdout(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(output.status.success() && !stderr(&output).contains("ignored"), "{}", stderr(&output));
        stdout(&output)
    }

    /// The file for the device.
    fn path(&self) -> PathBuf {
        self.stdout(&["tune", "--reset"]).strip_suffix(" is deleted\n").unwrap().into()
    }

    /// Stores a value, as `tune` does.
    fn put(&self, name: &str, value: u32) {
        let context = common::context();
        let values = json!({ name: value });
        let document =
            json!({"version": 1, "device": context.name(), "driver": context.driver(), "values": values});
        fs::write(self.path(), document.to_string()).unwrap();
    }

    /// The picture of the cube, and what is printed to standard error.
    fn picture(&self, arguments: &[&str]) -> (Vec<u8>, String) {
        let render = ["render", "cube.toml", "-o", "a.exr"];
        let output = self.run(&[&render[..], &SMALL[..], arguments].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        (fs::read(self.cube.path().join("a.exr")).unwrap(), stderr(&output))
    }
}

/// The line of `info` about the first device.
fn tuning_line(info: &str) -> &str {
    info.lines().find_map(|line| line.strip_prefix("tuning ")).unwrap().trim()
}

#[test]
fn each_choice_is_listed_with_its_source() {
    let world = World::new();
    let of_class = world.stdout(&["info"]);
    let line = tuning_line(&of_class);
    assert!(CHOICES.iter().all(|name| line.contains(name)), "{line}");
    assert_eq!(line.matches("(class)").count(), CHOICES.len(), "{line}");
    world.put("record_lanes", 16);
    let stored = world.stdout(&["info"]);
    let line = tuning_line(&stored);
    assert!(line.contains("record_lanes 16 (tuned)"), "{line}");
    assert_eq!(line.matches("(class)").count(), CHOICES.len() - 1, "{line}");
}

#[test]
fn stored_values_are_those_given_and_given_ones_win() {
    let world = World::new();
    let (of_class, _) = world.picture(&[]);
    let (given, _) = world.picture(&["--tune", "record_lanes=16"]);
    assert!(given != of_class, "another order of sums has other bits");
    world.put("record_lanes", 16);
    assert!(world.picture(&[]).0 == given);
    let (back, _) = world.picture(&["--tune", "record_lanes=1", "--tune", "scan_group=8"]);
    world.path();
    assert!(back == world.picture(&["--tune", "record_lanes=1", "--tune", "scan_group=8"]).0);
}

#[test]
fn a_damaged_file_is_ignored_with_one_warning() {
    let world = World::new();
    let (of_class, _) = world.picture(&[]);
    fs::write(world.path(), "{\"version\": 1,").unwrap();
    let (picture, said) = world.picture(&[]);
    assert!(picture == of_class);
    assert_eq!(said.matches("is damaged").count(), 1, "{said}");
    assert!(said.contains("stored tuning is ignored, `lightpaths tune` measures it again"), "{said}");
    let (_, said) = world.picture(&["-q"]);
    assert_eq!(said, "");
    let info = world.run(&["info"]);
    assert!(info.status.success() && stdout(&info).contains("is damaged"));
}

#[test]
fn a_dry_run_prints_a_table_and_stores_nothing() {
    let world = World::new();
    let measure = ["tune", "cube.toml", "--frames", "2", "--dry-run", "--choice", "record_lanes"];
    let text = world.stdout(&[&measure[..], &["--cache", "paths"], &SMALL[..]].concat());
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].contains(common::context().driver()), "{text}");
    let heading: Vec<&str> = lines[1].split_whitespace().collect();
    assert_eq!(heading, ["median", "ms", "value", "cube", "all", "cube", "light", "ratio", "p90"]);
    let rows: Vec<Vec<&str>> = lines[2..7].iter().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[0][0], "record_lanes");
    assert_eq!(rows[0][4..], ["1.000", "1.000", "class"]);
    let mut values: Vec<u32> =
        rows.iter().enumerate().map(|(i, row)| row[usize::from(i == 0)].parse().unwrap()).collect();
    values.sort_unstable();
    assert_eq!(values, [1, 8, 16, 32, 64]);
    for cell in rows.iter().enumerate().flat_map(|(i, row)| &row[usize::from(i == 0)..][..5]) {
        assert!(cell.parse::<f64>().unwrap() > 0.0, "{text}");
    }
    assert!(lines[7].ends_with("nothing is stored in a dry run") && lines.len() == 8, "{text}");
    assert_eq!(listing(&world.store), [""; 0]);
}

/// The value of a choice that is not measured stays, whatever the measured one becomes.
#[test]
fn choices_that_are_not_measured_keep_their_stored_values() {
    let world = World::new();
    world.put("strip", 256);
    let measure = ["tune", "cube.toml", "--frames", "1", "--choice", "finds_alike"];
    let text = world.stdout(&[&measure[..], &SMALL[..]].concat());
    assert!(text.contains("strip=256: stored in") || text.contains("strip=256, finds_alike="), "{text}");
    let name = listing(&world.store).pop().unwrap();
    let document = json(&world.store, &name);
    assert_eq!(document["values"]["strip"], 256);
    assert_eq!(document["driver"], common::context().driver());
    assert!(tuning_line(&world.stdout(&["info"])).contains("strip 256 (tuned)"));
    world.path();
    assert_eq!(listing(&world.store), [""; 0]);
}

#[test]
fn wrong_arguments_name_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        (
            &["render", "-o", "a.exr", "--tune", "lanes=8"][..],
            &["lanes=8", "finds_alike, shafts, record_lanes"][..],
        ),
        (&["time", "--tune", "record_lanes=3"], &["record_lanes takes 1, 8, 16, 32, 64"]),
        (&["tune", "--choice", "lanes"], &["lanes", "expected one of finds_alike"]),
        (&["tune", "--reset", "--dry-run"], &["--reset", "--dry-run"]),
        (&["tune", "--frames", "0"], &["a whole number from 1 to 10000"]),
        (&["tune"], &["LIGHTPATHS_TUNING is empty"]),
        (&["tune", "--reset"], &["LIGHTPATHS_TUNING is empty"]),
    ] {
        assert_refused(&run(&folder, arguments), 2, words);
    }
}
