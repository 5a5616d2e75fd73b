//! Names and messages that OBJ and MTL files share.

use std::path::Path;

use super::limits::MATERIALS;
use super::value::printable;

/// Name of the material of faces before the first `usemtl`, or after one without a name.
pub(super) const NO_MATERIAL: &str = "default";

pub(super) fn too_many_materials() -> String {
    format!("there are more than {MATERIALS} materials")
}

/// A path for use in a message.
pub(super) fn shown(path: &Path) -> String {
    printable(&path.display().to_string())
}
