//! Lights in photometric units, and light meters.

use super::save::edit_often;
use super::{CAMERA, HEAD, SQUARE, load, message};
use glam::Vec3;
use lightpaths::scene::meter::MeterShape;
use lightpaths::scene::photometry::lux;
use lightpaths::scene::save::{Edited, SceneText};
use lightpaths::scene::{LightKind, LoadOptions, Scene};
use std::f64::consts::PI;

const POINT: &str = "kind = \"point\"\nposition = [0, 1, 0]\n";
const SPOT: &str = "kind = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nangle = 60\n";
const AREA: &str = "kind = \"area\"\ncorner = [0, 1, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, 0.25]\n";
const SUN: &str = "kind = \"directional\"\ndirection = [0, -1, 0]\n";

fn scene(light: &str) -> lightpaths::Result<Scene> {
    load(&format!("{HEAD}{CAMERA}[[light]]\nname = \"lamp\"\n{light}"), SQUARE)
}

fn emission(light: &str) -> Vec3 {
    scene(light).unwrap().lights[0].kind.emission()
}

#[test]
fn powers_become_radiometric() {
    // Solid angles: of the sphere, of a cone of 60°, of Lambert's cosine times the area.
    for (kind, powers, expected) in [
        (POINT, ["lumens = 683", "watts = 1", "candela = 54.3514"], 1.0 / (4.0 * PI)),
        (SPOT, ["lumens = 683", "watts = 1", "candela = 217.4056"], 1.0 / PI),
        (AREA, ["lumens = 683", "watts = 1", "nits = 434.8114"], 2.0 / PI),
        (SUN, ["lux = 683", "lux = 683.0", "lux = 6.83e2"], 1.0),
    ] {
        for power in powers {
            let found = emission(&format!("{kind}{power}\n"));
            let error = (found.as_dvec3() / expected - 1.0).abs().max_element();
            assert!(error < 1e-5, "{kind}{power}: {found}, {expected}");
        }
    }
}

#[test]
fn colours_keep_the_power() {
    for colour in
        ["kelvin = 2700", "kelvin = 9000", "tint = [1, 0.2, 0.1]", "kelvin = 3000\ntint = [0.5, 1, 1]"]
    {
        let found = emission(&format!("{POINT}candela = 100\n{colour}\n"));
        assert!((lux(found) - 100.0).abs() < 1e-3, "{colour}: {}", lux(found));
        assert!(found.x != found.z, "{colour}: {found}");
    }
}

#[test]
fn contradictory_powers_are_refused() {
    for (light, word) in [
        (format!("{POINT}lumens = 5\ncandela = 5\n"), "lumens states the power"),
        (format!("{POINT}lumens = 5\nintensity = [1, 1, 1]\n"), "lumens states the power"),
        (
            format!("{POINT}intensity = [1, 1, 1]\nkelvin = 2700\n"),
            "belongs to a power: lumens, candela, watts",
        ),
        (format!("{POINT}lumens = 5\ntint = [0, 0, 0]\n"), "must not be black"),
        (format!("{POINT}nits = 5\n"), "unknown key `nits`"),
        (format!("{SUN}lumens = 5\n"), "unknown key `lumens`"),
        (POINT.to_owned(), "or lumens, candela, watts"),
    ] {
        let found = message(scene(&light));
        assert!(found.contains(word), "{light}: {found}");
    }
}

/// Saving keeps a power in its unit unless the light has another emission by now.
#[test]
fn powers_are_saved_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.toml");
    std::fs::write(folder.path().join("m.obj"), SQUARE).unwrap();
    let light = format!("[[light]]\nname = \"lamp\"\n{SPOT}lumens = 800 # as on its box\nkelvin = 2700\n");
    std::fs::write(&file, format!("{HEAD}{CAMERA}{light}")).unwrap();
    let spec = file.to_str().unwrap();
    let scene = Scene::load(spec, &LoadOptions::default()).unwrap();
    let text = SceneText::new(spec, &LoadOptions::default(), &scene).unwrap();
    let saved = |scene: &Scene| text.with_edits(&Edited::from_scene(scene), &file).unwrap();
    let mut edited = scene.clone();
    edited.lights[0].kind = edited.lights[0].kind.moved_to(Vec3::new(0.5, 0.5, 0.5));
    let moved = saved(&edited);
    assert!(moved.contains("lumens = 800 # as on its box\nkelvin = 2700"), "{moved}");
    let LightKind::Spot { angle, .. } = &mut edited.lights[0].kind else { panic!("a spot") };
    *angle *= 0.5;
    let narrow = saved(&edited);
    assert!(!narrow.contains("lumens") && !narrow.contains("kelvin"), "{narrow}");
    assert!(narrow.contains("intensity = ["), "{narrow}");
    edit_often(spec, &LoadOptions::default(), 20);
}

#[test]
fn meters_are_read() {
    let plane = "[[meter]]\nname = \"desk\"\nkind = \"plane\"\ncorner = [0, 0.8, 0]\nedge_u = [2, 0, 0]\nedge_v = [0, 0, -1]\n";
    let point = "[[meter]]\nkind = \"point\"\nposition = [0, 0.5, 0]\nnormal = [0, 0, -2]\n";
    let light = format!("[[light]]\n{SUN}lux = 5\n");
    let scene = load(&format!("{HEAD}{CAMERA}{light}{plane}{point}"), SQUARE).unwrap();
    let [desk, other] = &scene.meters[..] else { panic!("two meters") };
    assert_eq!((desk.name.as_str(), desk.grid(), other.name.as_str()), ("desk", [6, 3], "meter1"));
    let MeterShape::Point { position, normal } = other.shape else { panic!("a point") };
    assert_eq!(normal, -Vec3::Z);
    assert!((position.as_dvec3() + scene.origin).distance(glam::DVec3::new(0.0, 0.5, 0.0)) < 1e-6);
    for (meter, word) in [
        (plane.replace("edge_v = [0, 0, -1]", "edge_v = [1, 0, 0]"), "parallel to edge_u"),
        (plane.replace("\"plane\"", "\"line\""), "line"),
        (plane.replace("name", "normal = [0, 1, 0]\nname"), "unknown key `normal`"),
        (point.replace("normal = [0, 0, -2]\n", ""), "`normal` is missing"),
        (format!("{plane}grid = [2, 0]\n"), "0 is out of range"),
        (format!("{plane}grid = [128, 128]\n{point}"), "more than 16384 points"),
        (format!("{plane}{plane}"), "desk"),
    ] {
        let found = message(load(&format!("{HEAD}{CAMERA}{light}{meter}"), SQUARE));
        assert!(found.contains(word), "{meter}: {found}");
    }
}
