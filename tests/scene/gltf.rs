//! glTF files as exporters write them, and damaged ones.

use base64::Engine;
use glam::{Vec2, Vec3};
use image::{ImageFormat, Rgb, RgbImage};
use lightpaths::Result;
use lightpaths::scene::material::Sides;
use lightpaths::scene::save::{Edited, SceneText};
use lightpaths::scene::{LightKind, LoadOptions, Scene};
use serde_json::{Value, json};

use super::refused::message;
use super::vertex_colours::difference;
use super::{CAMERA, LIGHT, close, load_files};

const FLOAT: u32 = 5126;
const SHORT: u32 = 5122;
const U8: u32 = 5121;
const U16: u32 = 5123;
const U32: u32 = 5125;

/// A file under construction. Its buffer holds what the views list.
pub(super) struct File {
    pub(super) root: Value,
    buffer: Vec<u8>,
}

impl File {
    fn new() -> Self {
        let root = json!({
            "asset": { "version": "2.0" },
            "scenes": [{ "nodes": [0] }],
            "nodes": [{ "mesh": 0 }],
            "bufferViews": [],
            "accessors": [],
        });
        Self { root, buffer: Vec::new() }
    }

    fn push(&mut self, list: &str, item: Value) -> usize {
        let list = self.root[list].as_array_mut().unwrap();
        list.push(item);
        list.len() - 1
    }

    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        let offset = self.buffer.len();
        self.buffer.extend(bytes);
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    fn list(&mut self, kind: &str, component: u32, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let item = json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
        self.push("accessors", item)
    }

    pub(super) fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = if kind == "VEC2" { 2 } else { 3 };
        let bytes: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let index = self.list(kind, FLOAT, numbers.len() / width, &bytes);
        let corner = |pick: fn(f32, f32) -> f32| {
            let of = |axis: usize| numbers.iter().skip(axis).step_by(width).copied().reduce(pick).unwrap();
            (0..width).map(of).collect::<Vec<_>>()
        };
        self.root["accessors"][index]["min"] = json!(corner(f32::min));
        self.root["accessors"][index]["max"] = json!(corner(f32::max));
        index
    }

    fn uri(&self) -> String {
        let text = base64::engine::general_purpose::STANDARD.encode(&self.buffer);
        format!("data:application/octet-stream;base64,{text}")
    }

    /// The text, with the buffer in a data URI.
    pub(super) fn text(&self) -> String {
        let mut root = self.root.clone();
        root["buffers"] = json!([{ "byteLength": self.buffer.len(), "uri": self.uri() }]);
        root.to_string()
    }

    pub(super) fn glb(&self) -> Vec<u8> {
        let mut root = self.root.clone();
        root["buffers"] = json!([{ "byteLength": self.buffer.len() }]);
        let mut json = root.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut binary = self.buffer.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let length = 12 + 8 + json.len() + 8 + binary.len();
        let mut bytes = b"glTF".to_vec();
        for number in [2, length as u32, json.len() as u32, 0x4e4f_534a] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(json);
        bytes.extend((binary.len() as u32).to_le_bytes());
        bytes.extend(0x004e_4942_u32.to_le_bytes());
        bytes.extend(binary);
        bytes
    }
}

const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

/// A square in the plane z = 0, of two triangles that face +z.
pub(super) fn square() -> File {
    let mut file = File::new();
    let positions = file.floats("VEC3", &SQUARE);
    let indices = file.list("SCALAR", U16, 6, &[0, 1, 2, 0, 2, 3].map(u16::to_le_bytes).concat());
    let primitive = json!({ "attributes": { "POSITION": positions }, "indices": indices });
    file.root["meshes"] = json!([{ "primitives": [primitive] }]);
    file
}

pub(super) fn load_text(text: &str) -> Result<Scene> {
    load_files(&[("m.gltf", text.as_bytes())], "m.gltf", &LoadOptions::default())
}

