//! Files that something was read from, with a check for changes since.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Modification time and length. `None` if the file does not exist.
type Stamp = Option<(SystemTime, u64)>;

/// The result of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Look {
    /// The files are unchanged.
    AsRead,
    /// The files differ, and an earlier check has reported that.
    Reported,
    /// The files differ from the last check: a program may still be writing them.
    Unsettled,
    /// The scene's own file has been missing since before the last check.
    Gone,
    /// The files have changed, and their state is that of the last check.
    Changed,
}

/// Files with their state at the time of reading.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    /// The scene's own file comes first. Empty for built-in scenes.
    read: Vec<(PathBuf, Stamp)>,
    seen: Vec<Stamp>,
    /// The state that [`Self::look`] reported last.
    reported: Option<Vec<Stamp>>,
}

impl Watch {
    /// Stores the state of a scene's files. Called before they are read, so that no
    /// change is missed.
    pub(super) fn new(spec: &str) -> Self {
        Self::of_files(files(spec))
    }

    /// Stores the state of files, as [`Self::new`] does for a scene's.
    pub(super) fn of_files(files: Vec<PathBuf>) -> Self {
        let read: Vec<_> = files.into_iter().map(|file| (file.clone(), stamp(&file))).collect();
        let seen = read.iter().map(|(_, stamp)| *stamp).collect();
        Self { read, seen, reported: None }
    }

    /// Compares the files with their state when read. Reports each other state once, after
    /// two equal checks.
    pub(super) fn look(&mut self) -> Look {
        let now = self.now();
        let is_settled = now == std::mem::replace(&mut self.seen, now.clone());
        if self.is_read(&now) {
            self.reported = None;
            Look::AsRead
        } else if self.reported.as_ref() == Some(&now) {
            Look::Reported
        } else if !is_settled {
            Look::Unsettled
        } else {
            let is_gone = now[0].is_none();
            self.reported = Some(now);
            if is_gone { Look::Gone } else { Look::Changed }
        }
    }

    /// Whether the files are unchanged at this moment.
    pub(super) fn is_as_read(&self) -> bool {
        self.is_read(&self.now())
    }

    /// Takes the state reported last as read: only a different one is reported again.
    pub(super) fn keep(&mut self) {
        let reported = self.reported.take().unwrap_or_default();
        for ((_, read), reported) in self.read.iter_mut().zip(reported) {
            *read = reported;
        }
    }

    /// The files that differ at this moment.
    pub(super) fn changed(&self) -> impl Iterator<Item = &Path> {
        self.read.iter().filter(|(file, read)| stamp(file) != *read).map(|(file, _)| file.as_path())
    }

    /// Whether `path` is the scene's own file.
    pub(super) fn is_own(&self, path: &Path) -> bool {
        let own = self.read.first().map(|(own, _)| own);
        own.is_some_and(|own| own == path || is_same_file(own, path))
    }

    /// Takes the scene's own file as read after the program has written it.
    pub(super) fn take_own_as_read(&mut self) {
        if let Some((own, read)) = self.read.first_mut() {
            *read = stamp(own);
        }
    }

    fn now(&self) -> Vec<Stamp> {
        self.read.iter().map(|(file, _)| stamp(file)).collect()
    }

    fn is_read(&self, stamps: &[Stamp]) -> bool {
        self.read.iter().map(|(_, read)| read).eq(stamps)
    }
}

/// The files that a scene consists of, as far as they can be determined.
fn files(spec: &str) -> Vec<PathBuf> {
    let file = Path::new(spec);
    if !file.is_file() {
        return Vec::new();
    }
    let mut files = vec![file.to_owned()];
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let models = text.parse::<toml_edit::DocumentMut>().ok();
    let models = models.as_ref().and_then(|toml| toml.get("model")?.as_array_of_tables());
    let named = models.into_iter().flatten().filter_map(|model| model.get("file")?.as_str());
    files.extend(named.map(|name| file.with_file_name(name)));
    // Material files stand beside their model, usually under its name.
    let materials: Vec<PathBuf> = files.iter().map(|file| file.with_extension("mtl")).collect();
    files.extend(materials);
    files
}

