//! Scenes saved and loaded again: equal to the bit, and the text unchanged where
//! nothing has changed.

use std::path::{Path, PathBuf};

use glam::Vec3;
use lightpaths::Result;
use lightpaths::scene::save::{Edited, SceneText, leads_outside, relative_to};
use lightpaths::scene::{
    Camera, DisplayTransform, Light, LightKind, LoadOptions, Material, Quality, Scene, ToneCurve,
    WhiteBalance,
};

use super::{CAMERA, LIGHT, SQUARE, box_model, set};

/// Seeded numbers.
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }

    pub(crate) fn below(&mut self, end: usize) -> usize {
        (self.unit() * end as f32) as usize
    }

    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }

    /// A position without coordinates near zero: f64 distinguishes its coordinates at 1e5 m.
    pub(crate) fn place(&mut self) -> Vec3 {
        let place = 8.0 * (self.vector() - 0.5);
        Vec3::select(place.abs().cmplt(Vec3::splat(3e-4)), Vec3::ONE, place)
    }

    pub(crate) fn direction(&mut self) -> Vec3 {
        (self.vector() - Vec3::new(0.5, 1.1, 0.5)).normalize()
    }

    pub(crate) fn kind(&mut self) -> LightKind {
        let emission = 100.0 * self.vector() * self.vector();
        match self.below(4) {
            0 => LightKind::Point { position: self.place(), intensity: emission },
            1 => LightKind::Spot {
                position: self.place(),
                direction: self.direction(),
                intensity: emission,
                angle: (1.0 + 89.0 * self.unit()).to_radians(),
                penumbra: self.unit(),
            },
            2 => LightKind::Area {
                corner: self.place(),
                edge_u: Vec3::new(0.2, 0.0, 0.0) + 0.1 * self.vector(),
                edge_v: Vec3::new(0.0, 0.2, 0.0) + 0.1 * self.vector(),
                radiance: emission,
                samples: 1 + self.below(20) as u32,
            },
            _ => LightKind::Directional { direction: self.direction(), irradiance: emission },
        }
    }
}

/// Debug output of floats, which preserves all bits.
fn exact(value: impl std::fmt::Debug) -> String {
    format!("{value:?}")
}

fn load(file: &Path) -> Result<Scene> {
    // If a scene is saved elsewhere, its models stay.
    Scene::load(file.to_str().unwrap(), &LoadOptions { allow_outside: true, ..LoadOptions::default() })
}

/// Saves and loads again, the text included.
#[track_caller]
fn again(
    text: &SceneText,
    edited: &Scene,
    to: &Path,
    triangles: &[lightpaths::scene::Triangle],
) -> (Scene, String) {
    let written = text.with_edits(&Edited::from_scene(edited), to).unwrap();
    std::fs::write(to, &written).unwrap();
    let scene = load(to).unwrap_or_else(|error| panic!("{error}\n{written}"));
    assert_eq!(exact(&scene.lights), exact(&edited.lights), "{written}");
    assert_eq!(exact(&scene.materials), exact(&edited.materials), "{written}");
    let looks = |camera: &Camera| exact((camera.position, camera.target, camera.up, camera.fov_y_degrees));
    assert_eq!(looks(&scene.cameras[0]), looks(&edited.cameras[0]), "{written}");
    assert_eq!((scene.origin, &scene.quality), (edited.origin, &edited.quality), "{written}");
    assert!(scene.triangles == triangles, "other triangles");
    (scene, written)
}

