//! Panes of models and scene files.

use glam::Vec3;
use lightpaths::scene::{LoadOptions, Scene};
use serde_json::json;

use super::gltf::{load_text, square};
use super::{CAMERA, HEAD, close, load_files};

/// A wall, and a quad of the material `glass`.
const MODEL: &str = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    usemtl wall\nf 1 2 3 4\nusemtl glass\nf 5 6 7 8\n";

fn with(glass: &str, section: &str) -> Scene {
    let toml = format!("{HEAD}{CAMERA}[environment]\n{section}");
    let mtl = format!("newmtl wall\nKd 0.5 0.5 0.5\nnewmtl glass\nKd 0.5 0.25 1\n{glass}");
    let files: [(&str, &[u8]); 3] =
        [("s.toml", toml.as_bytes()), ("m.obj", MODEL.as_bytes()), ("m.mtl", mtl.as_bytes())];
    load_files(&files, "s.toml", &LoadOptions::default()).unwrap()
}

/// Asserts that the quad is a pane of this colour; `None` if it is opaque.
#[track_caller]
fn assert_pane(scene: &Scene, colour: Option<Vec3>) {
    let count = if colour.is_some() { 2 } else { 0 };
    assert_eq!((scene.panes.len(), scene.triangles.len()), (count, 4 - count), "{:?}", scene.warnings);
    let Some(colour) = colour else { return };
    assert!(scene.panes.iter().all(|pane| close(pane.colour, colour)), "{:?}", scene.panes);
    let is_in_front = |corner: Vec3| f64::from(corner.z) + scene.origin.z > 0.99;
    assert!(scene.panes.iter().flat_map(|pane| pane.positions).all(is_in_front));
}

#[test]
fn low_opacity_in_mtl_files_makes_panes() {
    for (glass, colour) in [
        ("d 0.05\nNi 1.5\nillum 4\n", Some(Vec3::splat(0.95))),
        ("Tr 0.95\nillum 4\n", Some(Vec3::splat(0.95))),
        ("Tf 0.2 0.4 1\nd 0.25\n", Some(0.75 * Vec3::new(0.2, 0.4, 1.0))),
        ("Tf 1 1 1\nd 1\nTr 0\n", None),
        ("d 0.5\n", None),
        ("Tr 1\n", None),
        ("illum 7\n", None),
    ] {
        let scene = with(glass, "");
        assert_pane(&scene, colour);
        let are_named = |what: &str| scene.warnings.iter().any(|warning| warning.contains(what));
        assert_eq!(are_named("thin panes"), colour.is_some(), "{glass}: {:?}", scene.warnings);
        let is_opaque = !glass.contains("Tr 0\n") && colour.is_none();
        assert_eq!(are_named("surfaces are opaque"), is_opaque, "{glass}: {:?}", scene.warnings);
    }
}

#[test]
fn scene_files_make_panes_and_opaque_surfaces() {
    let section = |keys: &str| format!("[[material]]\nname = \"glass\"\n{keys}\n");
    let diffuse = Vec3::new(0.5, 0.25, 1.0);
    for (glass, keys, colour) in [
        ("", "opacity = 0.25", Some(Vec3::splat(0.75))),
        ("", "thin = true", Some(diffuse)),
        ("", "thin = true\nopacity = 0.5", Some(0.5 * diffuse)),
        ("", "thin = true\ndiffuse = [0.1, 0.2, 0.3]", Some(Vec3::new(0.1, 0.2, 0.3))),
        ("", "opacity = 1.0", None),
        ("", "thin = false", None),
        ("d 0.1\n", "opacity = 1.0", None),
        ("d 0.1\n", "thin = false", None),
        ("d 0.1\n", "diffuse = [0.1, 0.2, 0.3]", Some(Vec3::splat(0.9))),
    ] {
        assert_pane(&with(glass, &section(keys)), colour);
    }
}

#[test]
fn blending_and_transmission_of_gltf_make_panes() {
    let load = |mode: &str, opacity: f32, transmission: f32| {
        let mut file = square();
        file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
        let mut wall = file.root["meshes"][0]["primitives"][0].clone();
        wall["material"] = json!(1);
        file.root["meshes"].as_array_mut().unwrap().push(json!({ "primitives": [wall] }));
        file.root["nodes"].as_array_mut().unwrap().push(json!({ "mesh": 1, "translation": [0, 0, -1] }));
        let last = file.root["nodes"].as_array().unwrap().len() - 1;
        file.root["scenes"][0]["nodes"].as_array_mut().unwrap().push(json!(last));
        file.root["materials"] = json!([
            { "name": "pane", "alphaMode": mode,
              "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 1, opacity], "metallicFactor": 0 },
              "extensions": { "KHR_materials_transmission": { "transmissionFactor": transmission } } },
            { "name": "wall" },
        ]);
        file.root["extensionsUsed"] = json!(["KHR_materials_transmission"]);
        load_text(&file.text()).unwrap()
    };
    for (mode, opacity, transmission, colour) in [
        ("BLEND", 0.25, 0.0, Some(Vec3::splat(0.75))),
        ("BLEND", 0.75, 0.0, None),
        ("OPAQUE", 0.25, 0.0, None),
        ("OPAQUE", 1.0, 0.8, Some(0.8 * Vec3::new(0.5, 0.25, 1.0))),
        ("OPAQUE", 1.0, 0.4, None),
    ] {
        let scene = load(mode, opacity, transmission);
        let panes: Vec<Vec3> = scene.panes.iter().map(|pane| pane.colour).collect();
        assert_eq!(panes.len(), if colour.is_some() { 2 } else { 0 }, "{mode} {:?}", scene.warnings);
        assert!(panes.iter().all(|found| Some(true) == colour.map(|colour| close(*found, colour))));
        let is_named = |what| scene.warnings.iter().any(|warning| warning.contains(what));
        assert_eq!(is_named("thin panes"), colour.is_some(), "{:?}", scene.warnings);
        let is_passed_over = colour.is_none() && (mode == "BLEND" || transmission > 0.0);
        assert_eq!(is_named("surfaces are opaque"), is_passed_over, "{:?}", scene.warnings);
    }
}

/// A model of panes alone would be an empty picture.
#[test]
fn panes_alone_are_opaque() {
    let mut file = square();
    file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
    file.root["materials"] =
        json!([{ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.2] } }]);
    let scene = load_text(&file.text()).unwrap();
    assert_eq!((scene.panes.len(), scene.triangles.len()), (0, 2));
    assert!(scene.warnings.iter().any(|warning| warning.contains("all surfaces are panes")));
}