pub(super) fn load(file: &File) -> Scene {
    load_text(&file.text()).unwrap_or_else(|error| panic!("{error}"))
}

/// Corners of all triangles, in world space.
fn corners(scene: &Scene) -> Vec<[Vec3; 3]> {
    let moved = |p: Vec3| (p.as_dvec3() + scene.origin).as_vec3();
    scene.triangles.iter().map(|triangle| triangle.positions.map(moved)).collect()
}

/// Corners of the square's triangles in some order.
pub(super) fn sorted(scene: &Scene) -> Vec<[[i32; 3]; 3]> {
    let key = |corners: [Vec3; 3]| {
        let mut all = corners.map(|p| (1000.0 * p).round().as_ivec3().to_array());
        all.sort_unstable();
        all
    };
    let mut all: Vec<_> = corners(scene).into_iter().map(key).collect();
    all.sort_unstable();
    all
}

#[test]
fn a_square_is_the_same_in_every_form() {
    let file = square();
    let expected = sorted(&load(&file));
    assert_eq!(expected.len(), 2);
    let glb = file.glb();
    let options = LoadOptions::default();
    let as_glb = load_files(&[("m.glb", &glb)], "m.glb", &options).unwrap();
    assert_eq!(sorted(&as_glb), expected);

    // The buffer in a file of its own, whose name is percent-encoded.
    let mut root = file.root.clone();
    root["buffers"] = json!([{ "byteLength": file.buffer.len(), "uri": "a%20b.bin" }]);
    let text = root.to_string();
    let files = [("m.gltf", text.as_bytes()), ("a b.bin", &file.buffer[..])];
    assert_eq!(sorted(&load_files(&files, "m.gltf", &options).unwrap()), expected);

    // Within a scene file.
    let toml = format!("[[model]]\nfile = \"m.glb\"\n{CAMERA}{LIGHT}");
    let files = [("m.glb", &glb[..]), ("s.toml", toml.as_bytes())];
    assert_eq!(sorted(&load_files(&files, "s.toml", &options).unwrap()), expected);

    // As a strip, as a fan, with other indices, and without.
    let strips: [(u32, u32, Vec<u8>); 4] = [
        (5, U8, vec![0, 1, 3, 2]),
        (6, U8, vec![0, 1, 2, 3]),
        (4, U32, [0_u32, 1, 2, 0, 2, 3].map(u32::to_le_bytes).concat()),
        (5, U16, [1_u16, 2, 0, 3].map(u16::to_le_bytes).concat()),
    ];
    for (mode, component, bytes) in strips {
        let mut file = square();
        let count = bytes.len() / [1, 2, 4][[U8, U16, U32].iter().position(|c| *c == component).unwrap()];
        let indices = file.list("SCALAR", component, count, &bytes);
        file.root["meshes"][0]["primitives"][0]["indices"] = json!(indices);
        file.root["meshes"][0]["primitives"][0]["mode"] = json!(mode);
        let scene = load(&file);
        assert!(scene.triangles.iter().all(|t| close(t.geometric_normal(), Vec3::Z)), "mode {mode}");
        let area: f64 = scene.triangles.iter().map(lightpaths::scene::Triangle::area_m2).sum();
        assert!((area - 1.0).abs() < 1e-6, "mode {mode}: {area} m²");
    }
    let mut file = square();
    let unrolled: Vec<f32> =
        [0, 1, 2, 0, 2, 3].iter().flat_map(|&i| SQUARE[3 * i..3 * i + 3].to_vec()).collect();
    let positions = file.floats("VEC3", &unrolled);
    file.root["meshes"][0]["primitives"] = json!([{ "attributes": { "POSITION": positions } }]);
    assert_eq!(sorted(&load(&file)), expected);
}