fn edit(scene: &mut Scene, dice: &mut Dice) {
    for _ in 0..dice.below(3) {
        let index = dice.below(scene.lights.len() + 1);
        if index < scene.lights.len() && scene.lights.len() > 1 && !scene.lights[index].kind.is_fixed() {
            scene.lights.remove(index);
        }
    }
    // The environment states the sky.
    for light in scene.lights.iter_mut().filter(|light| !light.kind.is_fixed()) {
        match dice.below(4) {
            0 => light.kind = light.kind.moved_to(dice.place()),
            1 => light.kind = light.kind.with_emission(dice.vector()),
            2 => light.kind = dice.kind(),
            _ => {}
        }
        light.is_on = dice.below(3) > 0;
        light.group = [None, Some("ceiling"), Some("\"é\"")][dice.below(3)].map(str::to_owned);
    }
    for _ in 0..dice.below(4) {
        let number = dice.below(1 << 20);
        let (kind, is_on) = (dice.kind(), dice.below(4) > 0);
        // The sky is the last light of a file.
        let end = scene.lights.iter().position(|light| light.kind.is_fixed()).unwrap_or(scene.lights.len());
        scene.lights.insert(end, Light { is_on, ..Light::new(format!("light {number} \"é\""), kind) });
    }
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (dice.place() + Vec3::Z * 20.0, dice.place());
    camera.fov_y_degrees = 10.0 + 100.0 * dice.unit();
    let index = dice.below(scene.materials.len());
    let material = &mut scene.materials[index];
    match dice.below(3) {
        0 => material.diffuse = 0.5 * dice.vector(),
        1 => (material.specular, material.exponent) = (dice.vector(), 1.0 + 100.0 * dice.unit()),
        _ => material.diffuse = dice.vector(),
    }
    material.editable = dice.below(2) > 0;
    material.conserve_energy();
    material.clamp_albedo();
}

/// Edits a scene again and again, and saves and loads it after each edit. Every second time, the
/// scene that was loaded first is saved.
pub(crate) fn edit_often(spec: &str, options: &LoadOptions, times: usize) {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("saved.toml");
    let mut dice = Dice(11);
    let mut scene = Scene::load(spec, options).unwrap();
    let triangles = scene.triangles.clone();
    let mut text = SceneText::new(spec, options, &scene).unwrap();
    for time in 0..times {
        edit(&mut scene, &mut dice);
        let (loaded, _) = again(&text, &scene, &to, &triangles);
        if time % 2 == 0 {
            text = SceneText::new(to.to_str().unwrap(), &LoadOptions::default(), &loaded).unwrap();
            scene = loaded;
        }
    }
}

#[test]
fn edited_scenes_come_back() {
    edit_often("box", &LoadOptions::default(), 30);
    edit_often("atrium", &set(&["model.0.triangles=10000", "camera.gallery.fov_y=31"]), 2);
    let folder = tempfile::tempdir().unwrap();
    let obj = folder.path().join("a model.obj");
    for (number, offset) in [0.0, -0.3, 17.1, 1e3, 99_999.7].into_iter().enumerate() {
        let corner = |x: f64, z: f64| format!("v {} {} {}\n", x + offset, 0.1 - offset, z + 0.5 * offset);
        let text = [(0.0, 0.0), (1.0, 0.0), (1.1, -1.0), (0.0, -1.0)].map(|(x, z)| corner(x, z)).concat();
        std::fs::write(&obj, format!("{text}usemtl some\nf 1 2 3 4\n")).unwrap();
        let options =
            if number == 0 { LoadOptions::default() } else { set(&["light.sun.irradiance=[1,2,3]"]) };
        edit_often(obj.to_str().unwrap(), &options, 20);
    }
}

const COMMENTED: &str = "# At the top.
[[model]]   # the model
file = \"m.obj\"

[quality]
preset = \"draft\"
seed = 3 # lucky

# Cameras.
[[camera]]
name = \"a\"
position = [0, 1, 3]
target   = [0.0, 0.00, 0.0] # aligned
[[camera]]
name = \"b\"
position = [
    0.0, # x
    2.0,
    3.0,
]
target = [0.0, 0.1, 0.0]
up = [0.0, 3.0, 0.1]

# A lamp.
[[light]]
name = \"lamp\"
kind = \"point\" # isotropic
position = [0.5, 0.70, 0]
intensity = [1, 2.50, 3e0]
# It has no name.
[[light]]
kind = \"spot\"
position = [0, 1, 0]
direction = [0, -2, 0.1]
angle = 30 # half
intensity = [1, 1, 1]

[[material]]
name = \"default\"
diffuse = [0.30, 0.2, 0.1] # brown
# At the end.
";

/// A scene of these files in a folder of its own.
fn scene_of(toml: &str, options: &LoadOptions) -> (tempfile::TempDir, PathBuf, Scene, SceneText) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.toml");
    std::fs::write(folder.path().join("m.obj"), SQUARE).unwrap();
    std::fs::write(&file, toml).unwrap();
    let scene = Scene::load(file.to_str().unwrap(), options).unwrap();
    let text = SceneText::new(file.to_str().unwrap(), options, &scene).unwrap();
    (folder, file, scene, text)
}

