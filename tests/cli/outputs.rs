//! Outputs that are inputs, names that reach the terminal, and numbers as arguments.

use super::*;
use lightpaths::image::{ExrLayer, write_exr};

/// The cube with an image, and all other kinds of files that a scene reads.
fn scene() -> TempDir {
    let folder = folder_with(&[
        ("cube.obj", &format!("mtllib cube.mtl\nvt 0 0\nusemtl wall\n{CUBE}")),
        ("cube.mtl", "newmtl wall\nKd .5 .5 .5\nmap_Kd wall.png\n"),
        ("cube.toml", CUBE_SCENE),
        ("film.toml", "scene = \"cube.toml\"\nfps = 2\nduration = 1\n"),
    ]);
    let png = fs::File::create(folder.path().join("wall.png")).unwrap();
    lightpaths::image::write_png(png, [1, 1], &[[99; 4]]).unwrap();
    fs::create_dir(folder.path().join("out")).unwrap();
    folder
}

/// Inputs of that scene.
const INPUTS: [&str; 4] = ["cube.toml", "cube.obj", "cube.mtl", "wall.png"];

fn contents(folder: &TempDir) -> Vec<(PathBuf, Vec<u8>)> {
    let files = |folder: PathBuf| fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let all = files(folder.path().to_owned()).chain(files(folder.path().join("out")));
    let mut all: Vec<_> =
        all.filter(|path| path.is_file()).map(|path| (path.clone(), fs::read(path).unwrap())).collect();
    all.sort();
    all
}

/// Runs a command that must be refused, and asserts that every file stays.
#[track_caller]
fn refuse(folder: &TempDir, arguments: &str, words: &[&str]) {
    let before = contents(folder);
    let output = run(folder, &arguments.split(' ').collect::<Vec<_>>());
    assert_refused(&output, 2, words);
    assert!(contents(folder) == before, "{arguments}");
}

#[test]
fn outputs_that_are_inputs_are_refused() {
    let folder = scene();
    for input in INPUTS {
        for command in [
            "render cube.toml -o a.png --stats",
            "precompute cube.toml -o",
            "time cube.toml --json",
            "time cube.toml --trace",
        ] {
            refuse(&folder, &format!("{command} {input}"), &[input, "input"]);
            refuse(&folder, &format!("{command} ./{input}"), &[input, "input"]);
        }
    }
    refuse(&folder, "render cube.toml -o wall.png", &["wall.png", "input"]);
    refuse(&folder, "render cube.obj -o wall.png", &["wall.png", "input"]);
    refuse(&folder, "compare wall.png wall.png --heatmap wall.png", &["wall.png", "input"]);
}

#[cfg(unix)]
#[test]
fn links_to_inputs_are_refused_where_they_would_be_written() {
    let folder = scene();
    for (name, command) in [
        ("link.png", "render cube.toml -o link.png"),
        ("link.json", "time cube.toml --json link.json"),
        ("out/frame-00001.png", "film film.toml -o out"),
        ("out/frame-00001.exr", "film film.toml -o out --format exr --frames 1.."),
        ("out/film.mp4", "film film.toml -o out"),
        ("out/sweep.json", "sweep cube.toml -o out"),
        ("out/light-paths-flip.png", "sweep cube.toml -o out"),
        ("out/path-tracing.png", "sweep cube.toml -o out"),
        ("out/error-first.svg", "sweep cube.toml -o out"),
        ("out/figure-cube.html", "figures cube.toml -o out"),
        ("out/figure-cube-our-method.png", "figures cube.toml -o out"),
        ("out/judge.json", "judge cube.toml -o out"),
        ("out/stages.png", "judge cube.toml -o out"),
        ("out/scale.json", "scale cube.toml -o out"),
        ("out/memory.svg", "scale cube.toml -o out"),
    ] {
        let link = folder.path().join(name);
        let film = command.starts_with("film").then_some("film.toml");
        for input in INPUTS.into_iter().chain(film) {
            let input_path = folder.path().join(input);
            fs::hard_link(&input_path, &link).unwrap();
            refuse(&folder, command, &[name, input, "input"]);
            fs::remove_file(&link).unwrap();
            std::os::unix::fs::symlink(&input_path, &link).unwrap();
            refuse(&folder, command, &[name, input, "input"]);
            fs::remove_file(&link).unwrap();
        }
    }
    fs::write(folder.path().join("out/frame-00000.png"), "").unwrap();
    fs::hard_link(folder.path().join("out/frame-00000.png"), folder.path().join("out/frame-00001.png"))
        .unwrap();
    refuse(&folder, "film film.toml -o out", &["frame-00000.png", "frame-00001.png", "one file"]);
}