#[test]
fn nodes_place_instances_and_mirrors_keep_their_front() {
    let mut file = square();
    file.root["nodes"] = json!([
        { "children": [1, 2], "scale": [2, 2, 2] },
        { "mesh": 0, "translation": [10, 0, 0] },
        { "mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1] },
    ]);
    let scene = load(&file);
    let all = corners(&scene);
    assert_eq!(all.len(), 4);
    let [first, second] = [&all[..2], &all[2..]].map(|half| {
        let points = half.iter().flatten();
        points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)))
    });
    assert!(close(first.0, Vec3::new(20.0, 0.0, 0.0)) && close(first.1, Vec3::new(22.0, 2.0, 0.0)));
    assert!(close(second.0, Vec3::new(-2.0, 0.0, 10.0)) && close(second.1, Vec3::new(0.0, 2.0, 10.0)));
    assert!(scene.triangles.iter().all(|t| close(t.geometric_normal(), Vec3::Z)));
}

#[test]
fn quantised_and_sparse_positions_are_read() {
    let mut file = square();
    file.root["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    file.root["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    // Three shorts and two unused bytes a vertex; 32 767 stands for 1.
    let shorts: Vec<u8> = SQUARE
        .chunks(3)
        .flat_map(|p| [p[0], p[1], p[2], 0.0].map(|number| ((number * 32767.0) as i16).to_le_bytes()))
        .flatten()
        .collect();
    let positions = file.list("VEC3", SHORT, 4, &shorts);
    file.root["accessors"][positions]["normalized"] = json!(true);
    file.root["accessors"][positions]["min"] = json!([0, 0, 0]);
    file.root["accessors"][positions]["max"] = json!([1, 1, 0]);
    let view = file.root["accessors"][positions]["bufferView"].as_u64().unwrap() as usize;
    file.root["bufferViews"][view]["byteStride"] = json!(8);
    file.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
    let scene = load(&file);
    assert_eq!(sorted(&scene), sorted(&load(&square())));
    assert!(scene.warnings.iter().all(|warning| !warning.contains("extension")), "{:?}", scene.warnings);

    // No view: zeros, of which three are replaced.
    let mut file = square();
    let indices = file.view(&[1, 2, 3]);
    let values = file.view(&SQUARE[3..].iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<_>>());
    let sparse = json!({
        "count": 3,
        "indices": { "bufferView": indices, "componentType": U8 },
        "values": { "bufferView": values },
    });
    let item = json!({
        "componentType": FLOAT, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0], "sparse": sparse,
    });
    let positions = file.push("accessors", item);
    file.root["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
    assert_eq!(sorted(&load(&file)), sorted(&load(&square())));
}

#[test]
fn metalness_and_roughness_become_albedos_and_a_lobe() {
    let material = |surface: Value| {
        let mut file = square();
        file.root["materials"] = json!([{ "name": "a", "pbrMetallicRoughness": surface }]);
        file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
        load(&file).materials[0].clone()
    };
    let base = Vec3::new(0.8, 0.4, 0.2);
    let colour = [0.8, 0.4, 0.2, 1.0];
    // A rough dielectric is diffuse: its weak lobe joins the diffuse albedo.
    let rough = material(json!({ "baseColorFactor": colour, "metallicFactor": 0, "roughnessFactor": 0.6 }));
    assert_eq!(rough.specular, Vec3::ZERO);
    assert!(close(rough.diffuse, 0.96 * base + Vec3::splat(0.04)), "{rough:?}");
    // α = 0.04: n = (2/α² − 2)/4 = 312.
    let smooth = material(json!({ "baseColorFactor": colour, "metallicFactor": 0, "roughnessFactor": 0.2 }));
    assert!(close(smooth.diffuse, 0.96 * base) && close(smooth.specular, Vec3::splat(0.04)), "{smooth:?}");
    assert!((smooth.exponent - 312.0).abs() < 0.1, "{smooth:?}");
    let metal = material(json!({ "baseColorFactor": colour, "roughnessFactor": 0.5 }));
    assert!(close(metal.diffuse, Vec3::ZERO) && close(metal.specular, base), "{metal:?}");
    // Light between the facets of a rough metal is lost: 1.49 − 1.14 is left.
    let rough_metal = material(json!({ "baseColorFactor": colour }));
    assert!(rough_metal.specular == Vec3::ZERO && close(rough_metal.diffuse, 0.35 * base), "{rough_metal:?}");
    let bare = load(&square()).materials[0].clone();
    assert!(bare.specular == Vec3::ZERO && bare.diffuse.max_element() < 0.9, "{bare:?}");
}

#[test]
fn images_are_read_from_every_place_and_stand_upright() {
    let mut png = std::io::Cursor::new(Vec::new());
    let colours = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
    let image = RgbImage::from_fn(2, 2, |x, y| Rgb(colours[(2 * y + x) as usize]));
    image.write_to(&mut png, ImageFormat::Png).unwrap();
    let png = png.into_inner();
    let textured = |source: Value| {
        let mut file = square();
        let uv = file.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let texture = json!({ "index": 0 });
        let surface = json!({ "baseColorTexture": texture, "metallicFactor": 0.0, "roughnessFactor": 1.0 });
        file.root["materials"] = json!([{ "name": "a", "pbrMetallicRoughness": surface }]);
        file.root["textures"] = json!([{ "source": 0 }]);
        file.root["images"] = json!([source]);
        file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
        file.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
        file
    };
    let data = base64::engine::general_purpose::STANDARD.encode(&png);
    let mut inside = textured(json!({ "mimeType": "image/png", "bufferView": 0 }));
    let view = inside.view(&png);
    inside.root["images"][0]["bufferView"] = json!(view);
    let as_data = textured(json!({ "uri": format!("data:image/png;base64,{data}") }));
    let named = textured(json!({ "uri": "a%20b.png" })).text();
    let files = [("m.gltf", named.as_bytes()), ("a b.png", &png[..])];
    let scenes =
        [load(&inside), load(&as_data), load_files(&files, "m.gltf", &LoadOptions::default()).unwrap()];
    for scene in &scenes {
        let texture = scene.materials[0].texture.as_ref().unwrap();
        assert_eq!((texture.image.size, &texture.image.codes[..]), ([2, 2], &colours[..]));
        assert!(!texture.is_clamped);
        // The image's upper edge is at y = 1: there v is 1 here, and 0 in the file.
        for (triangle, places) in corners(scene).iter().zip(&scene.texture_coordinates) {
            for (corner, place) in triangle.iter().zip(places) {
                assert!((*place - Vec2::new(corner.x, corner.y)).length() < 1e-6, "{corner} at {place}");
            }
        }
    }

    let mut turned = as_data;
    let transform =
        json!({ "offset": [0.5, 0.25], "scale": [2, 4], "rotation": std::f32::consts::FRAC_PI_2 });
    turned.root["extensionsUsed"] = json!(["KHR_texture_transform"]);
    turned.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["extensions"] =
        json!({ "KHR_texture_transform": transform });
    let scene = load(&turned);
    for (triangle, places) in corners(&scene).iter().zip(&scene.texture_coordinates) {
        for (corner, place) in triangle.iter().zip(places) {
            // In the file: (u, v) of the corner, scaled, turned by 90°, moved.
            let [u, v] = [2.0 * corner.x, 4.0 * (1.0 - corner.y)];
            let expected = Vec2::new(v + 0.5, 1.0 - (0.25 - u));
            assert!((*place - expected).length() < 1e-5, "{corner} at {place}, {expected}");
        }
    }

    let missing = load(&textured(json!({ "uri": "nowhere.png" })));
    assert!(missing.materials[0].texture.is_none());
    let told = |warning: &String| warning.contains("images that cannot be used are left out: image 0 names");
    assert!(missing.warnings.iter().any(told), "{:?}", missing.warnings);
}

#[test]
fn cameras_and_lights_come_from_the_file_unless_the_scene_has_its_own() {
    let mut file = square();
    file.root["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.root["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "name": "lamp", "intensity": 683.0, "color": [1, 0.5, 0.25] },
        { "type": "spot", "name": "lamp", "intensity": 68.3,
          "spot": { "innerConeAngle": 0.2, "outerConeAngle": 0.4 } },
        { "type": "directional", "intensity": 6.83 },
    ] } });
    file.root["cameras"] = json!([
        { "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1, "aspectRatio": 2.0 } },
        { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 1, "zfar": 9, "znear": 0 } },
    ]);
    let light = |index: usize| json!({ "KHR_lights_punctual": { "light": index } });
    // Turned by 90° about x, -z becomes -y... and up +z.
    let down = [-std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f64::consts::FRAC_1_SQRT_2];
    file.root["nodes"] = json!([
        { "mesh": 0, "children": [1, 2, 3, 4, 5] },
        { "translation": [1, 2, 3], "extensions": light(0) },
        { "translation": [0, 4, 0], "rotation": down, "extensions": light(1) },
        { "rotation": down, "extensions": light(2) },
        { "name": "view", "translation": [0, 5, 0], "rotation": down, "camera": 0 },
        { "camera": 1 },
    ]);
    let scene = load(&file);
    let world = |p: Vec3| (p.as_dvec3() + scene.origin).as_vec3();
    let [lamp, spot, sun] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert_eq!([&lamp.name, &spot.name, &sun.name], ["lamp", "lamp 2", "light"]);
    let LightKind::Point { position, intensity } = lamp.kind else { panic!("{lamp:?}") };
    assert!(close(world(position), Vec3::new(1.0, 2.0, 3.0)));
    assert!(close(intensity, Vec3::new(1.0, 0.5, 0.25)), "683 cd are 1 W/sr: {intensity}");
    let LightKind::Spot { direction, angle, penumbra, intensity, .. } = spot.kind else { panic!("{spot:?}") };
    assert!(close(direction, Vec3::NEG_Y) && close(intensity, Vec3::splat(0.1)));
    assert!((angle - 0.4).abs() < 1e-6 && (penumbra - 0.5).abs() < 1e-6);
    let LightKind::Directional { direction, irradiance } = sun.kind else { panic!("{sun:?}") };
    assert!(close(direction, Vec3::NEG_Y) && close(irradiance, Vec3::splat(0.01)));
    let camera = &scene.cameras[0];
    assert_eq!((scene.cameras.len(), &*camera.name, camera.size), (1, "view", [1024, 512]));
    assert!(close(world(camera.position), Vec3::new(0.0, 5.0, 0.0)));
    assert!(close(camera.frame()[2], Vec3::NEG_Y) && close(camera.up, Vec3::NEG_Z));
    assert!((camera.fov_y_degrees.to_radians() - 0.5).abs() < 1e-6);
    let warned = |what: &str| scene.warnings.iter().any(|warning| warning.contains(what));
    assert!(warned("orthographic cameras are passed over"), "{:?}", scene.warnings);
    assert!(!warned("has no camera") && !warned("has no light"), "{:?}", scene.warnings);

    // A transform of the model moves them, too; sections of the scene file replace them.
    let text = file.text();
    let place = "translate = [0, 0, 7]\n";
    let load = |toml: &str| {
        let files = [("m.gltf", text.as_bytes()), ("s.toml", toml.as_bytes())];
        load_files(&files, "s.toml", &LoadOptions::default()).unwrap()
    };
    let moved = load(&format!("[[model]]\nfile = \"m.gltf\"\n{place}"));
    let at = moved.lights[0].kind.position().unwrap().as_dvec3() + moved.origin;
    assert!(close(at.as_vec3(), Vec3::new(1.0, 2.0, 10.0)) && moved.lights.len() == 3);
    let own = load(&format!("[[model]]\nfile = \"m.gltf\"\n{CAMERA}{LIGHT}"));
    assert_eq!((own.lights.len(), own.cameras.len(), &*own.cameras[0].name), (1, 1, "camera"));
}

