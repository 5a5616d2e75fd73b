//! Scenes that are refused, and the messages.

use lightpaths::scene::{LoadOptions, Scene};
use lightpaths::{Error, Result};

use super::{CAMERA, HEAD, LIGHT, SQUARE, good_toml, load, load_files, set};

/// The one line of the error message, without the folder's name.
pub(super) fn message(result: Result<Scene>) -> String {
    let error = result.unwrap_err();
    assert_eq!(error.exit_code(), 2, "{error}");
    let text = error.to_string();
    assert!(!text.contains('\n'), "more than one line: {text:?}");
    match &error {
        Error::Input { file, .. } => text.replace(&format!("{}/", file.parent().unwrap().display()), ""),
        _ => text,
    }
}

fn refuses(toml: &str, obj: &str, expected: &str) {
    let found = message(load(toml, obj));
    assert!(found.contains(expected), "expected {expected:?}, found {found:?}");
}

#[test]
fn bad_scene_files_are_refused() {
    let good = good_toml();
    let with = |more: &str| format!("{good}{more}");
    refuses("model = [", SQUARE, "s.toml:1: is not TOML: ");
    refuses(&with("[quality]\nentry_pionts = 5\n"), SQUARE, "s.toml:12: quality.entry_pionts: unknown key");
    refuses(&with("[quality]\nentry_pionts = 5\n"), SQUARE, "did you mean `entry_points`?");
    refuses(&with("[sky]\n"), SQUARE, "s.toml:11: sky: unknown key `sky`");
    refuses(&with("[quality]\npreset = \"ultra\"\n"), SQUARE, "possible: draft, paper, high");
    refuses(
        &with("[quality]\ngather_rays = 250\n"),
        SQUARE,
        "s.toml:12: quality.gather_rays: 250 is not 4·k²: the nearest is 256",
    );
    refuses(&with("[quality]\ncells = 48\n"), SQUARE, "quality.cells: 48 is not a power of two");
    refuses(&with("[quality]\nentry_points = 0\n"), SQUARE, "entry_points: 0 is out of range: 1 to 16777216");
    refuses(&with("[quality]\nseed = 1.5\n"), SQUARE, "quality.seed: a whole number was expected, found 1.5");
    refuses(
        &with("[[material]]\nname = \"glass\"\n"),
        SQUARE,
        "s.toml:12: material.glass.name: unknown material `glass`",
    );
    refuses(
        &with("[[material]]\nname = \"default\"\ndiffuse = [0.5, 2.0, 0.5]\n"),
        SQUARE,
        "s.toml:13: material.default.diffuse: 2.0 is out of range",
    );
    refuses(&with(LIGHT), SQUARE, "s.toml:12: light.lamp.name: \"lamp\" is there twice");
    refuses(
        &good.replace("[0, 1, 3]", "[0, nan, 3]"),
        SQUARE,
        "s.toml:4: camera.position: NaN is not a finite number",
    );
    refuses(
        &good.replace("[0, 1, 3]", "[0, \"1\", 3]"),
        SQUARE,
        "s.toml:4: camera.position: a list of three numbers was expected",
    );
    refuses(&good.replace("[0, 1, 3]", "[0, 0, 0]"), SQUARE, "camera.target: must differ from the position");
    refuses(&good.replace("[0, 1, 3]", "[0, 5, 0]"), SQUARE, "camera.up: must not be parallel");
    refuses(
        &good.replace("[camera]", "[camera]\nsize = [0, 0]"),
        SQUARE,
        "s.toml:4: camera.size: 0 is out of range: 1 to 16384",
    );
    refuses(
        &good.replace("[camera]", "[camera]\nfov_y = 180"),
        SQUARE,
        "camera.fov_y: 180.0 is out of range",
    );
    refuses(
        &good.replace("target = [0, 0, 0]\n", ""),
        SQUARE,
        "s.toml:3: camera: the key `target` is missing",
    );
    refuses(
        &good.replace("\"point\"", "\"piont\""),
        SQUARE,
        "s.toml:8: light.lamp.kind: unknown kind of light `piont`: did you mean `point`?",
    );
    refuses(
        &good.replace("intensity", "angle = 3\nintensity"),
        SQUARE,
        "s.toml:10: light.lamp.angle: unknown key",
    );
    refuses(
        &good.replace("[1, 1, 1]", "[1, -1, 1]"),
        SQUARE,
        "s.toml:10: light.lamp.intensity: -1.0 is out of range",
    );
    refuses(
        &good.replace("[[light]]", "[light]"),
        SQUARE,
        "s.toml:6: light: must be a list of tables: write [[light]]",
    );
    refuses(
        &good.replace("m.obj\"", "m.obj\"\nscale = 0"),
        SQUARE,
        "s.toml:3: model.0.scale: must not be smaller",
    );
    refuses(&format!("{HEAD}{CAMERA}"), SQUARE, "s.toml: the scene has no light");
    refuses(&format!("{CAMERA}{LIGHT}"), SQUARE, "s.toml: the scene has no model");
    refuses("", SQUARE, "s.toml: the scene has no model");
    // Deep nesting must not exhaust the stack.
    refuses(&format!("a = {}", "[".repeat(100_000)), SQUARE, "s.toml:1: is not TOML");
    refuses(&format!("{}a = 1", "a.".repeat(100_000)), SQUARE, "is not TOML");
    refuses(&format!("[{}a]", "a.".repeat(100_000)), SQUARE, "is not TOML");
}

