//! The sources of the shaders, which are reloaded when they change.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use super::watch::{Look, Watch};
use crate::error::{Error, Result};
use crate::gpu::{Context, NO_COMPILER};

/// Time between two checks of unchanged files.
const GLANCE: Duration = Duration::from_millis(200);
/// Time from a change to the next check. If both find the same, the change is handled.
const SETTLES: Duration = Duration::from_millis(50);

/// The folder that the embedded shaders were built from.
#[cfg(feature = "shaderc")]
const BUILT_FROM: Option<&str> = Some(concat!(env!("CARGO_MANIFEST_DIR"), "/glsl"));
/// A program without a compiler contains no path of the machine that built it.
#[cfg(not(feature = "shaderc"))]
const BUILT_FROM: Option<&str> = None;

/// A folder of shader sources under watch.
pub(super) struct ShaderSources {
    folder: PathBuf,
    /// `None` before the first check: the sources may be newer than the program.
    watch: Option<Watch>,
    /// Time of the next check.
    pub(super) next: Instant,
}

impl ShaderSources {
    /// The folder that the user named, or else the one that the program was built from, if
    /// that one still exists.
    ///
    /// # Errors
    /// The named folder does not exist, or the program has no compiler.
    pub(super) fn new(named: Option<&Path>) -> Result<Option<Self>> {
        match named {
            Some(_) if BUILT_FROM.is_none() => return Err(Error::Usage(format!("--shaders: {NO_COMPILER}"))),
            Some(folder) if !folder.is_dir() => {
                return Err(Error::input(folder, "--shaders: is not a folder"));
            }
            _ => (),
        }
        let folder = named.or(BUILT_FROM.map(Path::new)).filter(|folder| folder.is_dir());
        Ok(folder.map(|folder| Self { folder: folder.to_owned(), watch: None, next: Instant::now() }))
    }

    /// Reloads the shaders whose sources have changed, and returns their stems. Empty before the
    /// time of the next check.
    ///
    /// # Errors
    /// As [`Context::reload_shaders`]; once for each state of the files.
    pub(super) fn look(&mut self, context: &Context, now: Instant) -> Result<Vec<&'static str>> {
        if now < self.next {
            return Ok(Vec::new());
        }
        self.next = now + GLANCE;
        match self.watch.as_mut().map(Watch::look) {
            Some(Look::AsRead | Look::Reported) => return Ok(Vec::new()),
            Some(Look::Unsettled) => {
                self.next = now + SETTLES;
                return Ok(Vec::new());
            }
            Some(Look::Changed | Look::Gone) | None => (),
        }
        // Taken before the files are read, and listed anew: a change may add includes.
        self.watch = Some(Watch::of_files(files(&self.folder)));
        context.reload_shaders(&self.folder)
    }
}

/// The kernels and includes of a folder. An unreadable folder has none.
fn files(folder: &Path) -> Vec<PathBuf> {
    let listed = [folder.to_owned(), folder.join("include")].map(fs::read_dir);
    let paths = listed.into_iter().flatten().flatten().filter_map(|entry| Some(entry.ok()?.path()));
    let mut files: Vec<_> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension == "comp" || extension == "glsl"))
        .collect();
    files.sort();
    files
}
