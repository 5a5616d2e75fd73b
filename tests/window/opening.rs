//! Opening another scene, and saving to another file, by dialogs.

use std::process::Command;

use lightpaths::scene::{LoadOptions, Scene};
use tempfile::TempDir;

use crate::client::Point;
use crate::demo::Demo;
use crate::disk::{BLUE, ROOM, WHITE, is_blue, scene, shows_question};
use crate::display::Display;
use crate::keys;
use crate::scenarios::{READY, SIZE, SOON, changed, close, settled};
use crate::until;

/// Position of the answers of the question.
const SAVE_AND_OPEN: Point = (60, 42);
const DO_NOT_OPEN: Point = (305, 42);

/// A window with `s.toml`, beside which is `t.toml`.
fn open(display: &Display) -> (TempDir, Demo<'_>) {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("room.obj", ROOM);
    write("s.toml", &scene(WHITE));
    write("t.toml", &scene(BLUE));
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.args(["demo", "s.toml", "--size", SIZE, "--validation"]).current_dir(folder.path());
    command.env("LIGHTPATHS_RECENT", folder.path().join("lists"));
    let demo = Demo::run(Some(display), command);
    demo.wait_for_line("lightpaths: ready", READY);
    (folder, demo)
}

/// Chooses `t.toml` in the dialog: the third file, behind `room.obj` and `s.toml`.
fn choose_other(demo: &Demo) {
    let before = demo.capture();
    demo.client().tap(&[keys::CONTROL], keys::of('o'));
    until("dialog", SOON, || (demo.capture() != before).then_some(()));
    for _ in 0..3 {
        demo.client().tap(&[], keys::DOWN);
    }
    demo.client().tap(&[], keys::RETURN);
}

#[test]
fn another_scene_opens_in_the_same_window() {
    let display = Display::start();
    let (folder, demo) = open(&display);
    let white = settled(&demo);
    assert!(!is_blue(&white));
    let mark = demo.mark();
    choose_other(&demo);
    demo.wait_for_line_since(mark, "lightpaths: opened ", SOON);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    assert!(is_blue(&changed(&demo, &white)));
    let list = std::fs::read_to_string(folder.path().join("lists/recent.txt")).unwrap();
    let names: Vec<&str> = list.lines().map(|line| line.rsplit('/').next().unwrap()).collect();
    assert_eq!(names, ["t.toml", "s.toml"]);
    close(&demo);
}

#[test]
fn unsaved_edits_outlive_another_scene() {
    let display = Display::start();
    let (folder, demo) = open(&display);
    let before = settled(&demo);
    demo.client().tap(&[], keys::of('l'));
    let edited = changed(&demo, &before);
    choose_other(&demo);
    until("question", SOON, || shows_question(&demo.capture()).then_some(()));
    demo.client().click(1, DO_NOT_OPEN);
    until("no question", SOON, || (!shows_question(&demo.capture())).then_some(()));
    assert!(settled(&demo) == edited, "nothing was opened, and the edit is there");

    let mark = demo.mark();
    choose_other(&demo);
    until("question", SOON, || shows_question(&demo.capture()).then_some(()));
    demo.client().click(1, SAVE_AND_OPEN);
    demo.wait_for_line_since(mark, "lightpaths: saved s-edited.toml", SOON);
    demo.wait_for_line_since(mark, "lightpaths: opened ", SOON);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    assert!(is_blue(&changed(&demo, &edited)));
    let saved = folder.path().join("s-edited.toml");
    let saved = Scene::load(saved.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(saved.lights.len(), 2);
    close(&demo);
}
