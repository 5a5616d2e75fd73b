//! Reader of stored files: all data is checked before use.

use super::format::{BYTE_ORDER, Dependency, Header, Key, MAGIC, Section, hash, head_checksum};
use super::{CacheMiss, VERSION};
use crate::files::{self, Unread};
use bytemuck::Pod;
use std::fs;
use std::io::Read;
use std::path::Path;

/// Largest size of a file, bytes: its contents must fit a device.
pub const MAX_BYTES: u64 = 64 << 30;
/// Largest number of dependencies, and of sections.
const MAX_ENTRIES: u32 = 256;

/// The sections of a file that passed all checks.
#[derive(Debug)]
pub struct File<'a> {
    sections: Vec<(&'a str, u64, &'a [u8])>,
}

/// A copy of the item at the start of some bytes, and the rest.
fn split<T: Pod>(bytes: &[u8]) -> Option<(T, &[u8])> {
    let (item, rest) = bytes.split_at_checked(size_of::<T>())?;
    Some((bytemuck::pod_read_unaligned(item), rest))
}

/// A stored name: zeros only as padding.
fn name(bytes: &[u8]) -> Result<&str, CacheMiss> {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    let (name, padding) = bytes.split_at(end);
    let name = std::str::from_utf8(name).ok().filter(|name| !name.is_empty());
    name.filter(|_| padding.iter().all(|&byte| byte == 0)).ok_or_else(|| CacheMiss::damaged("a name is none"))
}

/// Why a file that a user named must not be read and replaced; the text follows its name.
/// `None` for a file of light paths, damaged or not, and for an unreadable file. Reads the
/// first bytes only.
pub fn misnamed(file: &Path) -> Option<String> {
    let (length, start) = glance(file)?;
    if !MAGIC.starts_with(&start[..start.len().min(MAGIC.len())]) {
        return Some("holds no light paths: name a folder, or a file that `precompute` wrote".to_owned());
    }
    if length > MAX_BYTES {
        return Some(files::too_long(length, MAX_BYTES));
    }
    let odd = |header: &Header| ![BYTE_ORDER, BYTE_ORDER.swap_bytes()].contains(&header.byte_order);
    if split::<Header>(&start).is_some_and(|(header, _)| odd(&header)) {
        return Some("holds no light paths: its first bytes alone are those of such a file".to_owned());
    }
    // A truncated file is written anew. A longer one contains other data as well.
    match split::<Header>(&start) {
        Some((header, _)) if is_known(&header) && header.file_bytes < length => Some(format!(
            "{}: remove it, or name another file",
            CacheMiss::damaged(wrong_length(length, &header))
        )),
        _ => files::room_for(length).err(),
    }
}

/// Length and first bytes of a regular file.
fn glance(file: &Path) -> Option<(u64, Vec<u8>)> {
    let length = fs::metadata(file).ok().filter(fs::Metadata::is_file)?.len();
    let mut start = Vec::new();
    fs::File::open(file).ok()?.take(size_of::<Header>() as u64).read_to_end(&mut start).ok()?;
    Some((length, start))
}

fn is_known(header: &Header) -> bool {
    header.magic == MAGIC && header.byte_order == BYTE_ORDER && header.version == VERSION
}

fn wrong_length(length: u64, header: &Header) -> String {
    format!("it has {length} bytes instead of {}", header.file_bytes)
}

impl<'a> File<'a> {
    /// The bytes of a file for [`Self::parse`].
    ///
    /// # Errors
    /// [`CacheMiss::Missing`], [`CacheMiss::Unreadable`], or [`CacheMiss::Damaged`] if the length
    /// differs from that in the header.
    pub fn bytes(file: &Path) -> Result<Vec<u8>, CacheMiss> {
        // Checked before memory is allocated.
        if let Some((length, start)) = glance(file)
            && let Some((header, _)) = split::<Header>(&start)
            && is_known(&header)
            && header.file_bytes != length
        {
            return Err(CacheMiss::Damaged(wrong_length(length, &header)));
        }
        files::read(file, MAX_BYTES).map_err(|unread| match unread {
            Unread::Missing => CacheMiss::Missing,
            Unread::Because(why) => CacheMiss::Unreadable(why),
        })
    }

    /// Parses a file's contents and compares their dependencies with the key.
    ///
    /// # Errors
    /// All but [`CacheMiss::Missing`] and [`CacheMiss::Unreadable`].
    pub fn parse(bytes: &'a [u8], key: &Key) -> Result<Self, CacheMiss> {
        Self::parse_if(bytes, |dependencies| compare(dependencies, key))
    }

    /// Parses a file's contents with any dependencies: for tests of files with false dependencies.
    ///
    /// # Errors
    /// As [`Self::parse`], all but [`CacheMiss::Stale`].
    pub fn parse_any(bytes: &'a [u8]) -> Result<Self, CacheMiss> {
        Self::parse_if(bytes, |_| Ok(()))
    }