#[test]
fn bad_files_are_refused() {
    let missing = message(load(&good_toml().replace("m.obj", "gone.obj"), SQUARE));
    assert!(
        missing.starts_with("s.toml:2: model.0.file: ") && missing.contains("gone.obj\" does not exist"),
        "{missing}"
    );
    let none = LoadOptions::default();
    let text = message(Scene::load("no/such.toml", &none));
    assert_eq!(text, "such.toml: does not exist: check the path");
    assert!(message(Scene::load("no/such.obj", &none)).contains("such.obj: does not exist"));
    let folder = tempfile::Builder::new().suffix(".toml").tempdir().unwrap();
    assert!(message(Scene::load(folder.path().to_str().unwrap(), &none)).contains("is a directory"));
    let folder = tempfile::Builder::new().suffix(".obj").tempdir().unwrap();
    assert!(message(Scene::load(folder.path().to_str().unwrap(), &none)).contains("is a directory"));
    let latin1 = message(load_files(&[("s.toml", b"a = 1\n# caf\xe9\n")], "s.toml", &none));
    assert_eq!(latin1, "s.toml:2: is not UTF-8 text: save it as UTF-8 (is it the right file?)");
    let sponza = message(Scene::load("sponza", &none));
    let known = "unknown built-in scene `sponza`: possible: box, atrium, room; or give the path";
    assert!(sponza.contains(known), "{sponza}");
    assert!(message(Scene::load("bos", &none)).contains("did you mean `box`?"));
}

#[test]
fn bad_models_are_refused() {
    let toml = good_toml();
    refuses(&toml, "", "m.obj: holds no face");
    refuses(&toml, "what is this\n", "m.obj: holds no face");
    refuses(&toml, "v 0 0 0\nv 1 nan 0\n", "m.obj:2: v: \"1 nan 0\" is not a finite position");
    refuses(&toml, "v 0 0 1e999\n", "m.obj:1: v: ");
    refuses(&toml, "v 0 0\n", "m.obj:1: v: three numbers were expected");
    refuses(&toml, "v 0 x 0\n", "m.obj:1: v: \"x\" is not a number");
    refuses(&toml, "v 0 0 0\nf 1 1\n", "m.obj: holds no face");
    refuses(
        &toml,
        &format!("{SQUARE}f 1 2 9\nv 2 2 2\n"),
        "m.obj:6: f: index 9 is out of range: the file has 5 vertices",
    );
    refuses(&toml, &format!("{SQUARE}f 1 2 0\n"), "m.obj:6: f: index 0 is out of range");
    refuses(
        &toml,
        &format!("{SQUARE}f 1 2 -5\n"),
        "m.obj:6: f: index -5 is out of range: 4 vertices precede it",
    );
    refuses(
        &toml,
        &format!("{SQUARE}f 4294967296 2 -9223372036854775808\n"),
        "m.obj:6: f: index -9223372036854775808",
    );
    refuses(&toml, &format!("{SQUARE}f 1 2 x/1\n"), "m.obj:6: f: \"x/1\" is not a corner");
    refuses(
        &toml,
        "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\nf 1 1 2\n",
        "s.toml: no triangle with an area is left of 2",
    );
    refuses(&toml, "v 0 0 0\nv 1e30 0 0\nv 0 1e30 0\nf 1 2 3\n", "m large, 1e-9 to 1e9 m expected");
}

