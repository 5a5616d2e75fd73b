//! Precompute cache: light paths on disk, used as long as the precomputation would give the same.

mod checks;
mod contents;
mod demand;
mod gloss_checks;
mod key;
mod read;
mod write;

use super::precompute::{Precomputed, precompute};
use super::{Progress, Renderer};
use crate::cache_file::{CacheMiss, File, Folder, Key};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::passes::precompute::kept::Kept;
use crate::scene::{Naming, Scene};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// The place where light paths are stored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Store {
    /// In one file, which is replaced if it is stale.
    File(PathBuf),
    /// In a folder, together with the light paths of other scenes.
    Folder(Folder),
}

/// Report of a written file of light paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Written {
    /// Length of the file, bytes.
    pub bytes: u64,
    /// Time of the precomputation, seconds.
    pub precompute_s: f64,
}

impl Renderer {
    /// As [`Self::new`], with a precompute cache. Stored light paths are used if the precomputation
    /// would give the same; else they are traced and stored. The picture is the same to the bit in
    /// both cases. `say` receives a line for each reason why a file cannot be used or written.
    ///
    /// # Errors
    /// The device lacks memory or failed; a folder cannot be created.
    pub fn cached(
        context: &Arc<Context>,
        scene: Scene,
        store: &Store,
        progress: &mut dyn Progress,
        say: &mut dyn FnMut(&str),
    ) -> Result<Self> {
        Self::cached_keeping(context, scene, (store, None), progress, say)
    }

    /// As [`Self::cached`], with what the precomputation before left.
    ///
    /// # Errors
    /// As for [`Self::cached`].
    #[doc(hidden)]
    pub fn cached_keeping(
        context: &Arc<Context>,
        mut scene: Scene,
        (store, kept): (&Store, Option<&mut Kept>),
        progress: &mut dyn Progress,
        say: &mut dyn FnMut(&str),
    ) -> Result<Self> {
        let start = Instant::now();
        let made = store.obtain(context, &mut scene, kept, progress, say)?;
        Self::from_precomputed(context, scene, made, start, progress)
    }

    /// Traces a scene's light paths and stores them in a file, which is replaced.
    ///
    /// # Errors
    /// The device lacks memory or failed; the file cannot be written.
    #[doc(hidden)]
    pub fn store(
        context: &Arc<Context>,
        mut scene: Scene,
        file: &Path,
        progress: &mut dyn Progress,
    ) -> Result<(Scene, Written)> {
        let key = key::key(context, &scene);
        let made = precompute(context, &mut scene, None, progress)?;
        let tables = write::Tables::from_precomputed(&made)?;
        let writer = tables.sections(&made);
        let failed = |error: std::io::Error| Error::output(file, format!("cannot be written: {error}"));
        writer.write(file, &key).map_err(failed)?;
        let written = Written { bytes: writer.file_bytes(&key), precompute_s: made.statistics.precompute_s };
        Ok((scene, written))
    }
}

/// What the precomputation before left, for one of this scene. `None` if random decisions are named
/// by number: a move changes all of them.
pub(super) fn begun<'a>(kept: Option<&'a mut Kept>, scene: &Scene) -> Option<&'a mut Kept> {
    let kept = kept.filter(|_| scene.naming() == Naming::Place)?;
    kept.begin(scene, key::surroundings(scene));
    Some(kept)
}

/// The reason why the contents of a file cannot be the light paths of a scene; their key is not
/// compared. `None` if each index is within its list. The device is not used.
///
/// # Errors
/// The scene itself cannot be traced.
pub fn miss_reason(bytes: &[u8], scene: &Scene) -> Result<Option<CacheMiss>> {
    match File::parse_any(bytes) {
        Ok(file) => Ok(read::Checked::from_file(scene, &file)?.err()),
        Err(miss) => Ok(Some(miss)),
    }
}

impl Store {
    /// The reason why the stored light paths of a scene, as it was loaded, cannot be used. `None`
    /// if they can.
    ///
    /// # Errors
    /// The scene itself cannot be traced.
    pub fn miss(&self, context: &Context, scene: &Scene) -> Result<Option<CacheMiss>> {
        let key = key::key(context, scene);
        Ok(read::Checked::read(scene, &self.file(&key), &key)?.err())
    }

    /// The file for a scene with this key.
    fn file(&self, key: &Key) -> PathBuf {
        match self {
            Self::File(file) => file.clone(),
            Self::Folder(folder) => folder.file(&key.digest(key::OF_NAME)),
        }
    }

    /// Returns the stored light paths, or traces and stores them.
    fn obtain(
        &self,
        context: &Arc<Context>,
        scene: &mut Scene,
        kept: Option<&mut Kept>,
        progress: &mut dyn Progress,
        say: &mut dyn FnMut(&str),
    ) -> Result<Precomputed> {
        let start = Instant::now();
        let replacements = context.replacement_count();
        let key = key::key(context, scene);
        if let Self::Folder(Folder { path, .. }) = self {
            fs::create_dir_all(path)
                .map_err(|error| Error::output(path, format!("cannot be made: {}", error.kind())))?;
        }
        let file = self.file(&key);
        let miss = match read::Checked::read(scene, &file, &key)? {
            Ok(checked) => {
                if let Self::Folder(_) = self {
                    Folder::touch(&file);
                }
                return checked.build(context, scene, start);
            }
            Err(miss) => miss,
        };
        if miss != CacheMiss::Missing {
            say(&format!("{} {miss}; its light paths are traced anew", file.display()));
        }
        let made = precompute(context, scene, begun(kept, scene), progress)?;
        if context.replacement_count() != replacements {
            // The key names the shaders from before.
            return Ok(made);
        }
        let tables = write::Tables::from_precomputed(&made)?;
        let writer = tables.sections(&made);
        let bytes = writer.file_bytes(&key);
        let written = match self {
            Self::Folder(folder) if bytes > folder.limit_bytes => {
                let limit = folder.limit_bytes;
                say(&format!("light paths of {bytes} bytes are not kept: the limit is {limit}"));
                return Ok(made);
            }
            Self::Folder(folder) => folder.make_room(&file, bytes).and_then(|()| writer.write(&file, &key)),
            Self::File(_) => writer.write(&file, &key),
        };
        if let Err(error) = written {
            say(&format!("{} cannot be written: {error}", file.display()));
        }
        Ok(made)
    }
}
