//! Holes by opacity maps, and hidden materials.

use glam::DVec3;
use image::{DynamicImage, GrayImage, ImageFormat, Luma, Rgba, RgbaImage};
use lightpaths::scene::save::{Edited, SceneText};
use lightpaths::scene::{LoadOptions, Scene};
use serde_json::json;

use super::gltf::{File, square};
use super::refused::message;
use super::textures::{SQUARE, encoded, load_with};
use super::{good_toml, set};

/// Four texels along each side; the left half is opaque.
fn half(value: u8) -> Vec<u8> {
    let image = RgbaImage::from_fn(4, 4, |x, _| Rgba([200, 100, 50, if x < 2 { 255 } else { value }]));
    encoded(image, ImageFormat::Png)
}

fn load(mtl: &str, image: &[u8], options: &LoadOptions) -> lightpaths::Result<Scene> {
    load_with(&good_toml(), SQUARE, mtl, &[("a.png", image)], options)
}

fn loaded(mtl: &str, image: &[u8]) -> Scene {
    load(mtl, image, &LoadOptions::default()).unwrap()
}

/// Asserts that the right half of the square is a hole.
#[track_caller]
fn assert_is_half(scene: &Scene) {
    assert_is_cut(scene, [0.5, 1.0], 0.0);
}

/// Asserts that [`half`]`(100)` cuts the square where the alpha, interpolated between the middles
/// of texels, is one half. The image repeats. Micro-triangles are a quarter of a texel wide.
#[track_caller]
fn assert_is_cut_between_texels(scene: &Scene) {
    let between = 0.25 / (255.0 - 100.0);
    assert_is_cut(scene, [0.375 + (255.0 - 127.5) * between, 0.875 + (127.5 - 100.0) * between], 1.0 / 16.0);
}

/// Asserts that the square is a hole from one x to another. Closer than `near` to these, it may be.
#[track_caller]
fn assert_is_cut(scene: &Scene, [from, to]: [f64; 2], near: f64) {
    let count = scene.triangles.len();
    assert_eq!(count, 2);
    let mut left = 0;
    for (number, triangle) in (0..).zip(&scene.triangles) {
        let [a, b, c] = triangle.positions.map(|p| p.as_dvec3() + scene.origin);
        for step in 0..200 {
            let [y, z] =
                [0.618_034, 0.754_878].map(|by| (f64::from(step) * by).fract()).map(|along: f64| along / 2.0);
            let weights = DVec3::new(1.0 - y - z, y, z);
            let x = (weights.x * a + weights.y * b + weights.z * c).x;
            if (x - from).abs().min((x - to).abs()) >= near {
                assert_eq!(scene.opacity.is_hole(number, weights), (from..to).contains(&x), "{x}");
            }
            left += u32::from(x < from);
        }
    }
    assert!(left > 50, "{left}");
    let surface = 1.0 - (to - from);
    // Each end is off by half of a micro-triangle's width at most.
    assert!((scene.area_m2() - surface).abs() < 1e-6 + near, "{}", scene.area_m2());
}

#[test]
fn the_alpha_of_an_image_or_its_luminance_cuts_holes() {
    let alpha = half(0);
    let grey = GrayImage::from_fn(4, 4, |x, _| Luma([if x < 2 { 255 } else { 0 }]));
    let grey = encoded(grey, ImageFormat::Png);
    for (mtl, image) in [
        ("newmtl wall\nmap_d a.png\n", &alpha),
        ("newmtl wall\nmap_d a.png\n", &grey),
        ("newmtl wall\nmap_d -clamp on a.png\nd 0\n", &alpha),
        ("newmtl wall\nmap_d a.png\nmap_Kd a.png\n", &alpha),
        ("newmtl wall\nmap_Kd a.png\nmap_d a.png\n", &alpha),
    ] {
        let scene = loaded(mtl, image);
        assert_is_half(&scene);
        assert_eq!(scene.warnings, [""; 0], "{mtl}");
        assert_eq!(scene.texture_coordinates.is_empty(), !mtl.contains("Kd"), "{mtl}");
    }
    // The colour of the scene file replaces that of the image alone.
    let options = set(&["material.wall.diffuse=[0.1,0.2,0.3]"]);
    let scene = load("newmtl wall\nmap_Kd a.png\nmap_d a.png\n", &alpha, &options).unwrap();
    assert_is_half(&scene);
    assert!(scene.materials[0].texture.is_none());
}

#[test]
fn maps_that_are_all_one_leave_no_micromaps() {
    let opaque = loaded("newmtl wall\nmap_d a.png\n", &half(200));
    assert!(opaque.opacity.is_empty() && opaque.triangles.len() == 2);
    // One triangle of the square is a hole.
    let corner = RgbaImage::from_fn(2, 2, |x, y| Rgba([0, 0, 0, if x == 1 && y == 1 { 0 } else { 255 }]));
    let mtl = "newmtl wall\nmap_d -s 0.001 0.001 -o 0.75 0.25 a.png\n";
    let none = load(mtl, &encoded(corner, ImageFormat::Png), &LoadOptions::default());
    assert!(message(none).contains("no triangle is left"));
}

