//! A scene file may read only files of its own folder.

use std::path::Path;

use lightpaths::scene::{Film, LoadOptions, Scene};
use tempfile::TempDir;

use super::refused::message;
use super::{CAMERA, LIGHT, SQUARE};

/// `scene/` with models and images, and `other/` beside it, with equally good files.
fn folders() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for place in ["scene/models", "scene/images", "other"] {
        std::fs::create_dir_all(folder.path().join(place)).unwrap();
    }
    for place in ["scene", "scene/models", "other"] {
        write(&folder, &format!("{place}/m.obj"), SQUARE);
        write(&folder, &format!("{place}/m.mtl"), "newmtl a\n");
    }
    write(&folder, "other/o.mtl", "newmtl a\nKd 0.1 0.1 0.1\n");
    for place in ["scene/images", "other"] {
        image::RgbImage::new(2, 2).save(folder.path().join(place).join("i.png")).unwrap();
    }
    image::RgbImage::new(2, 2).save(folder.path().join("other/o.png")).unwrap();
    folder
}

fn write(folder: &TempDir, path: &str, text: &str) {
    std::fs::write(folder.path().join(path), text).unwrap();
}

fn at(folder: &TempDir, path: &str) -> String {
    folder.path().join(path).to_str().unwrap().to_owned()
}

/// Loads a scene with this model. Returns the error, or `None` if it loads. With permission, all
/// scenes must load.
fn outcome(folder: &TempDir, model: &str) -> Option<String> {
    write(folder, "scene/s.toml", &format!("[[model]]\nfile = {model:?}\n{CAMERA}{LIGHT}"));
    let spec = at(folder, "scene/s.toml");
    let allowed = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    Scene::load(&spec, &allowed).unwrap();
    let refused = Scene::load(&spec, &LoadOptions::default());
    refused.is_err().then(|| message(refused))
}

const OUTSIDE: &str =
    "leads out of the folder of the file that names it: move it there, or pass --allow-outside";

#[test]
fn models_lie_in_the_scenes_folder() {
    let folder = folders();
    for inside in ["m.obj", "./m.obj", "models/m.obj", "models/../m.obj"] {
        assert_eq!(outcome(&folder, inside), None, "{inside}");
    }
    assert_eq!(outcome(&folder, &at(&folder, "scene/models/m.obj")), None, "an absolute path to the inside");
    for outside in
        ["../other/m.obj", "models/../../other/m.obj", "../scene/m.obj", &at(&folder, "other/m.obj")]
    {
        let said = outcome(&folder, outside).unwrap_or_else(|| panic!("{outside} was read"));
        assert!(said.starts_with("s.toml:2: model.0.file: ") && said.ends_with(OUTSIDE), "{said}");
    }
}

#[test]
fn materials_and_images_lie_in_the_scenes_folder() {
    let folder = folders();
    let obj = |library: &str| {
        format!("mtllib {library}\nusemtl a\nvt 0 0\n{}", SQUARE.replace("f 1 2 3 4", "f 1/1 2/1 3/1 4/1"))
    };
    // Files outside are left out, with a warning.
    let spec = at(&folder, "scene/s.toml");
    let allowed = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    let holds = |words: &str, is_read: &dyn Fn(&Scene) -> bool, is_inside: bool, what: &str| {
        assert_eq!(outcome(&folder, "models/t.obj"), None);
        assert!(is_read(&Scene::load(&spec, &allowed).unwrap()), "{what}");
        let scene = Scene::load(&spec, &LoadOptions::default()).unwrap();
        assert_eq!(is_read(&scene), is_inside, "{what}");
        let is_said = |warning: &String| warning.contains(words) && warning.ends_with(OUTSIDE);
        assert_eq!(scene.warnings.iter().any(is_said), !is_inside, "{what}: {:?}", scene.warnings);
    };
    write(&folder, "scene/n.mtl", "newmtl a\nKd 0.1 0.1 0.1\n");
    for (library, is_inside) in [("../n.mtl", true), ("../../other/o.mtl", false)] {
        write(&folder, "scene/models/t.obj", &obj(library));
        let is_read = |scene: &Scene| scene.materials[0].diffuse.x == 0.1;
        holds("t.obj:1: mtllib: ", &is_read, is_inside, library);
    }
    write(&folder, "scene/models/t.obj", &obj("t.mtl"));
    for (image, is_inside) in [
        ("../images/i.png", true),
        (r"..\images\i.png", true),
        ("../../other/o.png", false),
        (r"..\..\other\o.png", false),
        (r"..\..\OTHER\O.png", false),
        (&at(&folder, "other/o.png"), false),
    ] {
        write(&folder, "scene/models/t.mtl", &format!("newmtl a\nmap_Kd -s 2 2 {image}\n"));
        let is_read = |scene: &Scene| scene.materials[0].texture.is_some();
        if image.contains("OTHER") {
            // The loader does not search for names in a folder outside.
            let scene = Scene::load(&spec, &LoadOptions::default()).unwrap();
            assert!(!is_read(&scene) && scene.warnings.iter().any(|warning| warning.ends_with(OUTSIDE)));
        } else {
            holds("t.mtl:2: material \"a\": ", &is_read, is_inside, image);
        }
    }
}