#[test]
fn an_edited_model_is_saved_with_all_its_cameras_and_lights() {
    let mut file = square();
    file.root["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    file.root["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point", "name": "lamp", "intensity": 683.0 }] } });
    file.root["cameras"] = json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
    let lamp = json!({ "KHR_lights_punctual": { "light": 0 } });
    file.root["nodes"] = json!([
        { "mesh": 0, "children": [1, 2, 3, 4] },
        { "name": "a", "translation": [0, 0, 5], "camera": 0 },
        { "name": "b", "translation": [1, 0, 6], "camera": 0 },
        { "translation": [0, 1, 2], "extensions": lamp },
        { "translation": [3, 1, 2], "extensions": lamp },
    ]);
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("m.gltf"), file.text()).unwrap();
    let (spec, options) = (path("m.gltf"), LoadOptions::default());
    let mut scene = Scene::load(spec.to_str().unwrap(), &options).unwrap();
    let text = SceneText::new(spec.to_str().unwrap(), &options, &scene).unwrap();
    scene.lights[1].kind = scene.lights[1].kind.with_emission(Vec3::splat(9.0));
    scene.cameras[0].position += Vec3::X;
    scene.cameras[0].target += Vec3::X;
    let saved = text.with_edits(&Edited::from_scene(&scene), &path("s.toml")).unwrap();
    std::fs::write(path("s.toml"), saved).unwrap();
    let again = Scene::load(path("s.toml").to_str().unwrap(), &options).unwrap();
    assert_eq!(again.lights, scene.lights);
    assert_eq!(again.cameras.len(), 2);
    for (again, camera) in again.cameras.iter().zip(&scene.cameras) {
        assert_eq!(again.name, camera.name);
        assert!(close(again.position, camera.position) && close(again.frame()[2], camera.frame()[2]));
    }
}