#[test]
fn what_is_cut_or_left_out_is_said() {
    let grey = loaded("newmtl wall\nmap_d a.png\n", &half(100));
    assert_is_cut_between_texels(&grey);
    assert!(grey.warnings[0].ends_with("opacity is cut at one half: a surface is opaque or a hole"));
    let mtl = "newmtl wall\nmap_Kd -s 2 2 a.png\nmap_d a.png\n";
    assert!(loaded(mtl, &half(0)).warnings[0].contains("`map_d` has other options than `map_Kd`"));
}

const TWO: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nv 9 1 0\nusemtl wall\nf 1 2 3 4\n\
usemtl ghost\nf 1 2 5\nf 1 5 3\n";
const MTL: &str = "newmtl wall\nKd 1 1 1\nnewmtl ghost\n";

#[test]
fn hidden_materials_have_no_triangles() {
    let count = |mtl: &str, change: &[&str]| {
        let scene = load_with(&good_toml(), TWO, mtl, &[], &set(change)).unwrap();
        (scene.triangles.len(), scene.warnings.len())
    };
    let gone = format!("{MTL}d 0\n");
    assert_eq!(count(MTL, &[]).0, 4);
    assert_eq!(count(MTL, &["material.ghost.hidden=true"]).0, 2);
    assert_eq!(count(MTL, &["material.ghost.hidden=true"]).1, count(MTL, &[]).1);
    assert_eq!(count(&gone, &[]).0, 2);
    assert_eq!(count(&gone, &[]).1, count(MTL, &[]).1 + 1);
    assert_eq!(count(&gone, &["material.ghost.hidden=false"]).0, 4);
    let all = set(&["material.ghost.hidden=true", "material.wall.hidden=true"]);
    assert!(message(load_with(&good_toml(), TWO, MTL, &[], &all)).contains("no triangle is left"));
}

#[test]
fn hidden_materials_stay_hidden_in_a_saved_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (name, text) in [("s.toml", &*good_toml()), ("m.obj", TWO), ("m.mtl", MTL)] {
        std::fs::write(path(name), text).unwrap();
    }
    let options = set(&["material.ghost.hidden=true"]);
    let scene = Scene::load(&path("s.toml"), &options).unwrap();
    let text = SceneText::new(&path("s.toml"), &options, &scene).unwrap();
    let saved = text.with_edits(&Edited::from_scene(&scene), path("t.toml").as_ref()).unwrap();
    std::fs::write(path("t.toml"), &saved).unwrap();
    let again = Scene::load(&path("t.toml"), &LoadOptions::default()).unwrap();
    assert!(saved.contains("hidden = true"), "{saved}");
    assert!(again.triangles == scene.triangles && scene.triangles.len() == 2);
}

/// A square whose material has an alpha mode, a base colour of that opacity, and an image.
fn gltf(mode: &str, opacity: f32, image: Option<Vec<u8>>) -> File {
    let mut file = square();
    let uv = file.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    file.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
    let mut surface = json!({ "baseColorFactor": [1, 1, 1, opacity] });
    if let Some(image) = image {
        let view = file.view(&image);
        file.root["images"] = json!([{ "bufferView": view, "mimeType": "image/png" }]);
        file.root["textures"] = json!([{ "source": 0 }]);
        surface["baseColorTexture"] = json!({ "index": 0 });
    }
    let material = json!({ "name": "leaf", "alphaMode": mode, "pbrMetallicRoughness": surface });
    file.root["materials"] = json!([material]);
    file
}

#[test]
fn alpha_modes_of_gltf_cut_holes() {
    let load = |file: &File| super::gltf::load_text(&file.text());
    let about = |scene: &Scene| scene.warnings.iter().filter(|text| text.contains("leaf")).count();
    let mask = load(&gltf("MASK", 1.0, Some(half(100)))).unwrap();
    assert_is_cut_between_texels(&mask);
    assert_eq!(about(&mask), 0);
    let opaque = load(&gltf("OPAQUE", 1.0, Some(half(0)))).unwrap();
    assert!(opaque.opacity.is_empty());
    let blend = load(&gltf("BLEND", 0.3, Some(half(0)))).unwrap();
    assert_is_half(&blend);
    assert_eq!(about(&blend), 1);
    // 100/255 is above the cutoff, and with the factor below it.
    let mut low = gltf("MASK", 1.0, Some(half(100)));
    low.root["materials"][0]["alphaCutoff"] = json!(0.35);
    assert!(load(&low).unwrap().opacity.is_empty());
    low.root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"][3] = json!(0.5);
    assert_is_half(&load(&low).unwrap());
    // Without an image the factor decides.
    assert!(load(&gltf("MASK", 0.6, None)).unwrap().opacity.is_empty());
    for (mode, opacity) in [("MASK", 0.4), ("BLEND", 0.0)] {
        assert!(message(load(&gltf(mode, opacity, None))).contains("no triangle is left"), "{mode}");
    }
}

#[test]
fn deep_images_have_alpha_too() {
    let image = DynamicImage::ImageRgba8(image::load_from_memory(&half(0)).unwrap().into_rgba8());
    let deep = DynamicImage::ImageRgba16(image.into_rgba16());
    assert_is_half(&loaded("newmtl wall\nmap_d a.png\n", &encoded(deep, ImageFormat::Png)));
}
