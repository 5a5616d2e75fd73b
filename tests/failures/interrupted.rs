//! Ctrl-C, SIGTERM and a closed terminal: the process ends at once, and files are whole or absent.

use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};

use crate::program::{Stage, listing, until, wait};

/// Processor time from the signal to the end, in hundredths of a second: one second. Wall-clock
/// time would depend on the load of the machine.
const AT_ONCE: u64 = 100;

const HUP: i32 = 1;
const INT: i32 = 2;
const TERM: i32 = 15;

/// A shell that is ready to send signals to a process, so that no time is lost to start one.
struct Sender {
    shell: Child,
}

impl Sender {
    fn new(process: &Child) -> Self {
        let script = format!("while read signal; do kill -$signal {}; done", process.id());
        let mut shell = Command::new("sh");
        Self {
            shell: shell.args(["-c", &script]).stdin(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap(),
        }
    }

    fn send(&mut self, signal: &str) {
        writeln!(self.shell.stdin.as_mut().unwrap(), "{signal}").unwrap();
    }
}

impl Drop for Sender {
    fn drop(&mut self) {
        drop(self.shell.stdin.take());
        let _ = self.shell.wait();
    }
}

fn start(mut command: Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// State of a process, such as `T` (stopped) and `Z` (ended and not awaited), and its processor
/// time, hundredths of a second.
fn state(process: &Child) -> (char, u64) {
    let stat = fs::read_to_string(format!("/proc/{}/stat", process.id())).unwrap();
    // The name in brackets may contain spaces; user and system time are the 12th and 13th
    // fields after it.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let ticks = |field: usize| fields[field].parse::<u64>().unwrap();
    (fields[0].chars().next().unwrap(), ticks(11) + ticks(12))
}

fn has_ended(process: &Child) -> bool {
    state(process).0 == 'Z'
}

/// Waits until the process has taken `time` of processor time, hundredths of a second,
/// or has ended.
fn run_for(process: &Child, time: u64) {
    let has_run = || (state(process).1 >= time || has_ended(process)).then_some(());
    until(has_run).expect("it takes time, or ends");
}

/// Sends signals and waits for the end; the process may have ended by itself before.
fn assert_ends(child: &mut Child, signals: &[&str], signal: i32, case: &str) -> bool {
    let mut sender = Sender::new(child);
    let before = state(child).1;
    signals.iter().for_each(|signal| sender.send(signal));
    until(|| has_ended(child).then_some(())).unwrap_or_else(|| panic!("{case}: hangs"));
    let taken = state(child).1 - before;
    let status = wait(child).expect("it has ended");
    assert!(taken <= AT_ONCE, "{case}: took {taken} hundredths of a second");
    assert!(status.signal() == Some(signal) || status.success(), "{case}: {status:?}");
    status.signal() == Some(signal)
}

/// Fails if there is a temporary or incomplete file.
fn assert_whole(folder: &Path, case: &str) {
    for name in listing(folder) {
        let path = folder.join(&name);
        let bytes = fs::read(&path).unwrap();
        let is_whole = match Path::new(&name).extension().and_then(|extension| extension.to_str()) {
            Some("png" | "exr") => lightpaths::image::read(&path, None).is_ok(),
            Some("json") => serde_json::from_slice::<serde_json::Value>(&bytes).is_ok(),
            Some("html") => bytes.trim_ascii_end().ends_with(b"</html>"),
            Some("svg") => bytes.trim_ascii_end().ends_with(b"</svg>"),
            Some("paths") => bytes.len() as u64 == u64::from_le_bytes(bytes[24..32].try_into().unwrap()),
            // References of sweeps, which store their length.
            _ => name.starts_with("cache/") && !name.contains(".part"),
        };
        assert!(is_whole, "{case}: {name} of {} bytes", bytes.len());
    }
}

#[test]
fn every_command_ends_at_once_at_any_moment() {
    let commands = [
        "render CUBE -o a.png --stats s.json",
        "render CUBE -o a.exr --method path --seconds 300",
        "render CUBE -o a.exr --method photon --seconds 300",
        "precompute CUBE -o a.paths",
        "render CUBE -o a.png --cache cache",
        // Enough entry points that the picture is close to the path tracer's, if the run
        // gets so far.
        "time CUBE -q --set quality.entry_points=20000 --json t.json",
        "film FILM -o film --video none",
        "sweep CUBE -o sweep --cache cache",
        "scale CUBE -o scale",
        "figures CUBE -o figures --cache cache",
        "info CUBE",
    ];
    let mut interrupted = 0;
    for (index, arguments) in commands.iter().enumerate() {
        // Moments in hundredths of a second of processor time: the work done by then is the same on
        // all similar machines.
        for (moment, signal) in [(1, INT), (20 + 7 * index as u64, [TERM, INT, HUP][index % 3])] {
            let stage = Stage::new();
            let mut child = start(stage.command(arguments));
            run_for(&child, moment);
            let case = format!("{arguments}, signal {signal} after {moment} hundredths of a second");
            interrupted += u32::from(assert_ends(&mut child, &[&signal.to_string()], signal, &case));
            assert_whole(stage.folder.path(), &case);
        }
    }
    // At least the first moment of each command, and the second of the slow ones.
    assert!(interrupted >= 15, "{interrupted} of 22 were still running");
}

#[test]
fn a_comparison_ends_at_once() {
    let stage = Stage::new();
    // Large enough to take seconds.
    for (name, shift) in [("a.png", 0), ("b.png", 7)] {
        let texel = |x: u32, y: u32| image::Rgb([x, y, x * y].map(|value| (value + shift) as u8));
        image::RgbImage::from_fn(2000, 2000, texel).save(stage.folder.path().join(name)).unwrap();
    }
    let mut interrupted = 0;
    for (moment, signal) in [(1, INT), (20, TERM), (50, HUP)] {
        let mut child = start(stage.command("compare a.png b.png --heatmap h.png"));
        run_for(&child, moment);
        let case = format!("signal {signal} after {moment} hundredths of a second");
        interrupted += u32::from(assert_ends(&mut child, &[&signal.to_string()], signal, &case));
        assert_eq!(stage.listing(), ["a.png", "b.png"], "{case}");
    }
    assert_eq!(interrupted, 3, "it takes longer than that");
}

/// Repeated until a file is seen growing, because the moment is unknown.
#[test]
fn a_file_that_is_being_written_goes() {
    const TRIES: usize = 12;
    for signal in [INT, TERM, HUP] {
        let caught = (0..TRIES).any(|_| is_caught_writing(signal));
        assert!(caught, "no file was seen growing in {TRIES} tries");
    }
}

/// Ends a process by a signal while it writes a file, and asserts that no file is left. Returns
/// false if the process was too fast.
fn is_caught_writing(signal: i32) -> bool {
    let stage = Stage::new();
    let mut child = start(stage.command("precompute CUBE --set quality.entry_points=20000 -o a.paths"));
    let mut stopper = Sender::new(&child);
    let folder = stage.folder.path();
    let is_growing = |name: &String| {
        name.ends_with(".part") && fs::metadata(folder.join(name)).is_ok_and(|about| about.len() > 0)
    };
    while !listing(folder).iter().any(is_growing) && !has_ended(&child) {}
    // Stopped while it writes, unless it was too fast.
    stopper.send("STOP");
    until(|| ['T', 'Z'].contains(&state(&child).0).then_some(())).expect("it stops");
    let is_caught = stage.listing().iter().any(is_growing);
    let case = format!("signal {signal}");
    assert_ends(&mut child, &[&signal.to_string(), "CONT"], signal, &case);
    assert_whole(folder, &case);
    is_caught
}

#[test]
fn what_encodes_a_film_ends_with_the_program() {
    let stage = Stage::new();
    let programs = tempfile::tempdir().unwrap();
    let script =
        "#!/bin/sh\nfor last; do :; done\necho half > \"$last\"\necho $$ > encoder\nexec /bin/sleep 900\n";
    let ffmpeg = programs.path().join("ffmpeg");
    fs::write(&ffmpeg, script).unwrap();
    fs::set_permissions(&ffmpeg, fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = stage.command("film FILM -o .");
    command.env("PATH", programs.path());
    let mut child = start(command);
    let file = stage.folder.path().join("encoder");
    let encoder = || fs::read_to_string(&file).ok().and_then(|text| text.trim().parse::<u32>().ok());
    let encoder = until(encoder).expect("an encoder");
    assert!(stage.listing().iter().any(|name| name.ends_with(".part")), "{:?}", stage.listing());
    assert!(assert_ends(&mut child, &["TERM"], TERM, "encoding"));
    fs::remove_file(file).unwrap();
    assert_whole(stage.folder.path(), "encoding");
    assert_eq!(stage.listing().len(), 4, "frames only");
    // The encoder's new parent may not have awaited it yet; an ended process has no memory.
    let status = || fs::read_to_string(format!("/proc/{encoder}/status")).unwrap_or_default();
    until(|| (!status().contains("VmSize")).then_some(())).expect("the encoder ends");
}

#[test]
fn what_is_to_be_ignored_is_ignored() {
    let stage = Stage::new();
    let mut command = Command::new("sh");
    let words = stage.words("render CUBE -o a.png");
    command.args(["-c", "trap '' HUP INT; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_lightpaths")]).args(words);
    command.current_dir(stage.folder.path());
    let mut child = start(command);
    let status = || fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap();
    until(|| status().starts_with("Name:\tlightpaths").then_some(())).expect("the shell becomes the program");
    let mut sender = Sender::new(&child);
    for (moment, signal) in [(1, "HUP"), (20, "INT")] {
        run_for(&child, moment);
        sender.send(signal);
    }
    let status = wait(&mut child).expect("it ends");
    assert!(status.success(), "{status:?}");
    assert_whole(stage.folder.path(), "ignored");
    assert_eq!(stage.listing(), ["a.png"]);
}