/// Colours of vertices are linear, of any component type, and multiply the base colour.
#[test]
fn vertex_colours_multiply_the_base_colour() {
    let corners = [[0.0, 0.5, 1.0], [0.2, 0.4, 1.0], [0.2, 0.6, 0.8], [1.0, 1.0, 1.0]];
    let flat: Vec<f32> = corners.iter().flatten().copied().collect();
    for component in [FLOAT, U16, U8] {
        let mut file = square();
        let most = if component == U8 { 255.0 } else { 65535.0 };
        let (kind, bytes): (_, Vec<u8>) = match component {
            FLOAT => ("VEC3", flat.iter().flat_map(|number| number.to_le_bytes()).collect()),
            _ => {
                let rgba = corners.iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]);
                let codes = rgba.map(|number: f32| (most * number).round() as u16);
                let bytes = |code: u16| code.to_le_bytes()[..if component == U8 { 1 } else { 2 }].to_vec();
                ("VEC4", codes.flat_map(bytes).collect())
            }
        };
        let colours = file.list(kind, component, 4, &bytes);
        file.root["accessors"][colours]["normalized"] = json!(component != FLOAT);
        file.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colours);
        file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
        file.root["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 0.125, 1],
            "metallicFactor": 0 } }]);
        let scene = load(&file);
        let expected = [0, 1, 2].map(|index| Vec3::from(corners[index]).as_dvec3());
        let error = difference(&scene, 0, expected);
        assert!(error < 5e-3, "{component}: {error}");
        let diffuse = scene.materials[0].diffuse;
        assert!(close(diffuse, 0.96 * Vec3::new(0.5, 0.25, 0.125) + 0.04), "{diffuse}");
    }
}

