//! The scenes that were opened last. They are stored in the program's cache folder.

use std::fs;
use std::path::{Path, PathBuf};

use crate::gpu::cache_folder;
use crate::scene::builtin;

/// Maximum number of scenes on the list.
const MOST: usize = 8;

/// The list, the last one first.
pub(super) struct Recent {
    /// `None`: there is no folder for it.
    file: Option<PathBuf>,
    pub(super) scenes: Vec<PathBuf>,
}

impl Recent {
    /// Reads the list, and adds the scene that is open.
    pub(super) fn new(spec: &str) -> Self {
        let folder = cache_folder("LIGHTPATHS_RECENT", "window");
        Self::of_file(folder.map(|folder| folder.join("recent.txt")), spec)
    }

    /// An empty list that is not stored.
    pub(super) fn none() -> Self {
        Self { file: None, scenes: Vec::new() }
    }

    fn of_file(file: Option<PathBuf>, spec: &str) -> Self {
        let text = file.as_ref().and_then(|file| fs::read_to_string(file).ok()).unwrap_or_default();
        let mut recent = Self { file, scenes: text.lines().take(MOST).map(PathBuf::from).collect() };
        recent.add(spec);
        recent
    }

    /// Puts a scene first and stores the list. Built-in scenes are not on it.
    pub(super) fn add(&mut self, spec: &str) {
        if builtin::NAMES.contains(&spec) {
            return;
        }
        let path = Path::new(spec).canonicalize().unwrap_or_else(|_| PathBuf::from(spec));
        self.scenes.retain(|known| *known != path);
        self.scenes.insert(0, path);
        self.scenes.truncate(MOST);
        let Some(file) = &self.file else { return };
        let lines: Vec<_> = self.scenes.iter().map(|path| path.to_string_lossy()).collect();
        // The list is a convenience: a disk that is full does not matter.
        let _ = file.parent().map(fs::create_dir_all);
        let _ = fs::write(file, lines.join("\n"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_scene_comes_first_and_none_comes_twice() {
        let folder = tempfile::tempdir().unwrap();
        let file = Some(folder.path().join("new/recent.txt"));
        let mut recent = Recent::of_file(file.clone(), "box");
        assert!(recent.scenes.is_empty());
        for number in 0..10 {
            recent.add(&format!("/none/{number}.toml"));
        }
        recent.add("/none/5.toml");
        let names = |recent: &Recent| {
            recent.scenes.iter().map(|path| path.file_stem().unwrap().to_owned()).collect::<Vec<_>>()
        };
        assert_eq!(names(&recent), ["5", "9", "8", "7", "6", "4", "3", "2"]);
        assert_eq!(names(&Recent::of_file(file, "/none/1.toml")), ["1", "5", "9", "8", "7", "6", "4", "3"]);
    }
}
