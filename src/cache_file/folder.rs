//! A folder of cached files with a size limit: the least recently used files are removed first.

use super::temporary;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// Extension of the cached files. Other files in the folder are ignored.
const EXTENSION: &str = "paths";

/// Age at which a temporary file counts as abandoned.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// A cache folder with the limit of its size.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    /// Path of the folder.
    pub path: PathBuf,
    /// Largest total size of the cached files, bytes.
    pub limit_bytes: u64,
}

impl Folder {
    /// The path of the file with that stem.
    pub fn file(&self, stem: &str) -> PathBuf {
        self.path.join(format!("{stem}.{EXTENSION}"))
    }

    /// Marks a file as used. A failure only makes it look older.
    pub fn touch(file: &Path) {
        let opened = fs::File::options().append(true).open(file);
        let _ = opened.and_then(|file| file.set_modified(SystemTime::now()));
    }

    /// Frees space for `bytes` bytes under the name `file`: removes the least recently used files.
    /// A file that another process removes meanwhile is no error.
    ///
    /// # Errors
    /// The system's error.
    pub fn make_room(&self, file: &Path, bytes: u64) -> io::Result<()> {
        let mut kept = Vec::new();
        let mut total = bytes;
        for entry in fs::read_dir(&self.path)? {
            let path = entry?.path();
            let Some((modified, size)) = modified_and_size(&path) else { continue };
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if name.starts_with(temporary::PREFIX) {
                if modified.elapsed().is_ok_and(|age| age > ABANDONED) {
                    remove(&path)?;
                }
            } else if path != file && path.extension().is_some_and(|extension| extension == EXTENSION) {
                total += size;
                kept.push((modified, size, path));
            }
        }
        kept.sort();
        for (_, size, path) in kept {
            if total <= self.limit_bytes {
                break;
            }
            remove(&path)?;
            total -= size;
        }
        Ok(())
    }
}

/// Modification time and size. `None` if it is no regular file or has been removed.
fn modified_and_size(path: &Path) -> Option<(SystemTime, u64)> {
    let found = fs::symlink_metadata(path).ok().filter(fs::Metadata::is_file)?;
    Some((found.modified().ok()?, found.len()))
}

fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