/// Files that the user names may be anywhere; files that these name must be beside them.
#[test]
fn users_name_what_they_like() {
    let folder = folders();
    assert_eq!(outcome(&folder, "m.obj"), None);
    let set =
        |path: String| LoadOptions { set: vec![format!("model.0.file={path:?}")], ..LoadOptions::default() };
    let spec = at(&folder, "scene/s.toml");
    for path in [at(&folder, "other/m.obj"), "../other/m.obj".to_owned()] {
        Scene::load(&spec, &set(path)).unwrap();
    }
    write(&folder, "other/t.obj", &format!("mtllib m.mtl\n{SQUARE}"));
    Scene::load(&spec, &set("../other/t.obj".to_owned())).unwrap();
    write(&folder, "scene/n.mtl", "newmtl a\nKd 0.1 0.1 0.1\n");
    write(&folder, "other/t.obj", &format!("mtllib ../scene/n.mtl\nusemtl a\n{SQUARE}"));
    for loaded in [
        Scene::load(&spec, &set("../other/t.obj".to_owned())),
        Scene::load(&at(&folder, "other/t.obj"), &LoadOptions::default()),
    ] {
        let scene = loaded.unwrap();
        assert_eq!(scene.materials[0].diffuse.x, 0.7);
        assert!(scene.warnings.iter().any(|warning| warning.ends_with(OUTSIDE)), "{:?}", scene.warnings);
    }
}

#[test]
fn films_name_scenes_in_their_folder() {
    let folder = folders();
    assert_eq!(outcome(&folder, "m.obj"), None);
    let film = |scene: &str| format!("scene = {scene:?}\nduration = 1\n");
    write(&folder, "film.toml", &film("scene/s.toml"));
    Film::load(&at(&folder, "film.toml"), &LoadOptions::default()).unwrap();
    write(&folder, "other/film.toml", &film("../scene/s.toml"));
    let spec = at(&folder, "other/film.toml");
    let refused = message(Film::load(&spec, &LoadOptions::default()).map(|(_, scene)| scene));
    assert!(refused.starts_with("film.toml:1: scene: ") && refused.ends_with(OUTSIDE), "{refused}");
    Film::load(&spec, &LoadOptions { allow_outside: true, ..LoadOptions::default() }).unwrap();
}

#[cfg(unix)]
#[test]
fn links_lead_no_further_than_paths() {
    use std::os::unix::fs::symlink;
    let folder = folders();
    let link = |to: &str, from: &str| symlink(to, folder.path().join(from)).unwrap();
    link("models/m.obj", "scene/in.obj");
    link("../other/m.obj", "scene/out.obj");
    link("../other", "scene/out");
    link(&at(&folder, "other/m.obj"), "scene/absolute.obj");
    assert_eq!(outcome(&folder, "in.obj"), None);
    for outside in ["out.obj", "out/m.obj", "absolute.obj"] {
        assert!(outcome(&folder, outside).unwrap_or_else(|| panic!("{outside} was read")).ends_with(OUTSIDE));
    }
    // The target of a path counts.
    assert_eq!(outcome(&folder, "out/../scene/m.obj"), None);
    // The user may name a scene or its folder through a link.
    assert_eq!(outcome(&folder, "models/m.obj"), None);
    link("scene", "linked");
    Scene::load(&at(&folder, "linked/s.toml"), &LoadOptions::default()).unwrap();
    link("../scene/s.toml", "other/s.toml");
    link("../scene/models", "other/models");
    let refused = message(Scene::load(&at(&folder, "other/s.toml"), &LoadOptions::default()));
    assert!(refused.ends_with(OUTSIDE), "files lie beside the link: {refused}");
}

/// Reading a pipe or a device may wait or never end.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_not_opened() {
    use std::os::unix::fs::symlink;
    let folder = folders();
    let made =
        std::process::Command::new("mkfifo").arg(folder.path().join("scene/pipe.obj")).status().unwrap();
    assert!(made.success());
    symlink("/dev/zero", folder.path().join("zero.obj")).unwrap();
    let allowed = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    for (model, words) in [
        ("pipe.obj", "is not a regular file"),
        ("../zero.obj", "is not a regular file"),
        ("models", "is a directory"),
    ] {
        write(&folder, "scene/s.toml", &format!("[[model]]\nfile = {model:?}\n{CAMERA}{LIGHT}"));
        let said = message(Scene::load(&at(&folder, "scene/s.toml"), &allowed));
        assert!(said.contains(words), "{said}");
    }
    assert!(Path::new("/dev/zero").exists());
}
