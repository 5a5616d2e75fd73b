//! JSON documents of glTF files as other programs write them, and of other versions.

use glam::Vec3;
use image::{ImageFormat, Rgb, RgbImage};
use lightpaths::scene::LoadOptions;
use serde_json::{Value, json};

use super::gltf::{File, load, load_text, sorted, square};
use super::load_files;
use super::refused::message;

fn primitive(file: &mut File) -> &mut Value {
    &mut file.root["meshes"][0]["primitives"][0]
}

#[test]
fn members_that_are_not_read_may_have_any_form_that_gltf_allows() {
    type Change<'a> = &'a dyn Fn(&mut File);
    let pointer =
        json!([{ "channels": [{ "sampler": 0, "target": { "path": "pointer" } }], "samplers": [] }]);
    let bare = json!({ "attributes": {} });
    let cases: [(Change, Option<&str>); 8] = [
        (&|file| file.root["accessors"][0]["count"] = json!(4.0), None),
        (&|file| file.root["nodes"][0]["translation"] = json!([0.0, 0, -0.0]), None),
        (
            &|file| file.root["meshes"][0]["primitives"].as_array_mut().unwrap().push(bare.clone()),
            Some("primitives without positions are left out"),
        ),
        (&|file| file.root["scenes"].as_array_mut().unwrap().push(json!({})), Some("of several scenes")),
        (&|file| file.root["nodes"][0]["extras"] = json!(7), None),
        (&|file| file.root["asset"]["extras"] = json!(["a", 1.5]), None),
        (&|file| file.root["animations"] = pointer.clone(), Some("animations are passed over")),
        (&|file| drop(file.root["accessors"][0].as_object_mut().unwrap().remove("min")), None),
    ];
    for (change, note) in cases {
        let mut file = square();
        change(&mut file);
        let scene = load(&file);
        assert_eq!(sorted(&scene), sorted(&load(&square())));
        let notes: Vec<_> = scene.warnings.iter().filter(|warning| !warning.contains(" has no ")).collect();
        assert!(
            notes.len() == note.iter().count() && notes.iter().all(|it| it.contains(note.unwrap())),
            "{notes:?}"
        );
    }
}

#[test]
fn accessors_without_a_view_are_zeros() {
    let mut file = square();
    let zeros = json!({ "componentType": 5126, "count": 4, "type": "VEC3" });
    file.root["accessors"].as_array_mut().unwrap().push(zeros.clone());
    primitive(&mut file)["attributes"]["NORMAL"] = json!(2);
    let scene = load(&file);
    assert_eq!(sorted(&scene), sorted(&load(&square())));
    assert!(
        scene.warnings.iter().any(|it| it.contains("2 with zero or non-finite normals")),
        "{:?}",
        scene.warnings
    );
    for (index, expected) in [(0, "the model is 0e0 m large"), (1, "no triangle with an area is left")] {
        let mut file = square();
        file.root["accessors"][index].as_object_mut().unwrap().remove("bufferView");
        let found = message(load_text(&file.text()));
        assert!(found.contains(expected), "{found}");
    }
}

#[test]
fn attributes_without_a_list_are_refused() {
    for name in ["POSITION", "NORMAL"] {
        let mut file = square();
        primitive(&mut file)["attributes"][name] = json!(u32::MAX);
        let found = message(load_text(&file.text()));
        assert!(found.ends_with("is no valid glTF: an attribute is a list that does not exist"), "{found}");
    }
}

#[test]
fn files_of_version_1_are_named_so() {
    let mut root = json!({ "asset": { "version": "1.0" }, "meshes": { "a": {} }, "scenes": { "b": {} } });
    let found = message(load_text(&root.to_string()));
    assert!(found.ends_with("m.gltf: is glTF \"1.0\", only 2.0 is read: convert it"), "{found}");
    root.as_object_mut().unwrap().remove("asset");
    assert_eq!(message(load_text(&root.to_string())), found.replace('\n', ""));
    let mut glb = square().glb();
    glb[4] = 1;
    let found = message(load_files(&[("m.glb", &glb)], "m.glb", &LoadOptions::default()));
    assert!(found.ends_with("m.glb: is glTF \"1\", only 2.0 is read: convert it"), "{found}");
}

