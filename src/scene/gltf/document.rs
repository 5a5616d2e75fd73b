//! The JSON document of a glTF file: what other programs write, and what is not read of it.

use std::collections::HashSet;
use std::path::Path;

use gltf::json::deserialize::{from_slice, from_value};
use gltf::json::validation::{Checked, Error as Fault, Validate};
use gltf::json::{Index, Root, Value};
use gltf::{Document, Glb};

use super::super::material_names::shown;
use super::super::reading::Reading;
use super::super::value::{excerpt, printable};

/// Extensions that are read, or that change nothing here: surfaces reflect on both sides.
const READ: [&str; 7] = [
    WEBP,
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

const WEBP: &str = "EXT_texture_webp";

/// Extensions that compress geometry.
const COMPRESSED: [&str; 3] =
    ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// The document, and the binary chunk of a GLB file. A failure's reason follows the file's name.
pub(super) fn parse(bytes: &[u8]) -> Result<(Document, Option<Vec<u8>>), String> {
    let (json, binary) = match bytes {
        [b'g', b'l', b'T', b'F', version @ 1, 0, 0, 0, ..] => {
            return Err(other_version(&version.to_string()));
        }
        [b'g', b'l', b'T', b'F', ..] => {
            // Bytes beyond the stated length belong to no chunk.
            let length = bytes.get(8..12).map_or(0, |l| u32::from_le_bytes([l[0], l[1], l[2], l[3]]));
            let glb = Glb::from_slice(bytes.get(..length as usize).unwrap_or(bytes)).map_err(unreadable)?;
            (glb.json, glb.bin.map(std::borrow::Cow::into_owned))
        }
        _ => (bytes.into(), None),
    };
    let json = json.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&json);
    let mut root: Root = match from_slice(json) {
        Ok(root) => root,
        Err(error) => mended(json).unwrap_or_else(|| Err(unreadable(error)))?,
    };
    if !root.asset.version.starts_with("2.") {
        return Err(other_version(&root.asset.version));
    }
    if let Some(name) = compression(&root) {
        return Err(format!(
            "is compressed by {name}, which is not read: save it without compression of meshes"
        ));
    }
    // The validation refuses attributes of applications, such as `_ID`.
    for primitive in root.meshes.iter_mut().flat_map(|mesh| &mut mesh.primitives) {
        primitive.attributes.retain(|name, _| matches!(name, Checked::Valid(_)));
        // The validation panics on such a list.
        if primitive.attributes.values().any(|list| list.value() >= root.accessors.len()) {
            return Err("is no valid glTF: an attribute is a list that does not exist".to_owned());
        }
    }
    take_webp(&mut root);
    validate(&root)?;
    Ok((Document::from_json_without_validation(root), binary))
}

fn unreadable(error: impl std::fmt::Display) -> String {
    format!("is no readable glTF 2.0: {}", printable(&error.to_string()))
}

fn other_version(version: &str) -> String {
    format!("is glTF {}, only 2.0 is read: convert it", excerpt(version))
}

/// A document in a form that the `gltf` crate accepts. `None` if there is none.
///
/// The crate refuses three things that glTF 2.0 allows: scenes without a list of nodes, extras
/// that are no objects, and animations of properties other than a node's. Extras and animations
/// are not read. It also refuses integers that exporters write as `1.0`.
fn mended(json: &[u8]) -> Option<Result<Root, String>> {
    let mut value: Value = from_slice(json).ok()?;
    simplify(&mut value);
    let root = value.as_object_mut()?;
    // Lists of version 1.0 are objects, and its `asset` may be missing.
    if root.get("meshes").is_some_and(Value::is_object) {
        let stated = root.get("asset").and_then(|asset| asset.get("version")?.as_str());
        return Some(Err(other_version(stated.unwrap_or("1.0"))));
    }
    for scene in root.get_mut("scenes").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(scene) = scene.as_object_mut() {
            scene.entry("nodes").or_insert_with(|| Value::Array(Vec::new()));
        }
    }
    if let Some(animations) = root.get_mut("animations").and_then(Value::as_array_mut) {
        // One without channels remains, so that a note mentions it.
        animations.truncate(1);
        for list in animations.iter_mut().filter_map(Value::as_object_mut).flat_map(|item| item.values_mut())
        {
            list.as_array_mut().into_iter().for_each(Vec::clear);
        }
    }
    from_value(value).ok().map(Ok)
}

