//! Paths of files as seen from other files.

use std::path::{Component, Path, PathBuf};

use crate::{Error, Result};

/// Converts `path`, relative to the current directory or absolute, for use in a file at `to`. The
/// result is relative to that file if possible, with slashes; else absolute.
///
/// # Errors
/// [`Error::Output`] if a text file cannot name it.
pub fn relative_to(path: &Path, to: &Path) -> Result<String> {
    let (folder, path) = (folder_of(to), folder_of(path).join(path.file_name().unwrap_or_default()));
    let shared = folder.components().zip(path.components()).take_while(|(a, b)| a == b).count();
    let is_root = |part: &Component| matches!(part, Component::Prefix(_) | Component::RootDir);
    let has_way = path.components().take(shared).any(|part| is_root(&part));
    let relative: PathBuf = folder
        .components()
        .skip(shared)
        .map(|_| Component::ParentDir)
        .chain(path.components().skip(shared))
        .collect();
    let found = if has_way { relative } else { path };
    let text = found.to_str().filter(|text| !text.contains(char::is_control)).ok_or_else(|| {
        Error::output(to, format!("{:?} cannot be named in a file: rename the folder", found.display()))
    })?;
    Ok(if has_way && cfg!(windows) { text.replace('\\', "/") } else { text.to_owned() })
}

/// The new text of `path` in a file that moves from `from` to `to`. `None` if it need not change.
pub(super) fn moved(path: &Path, from: &Path, to: &Path) -> Result<Option<String>> {
    let stays = path.is_absolute() && !from.is_absolute() || folder_of(from) == folder_of(to);
    if stays { Ok(None) } else { relative_to(path, to).map(Some) }
}

/// The folder of a file. Links in an existing folder are resolved, so that `..` is correct.
fn folder_of(file: &Path) -> PathBuf {
    let folder = match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    };
    let absolute = || std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    folder.canonicalize().unwrap_or_else(|_| absolute())
}
