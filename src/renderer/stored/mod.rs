//! Light paths on disk: what the precomputation found is kept, and taken from there as long as it
//! would find the same again.

mod checks;
mod contents;
mod gloss_checks;
mod key;
mod read;
mod write;

use super::precompute::{Precomputed, precompute};
use super::{Progress, Renderer, memory_hint};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::scene::Scene;
use crate::stored::{CacheMiss, File, Folder, Key};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Where light paths are kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Store {
    /// In a file of their own; it is replaced where it is out of date.
    File(PathBuf),
    /// In a folder with those of other scenes.
    Folder(Folder),
}

/// A file of light paths that was written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Written {
    /// Length of the file.
    pub bytes: u64,
    /// What tracing the light paths took, seconds.
    pub precompute_s: f64,
}

impl Renderer {
    /// As [`Self::new`]; but light paths that are kept and would come out the same are not traced
    /// again, and others are kept. The picture is the same to the bit, whether they were. `say`
    /// is told, in a line each, why something that is kept cannot be used, or why something
    /// cannot be kept.
    ///
    /// # Errors
    /// The device lacks memory or failed; a folder cannot be made.
    pub fn stored(
        context: &Arc<Context>,
        scene: Scene,
        store: &Store,
        progress: &mut dyn Progress,
        say: &mut dyn FnMut(&str),
    ) -> Result<Self> {
        let make = || {
            let (start, mut scene) = (Instant::now(), scene);
            let made = store.obtain(context, &mut scene, progress, say)?;
            Self::of(context, scene, made, start)
        };
        make().map_err(memory_hint::with_hint)
    }

    /// Traces a scene's light paths and keeps them in a file, whatever it held before.
    ///
    /// # Errors
    /// The device lacks memory or failed; the file cannot be written.
    pub fn store(
        context: &Arc<Context>,
        mut scene: Scene,
        file: &Path,
        progress: &mut dyn Progress,
    ) -> Result<(Scene, Written)> {
        let key = key::key(context, &scene);
        let made = precompute(context, &mut scene, progress).map_err(memory_hint::with_hint)?;
        let tables = write::Tables::of(&made)?;
        let writer = tables.sections(&made);
        let failed = |error: std::io::Error| Error::output(file, format!("cannot be written: {error}"));
        writer.write(file, &key).map_err(failed)?;
        let written = Written { bytes: writer.file_bytes(&key), precompute_s: made.statistics.precompute_s };
        Ok((scene, written))
    }
}

/// Why the contents of a file, whatever they say that they were made from, cannot be the
/// light paths of a scene; none where nothing in them leads out of a list. The device hears
/// nothing of it.
///
/// # Errors
/// The scene itself cannot be traced.
pub fn miss_reason(bytes: &[u8], scene: &Scene) -> Result<Option<CacheMiss>> {
    match File::parse_any(bytes) {
        Ok(file) => Ok(read::Checked::of(scene, &file)?.err()),
        Err(miss) => Ok(Some(miss)),
    }
}

impl Store {
    /// Why the light paths of a scene, as it was loaded, cannot be taken from here; none
    /// where they can.
    ///
    /// # Errors
    /// The scene itself cannot be traced.
    pub fn miss(&self, context: &Context, scene: &Scene) -> Result<Option<CacheMiss>> {
        let key = key::key(context, scene);
        Ok(read::Checked::read(scene, &self.file(&key), &key)?.err())
    }

    /// The file that a scene of that key has.
    fn file(&self, key: &Key) -> PathBuf {
        match self {
            Self::File(file) => file.clone(),
            Self::Folder(folder) => folder.file(&key.digest(key::OF_NAME)),
        }
    }

    /// What is kept, or else what is traced now, and then kept.
    fn obtain(
        &self,
        context: &Arc<Context>,
        scene: &mut Scene,
        progress: &mut dyn Progress,
        say: &mut dyn FnMut(&str),
    ) -> Result<Precomputed> {
        let start = Instant::now();
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
        let made = precompute(context, scene, progress)?;
        let tables = write::Tables::of(&made)?;
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
