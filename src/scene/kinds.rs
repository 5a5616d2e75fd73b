//! Files of other formats: their description, and advice for the user.

use std::path::Path;

use super::builtin;
use super::value::{excerpt, unknown};
use crate::Error;

const BLENDER: &str = "export it as glTF, in Blender by File > Export > glTF 2.0";
const IMPORT: &str = "import it into Blender, and export it by File > Export > glTF 2.0";
const PROGRAM: &str = "export it as glTF or OBJ from the program that wrote it";
const CONVERT: &str = "convert it to glTF or OBJ";
const MODEL: &str = "give a .toml, .glb, .gltf, .obj, .ply or .stl file";
const UNPACK: &str = "unpack it, and give the .toml file or the model in it";

/// File extensions in lower case, the format's description, and the advice.
const KINDS: [(&[&str], &str, &str); 19] = [
    (&["blend", "blend1"], "a Blender file", BLENDER),
    (&["fbx"], "an FBX model", IMPORT),
    (&["usd", "usda", "usdc", "usdz"], "a USD scene", IMPORT),
    (&["dae"], "a COLLADA model", IMPORT),
    (&["abc"], "an Alembic scene", IMPORT),
    (&["x3d", "wrl", "vrml"], "an X3D or VRML model", IMPORT),
    (&["3ds"], "a 3D Studio model", CONVERT),
    (&["max"], "a 3ds Max scene", PROGRAM),
    (&["ma", "mb"], "a Maya scene", PROGRAM),
    (&["c4d"], "a Cinema 4D scene", PROGRAM),
    (&["skp"], "a SketchUp model", PROGRAM),
    (&["3dm"], "a Rhino model", PROGRAM),
    (&["step", "stp", "iges", "igs", "dwg", "dxf", "ifc", "f3d", "sldprt"], "a CAD model", PROGRAM),
    (
        &["lwo", "lws", "off", "x", "md2", "md3", "ac", "vox", "3mf", "pbrt", "xml", "pov"],
        "a model or scene of another kind",
        CONVERT,
    ),
    (&["mtl"], "a list of materials", "give the .obj file that names it"),
    (&["zip", "gz", "tgz", "tar", "7z", "rar", "xz", "bz2", "zst"], "an archive", UNPACK),
    (&["png", "jpg", "jpeg", "exr", "hdr", "tga", "bmp", "gif", "tif", "tiff", "webp"], "an image", MODEL),
    (&["json", "yaml", "yml"], "no scene file", "write it as TOML"),
    (&["spv", "exe", "dll", "so"], "a program", MODEL),
];

/// Whether a scene is named by a model's file: neither a scene file nor a built-in scene.
pub fn is_model(spec: &str) -> bool {
    ending(spec).is_some_and(|ending| ending != "toml")
}

fn ending(name: &str) -> Option<String> {
    // Also handles paths of other systems.
    let ending = Path::new(name).extension()?.to_str()?.to_ascii_lowercase();
    (!ending.contains('\\')).then_some(ending)
}

/// Why a file of this name is not read as a model; the text follows the name. `None` if it may
/// be a model.
pub(super) fn not_read(name: &str) -> Option<String> {
    let ending = ending(name)?;
    let (_, what, hint) = KINDS.iter().find(|(endings, ..)| endings.contains(&&*ending))?;
    Some(format!("is {what}, which is not read: {hint}"))
}

/// The error for a SCENE that is neither built in, nor a scene file or a model.
pub(super) fn no_scene(spec: &str) -> Error {
    if let Some(what) = not_read(spec) {
        return Error::input(spec, what);
    }
    let is_path = spec.contains(['/', '\\']) || ending(spec).is_some() || Path::new(spec).exists();
    let built_in = builtin::NAMES.join(", ");
    if is_path {
        let known = "a .toml scene file, a .glb, .gltf, .obj, .ply or .stl model or a built-in scene";
        return Error::Usage(format!("{} is no scene: {known} ({built_in}) was expected", excerpt(spec)));
    }
    let what = unknown("built-in scene", &builtin::NAMES, spec);
    Error::Usage(format!("{what}; or give the path of a .toml, .glb, .gltf, .obj, .ply or .stl file"))
}