fn stamp(file: &Path) -> Stamp {
    let about = std::fs::metadata(file).ok()?;
    Some((about.modified().ok()?, about.len()))
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

#[cfg(test)]
mod tests {
    use std::fs::{self, File};
    use std::time::Duration;

    use super::*;

    /// A scene's file under watch. Tests set modification times, so that no test waits for a clock.
    struct Scene {
        folder: tempfile::TempDir,
        watch: Watch,
    }

    impl Scene {
        fn new() -> Self {
            let folder = tempfile::tempdir().unwrap();
            write(&folder.path().join("s.toml"), "[[model]]\nfile = \"m.obj\"\n", 1);
            write(&folder.path().join("m.obj"), "v 0 0 0\n", 1);
            let watch = Watch::new(folder.path().join("s.toml").to_str().unwrap());
            Self { folder, watch }
        }

        fn path(&self, name: &str) -> PathBuf {
            self.folder.path().join(name)
        }

        fn looks(&mut self) -> [Look; 3] {
            [(); 3].map(|()| self.watch.look())
        }
    }

    fn write(path: &Path, text: &str, second: u64) {
        fs::write(path, text).unwrap();
        let time = SystemTime::UNIX_EPOCH + Duration::from_secs(second);
        File::options().write(true).open(path).unwrap().set_modified(time).unwrap();
    }

    const REPORT: [Look; 3] = [Look::Unsettled, Look::Changed, Look::Reported];

    #[test]
    fn a_change_of_any_file_is_reported_once_when_it_has_settled() {
        for name in ["s.toml", "m.obj", "m.mtl"] {
            let mut scene = Scene::new();
            assert_eq!(scene.looks(), [Look::AsRead; 3]);
            write(&scene.path(name), "# other", 2);
            assert_eq!(scene.looks(), REPORT, "{name}");
            assert!(!scene.watch.is_as_read());
            write(&scene.path(name), "# yet another", 2);
            assert_eq!(scene.looks(), REPORT, "{name}, again");
        }
    }

    #[test]
    fn a_file_that_is_still_written_is_not_reported() {
        let mut scene = Scene::new();
        for second in 2..9 {
            write(&scene.path("s.toml"), "[[model", second);
            assert_eq!(scene.watch.look(), Look::Unsettled);
        }
        assert_eq!(scene.watch.look(), Look::Changed);
    }

    #[test]
    fn a_file_that_goes_and_comes_back_the_same_has_not_changed() {
        let mut scene = Scene::new();
        fs::rename(scene.path("s.toml"), scene.path("away")).unwrap();
        assert_eq!(scene.looks(), [Look::Unsettled, Look::Gone, Look::Reported]);
        fs::rename(scene.path("away"), scene.path("s.toml")).unwrap();
        assert_eq!(scene.looks(), [Look::AsRead; 3]);
        fs::remove_file(scene.path("s.toml")).unwrap();
        assert_eq!(scene.looks()[1], Look::Gone, "reported again");
        write(&scene.path("s.toml"), "# other", 2);
        assert_eq!(scene.looks(), REPORT);
    }

    #[test]
    fn what_is_kept_or_saved_counts_as_read() {
        let mut scene = Scene::new();
        write(&scene.path("s.toml"), "# theirs", 2);
        scene.looks();
        // Written again before the answer: this state has not been reported.
        write(&scene.path("s.toml"), "# theirs again", 3);
        scene.watch.keep();
        assert!(!scene.watch.is_as_read());
        assert_eq!(scene.looks(), REPORT);
        scene.watch.keep();
        assert_eq!(scene.looks(), [Look::AsRead; 3]);
        write(&scene.path("s.toml"), "# ours", 4);
        scene.watch.take_own_as_read();
        assert_eq!(scene.looks(), [Look::AsRead; 3]);
        assert!(scene.watch.is_own(&scene.folder.path().join(".").join("s.toml")));
        assert!(!scene.watch.is_own(&scene.path("m.obj")) && !scene.watch.is_own(&scene.path("none.toml")));
    }

    #[test]
    fn built_in_scenes_have_no_files() {
        let mut watch = Watch::new("box");
        assert_eq!(watch.look(), Look::AsRead);
        watch.take_own_as_read();
        watch.keep();
        assert!(watch.is_as_read() && !watch.is_own(Path::new("box")));
    }
}
