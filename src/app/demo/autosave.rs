//! Autosave: unsaved edits are in a file beside the scene's, so that a crash loses none of them.

use std::fs;
use std::path::{Path, PathBuf};

use super::document::Document;
use super::files;
use super::session::Session;
use crate::error::{Error, Result};
use crate::scene::builtin;

/// The file, and what it holds.
pub(super) struct Autosave {
    scene: PathBuf,
    /// `None`: the scene is built in, or there is a file that must not be replaced.
    path: Option<PathBuf>,
    /// The edits that this window has written last, or could not write. `None`: none.
    written: Option<Document>,
    /// A file of an earlier window waits for an answer.
    waits: bool,
    /// Where the edits of an earlier window are since they made way, until the user is told.
    kept: Option<PathBuf>,
}

impl Autosave {
    /// Finds the file of an earlier window that did not end as it should.
    pub(super) fn new(spec: &str) -> Self {
        let path = (!builtin::NAMES.contains(&spec)).then(|| beside(Path::new(spec)));
        let waits = path.as_ref().is_some_and(|path| path.is_file());
        Self { scene: PathBuf::from(spec), path, written: None, waits, kept: None }
    }

    /// The file of an earlier window, if it waits for an answer.
    pub(super) fn found(&self) -> Option<&Path> {
        self.path.as_deref().filter(|_| self.waits)
    }

    /// Writes edits that the file does not hold yet. Deletes the file if nothing is unsaved.
    /// What an earlier window left makes way.
    ///
    /// # Errors
    /// The file cannot be written: the next edit tries again. What an earlier window left cannot be
    /// moved out of the way: it stays, and there is no autosave from then on.
    pub(super) fn follow(&mut self, session: &Session) -> Result<()> {
        let Some(path) = self.path.clone() else { return Ok(()) };
        if !session.has_unsaved_edits() {
            if self.written.take().is_some() {
                remove(&path);
            }
            return Ok(());
        }
        if self.written.as_ref() == Some(&session.document) {
            return Ok(());
        }
        self.make_way(&path)?;
        // Set first: an edit that no file can hold is refused once, and not in every frame.
        self.written = Some(session.document.clone());
        files::write_scene(session, &path).map(drop)
    }

    /// Where the edits of an earlier window are now, once after they made way.
    pub(super) fn take_kept(&mut self) -> Option<PathBuf> {
        self.kept.take()
    }

    /// Moves what an earlier window left out of the way.
    fn make_way(&mut self, path: &Path) -> Result<()> {
        if !std::mem::take(&mut self.waits) {
            return Ok(());
        }
        let kept = files::free_rescue_name(&self.scene);
        if let Err(error) = fs::rename(path, &kept) {
            self.path = None;
            return Err(Error::output(&kept, error.to_string()));
        }
        self.kept = Some(kept);
        Ok(())
    }

    /// Brings the edits of an earlier window back as one edit.
    ///
    /// # Errors
    /// The file cannot be read. It stays.
    pub(super) fn restore(&mut self, session: &mut Session) -> Result<()> {
        let Some(path) = self.found() else { return Ok(()) };
        session.restore(&path.display().to_string())?;
        self.waits = false;
        Ok(())
    }

    /// Deletes what an earlier window left.
    pub(super) fn discard(&mut self) {
        if let Some(path) = self.found() {
            remove(path);
        }
        self.waits = false;
    }

    /// Deletes this window's file: it ends as it should, or its edits are saved elsewhere.
    pub(super) fn end(&mut self) {
        if let (Some(path), Some(_)) = (&self.path, self.written.take()) {
            remove(path);
        }
    }
}

/// The path of the autosave of a scene.
fn beside(scene: &Path) -> PathBuf {
    PathBuf::from(format!("{}-autosave.toml", scene.with_extension("").display()))
}

fn remove(path: &Path) {
    // A file that is gone already is as it should be.
    let _ = fs::remove_file(path);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_autosave_stands_beside_its_scene() {
        assert_eq!(beside(Path::new("a/room.v2.toml")), Path::new("a/room.v2-autosave.toml"));
        assert_eq!(beside(Path::new("model.obj")), Path::new("model-autosave.toml"));
        assert!(Autosave::new("box").path.is_none());
    }
}