    fn parse_if(
        bytes: &'a [u8],
        is_ours: impl Fn(&[u8]) -> Result<(), CacheMiss>,
    ) -> Result<Self, CacheMiss> {
        let short = || CacheMiss::damaged("it ends too early");
        let (header, after) = split::<Header>(bytes).ok_or_else(short)?;
        if header.magic != MAGIC {
            return Err(CacheMiss::Foreign("does not hold light paths".into()));
        }
        if header.byte_order != BYTE_ORDER {
            return Err(CacheMiss::Foreign("comes from a machine of another byte order".into()));
        }
        if header.version != VERSION {
            let version = header.version;
            return Err(CacheMiss::Foreign(format!("has form {version}, and this program's is {VERSION}")));
        }
        if header.file_bytes != bytes.len() as u64 {
            return Err(CacheMiss::Damaged(wrong_length(bytes.len() as u64, &header)));
        }
        if header.dependency_count.max(header.section_count) > MAX_ENTRIES {
            return Err(CacheMiss::damaged("its tables are too long"));
        }
        let dependency_bytes = header.dependency_count as usize * size_of::<Dependency>();
        let section_bytes = header.section_count as usize * size_of::<Section>();
        let (tables, contents) =
            after.split_at_checked(dependency_bytes + section_bytes).ok_or_else(short)?;
        if header.checksum != head_checksum(&header, tables) {
            return Err(CacheMiss::damaged("the checksum of its header is wrong"));
        }
        let (dependencies, sections) = tables.split_at(dependency_bytes);
        is_ours(dependencies)?;
        Self::cut(sections, contents)
    }

    /// Divides the contents into the sections of the table.
    fn cut(table: &'a [u8], contents: &'a [u8]) -> Result<Self, CacheMiss> {
        let mut sections: Vec<(&str, u64, &[u8])> = Vec::new();
        let mut rest = contents;
        for entry in table.chunks_exact(size_of::<Section>()) {
            let section: Section = bytemuck::pod_read_unaligned(entry);
            let name = name(&entry[..section.name.len()])?;
            let size = section.element_bytes.checked_mul(section.count);
            let size = size.and_then(|size| usize::try_from(size).ok());
            let (own, others) = size
                .and_then(|size| rest.split_at_checked(size))
                .ok_or_else(|| CacheMiss::damaged(format!("section `{name}` is longer than the file")))?;
            if section.checksum != hash(own) {
                return Err(CacheMiss::damaged(format!("the checksum of section `{name}` is wrong")));
            }
            if sections.iter().any(|other| other.0 == name) {
                return Err(CacheMiss::damaged(format!("section `{name}` is there twice")));
            }
            sections.push((name, section.element_bytes, own));
            rest = others;
        }
        if !rest.is_empty() {
            return Err(CacheMiss::damaged("bytes are left that no section holds"));
        }
        Ok(Self { sections })
    }

    /// The items of a section.
    ///
    /// # Errors
    /// The section is missing, or has items of another size.
    pub fn list<T: Pod>(&self, name: &str) -> Result<Vec<T>, CacheMiss> {
        let section = self.sections.iter().find(|section| section.0 == name);
        let &(_, element_bytes, bytes) =
            section.ok_or_else(|| CacheMiss::damaged(format!("section `{name}` is missing")))?;
        if element_bytes != size_of::<T>() as u64 || bytes.len() % size_of::<T>() != 0 {
            return Err(CacheMiss::damaged(format!("section `{name}` holds something else")));
        }
        let mut items = vec![T::zeroed(); bytes.len() / size_of::<T>()];
        bytemuck::cast_slice_mut(&mut items).copy_from_slice(bytes);
        Ok(items)
    }

    /// The item of a section that holds one.
    ///
    /// # Errors
    /// As [`Self::list`], or the section holds fewer or more.
    pub fn one<T: Pod>(&self, name: &str) -> Result<T, CacheMiss> {
        match self.list(name)?[..] {
            [item] => Ok(item),
            _ => Err(CacheMiss::damaged(format!("section `{name}` holds more or less than one item"))),
        }
    }
}

/// Fails with the changed dependencies if the file was not made from those of the key.
fn compare(table: &[u8], key: &Key) -> Result<(), CacheMiss> {
    let mut found = Vec::new();
    for entry in table.chunks_exact(size_of::<Dependency>()) {
        let dependency: Dependency = bytemuck::pod_read_unaligned(entry);
        found.push((name(&entry[..dependency.name.len()])?, dependency.hash));
    }
    let names = |names: &mut dyn Iterator<Item = &str>| names.map(str::to_owned).collect::<Vec<_>>();
    let wanted = &key.dependencies;
    if names(&mut found.iter().map(|found| found.0)) != names(&mut wanted.iter().map(|wanted| wanted.0)) {
        return Err(CacheMiss::Stale(vec!["what light paths depend on".to_owned()]));
    }
    let changed = found.iter().zip(wanted).filter(|(found, wanted)| found.1 != wanted.1);
    let changed = names(&mut changed.map(|(found, _)| found.0));
    if changed.is_empty() { Ok(()) } else { Err(CacheMiss::Stale(changed)) }
}
