//! Files with correct checksums and hostile contents: each index that device or host follows is
//! compared with the length of its list.

use crate::common::context;
use crate::pictures::{glossy, textured, with_gaps};
use crate::tables::Tables;
use lightpaths::renderer::{Renderer, Silent, Store};
use lightpaths::scene::Scene;
use std::fs;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use tempfile::TempDir;

/// An index beyond any list of a small scene; it is not a marker value.
const FAR: u32 = 0x0fff_ffff;

/// Section, words of an element, and the word that is an index into a list or the length of one.
const POINTERS: &[(&str, usize, usize)] = &[
    ("numbers", 12, 3),
    ("numbers", 12, 4),
    ("numbers", 12, 5),
    ("numbers", 12, 8),
    ("numbers", 12, 9),
    ("order", 1, 0),
    ("sides", 1, 0),
    ("levels", 2, 0),
    ("levels", 2, 1),
    ("octree", 1, 0),
    ("unweighted clusters", 1, 0),
    ("parents", 1, 0),
    ("entry points", 10, 3),
    ("entry points", 10, 8),
    ("steps", 3, 0),
    ("steps", 3, 2),
    ("contribution offsets", 1, 0),
    ("path ranges", 3, 1),
    ("path ranges", 3, 2),
    ("cache points", 16, 7),
    ("neighbour offsets", 1, 0),
    ("neighbours", 2, 0),
    ("gather targets", 1, 0),
    ("merged ray counts", 1, 0),
    ("merged rays", 2, 0),
    ("near clusters", 6, 0),
    ("near clusters", 6, 1),
    ("near clusters", 6, 5),
    ("near patches", 6, 0),
    ("near patches", 6, 1),
    ("near patches", 6, 5),
    ("gloss entries", 13, 3),
    ("gloss entries", 13, 11),
    ("gloss vertices", 2, 0),
    ("gloss vertices", 2, 1),
    ("gloss entry indices", 1, 0),
    ("gloss vertex offsets", 2, 0),
    ("gloss vertex offsets", 2, 1),
    ("gloss bins", 4, 0),
    ("gloss sums", 2, 0),
    ("gloss sums", 2, 1),
    ("gloss child offsets", 1, 0),
    ("gloss children", 1, 0),
];

/// Sections that cannot be shorter.
const LENGTHS: &[&str] = &[
    "order",
    "sides",
    "enclosures",
    "levels",
    "octree",
    "levels of cells",
    "cell clusters",
    "areas",
    "shown areas",
    "parents",
    "inconsistent",
    "effective entry points",
    "entry points",
    "steps",
    "step colours",
    "lobes",
    "contributions",
    "contribution offsets",
    "path streams",
    "cache points",
    "neighbour offsets",
    "neighbours",
    "merged ray counts",
    "merged rays",
    "merged ray colours",
    "merged ray directions",
    "gloss vertices",
    "gloss entry indices",
    "gloss mirrors",
    "gloss vertex offsets",
    "gloss child offsets",
];

/// A file with every kind of section.
struct Everything {
    _folder: TempDir,
    file: PathBuf,
    scene: Scene,
    tables: Tables,
}

impl Everything {
    /// The one that all tests share, because each test writes the file anew.
    fn get() -> MutexGuard<'static, Self> {
        static EVERYTHING: OnceLock<Mutex<Everything>> = OnceLock::new();
        let shared = EVERYTHING.get_or_init(|| Mutex::new(Self::new()));
        // A failed test does not change the shared state in a way that matters.
        shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.paths");
        let mut scene = with_gaps(textured(glossy()));
        // Enough entry points that some gloss bins are sums of others.
        scene.quality.entry_points = 40_000;
        Renderer::store(&context(), scene.clone(), &file, &mut Silent).unwrap();
        let tables = Tables::from_bytes(&fs::read(&file).unwrap());
        Self { _folder: folder, file, scene, tables }
    }

    fn miss(&self, tables: &Tables) -> Option<String> {
        fs::write(&self.file, tables.file()).unwrap();
        let store = Store::File(self.file.clone());
        store.miss(&context(), &self.scene).unwrap().map(|miss| miss.to_string())
    }

    #[track_caller]
    fn assert_refused(&self, tables: &Tables, what: &str) {
        let miss = self.miss(tables);
        assert!(miss.as_ref().is_some_and(|line| line.starts_with("is damaged: ")), "{what}: {miss:?}");
    }
}

