//! File format of stored results, and its writer.

use super::{Temporary, VERSION};
use bytemuck::{Pod, Zeroable};
use std::borrow::Cow;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// First bytes of every file.
pub(super) const MAGIC: [u8; 8] = *b"lpstored";
/// Marks the byte order: it reads differently in another one.
pub(super) const BYTE_ORDER: u32 = 0x0102_0304;
/// Longest name of a dependency or section, bytes.
pub(super) const NAME_BYTES: usize = 24;

/// Start of a file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Header {
    pub(super) magic: [u8; 8],
    pub(super) byte_order: u32,
    pub(super) version: u32,
    pub(super) dependency_count: u32,
    pub(super) section_count: u32,
    /// Length of the file, bytes.
    pub(super) file_bytes: u64,
    /// Checksum of the header with this field zero, and of the tables up to the sections.
    pub(super) checksum: [u64; 2],
}

/// Something that the contents depend on.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Dependency {
    pub(super) name: [u8; NAME_BYTES],
    pub(super) hash: [u64; 2],
}

/// The preceding sections determine a section's offset.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct Section {
    pub(super) name: [u8; NAME_BYTES],
    pub(super) element_bytes: u64,
    pub(super) count: u64,
    pub(super) checksum: [u64; 2],
}

/// A 128-bit hash of the contents. It does not resist deliberate collisions.
pub fn hash(bytes: &[u8]) -> [u64; 2] {
    words(xxh3_128(bytes))
}

fn words(hash: u128) -> [u64; 2] {
    [hash as u64, (hash >> 64) as u64]
}

/// A name as it is stored: padded with zeros.
fn padded(name: &str) -> [u8; NAME_BYTES] {
    assert!(name.len() <= NAME_BYTES, "`{name}` is longer than {NAME_BYTES} bytes");
    let mut bytes = [0; NAME_BYTES];
    bytes[..name.len()].copy_from_slice(name.as_bytes());
    bytes
}

/// Dependencies of a file's contents: names and hashes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Key {
    pub(super) dependencies: Vec<(&'static str, [u64; 2])>,
}

impl Key {
    /// Adds a dependency. Panics on names of more than 24 bytes.
    #[must_use]
    pub fn with(mut self, name: &'static str, hash: [u64; 2]) -> Self {
        assert!(name.len() <= NAME_BYTES, "`{name}` is longer than {NAME_BYTES} bytes");
        self.dependencies.push((name, hash));
        self
    }

    /// One hash of the named dependencies, in hexadecimal for a file name.
    pub fn digest(&self, names: &[&str]) -> String {
        let mut state = Xxh3::new();
        for (name, hash) in self.dependencies.iter().filter(|(name, _)| names.contains(name)) {
            state.update(name.as_bytes());
            state.update(bytemuck::cast_slice(hash));
        }
        format!("{:032x}", state.digest128())
    }
}

/// The sections of a new file.
#[derive(Default)]
pub struct Writer<'a> {
    sections: Vec<(Section, Cow<'a, [u8]>)>,
}

impl<'a> Writer<'a> {
    /// Adds a section. Panics on names of more than 24 bytes.
    pub fn add<T: Pod>(&mut self, name: &str, items: impl Into<Cow<'a, [T]>>) {
        let items: Cow<'a, [T]> = items.into();
        let count = items.len() as u64;
        let bytes: Cow<'a, [u8]> = match items {
            Cow::Borrowed(items) => Cow::Borrowed(bytemuck::cast_slice(items)),
            Cow::Owned(items) => Cow::Owned(bytemuck::cast_slice(&items).to_vec()),
        };
        let element_bytes = size_of::<T>() as u64;
        let section = Section { name: padded(name), element_bytes, count, checksum: hash(&bytes) };
        self.sections.push((section, bytes));
    }

    /// Length of the file, bytes.
    pub fn file_bytes(&self, key: &Key) -> u64 {
        let head = size_of::<Header>()
            + key.dependencies.len() * size_of::<Dependency>()
            + self.sections.len() * size_of::<Section>();
        head as u64 + self.sections.iter().map(|(_, bytes)| bytes.len() as u64).sum::<u64>()
    }

    /// The header and the tables.
    fn head(&self, key: &Key) -> Vec<u8> {
        let mut header = Header {
            magic: MAGIC,
            byte_order: BYTE_ORDER,
            version: VERSION,
            dependency_count: key.dependencies.len() as u32,
            section_count: self.sections.len() as u32,
            file_bytes: self.file_bytes(key),
            checksum: [0; 2],
        };
        let mut tables = Vec::new();
        for &(name, hash) in &key.dependencies {
            tables.extend_from_slice(bytemuck::bytes_of(&Dependency { name: padded(name), hash }));
        }
        for (section, _) in &self.sections {
            tables.extend_from_slice(bytemuck::bytes_of(section));
        }
        header.checksum = head_checksum(&header, &tables);
        [bytemuck::bytes_of(&header), &tables].concat()
    }

    /// The file's contents.
    pub fn to_bytes(&self, key: &Key) -> Vec<u8> {
        let mut all = self.head(key);
        self.sections.iter().for_each(|(_, bytes)| all.extend_from_slice(bytes));
        all
    }

    /// Writes a temporary file beside the target, which gets its name when all data is on the disk.
    /// If several processes write at once, one complete file remains.
    ///
    /// # Errors
    /// The system's error; an existing file is then unchanged.
    pub fn write(&self, file: &Path, key: &Key) -> io::Result<()> {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let temporary = Temporary::beside(file)?;
        let mut out = BufWriter::new(temporary.file());
        out.write_all(&self.head(key))?;
        for (_, bytes) in &self.sections {
            out.write_all(bytes)?;
        }
        out.flush()?;
        drop(out);
        // Without this a crash soon after the rename could leave an empty file under
        // the final name.
        temporary.file().sync_all()?;
        temporary.persist(file)?;
        #[cfg(unix)]
        std::fs::File::open(folder)?.sync_all()?;
        Ok(())
    }
}

/// Checksum of a header and the tables behind it.
pub(super) fn head_checksum(header: &Header, tables: &[u8]) -> [u64; 2] {
    let mut state = Xxh3::new();
    state.update(bytemuck::bytes_of(&Header { checksum: [0; 2], ..*header }));
    state.update(tables);
    words(state.digest128())
}
