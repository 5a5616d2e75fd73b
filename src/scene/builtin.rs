//! Where files come from: the disk, or the built-in scenes that are part of the binary.

use std::path::{Path, PathBuf};

use crate::{Error, Result};

/// Names of the built-in scenes.
pub const NAMES: [&str; 3] = ["box", "atrium", "room"];

const EMBEDDED: [(&str, &str); 5] = [
    ("box.toml", include_str!("../../assets/box.toml")),
    ("box.obj", include_str!("../../assets/box.obj")),
    ("box.mtl", include_str!("../../assets/box.mtl")),
    ("atrium.toml", include_str!("../../assets/atrium.toml")),
    ("room.toml", include_str!("../../assets/room.toml")),
];

/// Names of the embedded models: `built_in = "box"` in any scene file is what `file = "box.obj"` is in the built-in scene.
pub(super) const MODELS: [&str; 1] = ["box"];

/// The file of an embedded model.
pub(super) fn model_file(name: &str) -> PathBuf {
    PathBuf::from(format!("{name}.obj"))
}

/// The OBJ text of the embedded model of that name, if there is one.
pub(super) fn model(name: &str) -> Option<Vec<u8>> {
    MODELS.contains(&name).then(|| Files::Embedded.read(&model_file(name)).ok()).flatten()
}

/// A place to read files from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Files {
    Disk,
    Embedded,
}

impl Files {
    /// The bytes of a regular file; where there are none, why, in words that follow its name.
    pub(super) fn read(self, path: &Path) -> std::result::Result<Vec<u8>, String> {
        match self {
            Self::Embedded => {
                let found = EMBEDDED.iter().find(|(name, _)| Path::new(name) == path);
                found.map(|(_, text)| text.as_bytes().to_vec()).ok_or_else(|| "is not built in".to_owned())
            }
            Self::Disk => {
                let say = |fault: std::io::Error| match fault.kind() {
                    std::io::ErrorKind::NotFound => "does not exist: check the path".to_owned(),
                    kind => format!("cannot be read: {kind}"),
                };
                let metadata = std::fs::metadata(path).map_err(say)?;
                if metadata.is_dir() {
                    return Err("is a directory, a file was expected".to_owned());
                }
                // A pipe or a device could go on for ever.
                if !metadata.is_file() {
                    return Err("is not a regular file".to_owned());
                }
                std::fs::read(path).map_err(say)
            }
        }
    }
}

/// The text in `bytes`, or an error that names the line where it stops being UTF-8.
pub(super) fn utf8(file: &Path, bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|fault| {
        let good = &fault.as_bytes()[..fault.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count();
        Error::input_at(file, line, "is not UTF-8 text: save it as UTF-8 (is it the right file?)")
    })
}
