//! Temporary files that are renamed when they are complete.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

/// Prefix of temporary files; a killed process leaves one behind.
pub(super) const PREFIX: &str = ".lightpaths-";

/// All temporary files of this process.
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file that is removed unless it gets its final name.
pub struct Temporary {
    /// `None` only while it is dropped or renamed.
    file: Option<NamedTempFile>,
}

impl Temporary {
    /// Creates a temporary file in the folder of `target`, the file that it will create or replace.
    ///
    /// # Errors
    /// The system's error.
    pub fn beside(target: &Path) -> io::Result<Self> {
        let folder = match target.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(".part");
        // Temporary files are private by default. This one becomes an ordinary file, subject to the
        // umask. A replacement of a private file is private from the start; `persist` restores its
        // mode whatever the umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(
            mode(target).map_or(0o666, |mode| mode | 0o600),
        ));
        let mut live = live();
        let file = builder.tempfile_in(folder)?;
        live.push(file.path().to_owned());
        Ok(Self { file: Some(file) })
    }

    /// The file, open for writing.
    pub fn file(&self) -> &File {
        self.held().as_file()
    }

    /// Path of the temporary file.
    pub fn path(&self) -> &Path {
        self.held().path()
    }

    /// Renames the file to `target`. It replaces an existing file and takes over its permissions.
    ///
    /// # Errors
    /// The system's error; the temporary file is then removed.
    pub fn persist(mut self, target: &Path) -> io::Result<()> {
        let mut live = live();
        let Some(file) = self.file.take() else { return Ok(()) };
        live.retain(|path| path != file.path());
        #[cfg(unix)]
        if let Some(mode) = mode(target) {
            fs::set_permissions(file.path(), std::os::unix::fs::PermissionsExt::from_mode(mode))?;
        }
        file.persist(target).map(drop).map_err(|error| error.error)
    }

    fn held(&self) -> &NamedTempFile {
        self.file.as_ref().expect("taken only when it goes")
    }
}

/// Permissions of a file for its owner, its group and others. `None` if there is no such file.
#[cfg(unix)]
fn mode(file: &Path) -> Option<u32> {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(file).ok().map(|found| found.permissions().mode() & 0o777)
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let Some(file) = self.file.take() else { return };
        let mut live = live();
        live.retain(|path| path != file.path());
        drop(file);
    }
}

/// Removes all temporary files of this process. While the returned guard lives, none is created or
/// renamed: the caller is about to end the process.
pub fn remove_temporaries() -> impl Sized {
    let live = live();
    for path in &*live {
        // The process ends, so the error is ignored.
        let _ = fs::remove_file(path);
    }
    live
}

fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}
