//! Sources of scene files: the disk, memory, or the built-in scenes in the binary.

use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};

use super::load_options::Memory;
use super::{LoadOptions, limits};
use crate::{Error, Result, files};

/// Names of the built-in scenes.
pub const NAMES: [&str; 3] = ["box", "atrium", "room"];

const EMBEDDED: [(&str, &str); 5] = [
    ("box.toml", include_str!("../../assets/box.toml")),
    ("box.obj", include_str!("../../assets/box.obj")),
    ("box.mtl", include_str!("../../assets/box.mtl")),
    ("atrium.toml", include_str!("../../assets/atrium.toml")),
    ("room.toml", include_str!("../../assets/room.toml")),
];

/// Names of the embedded models. `built_in = "box"` in a scene file means `file = "box.obj"` in
/// the built-in scene.
pub(super) const MODELS: [&str; 1] = ["box"];

/// The file of an embedded model.
pub(super) fn model_file(name: &str) -> PathBuf {
    PathBuf::from(format!("{name}.obj"))
}

/// The OBJ text of the embedded model of that name. `None` if there is none.
pub(super) fn model(name: &str) -> Option<Vec<u8>> {
    MODELS.contains(&name).then(|| Files::Embedded.read(&model_file(name), limits::OBJ_BYTES).ok()).flatten()
}

/// A source of files.
#[derive(Clone, Debug)]
pub(super) enum Files {
    /// On disk: the files in this folder and below it, or all files.
    Disk(Option<PathBuf>),
    Memory(Memory),
    Embedded,
}

impl Files {
    /// The folder of a file that the user named, and everything below it.
    pub(super) fn beside(file: &Path) -> Self {
        Self::Disk(Some(file.with_file_name("")))
    }

    /// The source of the files that a user's file may name; built-in files have their own.
    pub(super) fn from_options(file: &Path, options: &LoadOptions) -> Self {
        match &options.memory {
            Some(files) => Self::Memory(files.clone()),
            None if options.allow_outside => Self::Disk(None),
            None => Self::beside(file),
        }
    }

    /// Reads a file that the user named. It may be anywhere, or a link to anywhere.
    pub(super) fn read_named(&self, file: &Path, most: u64) -> std::result::Result<Vec<u8>, String> {
        if let Self::Disk(_) = self { Self::Disk(None).read(file, most) } else { self.read(file, most) }
    }

    /// Reads a regular file of at most `most` bytes. Fails with a reason that follows
    /// the file's name.
    pub(super) fn read(&self, path: &Path, most: u64) -> std::result::Result<Vec<u8>, String> {
        match self {
            Self::Embedded => {
                let found = EMBEDDED.iter().find(|(name, _)| Path::new(name) == path);
                found.map(|(_, text)| text.as_bytes().to_vec()).ok_or_else(|| "is not built in".to_owned())
            }
            Self::Memory(files) => {
                let found = &files[&self.locate(path)?];
                let bytes = found.len();
                if bytes as u64 > most { Err(files::too_long(bytes, most)) } else { Ok(found.clone()) }
            }
            Self::Disk(_) => files::read(&self.locate(path)?, most).map_err(|unread| unread.to_string()),
        }
    }

    /// The path of a file on disk. `None` if its source is not the disk.
    pub(super) fn on_disk(&self, file: &Path) -> Option<PathBuf> {
        matches!(self, Self::Disk(_)).then(|| file.to_owned())
    }

    /// Whether the path is a regular file that may be read.
    pub(super) fn is_file(&self, path: &Path) -> bool {
        match self {
            Self::Embedded => EMBEDDED.iter().any(|(name, _)| Path::new(name) == path),
            Self::Memory(files) => files.contains_key(path),
            Self::Disk(_) => self.locate(path).is_ok_and(|found| found.is_file()),
        }
    }

    /// Whether the path is a file or a folder that may be read.
    pub(super) fn exists(&self, path: &Path) -> bool {
        match self {
            Self::Embedded => self.is_file(path),
            Self::Memory(files) => files.keys().any(|file| file.starts_with(path)),
            Self::Disk(_) => self.locate(path).is_ok_and(|found| found.exists()),
        }
    }

    /// Names in a folder, at most [`limits::FOLDER_NAMES`]. Empty if it may not be read.
    pub(super) fn names_in(&self, folder: &Path) -> Vec<OsString> {
        let here = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        match self {
            Self::Embedded => Vec::new(),
            Self::Memory(files) => {
                let below =
                    files.keys().filter_map(|file| file.strip_prefix(folder).ok()?.components().next());
                below.map(|part| part.as_os_str().to_owned()).collect()
            }
            Self::Disk(_) => {
                let entries = self.locate(here).ok().and_then(|folder| folder.read_dir().ok());
                let names = entries.into_iter().flatten().flatten().map(|entry| entry.file_name());
                names.take(limits::FOLDER_NAMES).collect()
            }
        }
    }

    /// The path of a file with its links resolved. Fails if it lies outside of this source.
    pub(super) fn locate(&self, path: &Path) -> std::result::Result<PathBuf, String> {
        let folder = match self {
            Self::Disk(Some(folder)) => folder,
            Self::Memory(files) if !files.contains_key(path) => {
                return Err(files::Unread::Missing.to_string());
            }
            _ => return Ok(path.to_owned()),
        };
        let outside = || {
            "leads out of the folder of the file that names it: move it there, or pass --allow-outside"
                .to_owned()
        };
        // Checked before any lookup: some systems contact other machines for certain paths.
        if leads_out(folder, path) {
            return Err(outside());
        }
        let real = |path: &Path| path.canonicalize().map_err(|error| files::Unread::from(error).to_string());
        let here = real(if folder.as_os_str().is_empty() { Path::new(".") } else { folder })?;
        let found = real(path)?;
        if found.starts_with(here) { Ok(found) } else { Err(outside()) }
    }
}

/// Whether a path, as written, leaves the folder at some point.
fn leads_out(folder: &Path, path: &Path) -> bool {
    let Ok(below) = path.strip_prefix(folder) else { return true };
    let mut depth = 0_usize;
    below.components().any(|part| match part {
        Component::Normal(_) => {
            depth += 1;
            false
        }
        Component::CurDir => false,
        Component::ParentDir if depth > 0 => {
            depth -= 1;
            false
        }
        _ => true,
    })
}

/// The text in `bytes`, or an error that names the line where it stops being UTF-8.
pub(super) fn utf8(file: &Path, bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|fault| {
        let good = &fault.as_bytes()[..fault.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|&&byte| byte == b'\n').count();
        Error::input_at(file, line, "is not UTF-8 text: save it as UTF-8 (is it the right file?)")
    })
}
