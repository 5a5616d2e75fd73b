//! Opening another scene, and saving to another file, by dialogs.

use std::process::Command;

use lightpaths::scene::{LoadOptions, Scene};
use tempfile::TempDir;

use crate::client::Point;
use crate::demo::Demo;
use crate::disk::{BLUE, ROOM, WHITE, is_blue, scene, shows_question};
use crate::display::Display;
use crate::keys;
use crate::picture::changed_pixels;
use crate::scenarios::{PICTURE, READY, SIZE, SOON, changed, close, settled};
use crate::until;

/// Position of the answers of the question.
const SAVE_AND_OPEN: Point = (60, 42);
const DO_NOT_OPEN: Point = (305, 42);

/// A window with `s.toml`, beside which is `t.toml`. Recent scenes are listed in the second folder.
fn open(display: &Display) -> ([TempDir; 2], Demo<'_>) {
    let [folder, lists] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("room.obj", ROOM);
    write("s.toml", &scene(WHITE));
    write("t.toml", &scene(BLUE));
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.args(["demo", "s.toml", "--size", SIZE, "--validation"]).current_dir(folder.path());
    command.env("LIGHTPATHS_RECENT", lists.path());
    let demo = Demo::run(Some(display), command);
    demo.wait_for_line("lightpaths: ready", READY);
    ([folder, lists], demo)
}

/// Chooses `t.toml` in the dialog, the last file of the folder.
fn choose_other(demo: &Demo, folder: &TempDir) {
    let mut before = demo.settled(None);
    let mut tap = |held: &[u32], key| {
        demo.client().tap(held, key);
        // A thread reads the folder, and keys before that choose nothing.
        until("dialog", SOON, || (demo.capture() != before).then_some(()));
        before = demo.settled(None);
    };
    tap(&[keys::CONTROL], keys::of('o'));
    for _ in std::fs::read_dir(folder.path()).unwrap() {
        tap(&[], keys::DOWN);
    }
    demo.client().tap(&[], keys::RETURN);
}

#[test]
fn another_scene_opens_in_the_same_window() {
    let display = Display::start();
    let ([folder, lists], demo) = open(&display);
    let white = settled(&demo);
    assert!(!is_blue(&white));
    let mark = demo.mark();
    choose_other(&demo, &folder);
    let opened = demo.wait_for_line_since(mark, "lightpaths: opened ", SOON);
    assert!(opened.ends_with("t.toml"), "{opened}");
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    assert!(is_blue(&changed(&demo, &white)));
    let list = std::fs::read_to_string(lists.path().join("recent.txt")).unwrap();
    let names: Vec<&str> = list.lines().map(|line| line.rsplit('/').next().unwrap()).collect();
    assert_eq!(names, ["t.toml", "s.toml"]);
    close(&demo);
}

#[test]
fn unsaved_edits_outlive_another_scene() {
    let display = Display::start();
    let ([folder, _lists], demo) = open(&display);
    let before = settled(&demo);
    demo.client().tap(&[], keys::of('l'));
    let edited = changed(&demo, &before);
    choose_other(&demo, &folder);
    until("question", SOON, || shows_question(&demo.capture()).then_some(()));
    demo.client().click(1, DO_NOT_OPEN);
    until("no question", SOON, || (!shows_question(&demo.capture())).then_some(()));
    let still = changed_pixels(&edited, &settled(&demo), PICTURE, 0) == 0;
    assert!(still, "nothing was opened, and the edit is there");

    let mark = demo.mark();
    choose_other(&demo, &folder);
    until("question", SOON, || shows_question(&demo.capture()).then_some(()));
    demo.client().click(1, SAVE_AND_OPEN);
    demo.wait_for_line_since(mark, "lightpaths: saved s-edited.toml", SOON);
    let opened = demo.wait_for_line_since(mark, "lightpaths: opened ", SOON);
    assert!(opened.ends_with("t.toml"), "{opened}");
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    assert!(is_blue(&changed(&demo, &edited)));
    let saved = folder.path().join("s-edited.toml");
    let saved = Scene::load(saved.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(saved.lights.len(), 2);
    close(&demo);
}
