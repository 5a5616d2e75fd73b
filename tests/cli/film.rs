//! `film`, as scripts use it.

use super::{CUBE, CUBE_SCENE, assert_refused, folder_with, lightpaths, listing, stderr, stdout};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// Two seconds: the camera moves, the wall becomes glossy, the light moves and fades, and an
/// area light appears.
const FILM: &str = r#"
scene = "cube.toml"
fps = 3
duration = 2.0
size = [16, 12]
[[camera]]
time = 0.0
position = [0.0, 1.0, 0.9]
[[camera]]
time = 1.9
position = [0.4, 0.7, 0.8]
[[light]]
name = "lamp"
time = 0.0
position = [0.2, 1.6, 0.1]
[[light]]
name = "lamp"
time = 1.0
position = [-0.5, 1.2, 0.3]
on = false
fade = 0.6
[[light]]
name = "panel"
time = 0.5
kind = "area"
corner = [-0.2, 1.9, -0.2]
edge_u = [0.4, 0.0, 0.0]
edge_v = [0.0, 0.0, 0.4]
radiance = [6.0, 5.0, 4.0]
[[material]]
name = "default"
time = 0.3
fade = 1.0
diffuse = [0.3, 0.2, 0.1]
specular = [0.4, 0.4, 0.4]
exponent = 20.0
"#;

const SMALL: [&str; 8] = [
    "--set",
    "quality.entry_points=2000",
    "--set",
    "quality.gather_rays=16",
    "--set",
    "quality.cells=8",
    "--set",
    "quality.directions=64",
];

/// A film and its scene, and a folder with the only programs on the path.
fn folder() -> TempDir {
    let folder = folder_with(&[("cube.obj", CUBE), ("cube.toml", CUBE_SCENE), ("walk.toml", FILM)]);
    fs::create_dir(folder.path().join("bin")).unwrap();
    folder
}

fn film_command(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = lightpaths(folder, &[&["film", "walk.toml"], arguments, &SMALL].concat());
    command.env("PATH", folder.path().join("bin"));
    command
}

fn film(folder: &TempDir, arguments: &[&str]) -> Output {
    let output = film_command(folder, arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    output
}

/// Names and bytes of a folder's files.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> =
        entries.map(|path| (path.file_name().unwrap().into(), fs::read(path).unwrap())).collect();
    files.sort();
    files
}

#[test]
fn shares_hold_the_bytes_of_the_whole() {
    let folder = folder();
    // The shares run in another order; one has a single frame, and the last is longer
    // than the film.
    let output = film(&folder, &["-o", "whole", "--format", "exr"]);
    assert!(stdout(&output).contains("frames 0 to 5 of 6, 16x12"), "{}", stdout(&output));
    assert!(stdout(&output).contains("ms in the median"), "{}", stdout(&output));
    for frames in ["4..9", "1..4", "0"] {
        film(&folder, &["-o", "shares", "--format", "exr", "--frames", frames, "-q"]);
    }
    let [whole, fractions] = ["whole", "shares"].map(|name| files(&folder.path().join(name)));
    let names: Vec<_> = whole.iter().map(|(name, _)| name.to_str().unwrap()).collect();
    let expected: Vec<_> = (0..6).map(|frame| format!("frame-{frame:05}.exr")).collect();
    assert_eq!(names, expected);
    assert!(whole == fractions);
    assert!(whole.windows(2).all(|pair| pair[0].1 != pair[1].1), "all of them differ");
}

#[test]
fn frames_that_are_there_are_replaced_and_others_stay() {
    let folder = folder();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    for name in ["frame-00001.png", "frame-00002.png", "notes.txt"] {
        fs::write(out.join(name), "old").unwrap();
    }
    let output = film(&folder, &["-o", "out", "--frames", "1..2"]);
    assert!(stderr(&output).contains("once all frames are there: cd out && ffmpeg "), "{}", stderr(&output));
    let found = files(&out);
    let lengths: Vec<_> =
        found.iter().map(|(name, bytes)| (name.to_str().unwrap(), bytes == b"old")).collect();
    assert_eq!(lengths, [("frame-00001.png", false), ("frame-00002.png", true), ("notes.txt", true)]);
}

