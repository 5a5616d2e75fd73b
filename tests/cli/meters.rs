//! Light meters on the command line, and layers of single lights.

use super::{CUBE, channels, folder_with, run, stderr, stdout};
use serde_json::Value;
use tempfile::TempDir;

/// The cube with three lights and two meters; one point is in the floor's slab below.
const SCENE: &str = r#"
[[model]]
file = "cube.obj"
[camera]
position = [0, 1, 0.9]
target = [0, 1, 0]
fov_y = 60.0
size = [24, 16]
[[light]]
name = "lamp"
kind = "spot"
position = [0.5, 1.8, 0.1]
direction = [0.0, -1.0, 0.0]
angle = 70
penumbra = 0.5
lumens = 800
kelvin = 2700
[[light]]
name = "panel.a"
kind = "area"
corner = [-0.8, 1.9, -0.3]
edge_u = [0.4, 0.0, 0.0]
edge_v = [0.0, 0.0, 0.6]
nits = 500
[[light]]
name = "off"
kind = "point"
position = [0.0, 1.0, 0.0]
candela = 5
on = false
[[meter]]
name = "desk"
kind = "plane"
corner = [0.1, 0.7, 0.4]
edge_u = [0.8, 0.0, 0.0]
edge_v = [0.0, 0.0, -0.8]
grid = [4, 2]
[[meter]]
name = "wall"
kind = "point"
position = [-0.99, 1.0, 0.0]
normal = [1.0, 0.0, 0.0]
[quality]
entry_points = 3000
cache_points = 400
gather_rays = 64
cells = 8
"#;

fn folder() -> TempDir {
    folder_with(&[("cube.obj", CUBE), ("s.toml", SCENE)])
}

fn good(folder: &TempDir, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    stdout(&output)
}

fn document(folder: &TempDir, arguments: &[&str]) -> Value {
    serde_json::from_str(&good(folder, arguments)).unwrap()
}

#[test]
fn figures_of_meters_agree_in_all_forms() {
    let folder = folder();
    let figures = document(&folder, &["measure", "s.toml", "--by-light", "--json", "--csv", "m.csv"]);
    let number = |value: &Value| value.as_f64().unwrap();
    let rows: Vec<Vec<String>> = std::fs::read_to_string(folder.path().join("m.csv"))
        .unwrap()
        .lines()
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect();
    assert_eq!(rows[0][..5].join(","), "meter,x_m,y_m,z_m,lux");
    assert_eq!(rows[0][9..].join(","), "\"lux of lamp\",\"lux of panel.a\"");
    for (meter, name) in figures["meters"].as_array().unwrap().iter().zip(["desk", "wall"]) {
        assert_eq!(meter["name"], name);
        let own = || rows.iter().filter(|row| row[0] == format!("\"{name}\""));
        let lux: Vec<f64> = own().map(|row| row[4].parse().unwrap()).collect();
        let mean = lux.iter().sum::<f64>() / lux.len() as f64;
        assert!((number(&meter["mean_lux"]) - mean).abs() < 1e-9 * mean);
        let min = lux.iter().copied().fold(f64::INFINITY, f64::min);
        // JSON is read with an error in the last digit.
        assert!((number(&meter["uniformity"]) - min / mean).abs() < 1e-14);
        assert!(mean > 1.0 && number(&meter["direct_lux"]) < mean);
        // Light adds up.
        let lights: f64 =
            meter["lights"].as_array().unwrap().iter().map(|light| number(&light["mean_lux"])).sum();
        assert!((lights / mean - 1.0).abs() < 1e-5, "{lights} {mean}");
        for row in own() {
            let [all, lamp, panel] = [4, 9, 10].map(|column: usize| row[column].parse::<f64>().unwrap());
            assert!(((lamp + panel) / all - 1.0).abs() < 1e-5);
        }
    }
    assert_eq!(rows.len(), 1 + 8 + 1);
    let text = good(&folder, &["measure", "s.toml"]);
    let mean = number(&figures["meters"][0]["mean_lux"]);
    assert!(text.starts_with("meter") && text.contains(&format!("{mean:.1}")), "{text}");
    let paths = document(&folder, &["measure", "s.toml", "--method", "path", "--spp", "4096", "--json"]);
    let traced = number(&paths["meters"][0]["mean_lux"]);
    assert!((traced / mean - 1.0).abs() < 0.02, "{traced} {mean}");
}

