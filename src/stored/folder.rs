//! A folder of files, of which those that were not used for longest go where there are too many.

use super::temporary;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// What file names end in. Whatever else is in the folder is left alone.
const EXTENSION: &str = "paths";

/// A temporary file that is older than this is nobody's any more.
const ABANDONED: Duration = Duration::from_secs(24 * 3600);

/// A folder, and how much of it may be ours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    /// Path of the folder.
    pub path: PathBuf,
    /// Bytes of all its files together, at most.
    pub limit_bytes: u64,
}

impl Folder {
    /// The file of that stem.
    pub fn file(&self, stem: &str) -> PathBuf {
        self.path.join(format!("{stem}.{EXTENSION}"))
    }

    /// Notes that a file was used. Where that fails it counts as older than it is.
    pub fn touch(file: &Path) {
        let opened = fs::File::options().append(true).open(file);
        let _ = opened.and_then(|file| file.set_modified(SystemTime::now()));
    }

    /// Makes room for so many bytes under the name `file`: removes those that were not used for
    /// longest. What another process removes meanwhile is no error.
    ///
    /// # Errors
    /// What the system said.
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

/// Of a regular file that is still there.
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