/// Removes all extras, and writes whole numbers as integers.
fn simplify(value: &mut Value) {
    const LARGEST: f64 = (1_u64 << 53) as f64;
    match value {
        Value::Object(members) => {
            members.remove("extras");
            members.values_mut().for_each(simplify);
        }
        Value::Array(items) => items.iter_mut().for_each(simplify),
        Value::Number(number) => {
            let whole = number.as_f64().filter(|x| number.is_f64() && x.fract() == 0.0 && x.abs() < LARGEST);
            if let Some(whole) = whole {
                *value = Value::from(whole as i64);
            }
        }
        _ => (),
    }
}

/// The extension that holds the geometry. `None` if the buffers have it, too.
fn compression(root: &Root) -> Option<&str> {
    let is_empty = root.accessors.iter().any(|list| list.buffer_view.is_none() && list.sparse.is_none());
    let used = root.extensions_used.iter().filter(|_| is_empty);
    let mut names = root.extensions_required.iter().chain(used).map(String::as_str);
    names.find(|name| COMPRESSED.contains(name))
}

/// Textures without another image show the WebP image that the extension names.
fn take_webp(root: &mut Root) {
    for texture in &mut root.textures {
        let extensions = texture.extensions.as_ref();
        let webp = extensions.and_then(|extensions| extensions.others.get(WEBP)?.get("source")?.as_u64());
        if let Some(index) = webp.filter(|_| texture.source.value() == u32::MAX as usize) {
            texture.source = Index::new(u32::try_from(index).unwrap_or(u32::MAX - 1));
        }
    }
}

/// Fails with the first fault of the `gltf` crate's validation that matters here.
fn validate(root: &Root) -> Result<(), String> {
    let mut found = None;
    root.validate(root, gltf::json::Path::new, &mut |path, fault| {
        let path = path();
        if found.is_none() && !is_harmless(path.as_str(), fault) {
            found = Some(format!("is no valid glTF: {}: {fault}", printable(path.as_str())));
        }
    });
    found.map_or(Ok(()), Err)
}

/// Whether a fault of the validation changes nothing that is read.
fn is_harmless(path: &str, fault: Fault) -> bool {
    // An accessor without a view is a list of zeros.
    let is_zeros =
        fault == Fault::Missing && path.starts_with("accessors[") && path.ends_with("].bufferView");
    let is_bound = path.starts_with("meshes[") && (path.ends_with(".min") || path.ends_with(".max"));
    // A note mentions primitives without positions.
    let is_left_out = fault == Fault::Missing && path.ends_with("attributes[\"POSITION\"]");
    is_zeros || is_bound || is_left_out || path.starts_with("animations[") || fault == Fault::Unsupported
}

/// An extension that the file requires and that is not read.
pub(super) fn required(document: &Document) -> Option<String> {
    document.extensions_required().find(|name| !READ.contains(name)).map(excerpt)
}

/// Notes extensions and animations that are not read.
pub(super) fn note_unread(reading: &mut Reading, path: &Path, document: &Document) {
    let mut names: Vec<&str> = document.extensions_used().chain(document.extensions_required()).collect();
    let mut seen = HashSet::new();
    names.retain(|name| seen.insert(*name) && !READ.contains(name));
    for name in names {
        reading.notes.add_named("extensions that are not read", &excerpt(name), || shown(path));
    }
    if document.animations().len() > 0 {
        reading.notes.add("animations are passed over", || shown(path));
    }
}
