//! Ctrl-C, SIGTERM and a terminal that is closed: the process ends at once, and files are whole or absent.

use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{LONG, Stage, listing, wait};

/// From the signal to the end.
const AT_ONCE: Duration = Duration::from_secs(1);

const HUP: i32 = 1;
const INT: i32 = 2;
const TERM: i32 = 15;

/// A shell that is ready to send signals to a process, without the time that it takes to start one.
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

/// Waits for the end that the signal brings; the process may have ended by itself before.
fn assert_ended(child: &mut Child, signal: i32, case: &str) -> bool {
    let begun = Instant::now();
    let status = wait(child, LONG).unwrap_or_else(|| panic!("{case}: hangs"));
    assert!(begun.elapsed() <= AT_ONCE, "{case}: took {:?}", begun.elapsed());
    assert!(status.signal() == Some(signal) || status.success(), "{case}: {status:?}");
    status.signal() == Some(signal)
}

/// Fails if a temporary file, or a half of anything, is there.
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
            // References of sweeps, which say how long they are.
            _ => name.starts_with("cache/") && !name.contains(".part"),
        };
        assert!(is_whole, "{case}: {name} of {} bytes", bytes.len());
    }
}

#[test]
fn every_command_ends_at_once_at_any_moment() {
    // Moments from the first instant to about the end; which stage that is depends on the machine.
    let commands = [
        "render CUBE -o a.png --stats s.json",
        "render CUBE -o a.exr --method path --seconds 100",
        "render CUBE -o a.exr --method photon --seconds 100",
        "precompute CUBE -o a.paths",
        "render CUBE -o a.png --cache cache",
        // So many that its picture is near enough to the path tracer's, should it come so far.
        "time CUBE -q --set quality.entry_points=20000 --json t.json",
        "film FILM -o film --video none",
        "sweep CUBE -o sweep --cache cache",
        "scale CUBE -o scale",
        "figures CUBE -o figures --cache cache",
        "info CUBE",
    ];
    let mut interrupted = 0;
    for (index, arguments) in commands.iter().enumerate() {
        for (moment, signal) in
            [(10, INT), (250, TERM), (700 + 70 * index as u64, [INT, TERM, HUP][index % 3])]
        {
            let stage = Stage::new();
            let mut child = start(stage.command(arguments));
            let mut sender = Sender::new(&child);
            std::thread::sleep(Duration::from_millis(moment));
            sender.send(&signal.to_string());
            let case = format!("{arguments}, signal {signal} after {moment} ms");
            interrupted += u32::from(assert_ended(&mut child, signal, &case));
            assert_whole(stage.folder.path(), &case);
        }
    }
    assert!(interrupted > 22, "{interrupted} of 33 were still running");
}

#[test]
fn a_comparison_ends_at_once() {
    let stage = Stage::new();
    // So large that it takes seconds.
    for (name, shift) in [("a.png", 0), ("b.png", 7)] {
        let texel = |x: u32, y: u32| image::Rgb([x, y, x * y].map(|value| (value + shift) as u8));
        image::RgbImage::from_fn(3000, 3000, texel).save(stage.folder.path().join(name)).unwrap();
    }
    let mut interrupted = 0;
    for (moment, signal) in [(10, INT), (400, TERM), (900, HUP)] {
        let mut child = start(stage.command("compare a.png b.png --heatmap h.png"));
        let mut sender = Sender::new(&child);
        std::thread::sleep(Duration::from_millis(moment));
        sender.send(&signal.to_string());
        let case = format!("signal {signal} after {moment} ms");
        interrupted += u32::from(assert_ended(&mut child, signal, &case));
        assert_eq!(stage.listing(), ["a.png", "b.png"], "{case}");
    }
    assert_eq!(interrupted, 3, "it takes longer than that");
}

#[test]
fn a_file_that_is_being_written_goes() {
    let mut caught = 0;
    for signal in [INT, TERM, HUP, TERM, INT, TERM, HUP, TERM] {
        let stage = Stage::new();
        let mut child = start(stage.command("precompute CUBE -o a.paths"));
        let mut sender = Sender::new(&child);
        let folder = stage.folder.path();
        let is_growing = |name: &String| {
            name.ends_with(".part") && fs::metadata(folder.join(name)).is_ok_and(|about| about.len() > 0)
        };
        while !listing(folder).iter().any(is_growing) && child.try_wait().unwrap().is_none() {}
        // Stopped in the middle of it, if it has not been too fast, so that there is something to see.
        sender.send("STOP");
        std::thread::sleep(Duration::from_millis(20));
        caught += u32::from(stage.listing().iter().any(is_growing));
        sender.send(&signal.to_string());
        sender.send("CONT");
        let case = format!("signal {signal}");
        assert_ended(&mut child, signal, &case);
        assert_whole(folder, &case);
    }
    assert!(caught > 0, "no file was seen growing");
}

#[test]
fn what_encodes_a_film_ends_with_the_program() {
    let stage = Stage::new();
    let programs = tempfile::tempdir().unwrap();
    let script =
        "#!/bin/sh\nfor last; do :; done\necho half > \"$last\"\necho $$ > encoder\nexec /bin/sleep 100\n";
    let ffmpeg = programs.path().join("ffmpeg");
    fs::write(&ffmpeg, script).unwrap();
    fs::set_permissions(&ffmpeg, fs::Permissions::from_mode(0o755)).unwrap();
    let mut command = stage.command("film FILM -o .");
    command.env("PATH", programs.path());
    let mut child = start(command);
    let file = stage.folder.path().join("encoder");
    let begun = Instant::now();
    let encoder: u32 = loop {
        match fs::read_to_string(&file).ok().and_then(|text| text.trim().parse().ok()) {
            Some(encoder) => break encoder,
            None => assert!(begun.elapsed() < LONG, "no encoder"),
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    assert!(stage.listing().iter().any(|name| name.ends_with(".part")), "{:?}", stage.listing());
    Sender::new(&child).send("TERM");
    assert!(assert_ended(&mut child, TERM, "encoding"));
    fs::remove_file(file).unwrap();
    assert_whole(stage.folder.path(), "encoding");
    assert_eq!(stage.listing().len(), 4, "frames only");
    // Whoever adopted the encoder may not have looked after it yet; a process that has ended has no memory.
    let status = fs::read_to_string(format!("/proc/{encoder}/status")).unwrap_or_default();
    assert!(!status.contains("VmSize"), "the encoder goes on");
}

#[test]
fn what_is_to_be_ignored_is_ignored() {
    let stage = Stage::new();
    let mut command = Command::new("sh");
    let words = stage.words("render CUBE -o a.png");
    command.args(["-c", "trap '' HUP INT; exec \"$@\"", "sh", env!("CARGO_BIN_EXE_lightpaths")]).args(words);
    command.current_dir(stage.folder.path());
    let mut child = start(command);
    let mut sender = Sender::new(&child);
    for signal in ["HUP", "INT"] {
        std::thread::sleep(Duration::from_millis(200));
        sender.send(signal);
    }
    let status = wait(&mut child, LONG).expect("it ends");
    assert!(status.success(), "{status:?}");
    assert_whole(stage.folder.path(), "ignored");
    assert_eq!(stage.listing(), ["a.png"]);
}