#[test]
fn what_is_not_edited_stays_as_it_is_written() {
    let (_folder, file, mut scene, text) = scene_of(COMMENTED, &LoadOptions::default());
    let triangles = scene.triangles.clone();
    assert_eq!(again(&text, &scene, &file, &triangles).1, COMMENTED);
    scene.lights[0].kind = scene.lights[0].kind.with_emission(Vec3::new(1.0, 0.1, 3.0));
    scene.lights[1].is_on = false;
    let LightKind::Spot { angle, .. } = &mut scene.lights[1].kind else { panic!("the second is a spot") };
    *angle = 31.0_f64.to_radians() as f32;
    scene.cameras[0].fov_y_degrees = 33.3;
    scene.materials[0].diffuse.z = 0.7;
    let expected = COMMENTED
        .replace("2.50, 3e0", "0.1, 3e0")
        .replace("# aligned\n", "# aligned\nfov_y = 33.3\n")
        .replace(
            "angle = 30 # half\nintensity = [1, 1, 1]\n",
            "angle = 31.0 # half\nintensity = [1, 1, 1]\non = false\n",
        )
        .replace("0.2, 0.1] # brown", "0.2, 0.7] # brown");
    assert_eq!(again(&text, &scene, &file, &triangles).1, expected);
    // A light that moves up keeps the name that its old number gave it.
    scene.lights.remove(0);
    let kind = LightKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    scene.lights.push(Light::new("sun", kind));
    let (loaded, written) = again(&text, &scene, &file, &triangles);
    assert_eq!(loaded.lights.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["light1", "sun"]);
    assert!(!written.contains("# A lamp.") && written.contains("# It has no name."), "{written}");
    assert!(written.contains("\n[[light]]\nname = \"sun\"\nkind = \"directional\"\n"), "{written}");
    assert!(written.find("[[material]]").unwrap() > written.find("\"sun\"").unwrap(), "{written}");
}

#[test]
fn options_are_saved_as_values() {
    let options = LoadOptions {
        preset: Some("high".to_owned()),
        size: Some([5, 6]),
        camera: Some("b".to_owned()),
        ..set(&["quality.cells=32", "camera.fov_y=50", "light.lamp.position=[1,2,3]", "model.0.scale=2"])
    };
    let (folder, _, scene, text) = scene_of(COMMENTED, &options);
    let (loaded, written) = again(&text, &scene, &folder.path().join("t.toml"), &scene.triangles);
    assert_eq!(loaded.quality, Quality { cells: 32, seed: 3, ..Quality::HIGH });
    assert_eq!(loaded.cameras.iter().map(|it| it.name.as_str()).collect::<Vec<_>>(), ["b", "a"]);
    assert_eq!(loaded.cameras[0].size, [512, 512], "--size is the session's");
    assert_eq!(loaded.cameras[0].fov_y_degrees, 50.0);
    assert!(written.contains("position = [1, 2, 3]") && written.contains("seed = 3 # lucky"), "{written}");
    let options = set(&["camera.a.size=[7,8]", "material.default.editable=true"]);
    let (folder, _, scene, text) = scene_of(COMMENTED, &options);
    let (loaded, _) = again(&text, &scene, &folder.path().join("t.toml"), &scene.triangles);
    assert_eq!((loaded.cameras[0].size, loaded.cameras.len()), ([7, 8], 2));
}

#[test]
fn inline_tables_and_single_cameras_are_edited() {
    let toml = "light = [{ kind = \"point\", position = [0, 1, 0], intensity = [1, 1, 1] }] # one\n\
                camera.position = [0, 1, 3]\ncamera.target = [0, 0, 0]\n[[model]]\nfile = \"m.obj\"\n";
    let (_folder, file, mut scene, text) = scene_of(toml, &LoadOptions::default());
    let triangles = scene.triangles.clone();
    assert_eq!(again(&text, &scene, &file, &triangles).1, toml);
    scene.lights[0].is_on = false;
    scene.cameras[0].position = Vec3::new(1.0, 2.0, 3.0);
    let kind = LightKind::Point { position: Vec3::ONE, intensity: Vec3::splat(1e-9) };
    scene.lights.push(Light::new("b", kind));
    let (_, written) = again(&text, &scene, &file, &triangles);
    assert!(written.contains("intensity = [1e-9, 1e-9, 1e-9]"), "{written}");
}

