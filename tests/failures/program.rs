//! Runs the program under faults, with a time limit.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tempfile::TempDir;

use crate::layer::{Layer, calls_in};

/// Time limit, generous for a busy machine: a run beyond it hangs.
pub const HANG: Duration = Duration::from_secs(900);

/// A closed cube of two metres, with the camera and the light inside.
const CUBE: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 4 1 5 8\nf 2 3 7 6\n";
/// A scene with a quality that is fast.
const SCENE: &str = "[[model]]\nfile = \"cube.obj\"\n[camera]\nposition = [0, 1, 0.9]\ntarget = [0, 1, 0]\n\
up = [0, 1, 0]\nfov_y = 60.0\nsize = [16, 16]\n[[light]]\nname = \"lamp\"\nkind = \"point\"\n\
position = [0.2, 1.6, 0.1]\nintensity = [1, 1, 1]\n[quality]\nentry_points = 200\ncache_points = 50\n\
gather_rays = 16\ncells = 8\n";
/// Four frames in which the camera moves.
const FILM: &str = "scene = \"cube.toml\"\nfps = 2\nduration = 2.0\n[[camera]]\ntime = 0.0\nposition = [0, 1, 0.9]\n\
[[camera]]\ntime = 1.9\nposition = [0.4, 0.7, 0.8]\n";

/// A small cube that moves in the large one, in two frames.
const MOVES: &str = "scene = \"pair.toml\"\nfps = 2\nduration = 1.0\n\
[[model]]\nname = \"small\"\ntime = 0.0\ntranslate = [-0.5, 0.1, 0]\n\
[[model]]\nname = \"small\"\ntime = 0.9\ntranslate = [-0.4, 0.1, 0]\n";
const SMALL: &str = "[[model]]\nfile = \"cube.obj\"\nname = \"small\"\nmovable = true\nscale = 0.2\ntranslate = [-0.5, 0.1, 0]\n";

/// Folders of scenes and of results, and the layer.
pub struct Stage {
    scenes: TempDir,
    pub folder: TempDir,
    layer: Layer,
}

/// Result of a run.
pub struct Outcome {
    pub status: ExitStatus,
    pub stdout: String,
    /// Lines on stderr.
    pub said: Vec<String>,
    /// Faults that occurred, a line for each.
    pub faults: Vec<String>,
    /// Number of calls of each function, if the program finished under [`Stage::run`]; else empty.
    pub calls: BTreeMap<String, u64>,
}

impl Stage {
    pub fn new() -> Self {
        let scenes = tempfile::tempdir().unwrap();
        let pair = format!("{SMALL}{SCENE}");
        let files = [
            ("cube.obj", CUBE),
            ("cube.toml", SCENE),
            ("walk.toml", FILM),
            ("pair.toml", &pair),
            ("moves.toml", MOVES),
        ];
        for (name, text) in files {
            fs::write(scenes.path().join(name), text).unwrap();
        }
        Self { scenes, folder: tempfile::tempdir().unwrap(), layer: Layer::new() }
    }

    /// The program with these arguments, separated by spaces: `CUBE` is the scene, `FILM` and
    /// `MOVES` are films.
    pub fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
        command.current_dir(self.folder.path()).args(self.words(arguments));
        command
    }

    pub fn words(&self, arguments: &str) -> Vec<String> {
        let place = |name: &str| self.scenes.path().join(name).to_str().unwrap().to_owned();
        let word = |word: &str| match word {
            "CUBE" => place("cube.toml"),
            "FILM" => place("walk.toml"),
            "MOVES" => place("moves.toml"),
            other => other.to_owned(),
        };
        arguments.split_whitespace().map(word).collect()
    }

    /// Runs the program under faults, in the notation of `tests/faults`.
    pub fn run(&self, arguments: &str, faults: &str) -> Outcome {
        let mut command = self.command(arguments);
        self.afflict(&mut command, faults);
        let file = self.scenes.path().join("calls");
        let _ = fs::remove_file(&file);
        command.env("LIGHTPATHS_CALLS", &file);
        let mut outcome = outcome(command);
        outcome.calls = calls_in(&file);
        outcome
    }

    pub fn afflict(&self, command: &mut Command, faults: &str) {
        self.layer.afflict(command, faults);
        // Mesa's layer queries devices before the program does, and does not expect failures.
        command.env("NODEVICE_SELECT", "1");
    }

    /// Number of calls of each fallible function in a run without faults.
    pub fn calls(&self, arguments: &str) -> BTreeMap<String, u64> {
        let mut calls = self.all_calls(arguments);
        calls.retain(|name, _| !is_end(name));
        calls
    }

    /// The same, functions that destroy objects included.
    pub fn all_calls(&self, arguments: &str) -> BTreeMap<String, u64> {
        let outcome = self.run(arguments, "");
        assert!(outcome.status.success(), "{arguments}: {:?}", outcome.said);
        outcome.calls
    }

    /// Files in the folder of results.
    pub fn listing(&self) -> Vec<String> {
        listing(self.folder.path())
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.folder.path().join(name)).unwrap()
    }

    pub fn write(&self, name: &str, text: &str) {
        fs::write(self.folder.path().join(name), text).unwrap();
    }
}