#[test]
fn no_index_leads_out_of_a_list() {
    let all = Everything::get();
    assert_eq!(all.miss(&all.tables), None, "untouched");
    for &(section, words, word) in POINTERS {
        let count = all.tables.clone().words(section) / words;
        assert!(count > 0, "`{section}` is empty");
        for element in [0, count - 1] {
            let mut tables = all.tables.clone();
            *tables.word(section, words * element + word) = FAR.to_le_bytes();
            all.assert_refused(&tables, &format!("{section}, element {element}, word {word}"));
        }
    }
    // If another value is further out, or not every element counts.
    let mut tables = all.tables.clone();
    *tables.word("contributions", 0) = FAR.to_le_bytes();
    all.assert_refused(&tables, "contributions");
    let mut tables = all.tables.clone();
    *tables.word("cell clusters", 0) = FAR.to_le_bytes();
    all.assert_refused(&tables, "cell clusters");
    // Header, top nodes, cells.
    for word in 1..tables.words("octree").min(40) {
        let mut tables = all.tables.clone();
        *tables.word("octree", word) = FAR.to_le_bytes();
        all.assert_refused(&tables, &format!("word {word} of the octree"));
    }
    // Radii determine how many records the device lists for a pixel.
    let radius = |tables: &mut Tables| f32::from_le_bytes(*tables.word("cache points", 3));
    let own = radius(&mut all.tables.clone());
    for wrong in [0.0, -own, 25.1 * own, 1e30, f32::INFINITY] {
        let mut tables = all.tables.clone();
        *tables.word("cache points", 3) = wrong.to_le_bytes();
        all.assert_refused(&tables, &format!("a radius of {wrong} m instead of {own}"));
    }
    // All radii equal, and larger than the scene.
    let mut tables = all.tables.clone();
    for point in 0..tables.words("cache points") / 16 {
        *tables.word("cache points", 16 * point + 3) = 1e4_f32.to_le_bytes();
    }
    all.assert_refused(&tables, "radii beyond the scene");
    for (section, word, wrong) in
        [("neighbours", 1, 1.5_f32), ("neighbours", 1, -0.5), ("near patches", 2, f32::NAN)]
    {
        let mut tables = all.tables.clone();
        *tables.word(section, word) = wrong.to_le_bytes();
        all.assert_refused(&tables, &format!("{wrong} in {section}"));
    }
    // A split at the end of a cell's list would read beyond it.
    let mut tables = all.tables.clone();
    let last = tables.words("cell clusters") - 1;
    *tables.word("cell clusters", last) = (63_u32 << 26).to_le_bytes();
    all.assert_refused(&tables, "a split without its plane");
    for (section, word) in [("cache points", 0), ("cache points", 3), ("entry points", 1), ("areas", 0)] {
        let mut tables = all.tables.clone();
        *tables.word(section, word) = f32::NAN.to_le_bytes();
        all.assert_refused(&tables, &format!("no number in {section}"));
    }
}

#[test]
fn no_list_is_shorter_than_it_must_be() {
    let all = Everything::get();
    for section in LENGTHS {
        let mut tables = all.tables.clone();
        let element = {
            let is_it =
                |entry: &[u8]| entry[..24].split(|&byte| byte == 0).next() == Some(section.as_bytes());
            let (entry, _) = tables.sections.iter().find(|(entry, _)| is_it(entry)).unwrap();
            u64::from_le_bytes(entry[24..32].try_into().unwrap()) as usize
        };
        let contents = tables.contents(section);
        assert!(contents.len() >= element, "`{section}` is empty");
        contents.truncate(contents.len() - element);
        all.assert_refused(&tables, section);
    }
    // Missing sections: each gets another name.
    for section in 0..all.tables.sections.len() {
        let mut tables = all.tables.clone();
        tables.sections[section].0[0] ^= 0x20;
        all.assert_refused(&tables, &format!("section {section} renamed"));
    }
}