#[test]
fn models_are_found_from_anywhere() {
    let folder = tempfile::tempdir().unwrap();
    let at = |path: &str| folder.path().join(path);
    for name in ["a/b", "c d"] {
        std::fs::create_dir_all(at(name)).unwrap();
    }
    std::fs::write(at("a/b/box.obj"), box_model::obj()).unwrap();
    std::fs::write(at("a/b/box.mtl"), include_bytes!("../../assets/box.mtl")).unwrap();
    std::fs::write(at("a/s.toml"), format!("[[model]]\nfile = \"b/box.obj\"\n{CAMERA}{LIGHT}")).unwrap();
    for (from, to, line) in [
        ("a/s.toml", "a/t.toml", "file = \"b/box.obj\""),
        ("a/s.toml", "c d/t.toml", "file = \"../a/b/box.obj\""),
        ("a/s.toml", "a/b/t.toml", "file = \"box.obj\""),
        ("a/b/box.obj", "c d/t.toml", "file = \"../a/b/box.obj\""),
        ("a/b/box.obj", "a/b/t.toml", "file = \"box.obj\""),
    ] {
        let spec = at(from);
        let scene = load(&spec).unwrap();
        let text = SceneText::new(spec.to_str().unwrap(), &LoadOptions::default(), &scene).unwrap();
        let (_, written) = again(&text, &scene, &at(to), &scene.triangles);
        assert!(written.contains(line), "{written}");
        assert_eq!(leads_outside(&written, &at(to)), line.contains(".."), "{line}");
        assert_eq!(
            Scene::load(at(to).to_str().unwrap(), &LoadOptions::default()).is_err(),
            line.contains("..")
        );
    }
    let scene = Scene::load("box", &LoadOptions::default()).unwrap();
    let text = SceneText::new("box", &LoadOptions::default(), &scene).unwrap();
    let (_, written) = again(&text, &scene, &at("t.toml"), &scene.triangles);
    assert!(written.contains("[[model]]\nbuilt_in = \"box\"\n") && !written.contains("file"), "{written}");
    let relative = relative_to(&at("a/s.toml"), &at("c d/film.toml")).unwrap();
    assert_eq!(relative, "../a/s.toml");
}

#[test]
fn images_keep_their_place_under_another_tint() {
    let folder = tempfile::tempdir().unwrap();
    let at = |path: &str| folder.path().join(path);
    image::RgbImage::from_pixel(2, 2, image::Rgb([200, 100, 50])).save(at("i.png")).unwrap();
    std::fs::write(at("m.mtl"), "newmtl wall\nmap_Kd i.png\n").unwrap();
    let obj =
        "mtllib m.mtl\nusemtl wall\nvt 0 0\nvt 1 0\nvt 1 1\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nf 1/1 2/2 3/3\n";
    std::fs::write(at("m.obj"), obj).unwrap();
    let head = "[[model]]\nfile = \"m.obj\"\n";
    let load_with = |more: &str| {
        std::fs::write(at("s.toml"), format!("{head}{CAMERA}{LIGHT}{more}")).unwrap();
        load(&at("s.toml"))
    };
    let mut scene = load_with("").unwrap();
    let text = SceneText::new(at("s.toml").to_str().unwrap(), &LoadOptions::default(), &scene).unwrap();
    scene.materials[0].diffuse = Vec3::new(0.5, 0.25, 0.1);
    let (loaded, written) = again(&text, &scene, &at("t.toml"), &scene.triangles);
    assert!(
        loaded.materials[0].texture.is_some() && written.contains("tint = [0.5, 0.25, 0.1]"),
        "{written}"
    );
    let both =
        load_with("[[material]]\nname = \"wall\"\ntint = [1, 1, 1]\ndiffuse = [1, 1, 1]\n").unwrap_err();
    assert!(both.to_string().contains("state one of them"), "{both}");
}

#[test]
fn a_light_can_be_off() {
    for (word, is_on) in [("true", true), ("false", false)] {
        let (_folder, _, scene, _) = scene_of(
            &format!("[[model]]\nfile = \"m.obj\"\n{CAMERA}{LIGHT}on = {word}\n"),
            &LoadOptions::default(),
        );
        assert_eq!(scene.lights[0].is_on, is_on);
    }
}