#[test]
fn solved_powers_give_what_was_wanted() {
    let folder = folder();
    let solve =
        ["solve", "s.toml", "--target", "desk=250", "--target", "wall=120", "--json", "-o", "new.toml"];
    let solved = document(&folder, &solve);
    for target in solved["targets"].as_array().unwrap() {
        assert_eq!(target["reached"], true, "{solved}");
    }
    assert_eq!(solved["lights"].as_array().unwrap().len(), 2, "a light that is off stays off");
    let measured = document(&folder, &["measure", "new.toml", "--json"]);
    for (meter, wanted) in measured["meters"].as_array().unwrap().iter().zip([250.0, 120.0]) {
        let found = meter["mean_lux"].as_f64().unwrap();
        assert!((found / wanted - 1.0).abs() < 1e-3, "{meter}");
    }
    // One light cannot do both, and says so. The other one stays.
    let text =
        good(&folder, &["solve", "s.toml", "--light", "lamp", "--max-factor", "2", "--target", "wall=5000"]);
    assert!(text.contains("not reachable") && text.contains("2.0000") && !text.contains("panel"), "{text}");
}

/// A lamp beside one meter cannot light both alike from where it is; it moves to the middle.
#[test]
fn a_light_moves_where_powers_do_not_suffice() {
    let head = SCENE.split("[[light]]").next().unwrap();
    let meter = |name: &str, x: f32| {
        format!(
            "[[meter]]\nname = \"{name}\"\nkind = \"point\"\nposition = [{x}, 0.3, 0.0]\nnormal = [0.0, 1.0, 0.0]\n"
        )
    };
    let light = "[[light]]\nname = \"lamp\"\nkind = \"point\"\nposition = [-0.5, 1.5, 0.0]\ncandela = 100\n";
    let quality = SCENE.split("[quality]").nth(1).unwrap();
    let scene = format!("{head}{light}{}{}[quality]{quality}", meter("left", -0.6), meter("right", 0.6));
    let folder = folder_with(&[("cube.obj", CUBE), ("s.toml", &scene)]);
    let solve = ["solve", "s.toml", "--target", "left=100", "--target", "right=100", "--json"];
    let fixed = document(&folder, &solve);
    assert_eq!(fixed["targets"][0]["reached"], false, "{fixed}");
    let moved = document(&folder, &[&solve[..], &["--move", "lamp", "-o", "new.toml"]].concat());
    assert_eq!(
        (&moved["targets"][0]["reached"], &moved["targets"][1]["reached"]),
        (&true.into(), &true.into())
    );
    assert!(moved["lights"][0]["position"][0].as_f64().unwrap().abs() < 0.1, "{moved}");
    let measured = document(&folder, &["measure", "new.toml", "--json"]);
    for meter in measured["meters"].as_array().unwrap() {
        assert!((meter["mean_lux"].as_f64().unwrap() / 100.0 - 1.0).abs() < 0.02, "{measured}");
    }
}