#[test]
fn no_ffmpeg_is_a_line_and_no_error() {
    let folder = folder();
    let line = stderr(&film(&folder, &["-o", "out", "--video", "webm"]));
    assert!(line.contains("no video, ffmpeg is not installed") && line.contains("walk.webm"), "{line}");
    assert_eq!(stderr(&film(&folder, &["-o", "out", "--video", "none"])), "");
    assert_eq!(files(&folder.path().join("out")).len(), 6);
}

/// Installs a program as ffmpeg.
#[cfg(unix)]
fn install_ffmpeg(folder: &TempDir, script: &str) {
    use std::os::unix::fs::PermissionsExt;
    let program = folder.path().join("bin/ffmpeg");
    fs::write(&program, format!("#!/bin/sh\n{script}")).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
}

#[cfg(unix)]
#[test]
fn ffmpeg_gets_explicit_arguments_and_its_file_its_name() {
    let folder = folder();
    // The last argument is the output file.
    install_ffmpeg(&folder, "for last; do :; done\necho \"$@\" > \"$last\"\n");
    let output = film(&folder, &["-o", "out", "-q"]);
    assert!(stdout(&output).ends_with("out/walk.mp4\n"), "{}", stdout(&output));
    let said = fs::read_to_string(folder.path().join("out/walk.mp4")).unwrap();
    for words in ["-framerate 3 -i frame-%05d.png -frames:v 6", "-c:v libx264", "-pix_fmt yuv420p", "-f mp4"]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    film(&folder, &["-o", "out", "-q", "--video", "webm"]);
    assert!(fs::read_to_string(folder.path().join("out/walk.webm")).unwrap().contains("-c:v libvpx-vp9"));
    assert_eq!(files(&folder.path().join("out")).len(), 8, "nothing is left behind");
}

#[cfg(unix)]
#[test]
fn ffmpegs_trouble_is_an_error_only_where_a_video_was_asked_for() {
    let folder = folder();
    install_ffmpeg(&folder, "echo 'Unknown encoder libx264' >&2\nexit 1\n");
    let line = stderr(&film(&folder, &["-o", "out"]));
    assert!(line.contains("warning: no video") && line.contains("Unknown encoder libx264"), "{line}");
    let output = film_command(&folder, &["-o", "out", "-q", "--video", "mp4"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("walk.mp4: ffmpeg failed"), "{}", stderr(&output));
    assert_eq!(files(&folder.path().join("out")).len(), 6, "the frames stand, and nothing else");
}

#[test]
fn what_cannot_be_filmed_is_refused() {
    let folder = folder();
    fs::write(folder.path().join("file"), "").unwrap();
    fs::write(folder.path().join("bad.toml"), FILM.replace("fps = 3", "fsp = 3")).unwrap();
    let before = listing(&folder);
    for (arguments, words) in [
        ("film walk.toml", &["--output"][..]),
        ("film walk.toml -o out --frames 6..9", &["--frames", "6 frames"]),
        ("film walk.toml -o out --frames 3..3", &["--frames", "3..3"]),
        ("film walk.toml -o out --frames 1-3", &["--frames", "0..48"]),
        ("film walk.toml -o out --format jpg", &["--format", "png"]),
        ("film walk.toml -o out --format exr --exposure 1", &["--exposure"]),
        ("film walk.toml -o out --exposure auto", &["--exposure", "flicker"]),
        ("film walk.toml -o out --format exr --video mp4", &["--video"]),
        ("film walk.toml -o out --video avi", &["--video", "webm"]),
        ("film walk.toml -o out --size 0x4", &["--size"]),
        ("film walk.toml -o out --set light.panel.samples=3", &["panel"]),
        ("film walk.toml -o file", &["file", "is not a folder"]),
        ("film bad.toml -o out", &["bad.toml:3", "fsp", "fps"]),
        ("film missing.toml -o out", &["missing.toml", "does not exist"]),
        ("film bax -o out", &["bax", "box"]),
        ("film cube.toml -o out", &["cube.toml:1", "model"]),
    ] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let output = lightpaths(&folder, &arguments).output().unwrap();
        assert_refused(&output, 2, words);
        assert_eq!(listing(&folder), before, "{arguments:?}");
    }
    let mut hidden = film_command(&folder, &["-o", "out"]);
    hidden.env("VK_ICD_FILENAMES", "/nonexistent").env("VK_DRIVER_FILES", "/nonexistent");
    assert_refused(&hidden.output().unwrap(), 3, &["Vulkan"]);
    assert_eq!(listing(&folder), before);
}

