//! Changes the contents of files and sets correct checksums, as an attacker would.

use lightpaths::cache_file::hash;

const HEADER: usize = 48;
const DEPENDENCY: usize = 40;
const SECTION: usize = 56;
const NAME: usize = 24;

fn number(bytes: &[u8], at: usize) -> u64 {
    u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
}

/// Sections of a file.
#[derive(Clone)]
pub(crate) struct Tables {
    pub(crate) header: Vec<u8>,
    pub(crate) dependencies: Vec<u8>,
    /// Table entry and contents of each section.
    pub(crate) sections: Vec<(Vec<u8>, Vec<u8>)>,
}

impl Tables {
    pub(crate) fn from_bytes(file: &[u8]) -> Self {
        let count = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
        let table = HEADER + count(16) * DEPENDENCY;
        let mut start = table + count(20) * SECTION;
        let mut sections = Vec::new();
        for entry in file[table..start].chunks_exact(SECTION) {
            let size = (number(entry, NAME) * number(entry, NAME + 8)) as usize;
            sections.push((entry.to_vec(), file[start..start + size].to_vec()));
            start += size;
        }
        Self { header: file[..HEADER].to_vec(), dependencies: file[HEADER..table].to_vec(), sections }
    }

    pub(crate) fn contents(&mut self, name: &str) -> &mut Vec<u8> {
        let is_it = |entry: &[u8]| entry[..NAME].split(|&byte| byte == 0).next() == Some(name.as_bytes());
        let found = self.sections.iter_mut().find(|(entry, _)| is_it(entry));
        &mut found.unwrap_or_else(|| panic!("there is no section `{name}`")).1
    }

    /// The word with this index in a section.
    pub(crate) fn word(&mut self, name: &str, index: usize) -> &mut [u8; 4] {
        let words = self.contents(name).as_chunks_mut::<4>().0;
        let count = words.len();
        words.get_mut(index).unwrap_or_else(|| panic!("`{name}` has {count} words, not {index}"))
    }

    pub(crate) fn words(&mut self, name: &str) -> usize {
        self.contents(name).len() / 4
    }

    /// The file, with correct sizes and checksums.
    pub(crate) fn file(&self) -> Vec<u8> {
        let mut sections = self.sections.clone();
        for (entry, contents) in &mut sections {
            let count = contents.len() as u64 / number(entry, NAME).max(1);
            entry[NAME + 8..NAME + 16].copy_from_slice(&count.to_le_bytes());
            let [low, high] = hash(contents);
            entry[NAME + 16..NAME + 24].copy_from_slice(&low.to_le_bytes());
            entry[NAME + 24..].copy_from_slice(&high.to_le_bytes());
        }
        let table = sections.iter().flat_map(|(entry, _)| entry.clone()).collect();
        let contents: Vec<u8> = sections.into_iter().flat_map(|(_, contents)| contents).collect();
        let tables: Vec<u8> = [self.dependencies.clone(), table].concat();
        let bytes = (HEADER + tables.len() + contents.len()) as u64;
        let mut header = self.header.clone();
        header[24..32].copy_from_slice(&bytes.to_le_bytes());
        [with_checksum(header, &tables), tables, contents].concat()
    }
}

/// A header with the correct checksum for these tables.
pub(crate) fn with_checksum(mut header: Vec<u8>, tables: &[u8]) -> Vec<u8> {
    header[32..].fill(0);
    let [low, high] = hash(&[&header[..], tables].concat());
    header[32..40].copy_from_slice(&low.to_le_bytes());
    header[40..].copy_from_slice(&high.to_le_bytes());
    header
}

/// Sets the correct checksum of a file's head.
pub(crate) fn bless(file: &mut [u8]) {
    let count = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let end = HEADER + count(16) * DEPENDENCY + count(20) * SECTION;
    let header = with_checksum(file[..HEADER].to_vec(), &file[HEADER..end]);
    file[..HEADER].copy_from_slice(&header);
}
