//! Tone curves and white balance of pictures.

use super::*;
use lightpaths::image::read;

/// Renders the cube with these arguments, without messages. Returns the bytes of the PNG.
fn png(folder: &TempDir, scene: &str, arguments: &[&str]) -> Vec<u8> {
    let output = run(folder, &[&["render", scene, "-o", "a.png", "-q"], &SMALL[..], arguments].concat());
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    fs::read(folder.path().join("a.png")).unwrap()
}

fn scene_folder(scene: &str) -> TempDir {
    folder_with(&[("cube.obj", CUBE), ("a.toml", scene)])
}

#[test]
fn each_tone_curve_gives_another_picture_and_standard_is_the_default() {
    // The light is so bright that some values are beyond 0.8.
    let folder = scene_folder(&CUBE_SCENE.replace("intensity = [1, 1, 1]", "intensity = [12, 12, 12]"));
    let mut seen = vec![png(&folder, "a.toml", &[])];
    assert_eq!(png(&folder, "a.toml", &["--tone", "standard"]), seen[0]);
    assert_eq!(png(&folder, "a.toml", &["--white-balance", "6504", "--tint", "0"]), seen[0]);
    for arguments in [
        ["--tone", "none"],
        ["--tone", "filmic"],
        ["--tone", "aces"],
        ["--tone", "agx"],
        ["--white-balance", "3000"],
        ["--tint", "-9"],
    ] {
        let bytes = png(&folder, "a.toml", &arguments);
        assert!(!seen.contains(&bytes), "{arguments:?}");
        seen.push(bytes);
    }
    // Metrics of displayed values see the curve; a PNG is taken as it is.
    let flip = |arguments: &str| {
        let output = run(&folder, &arguments.split(' ').collect::<Vec<_>>());
        let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        figures["flip"].as_f64().unwrap()
    };
    run(&folder, &[&["render", "a.toml", "-o", "b.exr", "-q"], &SMALL[..]].concat());
    fs::write(folder.path().join("standard.png"), &seen[0]).unwrap();
    fs::write(folder.path().join("agx.png"), &seen[4]).unwrap();
    let [near, far] =
        ["", " --tone agx"].map(|tone| flip(&format!("compare --json b.exr standard.png{tone}")));
    assert!(near < 0.02 && far > 5.0 * near, "{near} {far}");
    let same = flip("compare --json b.exr agx.png --tone agx");
    assert!(same < 0.02, "{same}");
    let codes = flip("compare --json standard.png agx.png");
    assert_eq!(codes, flip("compare --json standard.png agx.png --tone aces --white-balance 3000"));
}

/// Mean code of each channel, and the largest difference of two channels of a pixel.
fn means(folder: &TempDir) -> ([f64; 3], f32) {
    let picture = read(&folder.path().join("a.png"), None).unwrap();
    let codes = picture.display.unwrap();
    let mean = |channel: usize| {
        255.0 * codes.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>() / codes.len() as f64
    };
    let spread = |[r, g, b]: &[f32; 3]| 255.0 * (r.max(*g).max(*b) - r.min(*g).min(*b));
    ([0, 1, 2].map(mean), codes.iter().map(spread).fold(0.0, f32::max))
}

#[test]
fn grey_in_the_light_of_a_lamp_becomes_grey() {
    let lamp = CUBE_SCENE.replace("intensity = [1, 1, 1]", "candela = 300\nkelvin = 2700");
    let folder = scene_folder(&lamp);
    png(&folder, "a.toml", &["--tone", "none"]);
    let ([red, green, blue], _) = means(&folder);
    assert!(red > green + 20.0 && green > blue + 20.0, "{red} {green} {blue}");
    for tone in ["none", "standard", "filmic"] {
        png(&folder, "a.toml", &["--white-balance", "2700", "--tone", tone]);
        let ([red, green, blue], spread) = means(&folder);
        assert!(green > 20.0 && green < 230.0, "neither black nor white: {green}");
        // Dithering moves each code by less than 1.5, and the mean of 1024 pixels by less than 0.1.
        assert!((red - green).abs() < 0.15 && (green - blue).abs() < 0.15, "{tone}: {red} {green} {blue}");
        assert!(spread < 2.5, "{tone}: {spread}");
    }
}

