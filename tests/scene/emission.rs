//! Emitting materials, visible area lights and the sky of scene files.

use std::io::Cursor;
use std::path::Path;

use glam::Vec3;
use image::{DynamicImage, ImageFormat, Rgb, Rgb32FImage};
use lightpaths::scene::material::Sides;
use lightpaths::scene::save::{Edited, SceneText};
use lightpaths::scene::{Light, LightKind, LoadOptions, Scene};

use super::refused::message;
use super::{CAMERA, HEAD, SQUARE, close, load, load_files, set};

const SKY: &str = "[environment]\nradiance = [0.5, 0.6, 0.8]\nrotate = 90.0\n";

fn lamp(mtl: &str) -> Scene {
    // A floor, and a lamp below a ceiling that is close above it.
    let obj = "mtllib m.mtl\nv 0 0 0\nv 4 0 0\nv 4 0 -4\nv 0 0 -4\nv 1 1.9 -1\nv 2 1.9 -1\nv 2 1.9 -2\nv 1 1.9 -2\n\
        v 0 2 0\nv 4 2 0\nv 4 2 -4\nv 0 2 -4\nusemtl wall\nf 1 2 3 4\nf 9 12 11 10\nusemtl lamp\nf 5 6 7 8\n";
    let files: [(&str, &[u8]); 2] = [("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())];
    load_files(&files, "m.obj", &LoadOptions::default()).unwrap()
}

#[test]
fn emitting_materials_are_the_lights_of_a_bare_model() {
    let scene = lamp("newmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0.5 0.5 0.5\nKe 17 12 4\n");
    let [light] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert_eq!(light.name, "lamp");
    let LightKind::Surface { material, radiance } = light.kind else { panic!("{light:?}") };
    assert_eq!((material, radiance), (1, Vec3::new(17.0, 12.0, 4.0)));
    let emitter = &scene.emission.surfaces[&material];
    assert_eq!((emitter.surface.len(), emitter.parts.len()), (1, 1), "one parallelogram");
    // Its front faces the ceiling close above it.
    assert_eq!(scene.materials[1].emitting_sides, Some(Sides::Back));
    assert!(scene.warnings.iter().all(|warning| !warning.contains("has no light")), "{:?}", scene.warnings);
    let dark = lamp("newmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKe 0 0 0\n");
    assert!(dark.lights.iter().all(|light| light.kind.word() != "surface"), "{:?}", dark.lights);
}

/// A lamp needs no ceiling; a small sign beside a floor is no lamp.
#[test]
fn a_lamp_over_a_floor_is_the_only_light_and_a_sign_is_not() {
    let lights = |lamp: &str| {
        let obj = format!(
            "mtllib m.mtl\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n{lamp}\nusemtl wall\nf 4 3 2 1\nusemtl lamp\nf 5 6 7 8\n"
        );
        let mtl = "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl lamp\nKd 0.5 0.5 0.5\nKe 17 12 4\n";
        let files: [(&str, &[u8]); 2] = [("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())];
        load_files(&files, "m.obj", &LoadOptions::default()).unwrap().lights
    };
    let over = lights("v -0.3 1.9 -0.3\nv 0.3 1.9 -0.3\nv 0.3 1.9 0.3\nv -0.3 1.9 0.3");
    assert!(matches!(over[..], [Light { kind: LightKind::Surface { .. }, .. }]), "{over:?}");
    let sign = lights("v 1.1 0 -0.05\nv 1.1 0 0.05\nv 1.1 0.1 0.05\nv 1.1 0.1 -0.05");
    assert!(sign.iter().any(|light| light.kind.word() == "directional"), "{sign:?}");
}

#[test]
fn scene_files_state_emission() {
    let toml = format!(
        "{HEAD}{CAMERA}[[material]]\nname = \"default\"\nemission = [2, 3, 4]\nemitting_sides = \"front\"\n"
    );
    let scene = load(&toml, SQUARE).unwrap();
    assert_eq!(scene.materials[0].emitting_sides, Some(Sides::Front));
    assert_eq!(scene.lights[0].kind.emission(), Vec3::new(2.0, 3.0, 4.0));
    let text = message(load(&toml.replace("front", "top"), SQUARE));
    assert!(text.contains("emitting_sides"), "{text}");
}

#[test]
fn visible_area_lights_are_surface() {
    let area = "[[light]]\nname = \"panel\"\nkind = \"area\"\ncorner = [0, 2, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0, 1]\nradiance = [3, 3, 3]\n";
    let hidden = load(&format!("{HEAD}{CAMERA}{area}"), SQUARE).unwrap();
    let shown = load(&format!("{HEAD}{CAMERA}{area}visible = true\n"), SQUARE).unwrap();
    assert_eq!(shown.triangles.len(), hidden.triangles.len() + 2);
    let [light] = &shown.lights[..] else { panic!("{:?}", shown.lights) };
    let LightKind::Surface { material, radiance } = light.kind else { panic!("{light:?}") };
    assert_eq!((light.name.as_str(), radiance), ("panel", Vec3::splat(3.0)));
    assert_eq!(shown.materials[material as usize].diffuse, Vec3::ZERO);
    let emitter = &shown.emission.surfaces[&material];
    assert!(emitter.parts[0].cross().y < 0.0, "it emits towards edge_u × edge_v");
}

/// A panorama of 8×4 texels, brighter towards the right.
fn panorama(format: ImageFormat) -> Vec<u8> {
    let image = Rgb32FImage::from_fn(8, 4, |x, y| Rgb([1.0 + x as f32, 1.0, 3.0 * y as f32]));
    let image = DynamicImage::from(image);
    let image = if format == ImageFormat::Png { image.into_rgb8().into() } else { image };
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

#[test]
fn a_sky_is_a_light_and_needs_no_other() {
    let scene = load(&format!("{HEAD}{CAMERA}{SKY}"), SQUARE).unwrap();
    let [light] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    let LightKind::Sky { radiance, turn, channel } = light.kind else { panic!("{light:?}") };
    assert!(close(radiance, Vec3::new(0.5, 0.6, 0.8)) && channel.is_none());
    assert!((turn - 90_f32.to_radians()).abs() < 1e-6);
    let sky = scene.emission.sky.as_ref().unwrap();
    assert_eq!((sky.side, sky.beams.len()), (1, 0), "one radiance, and no bright spot");
    for (name, format) in [("a.hdr", ImageFormat::Hdr), ("a.exr", ImageFormat::OpenExr)] {
        let toml = format!("{HEAD}{CAMERA}{SKY}image = \"{name}\"\nsamples = 8\n");
        let bytes = panorama(format);
        let files: [(&str, &[u8]); 3] =
            [("s.toml", toml.as_bytes()), ("m.obj", SQUARE.as_bytes()), (name, &bytes)];
        let scene = load_files(&files, "s.toml", &LoadOptions::default()).unwrap();
        assert_eq!(scene.lights.len(), 3, "a light for each channel");
        let sky = scene.emission.sky.as_ref().unwrap();
        assert_eq!((sky.environment.size, sky.side), ([8, 4], 64));
        assert!(close(sky.environment.texels[7], Vec3::new(8.0, 1.0, 0.0)), "{}", sky.environment.texels[7]);
        assert_eq!(scene.lights[2].kind.emission(), Vec3::new(0.0, 0.0, 0.8));
        assert!(scene.inputs.iter().any(|path| path.ends_with(name)), "no output replaces the image");
    }
}

#[test]
fn skies_that_cannot_be_read_are_refused() {
    for (what, bytes) in [
        ("no image", b"xyz".to_vec()),
        ("a black one", {
            let mut bytes = Cursor::new(Vec::new());
            Rgb32FImage::new(8, 4).write_to(&mut bytes, ImageFormat::OpenExr).unwrap();
            bytes.into_inner()
        }),
    ] {
        let toml = format!("{HEAD}{CAMERA}{SKY}image = \"a.exr\"\n");
        let files: [(&str, &[u8]); 3] =
            [("s.toml", toml.as_bytes()), ("m.obj", SQUARE.as_bytes()), ("a.exr", &bytes)];
        let text = message(load_files(&files, "s.toml", &LoadOptions::default()));
        assert!(text.contains("environment.image") && text.contains("a.exr"), "{what}: {text}");
    }
    let text = message(load(&format!("{HEAD}{CAMERA}{SKY}image = \"missing.hdr\"\n"), SQUARE));
    assert!(text.contains("missing.hdr"), "{text}");
    let text = message(load(&format!("{HEAD}{CAMERA}[environment]\ncolour = [1, 1, 1]\n"), SQUARE));
    assert!(text.contains("colour"), "{text}");
    let text = message(load(&format!("{HEAD}{CAMERA}"), SQUARE));
    assert!(text.contains("[environment]"), "{text}");
    let options = set(&["environment.radiance=[1, 1, 1]"]);
    let files: [(&str, &[u8]); 2] =
        [("s.toml", b"[[model]]\nfile = \"m.obj\"\n[environment]\n"), ("m.obj", SQUARE.as_bytes())];
    assert_eq!(load_files(&files, "s.toml", &options).unwrap().lights[0].kind.emission(), Vec3::ONE);
}

/// Emission is saved where the file states it, and loads again.
#[test]
fn edited_emission_is_saved() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let area = "[[light]]\nname = \"panel\"\nkind = \"area\"\ncorner = [0, 2, 0]\nedge_u = [1, 0, 0]\nedge_v = [0, 0, 1]\nradiance = [3, 3, 3]\nvisible = true\n";
    let emitter = "[[material]]\nname = \"default\"\nemission = [2, 3, 4]\n";
    std::fs::write(path("s.toml"), format!("{HEAD}{CAMERA}{area}{emitter}{SKY}")).unwrap();
    std::fs::write(path("m.obj"), SQUARE).unwrap();
    let load = |name: &str| Scene::load(path(name).to_str().unwrap(), &LoadOptions::default()).unwrap();
    let mut scene = load("s.toml");
    let text = SceneText::new(path("s.toml").to_str().unwrap(), &LoadOptions::default(), &scene).unwrap();
    assert_eq!(
        scene.lights.iter().map(|light| &*light.name).collect::<Vec<_>>(),
        ["panel", "default", "sky"]
    );
    for light in &mut scene.lights {
        light.kind = light.kind.with_emission(Vec3::new(7.0, 6.0, 5.0));
    }
    let edited = Edited::from_scene(&scene);
    let saved = text.with_edits(&edited, Path::new(&path("t.toml"))).unwrap();
    std::fs::write(path("t.toml"), &saved).unwrap();
    let again = load("t.toml");
    assert_eq!(again.triangles.len(), scene.triangles.len(), "{saved}");
    assert_eq!(again.lights, scene.lights, "{saved}");
}
