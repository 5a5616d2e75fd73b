//! The command line, as scripts use it: exit codes, one line for each failure, files
//! whole or absent.
#![allow(unreachable_pub, clippy::unwrap_used, reason = "a test may panic")]

mod cache;
#[path = "../common/mod.rs"]
mod common;
mod compare;
mod display;
mod error;
mod exact;
mod film;
mod init;
mod judge;
#[path = "../common/layer.rs"]
mod layer;
mod lights;
mod mattes;
mod memory;
mod meters;
mod outputs;
mod profile;
mod scale;
mod sweep;
mod textures;
mod time;
mod tune;

use std::fs;
use std::io::BufReader;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use common::channels;
use tempfile::TempDir;

/// Quality at which precomputation and frame of a small scene are fast.
const SMALL: [&str; 8] = [
    "--size",
    "32x32",
    "--set",
    "quality.entry_points=2000",
    "--set",
    "quality.gather_rays=64",
    "--set",
    "quality.cells=8",
];

/// A closed cube of two metres, with the camera and the light inside.
const CUBE: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 4 1 5 8\nf 2 3 7 6\n";
const CUBE_SCENE: &str = "[[model]]\nfile = \"cube.obj\"\n[camera]\nposition = [0, 1, 0.9]\ntarget = [0, 1, 0]\n\
up = [0, 1, 0]\nfov_y = 60.0\nsize = [8, 8]\n[[light]]\nname = \"lamp\"\nkind = \"point\"\n\
position = [0.2, 1.6, 0.1]\nintensity = [1, 1, 1]\n[quality]\ncache_points = 500\n";

const ROOM: &str = "[[model]]\nfile = \"room.obj\"\n[camera]\nposition = [0.3, 0.3, 2]\ntarget = [0.3, 0.3, 0]\nup = [0, 1, 0]\n\
fov_y = 40.0\nsize = [8, 8]\n";
const LIGHT: &str =
    "[[light]]\nname = \"lamp\"\nkind = \"point\"\nposition = [0.3, 0.3, 1]\nintensity = [1, 1, 1]\n";
const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// The program, with `folder` as its working directory.
fn lightpaths(folder: &TempDir, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    // Results must not depend on what is stored in the user's folder.
    command.current_dir(folder.path()).args(arguments).env("LIGHTPATHS_TUNING", "");
    command
}

fn run(folder: &TempDir, arguments: &[&str]) -> Output {
    lightpaths(folder, arguments).output().unwrap()
}

/// A folder with the scene `cube.toml`; pictures go elsewhere.
fn cube() -> TempDir {
    folder_with(&[("cube.obj", CUBE), ("cube.toml", CUBE_SCENE)])
}

/// `render`, in `folder`, of the cube at small settings.
fn render_cube(folder: &TempDir, cube: &TempDir, arguments: &[&str]) -> Command {
    let scene = cube.path().join("cube.toml");
    lightpaths(folder, &[&["render", scene.to_str().unwrap()], &SMALL[..], arguments].concat())
}

