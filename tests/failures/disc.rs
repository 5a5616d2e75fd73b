//! Output that cannot be written: full discs, read-only folders, closed pipes.

use std::fs::{self, File};
use std::process::Command;

use crate::program::{Outcome, Stage, outcome};

/// Commands that write, and their output file or folder.
const WRITERS: [(&str, &str); 9] = [
    ("render CUBE -q --method path --spp 1 -o OUT", "a.png"),
    ("render CUBE -q --method path --spp 1 -o OUT", "a.exr"),
    ("render CUBE -q --method path --spp 1 -o b.png --stats OUT", "s.json"),
    ("precompute CUBE -q -o OUT", "a.paths"),
    ("time CUBE -q --frames 1 --lights 1 --set quality.entry_points=20000 --json OUT", "t.json"),
    ("film FILM -q --frames 0..1 -o OUT", "film"),
    ("sweep CUBE -q --cache cache -o OUT", "sweep"),
    ("scale CUBE -q -o OUT", "scale"),
    ("figures CUBE -q --cache cache -o OUT", "figures"),
];

/// Runs the program in a shell, after another command.
fn after(stage: &Stage, first: &str, arguments: &str) -> Outcome {
    let mut command = Command::new("sh");
    let script = format!("{first}; exec \"$@\"");
    command.args(["-c", &script, "sh", env!("CARGO_BIN_EXE_lightpaths")]);
    command.args(stage.words(arguments)).current_dir(stage.folder.path());
    outcome(command)
}

#[test]
fn a_full_disc_is_said_and_the_old_file_survives() {
    let stage = Stage::new();
    for (arguments, name) in &WRITERS[..6] {
        let is_folder = !name.contains('.');
        if !is_folder {
            stage.write(name, "old");
        }
        // Not one byte may be written, as on a full disc, but for one process.
        let outcome = after(&stage, "ulimit -f 0", &arguments.replace("OUT", name));
        // The picture is written before its statistics.
        let named = if arguments.contains("b.png") { "b.png" } else { name };
        let words = ["cannot be written", "File too large", named];
        let said: Vec<_> = outcome.said.iter().filter(|line| !line.contains("debug build")).collect();
        assert_eq!(outcome.status.code(), Some(2), "{arguments}: {said:?}");
        assert!(said.len() == 1 && words.iter().all(|word| said[0].contains(word)), "{arguments}: {said:?}");
        match is_folder {
            true => assert_eq!(stage.listing(), [""; 0], "{arguments}"),
            false => {
                assert_eq!(stage.listing(), [*name], "{arguments}");
                assert_eq!(stage.read(name), b"old", "{arguments}");
                fs::remove_file(stage.folder.path().join(name)).unwrap();
            }
        }
    }
}

#[test]
fn a_disc_that_fills_in_the_middle_is_said_and_the_old_file_survives() {
    let stage = Stage::new();
    for (arguments, name) in [
        ("render CUBE -q --method path --spp 1 --size 320x320 -o OUT", "a.png"),
        ("render CUBE -q --method path --spp 1 --size 200x200 -o OUT", "a.exr"),
        ("precompute CUBE -q --set quality.entry_points=20000 -o OUT", "a.paths"),
        ("film FILM -q --frames 0..2 --size 200x200 --format exr -o OUT", "film"),
    ] {
        let arguments = arguments.replace("OUT", name);
        outcome(stage.command(&arguments)).assert_done(&arguments);
        let written = stage.listing();
        let old: Vec<Vec<u8>> = written.iter().map(|name| stage.read(name)).collect();
        let is_folder = !name.contains('.');
        if is_folder {
            fs::remove_dir_all(stage.folder.path().join(name)).unwrap();
        }
        // Some shells count blocks of 512 bytes, others of 1024.
        let blocks = old[0].len() / 3 / 1024;
        assert!(blocks > 20, "{arguments}: {} bytes", old[0].len());
        let outcome = after(&stage, &format!("ulimit -f {blocks}"), &arguments);
        let said: Vec<_> = outcome.said.iter().filter(|line| !line.contains("debug build")).collect();
        assert_eq!(outcome.status.code(), Some(2), "{arguments}: {said:?}");
        let words = ["cannot be written", "File too large", name];
        assert!(said.len() == 1 && words.iter().all(|word| said[0].contains(word)), "{arguments}: {said:?}");
        match is_folder {
            true => assert_eq!(stage.listing(), [""; 0], "{arguments}"),
            false => {
                assert_eq!(stage.listing(), written, "{arguments}");
                assert!(stage.read(name) == old[0], "{arguments}: the old file");
                fs::remove_file(stage.folder.path().join(name)).unwrap();
            }
        }
    }
}