/// Whether a function only ends the action of another, and cannot fail.
fn is_end(name: &str) -> bool {
    name.starts_with("vkDestroy") || name.starts_with("vkFree")
}

impl Outcome {
    /// Asserts the exit code, and one line on stderr with these words. Requested faults
    /// must have occurred.
    pub fn assert_failed(&self, code: i32, words: &[&str], case: &str) {
        assert_eq!(self.status.code(), Some(code), "{case}: {:?}", self.said);
        let said = self.said_but_few_paths();
        assert_eq!(said.len(), 1, "{case}: {:?}", self.said);
        let line = said[0];
        assert!(line.starts_with("lightpaths: "), "{case}: {line}");
        for word in words {
            assert!(line.contains(word), "{case}: no {word:?} in {line}");
        }
    }

    /// Whether the run succeeded because it never made the call that was to fail. The clock
    /// decides into how many dispatches a precomputation is cut, so a run may make fewer calls
    /// than the one before.
    pub fn is_beyond(&self, name: &str, call: u64) -> bool {
        self.status.success() && self.calls.get(name).copied().unwrap_or(0) < call
    }

    pub fn assert_done(&self, case: &str) {
        let is_silent = self.said_but_few_paths().is_empty();
        assert!(self.status.success() && is_silent, "{case}: {:?}, {:?}", self.status, self.said);
    }

    /// The lines on stderr without the warning that these small scenes have few entry points.
    fn said_but_few_paths(&self) -> Vec<&String> {
        self.said.iter().filter(|line| !line.contains("; raise quality.entry_points")).collect()
    }
}

/// Runs each case, two at a time, each on its own stage.
pub fn in_turns<T: Sync>(cases: &[T], run: impl Fn(&Stage, &T) + Sync) {
    let next = AtomicUsize::new(0);
    let work = || {
        let stage = Stage::new();
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            run(&stage, case);
        }
    };
    std::thread::scope(|scope| {
        scope.spawn(work);
        scope.spawn(work);
    });
}

/// Paths of all files below a folder, sorted.
pub fn listing(folder: &Path) -> Vec<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let (path, name) =
            entry.map(|entry| (entry.path(), entry.file_name().into_string().unwrap())).unwrap();
        match path.is_dir() {
            true => names.extend(listing(&path).into_iter().map(|below| format!("{name}/{below}"))),
            false => names.push(name),
        }
    }
    names.sort();
    names
}

/// Runs a command that must end by itself.
pub fn outcome(mut command: Command) -> Outcome {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (stdout, stderr) = (text(child.stdout.take().unwrap()), text(child.stderr.take().unwrap()));
    let status = wait(&mut child).unwrap_or_else(|| {
        child.kill().unwrap();
        panic!("{command:?} hangs");
    });
    let stderr = stderr.join().unwrap();
    let (faults, said) =
        stderr.lines().map(str::to_owned).partition(|line: &String| line.starts_with("faults: "));
    Outcome { status, stdout: stdout.join().unwrap(), said, faults, calls: BTreeMap::new() }
}

/// Exit status. `None` if the process hangs.
pub fn wait(child: &mut Child) -> Option<ExitStatus> {
    until(|| child.try_wait().unwrap())
}

/// Polls `look` until it returns a value. `None` if the time runs out.
pub fn until<T>(mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let begun = Instant::now();
    loop {
        let found = look();
        if found.is_some() || begun.elapsed() > HANG {
            return found;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn text(mut from: impl Read + Send + 'static) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut text = String::new();
        from.read_to_string(&mut text).unwrap();
        text
    })
}