#[test]
fn bad_settings_are_refused() {
    for (change, expected) in [
        ("quality", "KEY=VALUE was expected"),
        ("quality.cells=", "the value is not TOML"),
        ("quality.cells=[1", "the value is not TOML"),
        (
            "quality.cell=8",
            "quality.cell: unknown key `cell`: did you mean `cells`? possible: preset, entry_points",
        ),
        ("quality.cells=7", "--set quality.cells=7: quality.cells: 7 is out of range: 8 to 256"),
        ("quality.cells=\"a\"", "a whole number was expected, found the string \"a\""),
        ("quality.preset=best", "unknown preset `best`"),
        ("kwality.cells=8", "did you mean `quality`? possible: model, camera"),
        ("camera.sise=[1,1]", "unknown key `sise`: did you mean `size`?"),
        ("camera.side.size=[1,1]", "unknown key `side`"),
        ("camera.size=[0,1]", "camera.size: 0 is out of range"),
        ("light.lamp=3", "light.NAME.KEY or light.NUMBER.KEY was expected"),
        ("light.lampe.position=[0,0,0]", "unknown light `lampe`: did you mean `lamp`? possible: lamp"),
        ("light.7.position=[0,0,0]", "unknown light `7`"),
        ("material.tea.diffuse=[0,0,0]", "unknown material `tea`"),
        ("model.3.scale=2", "unknown model `3`"),
        ("a b=3", "is not a dotted key"),
        ("=3", "is not a dotted key"),
        ("quality.cells=8\nx", "--set quality.cells=8 x"),
    ] {
        let found = message(Scene::load("box", &set(&[change])));
        assert!(found.contains(expected) && found.starts_with("--set "), "{change}: {found:?}");
    }
    let size = LoadOptions { size: Some([0, 0]), ..Default::default() };
    assert!(message(Scene::load("box", &size)).contains("--size 0x0: width and height must be 1 to 16384"));
    let preset = LoadOptions { preset: Some("papper".to_owned()), ..Default::default() };
    let found = message(Scene::load("box", &preset));
    assert!(
        found.starts_with("--preset: quality.preset: unknown preset `papper`: did you mean `paper`?"),
        "{found}"
    );
}

/// Mutated files never panic; an error is one line.
#[test]
fn mutated_files_do_not_panic() {
    let toml = format!(
        "{}[quality]\npreset = \"draft\"\n[[material]]\nname = \"a\"\nspecular = [0.1, 0.1, 0.1]\n",
        good_toml()
    );
    let obj = format!(
        "mtllib m.mtl\no x\nusemtl a\nvt 0 0\nvn 0 1 0\n{SQUARE}f -4/1/1 -3/1/1 -2//1\nf 1 2/1 3 # end\n"
    );
    let mtl = "newmtl a\nKd 0.5 0.5 0.5\nKs 0 0 0\nNs 10\nKe 0 0 1\nmap_Kd -s 2 1 -clamp on a.tga\n";
    let image = super::textures::tga();
    let tokens: [&[u8]; 14] = [
        b"nan",
        b"-1",
        b"1e308",
        b"0",
        b"/",
        b"\n",
        b" ",
        b"[",
        b"\"",
        b"=",
        b"99999999999999999999",
        b"#",
        b"\xff",
        b".",
    ];
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut loaded = 0;
    for _ in 0..3000 {
        let mut files =
            [toml.clone().into_bytes(), obj.clone().into_bytes(), mtl.as_bytes().to_vec(), image.clone()];
        let file = &mut files[random(4)];
        for _ in 0..=random(3) {
            let (at, token) = (random(file.len()), tokens[random(tokens.len())]);
            let end = (at + random(4)).min(file.len());
            file.splice(at..end, token.iter().copied());
        }
        let names = ["s.toml", "m.obj", "m.mtl", "a.tga"];
        let files: Vec<(&str, &[u8])> = names.into_iter().zip(files.iter().map(Vec::as_slice)).collect();
        match load_files(&files, "s.toml", &LoadOptions::default()) {
            Ok(scene) => {
                loaded += 1;
                assert!(
                    scene.triangles.iter().all(|t| t
                        .normals
                        .iter()
                        .chain(&t.positions)
                        .all(|v| v.is_finite()))
                );
                assert!(scene.warnings.iter().all(|warning| !warning.contains('\n')));
            }
            Err(error) => {
                assert_eq!(error.exit_code(), 2);
                assert!(!error.to_string().contains('\n'), "{error}");
            }
        }
    }
    assert!((300..2700).contains(&loaded), "{loaded} of 3000 loaded: the mutations test too little");
}