#[test]
fn what_is_not_read_is_named() {
    let mut file = square();
    file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
    file.root["meshes"][0]["primitives"][0]["attributes"]["_ID"] = json!(0);
    let lines = json!({ "attributes": file.root["meshes"][0]["primitives"][0]["attributes"], "mode": 1 });
    file.root["meshes"][0]["primitives"].as_array_mut().unwrap().push(lines);
    file.root["materials"] = json!([
        { "name": "pane", "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.75] },
          "emissiveFactor": [1, 0.5, 0.25], "doubleSided": true, "extensions": { "KHR_materials_clearcoat": {} } },
        { "name": "leaf", "alphaMode": "MASK" },
    ]);
    file.root["extensionsUsed"] = json!(["KHR_materials_clearcoat", "EXT_unheard_of"]);
    file.root["scenes"].as_array_mut().unwrap().push(json!({ "nodes": [] }));
    let scene = load(&file);
    for expected in [
        "extensions that are not read: \"KHR_materials_clearcoat\"; \"EXT_unheard_of\"",
        "transparency is passed over: surfaces are opaque (opacity 0.75): pane",
        "points and lines are left out",
        "of several scenes the default one is read",
    ] {
        assert!(
            scene.warnings.iter().any(|found| found.contains(expected)),
            "{expected}: {:?}",
            scene.warnings
        );
    }
}

