//! Luminaires with measured intensities: reading, saving, films.

use super::recording::film_of;
use super::{CAMERA, HEAD, SQUARE, load_files, message};
use glam::Vec3;
use lightpaths::scene::film::Snapshot;
use lightpaths::scene::luminaire::Luminaire;
use lightpaths::scene::photometry::LUMENS_A_WATT;
use lightpaths::scene::save::{Edited, SceneText};
use lightpaths::scene::{Light, LightKind, LoadOptions, Scene};
use std::f64::consts::PI;

/// 100 cd in all directions of the lower hemisphere, and 50 cd at its rim on one side.
const LAMP: &str = "IESNA:LM-63-1995\nTILT=NONE\n1 1000 10 3 3 1 2 0 0 0\n1 1 20\n0 45 90\n0 90 180\n10 10 10\n10 10 10\n10 10 5\n";
const LIGHT: &str = "[[light]]\nname = \"lamp\"\nkind = \"spot\"\nposition = [0, 1, 0]\nies = \"lamp.ies\"\n";

fn load(light: &str) -> lightpaths::Result<Scene> {
    let text = format!("{HEAD}{CAMERA}{light}");
    let files = [("s.toml", text.as_bytes()), ("m.obj", SQUARE.as_bytes()), ("lamp.ies", LAMP.as_bytes())];
    load_files(&files, "s.toml", &LoadOptions::default())
}

#[test]
fn a_file_states_intensity_and_directions() {
    let scene = load(LIGHT).unwrap();
    let light = &scene.lights[0];
    let LightKind::Spot { direction, intensity, .. } = light.kind else { panic!("a spot") };
    assert_eq!(direction, -Vec3::Y);
    assert!((f64::from(intensity.y) * LUMENS_A_WATT - 100.0).abs() < 1e-4);
    let profile = &light.luminaire.as_ref().unwrap().profile;
    assert_eq!((profile.rows, profile.columns, profile.peak_candela), (3, 4, 100.0));
    assert!((profile.fraction(0.5 * PI, PI) - 0.5).abs() < 1e-6);
    let (flux, unit) = light.power().unwrap();
    assert!(unit == "lm" && flux > 550.0 && flux < 2.0 * PI * 100.0, "{flux}");
    assert!(scene.inputs.iter().any(|file| file.ends_with("lamp.ies")), "the window watches it");
}

#[test]
fn a_stated_power_scales_the_measured_intensities() {
    let flux = load(LIGHT).unwrap().lights[0].power().unwrap().0;
    for (power, expected) in [
        ("lumens = 1000", 1000.0),
        ("candela = 200", 2.0 * flux),
        ("kelvin = 2700", flux),
        ("intensity = [0.29282577, 0.29282577, 0.29282577]", 2.0 * flux),
    ] {
        let scene = load(&format!("{LIGHT}{power}\n")).unwrap();
        let found = scene.lights[0].power().unwrap().0;
        assert!((found / expected - 1.0).abs() < 1e-5, "{power}: {found} lm instead of {expected}");
    }
    let warm = load(&format!("{LIGHT}kelvin = 2700\n")).unwrap().lights[0].kind.emission();
    assert!(warm.x > warm.y && warm.y > warm.z, "{warm}");
}

/// The axis, then the planes C0 and C90.
#[test]
fn planes_turn_with_the_light() {
    let c0 = |keys: &str| {
        let scene = load(&format!("{LIGHT}{keys}")).unwrap();
        let LightKind::Spot { direction, .. } = scene.lights[0].kind else { panic!("a spot") };
        scene.lights[0].luminaire.as_ref().unwrap().c0(direction).as_vec3()
    };
    for (keys, expected) in [
        ("", Vec3::X),
        ("turn = 90\n", -Vec3::Z),
        ("turn = -90\n", Vec3::Z),
        ("direction = [0, 1, 0]\n", Vec3::X),
        ("direction = [0, 0, -1]\n", Vec3::X),
        ("direction = [1, 0, 0]\n", Vec3::Y),
        ("direction = [1, 0, 0]\nturn = 90\n", -Vec3::Z),
    ] {
        let found = c0(keys);
        assert!((found - expected).length() < 1e-6, "{keys}: {found} instead of {expected}");
    }
}