#[test]
fn two_outputs_of_one_file_are_refused() {
    let folder = scene();
    refuse(&folder, "render cube.toml -o a.png --stats ./a.png", &["two outputs", "a.png"]);
    refuse(&folder, "render cube.toml -o a.png --cache a.png", &["two outputs", "a.png"]);
}

/// A name with terminal control sequences.
const ODD: &str = "a\u{1b}]0;title\u{7}\u{9b}2J\rb";

#[test]
fn names_reach_the_terminal_without_control_characters() {
    let folder = tempfile::tempdir().unwrap();
    let pixels = vec![[0.5; 3]; 4];
    let layers = [ODD, "Größe"].map(|name| ExrLayer { name, channels: &["R", "G", "B"], pixels: &pixels });
    let write =
        |name: &str| write_exr(fs::File::create(folder.path().join(name)).unwrap(), [2, 2], &layers).unwrap();
    write("a.exr");
    let odd_file = format!("{}.exr", ODD.replace('/', ""));
    write(&odd_file);
    let is_clean = |output: &Output| {
        let said = stdout(output) + &stderr(output);
        assert!(!said.contains(|c: char| c.is_control() && c != '\n'), "{said:?}");
        assert_eq!(said.lines().count(), 1, "{said:?}");
        said
    };
    for arguments in [
        &["compare", "a.exr", "a.exr"][..],
        &["compare", &odd_file, &odd_file],
        &["compare", "a.exr", "a.exr", "--layer", ODD, "--reference-layer", "x"],
        &["compare", ODD, "a.exr"],
        &["compare", "a.exr", "a.exr", ODD],
        &["render", ODD, "-o", "a.png"],
        &["render", "box", "-o", ODD],
        &["render", "box", "-o", "a.png", "--camera", ODD],
        &["render", "box", "-o", "a.png", "--set", ODD],
        &["render", "box", "-o", "a.png", "--set", &format!("light.{ODD}.power=1")],
        &["film", ODD, "-o", "x"],
    ] {
        let output = run(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        is_clean(&output);
    }
    let said = is_clean(&run(&folder, &["compare", "a.exr", "a.exr"]));
    assert!(said.contains(r"a\u{1b}]0;title\u{7}\u{9b}2J\rb") && said.contains("`Größe`"), "{said}");
    // A successful command prints the name of its output file.
    let output = render_cube(&folder, &cube(), &["-o", &odd_file]).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    is_clean(&output);
}

#[test]
fn numbers_are_refused_with_what_was_expected_and_an_example() {
    let folder = scene();
    for (arguments, words) in [
        (
            "scale cube.toml -o out --lights a,b",
            &["'a'", "--lights", "whole numbers from 1 to 4096", "as in 1,16,256"][..],
        ),
        ("scale cube.toml -o out --lights 1,,2", &["''", "--lights", "as in"]),
        ("scale cube.toml -o out --lights 1;2", &["'1;2'", "--lights", "commas"]),
        ("scale cube.toml -o out --triangles 0", &["'0'", "--triangles", "from 1 on", "as in"]),
        ("scale cube.toml -o out --entry-points 1e6", &["'1e6'", "--entry-points", "as in"]),
        ("scale cube.toml -o out --cache-points -5", &["'-5'", "--cache-points", "as in"]),
        ("time cube.toml --lights 0", &["'0'", "--lights", "1 to 256", "as in 1,2,4,8"]),
        ("time cube.toml --predict 3000,1.5,3", &["'3000,1.5,3'", "--predict", "as in gbps=3000"]),
        ("time cube.toml --predict us=1,us=2", &["--predict", "us is there twice"]),
        ("time cube.toml --frames many", &["'many'", "--frames", "1 to 100000", "as in 20"]),
        ("render cube.toml -o a.png --method path --spp x", &["'x'", "--spp", "as in 64"]),
        ("render cube.toml -o a.png --method path --seconds x", &["'x'", "--seconds", "as in 2.5"]),
        ("render cube.toml -o a.png --exposure x", &["'x'", "--exposure", "as in -1.5"]),
        ("render cube.toml -o a.png --size 0x5", &["'0x5'", "--size", "as in 640x480"]),
        ("render cube.toml -o a.png --size big", &["'big'", "--size", "as in 640x480"]),
        ("render cube.toml -o a.png --cache c --cache-limit x", &["'x'", "--cache-limit", "as in 500M"]),
        ("film film.toml -o out --frames x", &["'x'", "--frames", "as in 0..48"]),
        ("sweep cube.toml -o out --spp 3", &["'3'", "--spp", "from 4 on", "as in 256"]),
        ("compare wall.png wall.png --max-relmse x", &["'x'", "--max-relmse", "as in 1e-3"]),
    ] {
        refuse(&folder, arguments, words);
    }
}