#[test]
fn compression_is_refused_if_the_file_requires_it() {
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression"] {
        let mut file = square();
        file.root["extensionsUsed"] = json!([name]);
        let scene = load(&file);
        let note = format!("extensions that are not read: {name:?}");
        assert!(scene.warnings.iter().any(|it| it.ends_with(&note)), "{:?}", scene.warnings);
        let mut required = square();
        required.root["extensionsRequired"] = json!([name]);
        // Without the list, an accessor without a view has its data nowhere else.
        file.root["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        for file in [required, file] {
            let found = message(load_text(&file.text()));
            assert!(found.contains(&format!("is compressed by {name}, which is not read")), "{found}");
        }
    }
}

#[test]
fn webp_images_are_read_where_no_other_image_stands() {
    let encoded = |format, colour| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        RgbImage::from_pixel(2, 2, Rgb(colour)).write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    };
    let mut file = square();
    let red = file.view(&encoded(ImageFormat::WebP, [255, 0, 0]));
    let green = file.view(&encoded(ImageFormat::Png, [0, 255, 0]));
    let coordinates = file.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    primitive(&mut file)["attributes"]["TEXCOORD_0"] = json!(coordinates);
    primitive(&mut file)["material"] = json!(0);
    file.root["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
    file.root["images"] = json!([
        { "bufferView": red, "mimeType": "image/webp" },
        { "bufferView": green, "mimeType": "image/png" },
    ]);
    file.root["extensionsUsed"] = json!(["EXT_texture_webp"]);
    let mut texture = json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } });
    for colour in [Vec3::X, Vec3::Y] {
        file.root["textures"] = json!([texture]);
        let scene = load(&file);
        let image = &scene.materials[0].texture.as_ref().unwrap().image;
        assert_eq!(image.brightest(), colour);
        assert!(scene.warnings.iter().all(|it| !it.contains("EXT_")), "{:?}", scene.warnings);
        texture["source"] = json!(1);
    }
    file.root["textures"] = json!([{ "extensions": { "EXT_texture_webp": { "source": 9 } } }]);
    let found = message(load_text(&file.text()));
    assert!(found.contains("is no valid glTF: textures[0].source"), "{found}");
}

#[test]
fn data_uris_may_be_percent_encoded_and_glb_files_longer_than_stated() {
    let mut file = square();
    let bytes = [0_u8; 36];
    let zeros = file.view(&bytes);
    let text = file.text();
    let plain = format!("data:application/octet-stream,{}", "%00".repeat(36));
    let mut root: Value = serde_json::from_str(&text).unwrap();
    root["buffers"]
        .as_array_mut()
        .unwrap()
        .extend([json!({ "byteLength": 36, "uri": plain }), json!({ "byteLength": 36 })]);
    // A buffer without data does no harm until a list is read from it.
    for (buffer, expected) in [(1, None), (2, Some("names a binary part that it does not have"))] {
        root["bufferViews"][zeros]["buffer"] = json!(buffer);
        root["bufferViews"][zeros]["byteOffset"] = json!(0);
        root["accessors"].as_array_mut().unwrap().truncate(2);
        root["accessors"]
            .as_array_mut()
            .unwrap()
            .push(json!({ "bufferView": zeros, "componentType": 5126, "count": 3, "type": "VEC3" }));
        root["extensionsRequired"] = json!(["EXT_unheard_of"]);
        assert_eq!(sorted(&load_text(&root.to_string()).unwrap()), sorted(&load(&square())));
        root["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(2);
        let found = message(load_text(&root.to_string()));
        let expected = expected.unwrap_or("has attributes of different lengths in one mesh");
        assert!(
            found.ends_with(&format!("{expected}; the file requires \"EXT_unheard_of\", which is not read")),
            "{found}"
        );
        root["meshes"][0]["primitives"][0]["attributes"].as_object_mut().unwrap().remove("NORMAL");
    }
    let glb = [square().glb(), b"junk behind".to_vec()].concat();
    let scene = load_files(&[("m.glb", &glb)], "m.glb", &LoadOptions::default()).unwrap();
    assert_eq!(sorted(&scene), sorted(&load(&square())));
}