#[test]
fn faults_are_named() {
    for (light, word) in [
        (LIGHT.replace("\"spot\"", "\"point\""), "belongs to a light of kind"),
        (format!("{LIGHT}angle = 30\n"), "is that of the file"),
        (format!("{LIGHT}penumbra = 0.5\n"), "is that of the file"),
        (format!("{LIGHT}turn = 400\n"), "out of range"),
        (
            format!("{}turn = 3\nangle = 30\n", LIGHT.replace("ies = \"lamp.ies\"\n", "")),
            "belongs to a light with `ies`",
        ),
        (LIGHT.replace("lamp.ies", "none.ies"), "none.ies"),
        (LIGHT.replace("lamp.ies", "m.obj"), "is no photometric file"),
        (LIGHT.replace("lamp.ies", "/etc/passwd"), "outside"),
        (format!("{LIGHT}lumens = 5\ncandela = 5\n"), "lumens states the power"),
    ] {
        let found = message(load(&light));
        assert!(found.contains(word), "{light}: {found}");
    }
}

#[test]
fn saving_keeps_files_powers_and_turns() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("m.obj", SQUARE);
    write("lamp.ies", LAMP);
    write("s.toml", &format!("{HEAD}{CAMERA}{LIGHT}lumens = 700 # bought\nturn = 30\n"));
    let spec = folder.path().join("s.toml");
    let spec = spec.to_str().unwrap();
    let scene = Scene::load(spec, &LoadOptions::default()).unwrap();
    let text = SceneText::new(spec, &LoadOptions::default(), &scene).unwrap();
    std::fs::create_dir(folder.path().join("below")).unwrap();
    let to = folder.path().join("below/t.toml");
    let saved = text.with_edits(&Edited::from_scene(&scene), &to).unwrap();
    assert!(saved.contains("ies = \"../lamp.ies\"") && saved.contains("lumens = 700 # bought"), "{saved}");
    assert!(!saved.contains("direction") && !saved.contains("angle"), "{saved}");

    // One more luminaire, as the window adds it.
    let mut edited = scene.clone();
    let added = Luminaire::open(&folder.path().join("lamp.ies")).unwrap();
    edited.lights.push(Light::measured("new", added, Vec3::ONE));
    edited.lights[1].luminaire.as_mut().unwrap().turn = -0.5;
    let saved = text.with_edits(&Edited::from_scene(&edited), &to).unwrap();
    std::fs::write(&to, &saved).unwrap();
    let options = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    let again = Scene::load(to.to_str().unwrap(), &options).unwrap();
    assert_eq!(again.lights, edited.lights, "{saved}");
}

#[test]
fn films_move_and_add_luminaires() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("m.obj", SQUARE);
    write("lamp.ies", LAMP);
    write("s.toml", &format!("{HEAD}{CAMERA}{LIGHT}"));
    let spec = folder.path().join("s.toml").to_str().unwrap().to_owned();
    let scene = Scene::load(&spec, &LoadOptions::default()).unwrap();
    let mut moved = scene.lights.clone();
    moved[0].kind = moved[0].kind.moved_to(Vec3::new(0.5, 0.2, 0.1));
    let mut more = moved.clone();
    let added = Luminaire::open(&folder.path().join("lamp.ies")).unwrap();
    more.push(Light::measured("new", added, Vec3::new(0.1, 0.5, 0.2)));
    more[1].luminaire.as_mut().unwrap().turn = 0.25;
    let first = Snapshot::from_scene(&scene);
    let samples =
        [scene.lights.clone(), moved, more.clone()].map(|lights| Snapshot { lights, ..first.clone() });
    let (text, _, filmed) = film_of(&spec, &scene, &samples, folder.path());
    assert!(!text.contains("angle") && !text.contains("penumbra"), "{text}");
    let last = filmed.lights.last().unwrap();
    let [found, wanted] = [last, &more[1]].map(|light| light.luminaire.as_ref().unwrap());
    assert!(found.profile == wanted.profile && (found.turn - wanted.turn).abs() < 1e-3);
}
