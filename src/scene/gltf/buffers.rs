//! The buffers of a glTF file: in the file, in data URIs, or in other files.

use std::path::{Path, PathBuf};

use base64::Engine;
use gltf::Document;
use gltf::buffer::{Source, View};

use super::super::limits::OBJ_BYTES;
use super::super::material_names::shown;
use super::super::reading::Reading;
use super::super::value::excerpt;

/// Contents of the buffers, by index. `None` for a buffer without data, which may be unused.
pub(super) struct Buffers(Vec<Option<Vec<u8>>>);

impl Buffers {
    /// Reads all buffers. Fails with a reason that follows the file's name.
    pub(super) fn read(
        reading: &mut Reading,
        path: &Path,
        document: &Document,
        mut binary: Option<Vec<u8>>,
    ) -> Result<Self, String> {
        let mut left = OBJ_BYTES;
        let mut all = Vec::new();
        for buffer in document.buffers() {
            let bytes = match buffer.source() {
                Source::Bin => binary.take(),
                Source::Uri(uri) => Some(bytes_of(reading, path, uri, left)?),
            };
            let Some(bytes) = bytes else {
                all.push(None);
                continue;
            };
            if bytes.len() < buffer.length() {
                let (stated, found) = (buffer.length(), bytes.len());
                return Err(format!("is damaged: a buffer of {stated} bytes has {found}"));
            }
            left = left.saturating_sub(bytes.len() as u64);
            all.push(Some(bytes));
        }
        Ok(Self(all))
    }

    /// The bytes of a view. Fails with a reason that follows the file's name.
    pub(super) fn view(&self, view: &View) -> Result<&[u8], String> {
        let buffer = self.0.get(view.buffer().index()).and_then(Option::as_ref);
        let buffer = buffer.ok_or("names a binary part that it does not have")?;
        let end = view.offset().checked_add(view.length());
        let range = end.and_then(|end| buffer.get(view.offset()..end));
        range.ok_or_else(|| "is damaged: a view reaches beyond its buffer".to_owned())
    }
}

/// The contents of a URI: of a data URI, or of a file beside `path`. Fails with a reason that
/// follows the name of `path`.
pub(super) fn bytes_of(reading: &mut Reading, path: &Path, uri: &str, most: u64) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, text) = data.split_once(',').ok_or("has a data URI without data")?;
        if !kind.ends_with(";base64") {
            return Ok(urlencoding::decode_binary(text.as_bytes()).into_owned());
        }
        let decoded = base64::engine::general_purpose::STANDARD.decode(text);
        return decoded.map_err(|error| format!("has a data URI that cannot be decoded: {error}"));
    }
    let file = file_of(reading, path, uri)?;
    reading.read(&file, most).map_err(|why| format!("names {:?}, which {why}", shown(&file)))
}

/// The file that a URI names, whose name may be percent-encoded.
pub(super) fn file_of(reading: &mut Reading, path: &Path, uri: &str) -> Result<PathBuf, String> {
    let name = urlencoding::decode(uri).map_err(|_| format!("names {}, which is no text", excerpt(uri)))?;
    let plain = reading.find(path, uri, || shown(path));
    plain
        .or_else(|_| reading.find(path, &name, || shown(path)))
        .map_err(|why| format!("names {}, which {why}", excerpt(&name)))
}
