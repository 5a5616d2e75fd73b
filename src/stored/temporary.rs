//! Files on the way to their final names.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::NamedTempFile;

/// What names of temporary files begin with; a process that is killed leaves one behind.
pub(super) const PREFIX: &str = ".lightpaths-";

/// Those that there are.
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// A file that goes unless it takes the name that it is meant for.
pub struct Temporary {
    /// None only while it goes.
    file: Option<NamedTempFile>,
}

impl Temporary {
    /// Creates one in that folder.
    ///
    /// # Errors
    /// What the system said.
    pub fn create(folder: &Path) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(PREFIX).suffix(".part");
        // Temporary files are private by default; this one becomes an ordinary file, subject to the umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut live = live();
        let file = builder.tempfile_in(folder)?;
        live.push(file.path().to_owned());
        Ok(Self { file: Some(file) })
    }

    /// The file, open for writing.
    pub fn file(&self) -> &File {
        self.held().as_file()
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.held().path()
    }

    /// Gives it its name, in the place of what has it.
    ///
    /// # Errors
    /// What the system said; the file is gone then.
    pub fn persist(mut self, target: &Path) -> io::Result<()> {
        let mut live = live();
        let Some(file) = self.file.take() else { return Ok(()) };
        live.retain(|path| path != file.path());
        file.persist(target).map(drop).map_err(|error| error.error)
    }

    fn held(&self) -> &NamedTempFile {
        self.file.as_ref().expect("taken only when it goes")
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let Some(file) = self.file.take() else { return };
        let mut live = live();
        live.retain(|path| path != file.path());
        drop(file);
    }
}

/// Removes all temporary files of this process. While what is returned lives, none is created, and none takes its name: who needs
/// that is about to end the process.
pub fn remove_temporaries() -> impl Sized {
    let live = live();
    for path in &*live {
        // There is nobody left to tell.
        let _ = std::fs::remove_file(path);
    }
    live
}

fn live() -> MutexGuard<'static, Vec<PathBuf>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}
