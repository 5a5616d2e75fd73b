//! What is to hold whatever a file says: readers come to an end, do not panic, and let no index out
//! that leads nowhere. Fuzzing calls these functions, and so do the property tests of `make test`
//! (`tests/readers`), which hold their memory against the input, too.
//!
//! Each returns whether the bytes were taken for good.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use lightpaths::image::parse;
use lightpaths::renderer::miss_reason;
use lightpaths::scene::{Camera, Film, LightKind, LoadOptions, Memory, Scene, Triangle};
use lightpaths::{Error, Result};

mod checksums;

/// A scene file that is good.
pub const TOML: &str = include_str!("../corpus/toml/good");
/// A model that is good.
pub const OBJ: &str = include_str!("../corpus/obj/good");
/// Its materials.
pub const MTL: &str = include_str!("../corpus/mtl/good");
/// Their image.
pub const TEXTURE: &[u8] = include_bytes!("../corpus/texture/good.png");

fn options(files: &[(&str, &[u8])]) -> LoadOptions {
    let good: [(&str, &[u8]); 4] = [
        ("s.toml", TOML.as_bytes()),
        ("m.obj", OBJ.as_bytes()),
        ("m.mtl", MTL.as_bytes()),
        ("i.png", TEXTURE),
    ];
    let files = good.iter().chain(files);
    let memory: BTreeMap<PathBuf, Vec<u8>> =
        files.map(|(name, bytes)| (PathBuf::from(name), bytes.to_vec())).collect();
    LoadOptions { memory: Some(Memory::new(memory)), ..LoadOptions::default() }
}

/// Loads the good scene with these files in place of its own.
pub fn scene(files: &[(&str, &[u8])]) -> Option<Scene> {
    let scene = taken(Scene::load("s.toml", &options(files)));
    scene.inspect(|scene| {
        hold(scene);
        scene.cameras.iter().for_each(hold_camera);
    })
}

/// What was loaded. What was not is refused in a line that people can read.
fn taken<T>(loaded: Result<T>) -> Option<T> {
    let refused = |error: Error| {
        let text = error.to_string();
        assert!(matches!(error, Error::Input { .. }), "{text}");
        assert!(text.len() < 30_000 && !text.contains(char::is_control), "{text:?}");
    };
    loaded.map_err(refused).ok()
}

/// Every index of a scene leads somewhere, and every number is one.
fn hold(scene: &Scene) {
    assert!(!scene.triangles.is_empty() && !scene.cameras.is_empty() && scene.origin.is_finite());
    for triangle in &scene.triangles {
        assert!((triangle.material as usize) < scene.materials.len(), "{triangle:?}");
        assert!(triangle.positions.iter().all(|point| point.is_finite()), "{triangle:?}");
        assert!(triangle.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-3), "{triangle:?}");
    }
    let coordinates = &scene.texture_coordinates;
    assert!(coordinates.is_empty() || coordinates.len() == scene.triangles.len());
    assert!(coordinates.iter().flatten().all(|place| place.is_finite()));
    for material in &scene.materials {
        let albedos = [material.diffuse, material.specular];
        assert!(
            albedos.iter().all(|albedo| albedo.is_finite() && albedo.min_element() >= 0.0),
            "{material:?}"
        );
        assert!((material.diffuse + material.specular).max_element() <= 1.0 + 1e-5, "{material:?}");
        assert!(material.exponent.is_finite() && material.exponent >= 1.0, "{material:?}");
        if let Some(texture) = &material.texture {
            let [width, height] = texture.image.size.map(|side| side as usize);
            assert!(width > 0 && height > 0 && texture.image.codes.len() == width * height);
        }
    }
    // Images have places wherever they are on a surface.
    let is_textured = |triangle: &Triangle| scene.materials[triangle.material as usize].texture.is_some();
    assert!(!coordinates.is_empty() || !scene.triangles.iter().any(is_textured));
    scene.lights.iter().for_each(|light| hold_light(&light.kind));
    assert!(scene.cameras.iter().all(|camera| camera.position.is_finite()));
    assert!(scene.warnings.iter().all(|warning| !warning.contains(['\n', '\u{1b}'])), "{:?}", scene.warnings);
    assert!(!scene.summary().iter().any(|(_, value)| value.contains(|c: char| c.is_control() && c != '\t')));
}

fn hold_camera(camera: &Camera) {
    let [right, up, forward] = camera.frame();
    assert!(right.is_finite() && up.is_finite() && forward.is_finite(), "{camera:?}");
}

fn hold_light(light: &LightKind) {
    assert!(
        light.emission().is_finite() && light.position().is_none_or(|place| place.is_finite()),
        "{light:?}"
    );
}

/// A scene file.
pub fn toml(bytes: &[u8]) -> bool {
    scene(&[("s.toml", bytes)]).is_some()
}