/// Runs [`render_cube`] and asserts success.
fn render(folder: &TempDir, arguments: &[&str]) -> Output {
    let output = render_cube(folder, &cube(), arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    output
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

fn listing(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Asserts the exit code, an empty stdout, and one line on stderr with all of `words`.
fn assert_refused(output: &Output, code: i32, words: &[&str]) {
    let line = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{words:?}: {line}");
    assert_eq!(stdout(output), "", "{words:?}");
    assert!(line.starts_with("lightpaths: ") && line.ends_with('\n') && line.lines().count() == 1, "{line}");
    for word in words {
        assert!(line.contains(word), "no {word:?} in {line}");
    }
}

fn folder_with(files: &[(&str, &str)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

#[test]
fn help_and_version_succeed_and_no_command_fails() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        (&["--help"][..], &["render", "time", "tune", "sweep", "judge", "compare", "info"][..]),
        (&["render", "--help"], &["--aov", "--exposure", "--tone", "--white-balance", "--set"]),
        (&["compare", "--help"], &["--heatmap", "--max-relmse", "--z-test"]),
        (&["film", "--help"], &["--frames", "--format", "--tone", "--video"]),
        (&["sweep", "--help"], &["--output", "--cache", "--seconds"]),
        (
            &["time", "--help"],
            &["--frames", "--json", "--predict", "--trace", "--repeat", "--capture", "--statistics"],
        ),
        (&["measure", "--help"], &["--by-light", "--csv", "--json"]),
        (&["solve", "--help"], &["--target", "--max-factor", "--output"]),
        (&["--version"], &[env!("CARGO_PKG_VERSION"), "features: "]),
        (&["completions", "bash"], &["_lightpaths()", "measure"]),
        (&["completions", "zsh"], &["#compdef lightpaths"]),
    ] {
        let output = run(&folder, arguments);
        assert!(output.status.success());
        assert!(words.iter().all(|word| stdout(&output).contains(word)), "{arguments:?}");
        assert_eq!(stderr(&output), "");
    }
    assert_eq!(run(&folder, &[]).status.code(), Some(2));
    assert_refused(&run(&folder, &["rendre"]), 2, &["rendre", "render"]);
}

#[test]
fn manual_pages_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(&folder, &["man", "-o", "man1"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let page = |name: &str| fs::read_to_string(folder.path().join("man1").join(name)).unwrap();
    assert!(page("lightpaths.1").contains("lightpaths\\-render"), "{}", page("lightpaths.1"));
    assert!(page("lightpaths-render.1").contains("target"));
}

#[test]
fn info_says_the_same_as_json() {
    let folder = cube();
    let output = run(&folder, &["info", "cube.toml", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let info: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(info["devices"][0]["limits"]["storage_range_bytes"].as_u64().unwrap() > 0);
    assert_eq!(
        (&info["scene"]["triangles"], &info["scene"]["lights"][0]["name"]),
        (&12.into(), &"lamp".into())
    );
    let place = &info["scene"]["lights"][0]["position"];
    for (axis, expected) in [0.2, 1.6, 0.1].into_iter().enumerate() {
        assert!((place[axis].as_f64().unwrap() - expected).abs() < 1e-6, "{place}");
    }
    let text = stdout(&run(&folder, &["info", "cube.toml"]));
    assert!(text.contains("lamp (point)"), "{text}");
}

#[test]
fn bad_scenes_are_refused_and_named() {
    let whole = format!("{ROOM}{LIGHT}");
    let unknown_key = format!("{ROOM}{LIGHT}colour = 3\n");
    let nan = TRIANGLE.replace("v 1 0 0", "v nan 0 0");
    let wrong_index = TRIANGLE.replace("f 1 2 3", "f 1 2 9");
    for (case, scene, model, words) in [
        ("missing model", &*whole, None, &["room.obj"][..]),
        ("broken number", &whole, Some("v 0 zero 0\n"), &["room.obj:1"]),
        ("broken index", &whole, Some(&*wrong_index), &["room.obj"]),
        ("no triangle", &whole, Some("v 0 0 0\n"), &["room.obj", "face"]),
        ("NaN vertex", &whole, Some(&nan), &["room.obj"]),
        ("no light", ROOM, Some(TRIANGLE), &["light"]),
        ("unknown key", &unknown_key, Some(TRIANGLE), &["scene.toml:14", "colour"]),
        ("no TOML", "[[model\n", Some(TRIANGLE), &["scene.toml:1"]),
        ("wrong type", "[[model]]\nfile = 3\n", Some(TRIANGLE), &["scene.toml:2", "file"]),
    ] {
        let mut files = vec![("scene.toml", scene)];
        files.extend(model.map(|text| ("room.obj", text)));
        let folder = folder_with(&files);
        let before = listing(&folder);
        println!("{case}");
        assert_refused(&run(&folder, &["render", "scene.toml", "-q", "-o", "a.png"]), 2, words);
        assert_refused(&run(&folder, &["time", "box", "scene.toml", "-q", "--json", "a.json"]), 2, words);
        assert_eq!(listing(&folder), before, "{case}");
    }
}

#[test]
fn a_scene_that_is_dark_on_purpose_is_black() {
    let dark = format!("light = []\n{ROOM}");
    let folder = folder_with(&[("scene.toml", &dark), ("room.obj", TRIANGLE)]);
    let render = [&["render", "scene.toml", "-o", "a.png", "--target-ms", "1000"][..], &SMALL[..]].concat();
    let output = run(&folder, &render);
    assert!(output.status.success(), "{}", stderr(&output));
    let picture = image::open(folder.path().join("a.png")).unwrap().to_rgb8();
    assert!(picture.pixels().all(|pixel| pixel.0 == [0; 3]));
    for arguments in ["time", "scale -o out", "sweep -o out", "figures -o out", "tune --dry-run"] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let output = run(&folder, &[&[arguments[0], "scene.toml", "-q"][..], &arguments[1..]].concat());
        assert_refused(&output, 2, &["scene.toml: is dark: without lights there is nothing to measure"]);
    }
}

#[test]
fn bad_arguments_are_refused_and_named() {
    let folder = folder_with(&[("old.txt", "")]);
    fs::create_dir(folder.path().join("folder.png")).unwrap();
    let before = listing(&folder);
    for (arguments, words) in [
        ("render -o a.png --size 0x0", &["--size", "0x0"][..]),
        ("render -o a.png --size 5", &["--size", "WIDTHxHEIGHT"]),
        ("render -o a.png --size 1000000x1000000", &["--size", "16384"]),
        ("render", &["--output"]),
        ("render -o a.jpg", &["a.jpg", ".exr", ".png"]),
        ("render -o a", &["a: ", ".exr", ".png"]),
        ("render -o missing/a.png", &["missing/a.png", "no folder missing"]),
        ("render -o folder.png", &["folder.png", "is a folder"]),
        ("render -o old.txt/a.png", &["old.txt"]),
        ("render -o a.png --stats missing/s.json", &["missing/s.json"]),
        ("render no_such_scene -o a.png", &["no_such_scene", "box"]),
        ("render no_such_scene.toml -o a.png", &["no_such_scene.toml"]),
        ("render box -o a.png --camera nobody", &["nobody"]),
        ("render box -o a.png --preset best", &["--preset", "draft"]),
        ("render box -o a.png --set quality.entry_point=1", &["entry_point"]),
        ("render box -o a.png --set nonsense", &["nonsense"]),
        ("render box -o a.png --set quality.entry_points=-1", &["quality.entry_points"]),
        ("render box -o a.png --method photon --spp 0", &["--spp"]),
        ("render box -o a.exr --method photon --aov variance", &["variance", "path"]),
        ("render box -o a.png --method path --spp 0", &["--spp"]),
        ("render box -o a.png --method path --seconds 0", &["--seconds", "positive"]),
        ("render box -o a.png --method path --seconds -1", &["--seconds", "positive"]),
        ("render box -o a.png --method path --seconds nan", &["--seconds", "positive"]),
        ("render box -o a.exr --method path --spp 2 --aov variance", &["variance", "--spp 4"]),
        ("render box -o a.exr --method direct --aov variance", &["variance", "path"]),
        ("render box -o a.png --spp 16", &["--spp"]),
        ("render box -o a.png --aov depth", &["--aov"]),
        ("render box -o a.exr --aov colour", &["colour", "albedo"]),
        ("render box -o a.exr --exposure 1", &["--exposure"]),
        ("render box -o a.png --exposure nan", &["--exposure"]),
        ("time box --frames 0", &["--frames"]),
        ("time box --lights 1,0", &["--lights"]),
        ("time box --repeat gather 5 --predict us=3", &["--repeat", "--predict"]),
        ("time box --json missing/t.json", &["missing/t.json"]),
    ] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        assert_refused(&run(&folder, &arguments), 2, words);
        assert_eq!(listing(&folder), before, "{arguments:?}");
    }
}

#[test]
fn a_folder_without_write_permission_is_refused() {
    // Even root cannot write here.
    if cfg!(target_os = "linux") {
        let folder = tempfile::tempdir().unwrap();
        assert_refused(&run(&folder, &["render", "box", "-o", "/proc/a.png"]), 2, &["/proc/a.png"]);
    }
}

#[test]
fn no_device_is_said_and_the_old_file_survives() {
    let folder = folder_with(&[("a.png", "old")]);
    let hidden = |arguments: &[&str]| {
        let mut command = lightpaths(&folder, arguments);
        command.env("VK_ICD_FILENAMES", "/nonexistent").env("VK_DRIVER_FILES", "/nonexistent");
        command.output().unwrap()
    };
    for arguments in [&["render", "-o", "a.png"][..], &["time", "-q", "--json", "t.json"], &["info"]] {
        assert_refused(&hidden(arguments), 3, &["Vulkan", "install"]);
    }
    let output = hidden(&["info", "box"]);
    assert!(output.status.success(), "a scene can be looked at without a device");
    assert!(stdout(&output).contains("no usable Vulkan device") && stdout(&output).contains("triangles"));
    let output = run(&folder, &["render", "-o", "a.png", "--device", "no such device"]);
    assert_refused(&output, 3, &["no such device"]);
    assert_eq!(listing(&folder), ["a.png"]);
    assert_eq!(fs::read_to_string(folder.path().join("a.png")).unwrap(), "old");
}

#[test]
fn png_and_statistics() {
    let folder = tempfile::tempdir().unwrap();
    let output = render(&folder, &["-o", "a.png", "--stats", "s.json"]);
    assert!(stdout(&output).contains("a.png: 32x32"), "{}", stdout(&output));
    assert_eq!(listing(&folder), ["a.png", "s.json"]);

    let file = BufReader::new(fs::File::open(folder.path().join("a.png")).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut codes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut codes).unwrap();
    assert_eq!((reader.info().width, reader.info().height, codes.len()), (32, 32, 32 * 32 * 3));
    let mean = codes.iter().map(|&code| f64::from(code)).sum::<f64>() / codes.len() as f64;
    assert!((16.0..240.0).contains(&mean), "neither black nor white: mean code {mean}");

    let statistics = json(&folder, "s.json");
    assert_eq!(statistics["quality"]["entry_points"], 2000);
    assert!(statistics["renderer"]["precompute_s"].as_f64().unwrap() > 0.0);
    assert!(!statistics["frame"]["passes"].as_array().unwrap().is_empty());
}

#[test]
fn exr_layers_add_up_and_cold_runs_agree() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let aovs = ["--aov", "depth,direct,indirect,albedo,normal"];
    let output = render(&folder, &[&["-q", "--validation", "-o", "a.exr"], &aovs[..]].concat());
    assert_eq!(stderr(&output), "", "the validation layers are silent");
    // Two runs at once disturb each other: no result may depend on the speed of the device.
    let run = |name| {
        render_cube(&folder, &cube, &[&["-q", "-o", name], &aovs[..]].concat())
            .stdout(Stdio::null())
            .spawn()
            .unwrap()
    };
    for mut run in [run("b.exr"), run("c.exr")] {
        assert!(run.wait().unwrap().success());
    }
    assert_eq!(listing(&folder), ["a.exr", "b.exr", "c.exr"]);
    let [a, b, c] = ["a.exr", "b.exr", "c.exr"].map(|name| fs::read(folder.path().join(name)).unwrap());
    assert!(a == b && b == c, "cold runs differ");

    let channels = channels(&folder.path().join("a.exr"));
    let names = "B G R albedo.B albedo.G albedo.R depth.Z direct.B direct.G direct.R indirect.B indirect.G indirect.R \
                 normal.X normal.Y normal.Z";
    assert_eq!(channels.keys().cloned().collect::<Vec<_>>().join(" "), names);
    for channel in ["R", "G", "B"] {
        let [beauty, direct, indirect] =
            ["", "direct.", "indirect."].map(|layer| &channels[&format!("{layer}{channel}")]);
        for pixel in 0..32 * 32 {
            let sum = direct[pixel] + indirect[pixel];
            assert!(
                (beauty[pixel] - sum).abs() <= 1e-5 * (1e-3 + sum),
                "pixel {pixel}: {} {sum}",
                beauty[pixel]
            );
        }
        assert!(indirect.iter().sum::<f32>() > 0.0, "there is indirect light");
    }
    let [x, y, z] = ["X", "Y", "Z"].map(|axis| channels[&format!("normal.{axis}")].as_slice());
    for ((x, y), z) in x.iter().zip(y).zip(z) {
        let length = (x * x + y * y + z * z).sqrt();
        assert!((length - 1.0).abs() < 1e-3, "the room fills the image with unit normals: {length}");
    }
    assert!(channels["depth.Z"].iter().all(|&depth| depth > 0.0));
}

#[test]
fn the_direct_method_is_the_direct_layer() {
    let folder = tempfile::tempdir().unwrap();
    render(&folder, &["-o", "a.exr", "--method", "direct", "--aov", "direct"]);
    let channels = channels(&folder.path().join("a.exr"));
    assert_eq!(channels.len(), 6);
    // The device multiplies albedo and irradiance of the picture, the host those of the layer: the
    // last bit may differ.
    for (picture, layer) in channels["R"].iter().zip(&channels["direct.R"]) {
        assert!((picture - layer).abs() <= 4.0 * f32::EPSILON * layer, "{picture}, {layer}");
    }
    assert!(channels["R"].iter().any(|&value| value > 0.0));
}

#[test]
fn photon_mapping_renders_all_layers_and_says_what_it_took() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let aovs = "direct,indirect,albedo,normal,depth";
    for name in ["a.exr", "b.exr"] {
        let arguments = ["--method", "photon", "--spp", "3", "--aov", aovs, "-o", name, "--stats", "s.json"];
        let output = render_cube(&folder, &cube, &arguments).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(stdout(&output).contains("3 samples a pixel"), "{}", stdout(&output));
    }
    assert!(fs::read(folder.path().join("a.exr")).unwrap() == fs::read(folder.path().join("b.exr")).unwrap());
    let statistics = json(&folder, "s.json");
    assert_eq!((&statistics["method"], &statistics["spp"]), (&"photon".into(), &3.into()));
    let channels = channels(&folder.path().join("a.exr"));
    for name in ["direct.R", "indirect.G", "albedo.B", "normal.Z", "depth.Z"] {
        assert!(channels.contains_key(name), "{name}");
    }
    for (index, value) in channels["R"].iter().enumerate() {
        let sum = channels["direct.R"][index] + channels["indirect.R"][index];
        assert!((value - sum).abs() <= 1e-6 * value.abs().max(1e-6), "{value}, {sum}");
    }
    assert!(channels["R"].iter().any(|value| *value > 0.0));
}

#[test]
fn a_killed_render_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = lightpaths(&folder, &["render", "-o", "a.png"]).stdout(Stdio::null()).spawn().unwrap();
    // Time for the process to begin; the test does not depend on it.
    std::thread::sleep(std::time::Duration::from_millis(200));
    let finished = child.try_wait().unwrap().is_some();
    child.kill().unwrap();
    child.wait().unwrap();
    // If the process has finished by then, the picture is whole.
    assert!(finished || listing(&folder).is_empty(), "{:?}", listing(&folder));
}

#[test]
fn a_reader_that_goes_away_is_no_panic() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = lightpaths(&folder, &["info", "box"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
}

fn json(folder: &TempDir, name: &str) -> serde_json::Value {
    serde_json::from_slice(&fs::read(folder.path().join(name)).unwrap()).unwrap()
}