#[test]
fn damaged_and_foreign_files_are_refused_in_one_line() {
    let change = |change: &dyn Fn(&mut File)| {
        let mut file = square();
        change(&mut file);
        message(load_text(&file.text()))
    };
    type Damage<'a> = &'a dyn Fn(&mut File);
    let cases: [(Damage, &str); 10] = [
        (&|file| file.root["asset"]["version"] = json!("1.0"), "is glTF \"1.0\", only 2.0 is read"),
        (
            &|file| file.root["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]),
            "is compressed by KHR_draco_mesh_compression, which is not read: save it without",
        ),
        (&|file| file.root["accessors"][0]["count"] = json!(9), "is damaged: a list reaches beyond its view"),
        (&|file| file.root["accessors"][0]["count"] = json!(u32::MAX), "has a list of 4294967295 elements"),
        (
            &|file| file.root["bufferViews"][0]["byteLength"] = json!(1_u64 << 40),
            "is damaged: a view reaches beyond",
        ),
        (&|file| file.buffer[48] = 9, "is damaged: vertex 9 is named, there are 4"),
        (
            &|file| file.root["nodes"] = json!([{ "mesh": 0, "children": [0] }]),
            "has nodes more than 256 deep",
        ),
        (&|file| file.root["nodes"] = json!([{}]), "holds no triangle"),
        (&|file| file.root["nodes"] = json!([{ "mesh": 7 }]), "is no valid glTF: nodes[0].mesh"),
        (&|file| file.root["accessors"][1]["type"] = json!("VEC2"), "has a list of indices of another kind"),
    ];
    for (damage, expected) in cases {
        let found = change(damage);
        assert!(found.contains(expected), "{found}: {expected} was expected");
    }
    assert!(message(load_text("{")).contains("is no readable glTF 2.0"));
    let glb = square().glb();
    for length in [0, 3, 11, 30, glb.len() - 1] {
        let found = message(load_files(&[("m.glb", &glb[..length])], "m.glb", &LoadOptions::default()));
        assert!(found.contains("m.glb"), "{length} bytes: {found}");
    }
}

#[test]
fn emission_makes_lights() {
    let mut file = square();
    file.root["meshes"][0]["primitives"][0]["material"] = json!(0);
    file.root["materials"] = json!([{ "name": "screen", "emissiveFactor": [1, 0.5, 0.25],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8.0 } } }]);
    file.root["extensionsUsed"] = json!(["KHR_materials_emissive_strength"]);
    let scene = load(&file);
    let [light] = &scene.lights[..] else { panic!("{:?}", scene.lights) };
    assert_eq!((light.name.as_str(), light.kind.word()), ("screen", "surface"));
    assert_eq!(light.kind.emission(), Vec3::new(8.0, 4.0, 2.0));
    assert_eq!(scene.materials[0].emitting_sides, Some(Sides::Front));
    assert!(scene.warnings.iter().all(|warning| !warning.contains("emissive")), "{:?}", scene.warnings);
}
