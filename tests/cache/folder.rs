//! A folder stays within its limit: the least recently used files are removed.

use lightpaths::cache_file::Folder;
use std::fs;
use std::path::Path;
use std::time::{Duration, SystemTime};

/// Creates a file of `size` bytes that was last used `days` days ago.
fn file(path: &Path, size: usize, days: u64) {
    fs::write(path, vec![0; size]).unwrap();
    let when = SystemTime::now() - Duration::from_secs(86_400 * days);
    fs::File::options().append(true).open(path).unwrap().set_modified(when).unwrap();
}

fn names(folder: &Folder) -> Vec<String> {
    let entries = fs::read_dir(&folder.path).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn the_oldest_go_first_and_others_stay() {
    let place = tempfile::tempdir().unwrap();
    let folder = Folder { path: place.path().to_owned(), limit_bytes: 1000 };
    for (stem, size, days) in [("a", 300, 5), ("b", 300, 9), ("c", 300, 1), ("d", 100, 2)] {
        file(&folder.file(stem), size, days);
    }
    file(&folder.path.join("old.reference"), 5000, 90);
    file(&folder.path.join(".lightpaths-old"), 10, 2);
    file(&folder.path.join(".lightpaths-new"), 10, 0);
    Folder::touch(&folder.file("b"));
    let others = [".lightpaths-new".to_owned(), "old.reference".to_owned()];
    let all = |stems: &[&str]| {
        let mut all: Vec<String> = stems.iter().map(|stem| format!("{stem}.paths")).collect();
        all.extend(others.clone());
        all.sort();
        all
    };
    // A file replaces itself, so it needs no more space.
    folder.make_room(&folder.file("a"), 300).unwrap();
    assert_eq!(names(&folder), all(&["a", "b", "c", "d"]));
    folder.make_room(&folder.file("e"), 1).unwrap();
    assert_eq!(names(&folder), all(&["b", "c", "d"]));
    folder.make_room(&folder.file("e"), 600).unwrap();
    assert_eq!(names(&folder), all(&["b"]), "it was used just now");
    folder.make_room(&folder.file("e"), 1000).unwrap();
    assert_eq!(names(&folder), all(&[]));
}
