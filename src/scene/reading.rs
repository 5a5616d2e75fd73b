//! Shared state of the readers of a scene's models.

use std::collections::{HashMap, HashSet};
use std::ffi::OsString;
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use xxhash_rust::xxh3::xxh3_128;

use super::builtin::Files;
use super::limits;
use super::lines::latin1;
use super::notes::Notes;
use super::texture::{Decoded, Image};
use super::value::excerpt;
use crate::files::guarded;

/// The note on files that are named otherwise.
pub(super) const OTHER_NAME: &str = "files are found under another name";

/// Source of the files, notes on them, and remaining limits.
pub(super) struct Reading<'a> {
    pub(super) files: Files,
    warnings: &'a mut Vec<String>,
    /// Notes on ignored and repaired statements; they become warnings at the end.
    pub(super) notes: Notes,
    /// Files on disk that were read: [`super::Scene::inputs`].
    inputs: &'a mut Vec<PathBuf>,
    /// Texels of all images so far.
    texels: u64,
    /// Images by file, with the reason if one cannot be used.
    images: HashMap<PathBuf, Result<Decoded, String>>,
    /// Images by their bytes: models embed the same image, and files are copies of each other.
    images_by_hash: HashMap<u128, Decoded>,
    /// Names in the searched folders.
    listings: HashMap<PathBuf, Rc<Listing>>,
    /// Materials that the scene file gives an image.
    with_image: HashSet<String>,
    /// The material of all faces of the model, if the scene file states one.
    pub(super) of_all_faces: Option<String>,
}

/// Names in a folder by their lower-case form.
type Listing = HashMap<String, OsString>;

impl<'a> Reading<'a> {
    /// `with_image`: the materials that the scene file gives an image.
    pub(super) fn new(
        files: Files,
        with_image: HashSet<String>,
        warnings: &'a mut Vec<String>,
        inputs: &'a mut Vec<PathBuf>,
    ) -> Self {
        Self {
            files,
            warnings,
            notes: Notes::default(),
            inputs,
            texels: 0,
            images: HashMap::new(),
            images_by_hash: HashMap::new(),
            listings: HashMap::new(),
            with_image,
            of_all_faces: None,
        }
    }

    /// Whether the scene file gives an image to the faces that the model gives this material.
    pub(super) fn gives_image(&self, material: &str) -> bool {
        self.with_image.contains(self.of_all_faces.as_deref().unwrap_or(material))
    }

    /// Adds the notes to the warnings.
    pub(super) fn finish(self) {
        self.warnings.extend(self.notes.sentences());
    }

    /// Reads a file and lists it as an input. Fails with a reason that follows
    /// the file's name.
    pub(super) fn read(&mut self, file: &Path, max_bytes: u64) -> Result<Vec<u8>, String> {
        let bytes = self.files.read(file, max_bytes)?;
        self.inputs.extend(self.files.on_disk(file));
        Ok(bytes)
    }

    /// Reads an image once, however many models and materials name it. Fails with a reason that
    /// follows the file's name.
    pub(super) fn image(&mut self, file: &Path) -> Result<Decoded, String> {
        if let Some(known) = self.images.get(file) {
            return known.clone();
        }
        let bytes = self.read(file, limits::IMAGE_BYTES);
        let decoded = bytes.and_then(|bytes| self.decode(file, &bytes));
        self.images.insert(file.to_owned(), decoded.clone());
        decoded
    }

    /// Decodes an image once; the ending of `name` decides whether it may be a TGA. Fails with a
    /// reason that follows the image's name.
    pub(super) fn decode(&mut self, name: &Path, bytes: &[u8]) -> Result<Decoded, String> {
        let hash = xxh3_128(bytes);
        if let Some(known) = self.images_by_hash.get(&hash) {
            return Ok(known.clone());
        }
        let left = limits::TEXELS - self.texels;
        let decoded = guarded("images", || Image::decode(name, bytes, left))?;
        self.texels += decoded.image.codes.len() as u64;
        self.images_by_hash.insert(hash, decoded.clone());
        Ok(decoded)
    }

    /// Finds the file that `by` names `name`: as written; without backslashes before blanks; with
    /// slashes for backslashes; in other letter case; then its last component, beside `by`. Notes
    /// a name that differs by more than slashes at `place`.
    ///
    /// Fails with a reason that follows the name.
    pub(super) fn find(
        &mut self,
        by: &Path,
        name: &str,
        place: impl FnOnce() -> String,
    ) -> Result<PathBuf, String> {
        let folder = by.with_file_name("");
        let slashed = name.replace('\\', "/");
        let portable = folder.join(&slashed);
        for path in [folder.join(name), folder.join(name.replace("\\ ", " ")), portable.clone()] {
            if self.files.is_file(&path) {
                return Ok(path);
            }
        }
        let last = slashed.rsplit('/').next().filter(|last| *last != slashed);
        let found = self.in_other_case(&folder, &slashed);
        let found = found.or_else(|| last.and_then(|last| self.in_other_case(&folder, last)));
        let Some(path) = found else {
            let why = self.files.read(&portable, 0).err();
            return Err(why.unwrap_or_else(|| "is no file that can be read".to_owned()));
        };
        let shown = format!("{} as {:?}", excerpt(name), path.display());
        self.notes.add_named(OTHER_NAME, &shown, place);
        Ok(path)
    }

    /// A file below `folder` whose path equals `name` except for letter case.
    fn in_other_case(&mut self, folder: &Path, name: &str) -> Option<PathBuf> {
        let mut path = folder.to_owned();
        for part in Path::new(name).components() {
            match part {
                Component::Normal(part) => {
                    let written = path.join(part);
                    path = if self.files.exists(&written) {
                        written
                    } else {
                        path.join(self.listing(&path).get(&part.to_str()?.to_lowercase())?)
                    };
                }
                Component::ParentDir => path.push(".."),
                Component::CurDir => (),
                Component::RootDir | Component::Prefix(_) => return None,
            }
        }
        self.files.is_file(&path).then_some(path)
    }

    fn listing(&mut self, folder: &Path) -> Rc<Listing> {
        let list = || {
            let mut names = self.files.names_in(folder);
            // Among names that differ only in case, the first in this order is found
            // on every system.
            names.sort_unstable_by(|a, b| b.cmp(a));
            let entries =
                names.into_iter().map(|name| (latin1(name.as_encoded_bytes()).to_lowercase(), name));
            Rc::new(entries.collect())
        };
        self.listings.entry(folder.to_owned()).or_insert_with(list).clone()
    }
}