/// A film of the good scene.
pub fn film(bytes: &[u8]) -> bool {
    let Some((film, scene)) = taken(Film::load("f.toml", &options(&[("f.toml", bytes)]))) else {
        return false;
    };
    hold(&scene);
    let step = (film.frame_count / 8).max(1);
    for frame in (0..film.frame_count).step_by(step as usize) {
        let state = film.state(frame);
        assert!(state.camera.position.is_finite());
        hold_camera(&state.camera);
        for (index, kind, _) in &state.lights {
            assert!(*index < scene.lights.len());
            hold_light(kind);
        }
        for state in &state.materials {
            assert!(
                state.material < scene.materials.len()
                    && state.diffuse.is_finite()
                    && state.exponent.is_finite()
            );
        }
    }
    true
}

/// A model.
pub fn obj(bytes: &[u8]) -> bool {
    scene(&[("m.obj", bytes)]).is_some()
}

/// A glTF model, as text or binary.
pub fn gltf(bytes: &[u8]) -> bool {
    other_model("m.glb", bytes)
}

/// A PLY model, as text or binary.
pub fn ply(bytes: &[u8]) -> bool {
    other_model("m.ply", bytes)
}

/// An STL model, as text or binary.
pub fn stl(bytes: &[u8]) -> bool {
    other_model("m.stl", bytes)
}

/// A model in place of the good one, without its materials.
fn other_model(name: &str, bytes: &[u8]) -> bool {
    let toml = TOML.replace("m.obj", name);
    let toml = toml.split("[[material]]").next().unwrap_or_default();
    scene(&[("s.toml", toml.as_bytes()), (name, bytes)]).is_some()
}

/// A photometric file of a light in the good scene.
pub fn luminaire(bytes: &[u8]) -> bool {
    let light = "\n[[light]]\nname = \"measured\"\nkind = \"spot\"\nposition = [0, 1, 0]\nies = \"l\"\n";
    let scene = scene(&[("s.toml", format!("{TOML}{light}").as_bytes()), ("l", bytes)]);
    let is_taken = scene.is_some();
    for luminaire in scene.iter().flat_map(|scene| &scene.lights).filter_map(|light| light.luminaire.as_ref())
    {
        let profile = &luminaire.profile;
        assert_eq!(profile.fractions.len(), profile.rows as usize * profile.columns as usize);
        assert!(profile.fractions.iter().all(|fraction| (0.0..=1.0).contains(fraction)));
        assert!(profile.peak_candela.is_finite() && profile.steradians() <= 12.6, "{profile:?}");
    }
    is_taken
}

/// Materials. Refused are unprintable names alone; what else is wrong is passed over.
pub fn mtl(bytes: &[u8]) -> bool {
    scene(&[("m.mtl", bytes)]).is_some()
}

/// An image of a material: a PNG, whose checksums are made right, any other kind, or
/// else a TGA.
pub fn texture(bytes: &[u8]) -> bool {
    let mtl = "newmtl a\nmap_Kd i.tga\n";
    let bytes = checksums::png(bytes);
    let scene = scene(&[("m.mtl", mtl.as_bytes()), ("i.tga", &bytes)]);
    scene.is_some_and(|scene| scene.materials.iter().any(|material| material.texture.is_some()))
}

/// An image to be compared: a PNG, whose checksums are made right, or an EXR.
pub fn image(bytes: &[u8]) -> bool {
    match parse(&checksums::png(bytes), None) {
        Ok(picture) => {
            let count = picture.size[0] as usize * picture.size[1] as usize;
            assert_eq!(picture.pixels.len(), count);
            assert!(picture.display.is_none_or(|display| display.len() == count));
            true
        }
        Err(_) => false,
    }
}

/// The scene that stored light paths are held against.
pub fn stored_scene() -> Scene {
    let set =
        ["entry_points=48", "cache_points=12", "gather_rays=4", "directions=4", "cells=8", "gap_rounds=2"];
    let set = set.iter().map(|number| format!("quality.{number}")).collect();
    let scene = Scene::load("s.toml", &LoadOptions { set, ..options(&[]) });
    scene.unwrap_or_else(|error| panic!("{error}"))
}

/// Stored light paths. Their checksums are made right: whoever means harm does that, too.
pub fn cache(bytes: &[u8]) -> bool {
    static SCENE: OnceLock<Arc<Scene>> = OnceLock::new();
    let scene = SCENE.get_or_init(|| Arc::new(stored_scene()));
    let is_taken =
        |bytes: &[u8]| miss_reason(bytes, scene).unwrap_or_else(|error| panic!("{error}")).is_none();
    let as_they_are = is_taken(bytes);
    checksums::cache(bytes).map_or(as_they_are, |mended| is_taken(&mended))
}