#[test]
fn places_that_cannot_keep_light_paths_are_refused_and_stay_as_they_are() {
    let stage = Stage::new();
    stage.write("a.txt", "text");
    for (cache, words) in
        [("a.txt/cache", ["a.txt/cache", "cannot be made"]), ("a.txt", ["a.txt", "holds no light paths"])]
    {
        let outcome = stage.run(&format!("render CUBE -o a.png --cache {cache}"), "");
        outcome.assert_failed(2, &words, cache);
        assert_eq!(stage.listing(), ["a.txt"], "{cache}");
        assert_eq!(stage.read("a.txt"), b"text", "{cache}");
    }
    // A read-only folder causes one line of output, and the picture is written.
    let outcome = stage.run("render CUBE -o a.png --cache /proc", "");
    assert!(outcome.status.success(), "{:?}", outcome.said);
    let told =
        outcome.said.iter().filter(|line| line.contains("/proc/") && line.contains("cannot be written"));
    assert_eq!(told.count(), 1, "{:?}", outcome.said);
    assert_eq!(stage.listing(), ["a.png", "a.txt"]);
}

#[test]
fn places_that_cannot_be_written_are_refused_before_any_work() {
    let stage = Stage::new();
    fs::create_dir(stage.folder.path().join("folder.png")).unwrap();
    stage.write("file", "text");
    for (arguments, name) in WRITERS {
        let is_folder = !name.contains('.');
        let mut places = vec![format!("/proc/{name}"), format!("file/{name}")];
        match is_folder {
            true => places.push("file".to_owned()),
            false => {
                places.extend([format!("missing/{name}"), "folder.png".to_owned(), "/dev/full".to_owned()]);
            }
        }
        for place in places {
            // A name with the wrong extension is refused for its extension.
            if place.ends_with("full") && name.contains("a.") {
                continue;
            }
            let outcome = stage.run(&arguments.replace("OUT", &place), "");
            let words = [place.split('/').next_back().unwrap(), ": "];
            outcome.assert_failed(2, &words, &format!("{arguments} to {place}"));
            assert_eq!(outcome.stdout, "", "{arguments} to {place}");
            assert!(
                stage.listing().iter().all(|left| left == "file"),
                "{arguments} to {place}: {:?}",
                stage.listing()
            );
        }
    }
}

#[test]
fn results_that_nobody_takes_are_said_or_dropped_without_a_panic() {
    // A closed pipe, a closed stream, and both for stderr.
    const STREAMS: [&str; 4] = ["exec >&-", "exec 2>&-", "exec >&- 2>&-", "exec 2>/dev/full"];
    let stage = Stage::new();
    for (arguments, streams) in [
        ("info CUBE", &STREAMS[..]),
        ("--help", &STREAMS),
        ("render CUBE -q --method path --spp 1 -o a.png", &STREAMS),
        ("compare a.png a.png", &STREAMS),
        // These commands take longer.
        ("precompute CUBE -q -o a.paths", &STREAMS[2..3]),
        ("film FILM -q --frames 0..1 -o film", &STREAMS[3..]),
    ] {
        // A full disc.
        let mut full = stage.command(arguments);
        full.stdout(File::options().write(true).open("/dev/full").unwrap());
        let output = full.output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments}: {said}");
        assert_eq!(
            said, "lightpaths: standard output: No space left on device (os error 28)\n",
            "{arguments}"
        );
        for streams in streams {
            let outcome = after(&stage, streams, arguments);
            assert!(
                outcome.status.success() && outcome.said.is_empty(),
                "{arguments}, {streams}: {:?}",
                outcome.said
            );
        }
        let mut gone = stage.command(arguments);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = gone.stdout(writer.try_clone().unwrap()).stderr(writer).output().unwrap();
        assert!(output.status.success(), "{arguments}: {:?}", output.status);
    }
}

#[test]
fn failures_that_nobody_hears_of_have_their_exit_code() {
    let stage = Stage::new();
    for (arguments, faults, code) in [
        (
            "render CUBE --validation --method path --spp 1 -o a.png",
            "vkQueueSubmit2KHR:1:VK_ERROR_DEVICE_LOST",
            4,
        ),
        ("render CUBE -o a.png", "vkEnumeratePhysicalDevices:1+:NONE", 3),
        ("render CUBE -o a.jpg", "", 2),
    ] {
        let mut command = stage.command(arguments);
        stage.afflict(&mut command, faults);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let status = command.stdout(writer.try_clone().unwrap()).stderr(writer).status().unwrap();
        assert_eq!(status.code(), Some(code), "{arguments}");
        assert_eq!(stage.listing(), [""; 0], "{arguments}");
    }
}
