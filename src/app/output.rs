//! Output files that are written completely or not at all.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::cache_file::Temporary;
use crate::error::{Error, Result};

/// An output file that was checked to be writable.
#[derive(Debug)]
pub(super) struct OutputFile {
    /// The path as the user named it.
    path: PathBuf,
    /// The file to replace: `path` with symbolic links followed, so that a link stays a link.
    target: PathBuf,
}

impl OutputFile {
    /// Checks that a file can be created at `path`, so that a typing error is found
    /// before the work.
    ///
    /// # Errors
    /// [`Error::Output`] if the folder is missing or read-only, or if `path` is no regular file.
    pub(super) fn check(path: &Path) -> Result<Self> {
        if path == Path::new("-") {
            return Err(Error::output(path, "is no file: pictures and figures go to files; or name it ./-"));
        }
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
        let output = Self { path: path.to_owned(), target };
        match fs::metadata(&output.target) {
            Ok(found) if found.is_dir() => return Err(Error::output(path, "is a folder; name a file in it")),
            Ok(found) if !found.is_file() => return Err(Error::output(path, "is not a regular file")),
            _ => {}
        }
        if !output.folder().is_dir() {
            let folder = output.folder().display();
            return Err(Error::output(path, format!("there is no folder {folder}; create it first")));
        }
        // Permissions, read-only mounts and quotas all matter, so only creating a file
        // is a reliable test. It is dropped at once: a process that is killed later
        // leaves nothing behind.
        output.temporary().map_err(|error| output.failed(&error))?;
        Ok(output)
    }

    /// Passes a writer of a temporary file to `fill`, then renames the file to the target.
    ///
    /// # Errors
    /// [`Error::Output`]; the temporary file is then removed and the target is unchanged.
    pub(super) fn write(&self, fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>) -> Result<()> {
        let write = || -> io::Result<()> {
            let temporary = self.temporary()?;
            let mut writer = BufWriter::new(temporary.file());
            fill(&mut writer)?;
            writer.flush()?;
            drop(writer);
            // Without this a crash soon after the rename could leave an empty file under
            // the final name.
            temporary.file().sync_all()?;
            temporary.persist(&self.target)
        };
        write().map_err(|error| self.failed(&error))
    }

    /// Writes the file through another program, which gets the absolute name of the temporary file.
    /// If `fill` returns false, nothing is written.
    ///
    /// # Errors
    /// Errors of `fill`, and as [`Self::write`].
    pub(super) fn write_by_name(&self, fill: impl FnOnce(&Path) -> Result<bool>) -> Result<()> {
        let temporary = self.temporary().map_err(|error| self.failed(&error))?;
        let path = fs::canonicalize(temporary.path()).map_err(|error| self.failed(&error))?;
        if fill(&path)? {
            // The other program may have replaced our temporary file.
            let finish = || File::open(&path)?.sync_all();
            finish().map_err(|error| self.failed(&error))?;
            temporary.persist(&self.target).map_err(|error| self.failed(&error))?;
        }
        Ok(())
    }

    /// The path as the user named it.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    fn folder(&self) -> &Path {
        match self.target.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        }
    }

    fn temporary(&self) -> io::Result<Temporary> {
        Temporary::beside(&self.target)
    }

    fn failed(&self, error: &io::Error) -> Error {
        // Some errors contain the temporary file's name, which means nothing to the user.
        let reason = match error.raw_os_error() {
            Some(code) => io::Error::from_raw_os_error(code),
            None if error.kind() == io::ErrorKind::Other => io::Error::other(error.to_string()),
            None => error.kind().into(),
        };
        Error::output(&self.path, format!("cannot be written: {reason}"))
    }
}

/// Creates a folder and its missing parents.
///
/// # Errors
/// [`Error::Output`] if that fails, or if a file has the name.
pub(super) fn create_folder(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(|error| {
        let reason = match folder.exists() {
            true => "is not a folder".to_owned(),
            false => format!("cannot be created: {}", error.kind()),
        };
        Error::output(folder, reason)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listing(folder: &Path) -> Vec<String> {
        let names =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.collect()
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        fs::write(&path, "old").unwrap();
        let output = OutputFile::check(&path).unwrap();
        let failure = output.write(|writer| {
            writer.write_all(&[b'x'; 100_000])?;
            Err(io::ErrorKind::StorageFull.into())
        });
        assert_eq!(failure.unwrap_err().exit_code(), 2);
        assert_eq!(listing(folder.path()), ["a.txt"]);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        output.write(|writer| writer.write_all(b"new")).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new");
        assert_eq!(listing(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_check_creates_nothing_and_refuses_what_cannot_be_written() {
        let folder = tempfile::tempdir().unwrap();
        OutputFile::check(&folder.path().join("a.png")).unwrap();
        assert!(listing(folder.path()).is_empty());
        for bad in [folder.path().to_owned(), folder.path().join("missing/a.png"), PathBuf::from("-")] {
            assert_eq!(OutputFile::check(&bad).unwrap_err().exit_code(), 2, "{}", bad.display());
        }
    }

    #[cfg(unix)]
    #[test]
    fn files_are_as_readable_as_any_other_and_links_stay_links() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let [plain, ours, link] = ["plain", "ours", "link"].map(|name| folder.path().join(name));
        fs::write(&plain, "").unwrap();
        OutputFile::check(&ours).unwrap().write(|writer| writer.write_all(b"1")).unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&plain), mode(&ours));
        symlink(&ours, &link).unwrap();
        OutputFile::check(&link).unwrap().write(|writer| writer.write_all(b"2")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&ours).unwrap(), "2");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_is_replaced_keeps_its_mode() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, "").unwrap();
        for mode in [0o600, 0o640, 0o666, 0o755, 0o777, 0o400] {
            fs::set_permissions(&path, PermissionsExt::from_mode(mode)).unwrap();
            let output = OutputFile::check(&path).unwrap();
            let found = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
            output
                .write(|writer| {
                    let own = listing(folder.path()).into_iter().find(|name| name != "a").unwrap();
                    let own = found(&folder.path().join(own));
                    assert_eq!(own & 0o077 & !mode, 0, "{mode:o} is {own:o} on the way");
                    writer.write_all(b"1")
                })
                .unwrap();
            assert_eq!(found(&path), mode, "{mode:o}");
            output
                .write_by_name(|temporary| {
                    // Imitates a program that replaces the file.
                    fs::remove_file(temporary).unwrap();
                    fs::write(temporary, "2").unwrap();
                    Ok(true)
                })
                .unwrap();
            assert_eq!((found(&path), fs::read_to_string(&path).unwrap()), (mode, "2".to_owned()));
        }
    }
}