/// Layers of single lights add up to the picture.
#[test]
fn layers_of_lights_add_up() {
    let folder = folder();
    good(&folder, &["render", "s.toml", "--aov", "direct,indirect,lights", "-o", "a.exr"]);
    let channels = channels(&folder.path().join("a.exr"));
    let names: Vec<&String> = channels.keys().filter(|name| name.starts_with("light.")).collect();
    assert_eq!(names.len(), 2 * 2 * 3, "{names:?}");
    for kind in ["direct", "indirect"] {
        for channel in ["R", "G", "B"] {
            let layers =
                ["lamp", "panel_a"].map(|light| &channels[&format!("light.{light}.{kind}.{channel}")]);
            let whole = &channels[&format!("{kind}.{channel}")];
            for (pixel, whole) in whole.iter().enumerate() {
                let sum: f32 = layers.iter().map(|layer| layer[pixel]).sum();
                assert!(
                    (sum - whole).abs() <= 1e-6 * whole.abs().max(1e-3),
                    "{kind} {channel}: {sum} {whole}"
                );
            }
            assert!(layers.iter().all(|layer| layer.iter().any(|&value| value > 0.0)));
        }
    }
    // The picture is that of a render without layers.
    good(&folder, &["render", "s.toml", "-o", "b.exr"]);
    let plain = super::channels(&folder.path().join("b.exr"));
    assert!(["R", "G", "B"].iter().all(|&channel| plain[channel] == channels[channel]));
}

/// Each pixel of a picture in false colours has the colour of its value.
#[test]
fn false_colours_show_values() {
    let folder = folder();
    good(&folder, &["render", "s.toml", "--aov", "irradiance", "-o", "a.exr"]);
    let channels = channels(&folder.path().join("a.exr"));
    for (quantity, layer) in [("lux", "irradiance."), ("nits", "")] {
        for (range, low, high) in [("0:400", 0.0, 400.0), ("5:500", 5.0_f64, 500.0_f64)] {
            good(&folder, &["render", "s.toml", "--false-color", quantity, "--range", range, "-o", "a.png"]);
            let picture = image::open(folder.path().join("a.png")).unwrap().to_rgb8();
            for (pixel, found) in picture.pixels().enumerate() {
                let weights = [("R", 0.2126), ("G", 0.7152), ("B", 0.0722)];
                let of = |(channel, weight): (&str, f64)| {
                    weight * f64::from(channels[&format!("{layer}{channel}")][pixel])
                };
                let value = 683.0 * weights.map(of).iter().sum::<f64>();
                let place = match low {
                    0.0 => value / high,
                    low => (value / low).ln() / (high / low).ln(),
                };
                let colour = colorous::VIRIDIS.eval_continuous(place.clamp(0.0, 1.0));
                assert_eq!(found.0, colour.as_array(), "{quantity} {range}, pixel {pixel}");
            }
        }
    }
    let output = run(&folder, &["render", "s.toml", "--false-color", "lux", "-o", "b.png"]);
    assert!(stderr(&output).contains("false colours: logarithmic from"), "{}", stderr(&output));
}

#[test]
fn faulty_arguments_of_meters_are_named() {
    let folder = folder_with(&[
        ("cube.obj", CUBE),
        ("s.toml", SCENE),
        ("none.toml", SCENE.split("[[meter]]").next().unwrap()),
    ]);
    for (arguments, word) in [
        (&["measure", "none.toml"][..], "no meter"),
        (&["measure", "s.toml", "--spp", "4096"], "--method path"),
        (&["measure", "s.toml", "--csv", "s.toml"], "s.toml"),
        (&["solve", "s.toml"], "--target"),
        (&["solve", "s.toml", "--target", "desk"], "METER=LUX"),
        (&["solve", "s.toml", "--target", "disk=5"], "desk, wall"),
        (&["solve", "s.toml", "--target", "desk=5", "--target", "desk=6"], "has two"),
        (&["solve", "s.toml", "--target", "desk=5", "--light", "off"], "on are lamp, panel.a"),
        (&["solve", "s.toml", "--target", "desk=5", "--move", "off"], "--move"),
        (&["solve", "s.toml", "--target", "desk=5", "--reach", "2"], "--move"),
        (&["solve", "s.toml", "--target", "desk=5", "-o", "s.toml"], "s.toml"),
    ] {
        let output = run(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let line = stderr(&output);
        assert!(line.contains(word) && line.trim_end().lines().count() == 1, "{arguments:?}: {line}");
    }
    assert_eq!(std::fs::read_to_string(folder.path().join("s.toml")).unwrap(), SCENE);
}