/// A slab that rises, rests for two frames and turns.
const MOVES: &str = r#"
scene = "slab.toml"
fps = 2
duration = 2.5
[[model]]
name = "slab"
time = 0.0
translate = [0.0, 0.2, -0.3]
[[model]]
name = "slab"
time = 0.5
translate = [0.0, 0.5, -0.3]
rotate = [0.0, 0.0, 0.0]
[[model]]
name = "slab"
time = 1.0
rotate = [0.0, 0.0, 0.0]
[[model]]
name = "slab"
time = 1.5
rotate = [0.0, 40.0, 0.0]
[[model]]
name = "slab"
time = 2.0
hidden = true
"#;

#[test]
fn moved_models_make_the_pictures_of_cold_starts_whatever_the_range() {
    let slab = "v -0.4 0 -0.4\nv 0.4 0 -0.4\nv 0.4 0 0.2\nv -0.4 0 0.2\nf 4 3 2 1\nf 1 2 3 4\n";
    let scene = format!("{CUBE_SCENE}[[model]]\nfile = \"slab.obj\"\n");
    let folder =
        folder_with(&[("cube.obj", CUBE), ("slab.obj", slab), ("slab.toml", &scene), ("walk.toml", MOVES)]);
    fs::create_dir(folder.path().join("bin")).unwrap();
    let output = film(&folder, &["-o", "whole", "--video", "none"]);
    assert!(stdout(&output).contains("frames 0 to 4 of 5, 8x8"), "{}", stdout(&output));
    film(&folder, &["-o", "shares", "--frames", "2..5", "--cache", "kept"]);
    film(&folder, &["-o", "shares", "--frames", "..2"]);
    let pictures = |name: &str| -> Vec<_> {
        files(&folder.path().join(name))
            .into_iter()
            .map(|(_, bytes)| image::load_from_memory(&bytes).unwrap())
            .collect()
    };
    let whole = pictures("whole");
    assert!(whole == pictures("shares"));
    let kept = folder.path().join("kept");
    assert!(!kept.exists() || files(&kept).is_empty(), "no place of a model takes the folder");
    let places: [&[&str]; 5] = [
        &["model.1.translate=[0, 0.2, -0.3]"],
        &["model.1.translate=[0, 0.5, -0.3]"],
        &["model.1.translate=[0, 0.5, -0.3]"],
        &["model.1.translate=[0, 0.5, -0.3]", "model.1.rotate=[0, 40, 0]"],
        &["model.1.hidden=true"],
    ];
    for (frame, (found, changes)) in whole.iter().zip(places).enumerate() {
        let changes = changes.iter().flat_map(|change| ["--set", change]);
        let arguments: Vec<&str> =
            ["render", "slab.toml", "-o", "cold.png"].into_iter().chain(SMALL).chain(changes).collect();
        let output = lightpaths(&folder, &arguments).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(*found == image::open(folder.path().join("cold.png")).unwrap(), "frame {frame}");
    }
    assert!(whole[0] != whole[1] && whole[1] == whole[2] && whole[2] != whole[3] && whole[3] != whole[4]);
}
