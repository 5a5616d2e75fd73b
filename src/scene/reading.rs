//! What is under way while the models of a scene are read.

use std::path::Path;

use super::builtin::Files;
use super::limits;
use super::texture::Image;
use crate::files::guarded;

/// Where files come from, what was said of them, and what they may still hold.
pub(super) struct Reading<'a> {
    pub(super) files: Files,
    pub(super) warnings: &'a mut Vec<String>,
    /// Of all images so far.
    texels: u64,
}

impl<'a> Reading<'a> {
    pub(super) fn new(files: Files, warnings: &'a mut Vec<String>) -> Self {
        Self { files, warnings, texels: 0 }
    }

    /// Reads an image, and says whether transparency was left out. Fails in words that follow the file's name.
    pub(super) fn image(&mut self, file: &Path) -> Result<(Image, bool), String> {
        let bytes = self.files.read(file, limits::IMAGE_BYTES)?;
        let left = limits::TEXELS - self.texels;
        let decoded = guarded("images", || Image::decode(file, &bytes, left))?;
        self.texels += decoded.0.codes.len() as u64;
        Ok(decoded)
    }
}