#[test]
fn what_has_no_display_takes_no_curve() {
    let folder = scene_folder(CUBE_SCENE);
    for (arguments, words) in [
        ("render a.toml -o a.exr --tone agx", &["--tone", ".png"][..]),
        ("render a.toml -o a.exr --white-balance 2700", &["--white-balance", ".png"]),
        ("render a.toml -o a.png --false-color nits --tint 3", &["--tint", "--false-color"]),
        ("render a.toml -o a.png --tone reinhard", &["reinhard", "filmic", "agx"]),
        ("render a.toml -o a.png --white-balance 900", &["--white-balance", "1667", "2700"]),
        ("render a.toml -o a.png --white-balance nan", &["--white-balance", "25000"]),
        ("render a.toml -o a.png --tint 51", &["--tint", "50"]),
        ("film box -o out --format exr --tone none", &["--tone", "png"]),
    ] {
        let before = listing(&folder);
        assert_refused(&run(&folder, &arguments.split(' ').collect::<Vec<_>>()), 2, words);
        assert_eq!(listing(&folder), before, "{arguments}");
    }
}

#[test]
fn frames_of_a_film_are_those_of_render() {
    let film = "scene = \"a.toml\"\nfps = 2\nduration = 0.5\n";
    let folder = folder_with(&[("cube.obj", CUBE), ("a.toml", CUBE_SCENE), ("film.toml", film)]);
    let shown = ["--tone", "agx", "--white-balance", "4000", "--exposure", "1"];
    let still = png(&folder, "a.toml", &shown);
    let arguments =
        [&["film", "film.toml", "-o", "out", "-q", "--video", "none"], &SMALL[..], &shown].concat();
    let output = run(&folder, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    assert_eq!(fs::read(folder.path().join("out/frame-00000.png")).unwrap(), still);
}

/// The scene file's `[picture]` is that of the arguments, and arguments win.
#[test]
fn a_scene_file_states_how_its_picture_is_displayed() {
    let plain = scene_folder(CUBE_SCENE);
    let keys = "[picture]\nexposure = 1.5\ntone = \"agx\"\nwhite_balance = 3000.0\ntint = -5.0\n";
    let own = scene_folder(&format!("{CUBE_SCENE}{keys}"));
    let all = ["--exposure", "1.5", "--tone", "agx", "--white-balance", "3000", "--tint", "-5"];
    let stated = png(&own, "a.toml", &[]);
    assert_eq!(stated, png(&plain, "a.toml", &all));
    assert_ne!(stated, png(&plain, "a.toml", &[]));
    for flags in all.chunks(2) {
        let other = match flags[0] {
            "--tone" => "none",
            "--white-balance" => "5000",
            _ => "3",
        };
        let changed: Vec<&str> =
            all.chunks(2).flat_map(|pair| [pair[0], if pair == flags { other } else { pair[1] }]).collect();
        let wins = png(&own, "a.toml", &[flags[0], other]);
        assert_eq!(wins, png(&plain, "a.toml", &changed), "{flags:?}");
        assert_ne!(wins, stated, "{flags:?}");
    }
    assert_eq!(
        png(&own, "a.toml", &["--set", "picture.tone=aces"]),
        png(&own, "a.toml", &["--tone", "aces"])
    );
    for (key, word) in
        [("tone=reinhard", "expected standard"), ("exposure=99", "out of range"), ("hue=1", "unknown key")]
    {
        let output = run(&own, &["render", "a.toml", "-o", "b.png", "--set", &format!("picture.{key}")]);
        assert_eq!(output.status.code(), Some(2), "{key}");
        assert!(stderr(&output).contains(word), "{key}: {}", stderr(&output));
    }
}