#[test]
fn a_scene_whose_lights_are_all_removed_is_dark() {
    let (_folder, file, scene, text) = scene_of(COMMENTED, &LoadOptions::default());
    let dark = Scene { lights: Vec::new(), ..scene.clone() };
    let (loaded, written) = again(&text, &dark, &file, &scene.triangles);
    assert!(loaded.lights.is_empty() && written.starts_with("light = []\n"), "{written}");
    // A light that is added there is the only one.
    let text = SceneText::new(file.to_str().unwrap(), &LoadOptions::default(), &loaded).unwrap();
    let lit = Scene { lights: scene.lights[..1].to_vec(), ..loaded };
    let (loaded, written) = again(&text, &lit, &file, &scene.triangles);
    assert_eq!((loaded.lights.len(), loaded.lights[0].kind), (1, scene.lights[0].kind));
    assert!(written.contains("[[light]]") && !written.contains("light = []"), "{written}");
}

#[test]
fn what_no_file_can_say_is_refused() {
    let (_folder, file, scene, text) = scene_of(COMMENTED, &LoadOptions::default());
    let refuses = |change: &dyn Fn(&mut Scene), words: &str| {
        let mut edited = scene.clone();
        change(&mut edited);
        let message = text.with_edits(&Edited::from_scene(&edited), &file).unwrap_err().to_string();
        assert!(message.contains(words) && !message.contains('\n'), "{message}");
    };
    refuses(&|scene| scene.cameras[0].fov_y_degrees = 180.0, "camera.a.fov_y: 180.0 is out of range");
    refuses(&|scene| scene.lights[1].name = "lamp".to_owned(), "names must differ");
    refuses(
        &|scene| scene.lights[0].kind = scene.lights[0].kind.with_emission(Vec3::NEG_ONE),
        "light.lamp.intensity",
    );
}

#[test]
fn materials_of_full_albedo_are_not_mended_twice() {
    let mut materials =
        "[[material]]\nname = \"default\"\ndiffuse = [0.9, 0.8, 0.7]\nspecular = [0.3, 0.2, 0.1]\n"
            .to_owned();
    materials.insert_str(0, &format!("[[model]]\nfile = \"m.obj\"\n{CAMERA}{LIGHT}"));
    let (_folder, file, mut scene, text) = scene_of(&materials, &LoadOptions::default());
    let material: &mut Material = &mut scene.materials[0];
    assert!(material.specular.x < 0.09, "highlights were dimmed");
    material.diffuse = Vec3::splat(0.1);
    let triangles = scene.triangles.clone();
    again(&text, &scene, &file, &triangles);
}

/// Only values that differ from the file's are written.
#[test]
fn the_display_of_the_picture_is_saved() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("m.obj"), SQUARE).unwrap();
    let file = folder.path().join("s.toml");
    let scene = |keys: &str| format!("[[model]]\nfile = \"m.obj\"\n{CAMERA}{LIGHT}{keys}");
    let save = |keys: &str, change: &dyn Fn(&mut DisplayTransform)| {
        std::fs::write(&file, scene(keys)).unwrap();
        let scene = load(&file).unwrap();
        let text = SceneText::new(file.to_str().unwrap(), &LoadOptions::default(), &scene).unwrap();
        let mut edited = Edited::from_scene(&scene);
        change(&mut edited.display);
        let saved = text.with_edits(&edited, &file).unwrap();
        std::fs::write(&file, &saved).unwrap();
        assert_eq!(load(&file).unwrap().picture.over(DisplayTransform::default()), edited.display);
        saved
    };
    let keys = "[picture]\nexposure = 0.50 # as printed\n";
    for same in ["", keys] {
        assert_eq!(save(same, &|_| ()), scene(same));
    }
    let brighter = save(keys, &|display| display.exposure_stops = 0.7);
    assert!(brighter.contains("exposure = 0.7 # as printed") && !brighter.contains("tone"), "{brighter}");
    let saved = save("", &|display| {
        display.tone = ToneCurve::Filmic;
        display.white_balance = WhiteBalance { kelvin: 2700.0, tint: 0.1 };
    });
    for line in ["[picture]", "tone = \"filmic\"", "white_balance = 2700.0", "tint = 0.1"] {
        assert!(saved.contains(line), "{saved}");
    }
    assert!(!saved.contains("exposure"), "{saved}");
}
