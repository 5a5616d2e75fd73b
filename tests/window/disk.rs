//! The files of an open scene change: no edit is lost.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use image::RgbImage;
use lightpaths::scene::{LoadOptions, Scene};
use lightpaths::{Context, ContextOptions, Layer, Renderer, Silent};
use tempfile::TempDir;

use crate::client::Point;
use crate::demo::{Demo, Stream};
use crate::display::Display;
use crate::keys;
use crate::picture::changed_pixels;
use crate::scenarios::{PICTURE, READY, SIDE, SIZE, SOON, changed, close, gizmo_of, settled};
use crate::until;

/// Position of the answer buttons.
const RELOAD: Point = (90, 42);
pub(crate) const KEEP_MINE: Point = (209, 42);
const KEEP_BOTH: Point = (286, 42);
const WHAT_DIFFERS: Point = (360, 42);

const LOADED: &str = "lightpaths: s.toml has changed and was loaded again";
pub(crate) const ASKED: &str = "lightpaths: s.toml has changed on disk; unsaved edits wait for an answer";
const REFUSED: &str = "lightpaths: not loaded again: s.toml";

pub(crate) const WHITE: &str = "[0.2, 0.2, 0.2]";
pub(crate) const BLUE: &str = "[0.03, 0.03, 0.2]";
pub(crate) const RED: &str = "[0.2, 0.03, 0.03]";

/// A closed cube of two metres.
pub(crate) const ROOM: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 4 1 5 8\nf 2 3 7 6\n";

pub(crate) fn scene(intensity: &str) -> String {
    format!(
        "[[model]]\nfile = \"room.obj\"\n[camera]\nposition = [0, 1, 0.9]\ntarget = [0, 1, 0]\n\
         [[light]]\nname = \"lamp\"\nkind = \"point\"\nposition = [0.2, 1.6, 0.1]\nintensity = {intensity}\n\
         [quality]\nentry_points = 2000\ncache_points = 200\ngather_rays = 16\ncells = 8\n\
         record_error = 1\n"
    )
}

/// A window with a scene of few light paths, in its own folder.
pub(crate) struct Desk<'a> {
    folder: TempDir,
    pub(crate) demo: Demo<'a>,
}

impl<'a> Desk<'a> {
    pub(crate) fn open(display: &'a Display) -> Self {
        Self::open_scene(display, &scene(WHITE))
    }

    fn open_scene(display: &'a Display, text: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("room.obj"), ROOM).unwrap();
        std::fs::write(folder.path().join("s.toml"), text).unwrap();
        Self::open_in(display, folder)
    }

    /// A window without panels in which the lamp's gizmo is in view.
    fn open_in_view(display: &'a Display) -> Self {
        let desk = Self::open_scene(display, &scene(WHITE).replace("[0.2, 1.6, 0.1]", "[0.1, 1.1, 0.1]"));
        desk.hide_panels();
        desk
    }

    fn hide_panels(&self) {
        self.demo.client().tap(&[], keys::of('p'));
        self.demo.client().resize((SIDE, SIDE));
        self.demo.assert_presents(SOON);
    }

    /// Position of the lamp's gizmo.
    fn gizmo(&self) -> Point {
        gizmo_of(self.path("s.toml").to_str().unwrap())
    }

    fn open_in(display: &'a Display, folder: TempDir) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
        command.args(["demo", "s.toml", "--size", SIZE, "--validation"]).current_dir(folder.path());
        let demo = Demo::run(Some(display), command);
        demo.wait_for_line("lightpaths: ready", READY);
        Self { folder, demo }
    }

    /// Ends the process as a crash does, and opens another window.
    pub(crate) fn crash(self, display: &'a Display) -> Self {
        let Self { folder, demo } = self;
        let killed = Command::new("kill").args(["-9", &demo.process().to_string()]).status().unwrap();
        assert!(killed.success());
        until("end", SOON, || (!demo.is_running()).then_some(()));
        drop(demo);
        Self::open_in(display, folder)
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs an action and waits for its line of output.
    pub(crate) fn answered(&self, line: &str, act: impl FnOnce()) {
        let mark = self.demo.mark();
        act();
        self.demo.wait_for_line_since(mark, line, SOON);
    }

    pub(crate) fn write(&self, text: &str, line: &str) {
        self.answered(line, || std::fs::write(self.path("s.toml"), text).unwrap());
    }

    /// Runs an action and waits until the scene is loaded again.
    pub(crate) fn reloads(&self, act: impl FnOnce()) {
        let mark = self.demo.mark();
        act();
        self.demo.wait_for_line_since(mark, LOADED, SOON);
        self.demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    }

    pub(crate) fn answer(&self, answer: Point) {
        until("question", SOON, || shows_question(&self.demo.capture()).then_some(()));
        self.demo.client().click(1, answer);
    }

    fn undo(&self) {
        self.demo.client().tap(&[keys::CONTROL], keys::of('z'));
    }

    fn save(&self) {
        self.demo.client().tap(&[keys::CONTROL], keys::of('s'));
    }

    /// Number of lines so far with this prefix.
    pub(crate) fn count(&self, line: &str) -> usize {
        self.demo.lines(Stream::Err).iter().filter(|said| said.starts_with(line)).count()
    }
}

/// Whether there is text in the colour of questions, which the room does not have.
pub(crate) fn shows_question(window: &RgbImage) -> bool {
    let part = image::imageops::crop_imm(window, 0, 0, SIDE, 40).to_image();
    let is_orange = |[r, g, b]: [u8; 3]| r > 180 && (110..200).contains(&g) && b < 60;
    part.pixels().filter(|pixel| is_orange(pixel.0)).count() > 100
}

/// Number of pixels, below the question, in the colours of lines that are only on disk, and only
/// in the edits.
fn lines_that_differ(window: &RgbImage) -> [usize; 2] {
    let part = image::imageops::crop_imm(window, 20, 180, SIDE / 2, SIDE / 2).to_image();
    [[0x56, 0xb4, 0xe9], [0xe6, 0x9f, 0x00]].map(|colour| {
        let is_near = |pixel: &[u8; 3]| pixel.iter().zip(colour).all(|(a, b)| a.abs_diff(b) < 40);
        part.pixels().filter(|pixel| is_near(&pixel.0)).count()
    })
}

pub(crate) fn is_blue(picture: &RgbImage) -> bool {
    let [red, _, blue] = picture.get_pixel(SIDE / 2, SIDE * 25 / 32).0.map(f64::from);
    blue > 1.5 * red
}

pub(crate) fn same(a: &RgbImage, b: &RgbImage) -> bool {
    changed_pixels(a, b, PICTURE, 0) == 0
}

pub(crate) fn lights(path: &Path) -> usize {
    Scene::load(path.to_str().unwrap(), &LoadOptions::default()).unwrap().lights.len()
}

#[test]
fn a_model_alone_is_exposed_when_all_its_light_is_there() {
    let display = Display::start();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("room.obj"), ROOM).unwrap();
    let settings = ["entry_points=2000", "cache_points=200", "gather_rays=16", "cells=8"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.args(["demo", "room.obj", "--size", SIZE]).current_dir(folder.path());
    for setting in settings {
        command.args(["--set", &format!("quality.{setting}")]);
    }
    let demo = Demo::run(Some(&display), command);
    let line = demo.wait_for_line("lightpaths: exposed by ", READY);
    let stops = line.rsplit(' ').next().and_then(|stops| stops.parse::<f32>().ok());
    assert!(stops.is_some_and(|stops| stops != 0.0), "{line}");
}

/// A window that is left alone shows own records.
#[test]
fn at_rest_the_picture_is_that_of_render() {
    let display = Display::start();
    let text = scene(WHITE).replace("record_error = 1", "record_error = 0.02");
    let desk = Desk::open_scene(&display, &text.replace("gather_rays = 16", "gather_rays = 256"));
    desk.hide_panels();
    let mut number = 0;
    let shown = until("own records", SOON, || {
        // A key is an event, after which the window waits for a second.
        std::thread::sleep(Duration::from_secs(3));
        number += 1;
        desk.demo.client().tap(&[keys::CONTROL], keys::of('p'));
        let file = desk.path(&format!("s-edited-{number:03}.exr"));
        until("saved picture", SOON, || file.exists().then_some(()));
        let shown = lightpaths::image::read(&file, None).unwrap();
        let options = LoadOptions { size: Some(shown.size), ..LoadOptions::default() };
        let scene = Scene::load(desk.path("s.toml").to_str().unwrap(), &options).unwrap();
        let context = Context::new(&ContextOptions::default()).unwrap();
        let mut renderer = Renderer::new(&context, scene, &mut Silent).unwrap();
        renderer.frame().unwrap();
        let plain = renderer.layer(Layer::Beauty).unwrap();
        assert!(renderer.refine().unwrap() > 0);
        renderer.frame().unwrap();
        let refined = renderer.layer(Layer::Beauty).unwrap();
        assert!(plain != refined && (shown.pixels == refined || shown.pixels == plain));
        (shown.pixels == refined).then_some(shown)
    });
    assert_eq!(shown.size[0], SIDE);
    close(&desk.demo);
}

#[test]
fn a_scene_without_edits_is_loaded_again_and_that_can_be_taken_back() {
    let display = Display::start();
    let desk = Desk::open(&display);
    let before = settled(&desk.demo);
    desk.write("[[model]\n", REFUSED);
    assert!(same(&before, &settled(&desk.demo)), "what cannot be read changes nothing");
    std::fs::rename(desk.path("s.toml"), desk.path("away")).unwrap();
    desk.demo.wait_for_line("lightpaths: s.toml is gone", SOON);
    assert!(same(&before, &settled(&desk.demo)), "nor does a file that is gone");

    desk.reloads(|| std::fs::write(desk.path("s.toml"), scene(BLUE)).unwrap());
    let blue = settled(&desk.demo);
    assert!(is_blue(&blue) && !is_blue(&before));
    desk.undo();
    let undone = changed(&desk.demo, &blue);
    assert!(same(&before, &undone), "lit as before");
    desk.demo.client().tap(&[keys::CONTROL, keys::SHIFT], keys::of('z'));
    assert!(same(&blue, &changed(&desk.demo, &undone)));
    // The document equals the files on disk, so no question appears.
    desk.reloads(|| std::fs::write(desk.path("room.obj"), format!("{ROOM}\n")).unwrap());
    assert_eq!(desk.count(ASKED), 0);
    close(&desk.demo);
}

#[test]
fn edits_outlive_every_change_on_disk_until_there_is_an_answer() {
    let display = Display::start();
    let desk = Desk::open(&display);
    let before = settled(&desk.demo);
    desk.demo.client().tap(&[], keys::of('l'));
    let mine = changed(&desk.demo, &before);
    desk.write(&scene(BLUE), ASKED);
    assert!(same(&mine, &settled(&desk.demo)), "nothing happens before there is an answer");
    // Changed again, broken, repaired, removed, and back again.
    desk.write(&scene(RED), ASKED);
    desk.write("[[model]\n", REFUSED);
    until("no question", SOON, || (!shows_question(&desk.demo.capture())).then_some(()));
    desk.write(&scene(BLUE), ASKED);
    desk.answered("lightpaths: s.toml is gone", || std::fs::remove_file(desk.path("s.toml")).unwrap());
    desk.write(&scene(BLUE), ASKED);
    assert!(same(&mine, &settled(&desk.demo)), "my edits are back");

    desk.answered("lightpaths: your edits are kept", || desk.answer(KEEP_MINE));
    assert!(same(&mine, &settled(&desk.demo)) && !shows_question(&desk.demo.capture()));
    assert_eq!(desk.count(LOADED), 0);

    desk.write(&scene(BLUE), ASKED);
    desk.reloads(|| desk.answer(KEEP_BOTH));
    assert_eq!(lights(&desk.path("s-mine.toml")), 2, "mine, saved");
    assert_eq!(std::fs::read_to_string(desk.path("s.toml")).unwrap(), scene(BLUE), "theirs, untouched");
    let theirs = settled(&desk.demo);
    assert!(is_blue(&theirs) && !shows_question(&theirs));

    desk.undo();
    assert!(same(&mine, &changed(&desk.demo, &theirs)), "mine is one step back");
    desk.write(&scene(RED), ASKED);
    desk.reloads(|| desk.answer(RELOAD));
    let red = settled(&desk.demo);
    desk.undo();
    assert!(same(&mine, &changed(&desk.demo, &red)), "even what was discarded is one step back");
    assert!(!desk.path("s-mine-002.toml").exists());
    close(&desk.demo);
}

/// Position of the answers about edits of a window that has crashed.
pub(crate) const BRING_BACK: Point = (60, 42);
const DELETE: Point = (160, 42);
pub(crate) const LEFT: &str = "lightpaths: s.toml has edits of the last time that were not saved";

#[test]
fn edits_outlive_a_crash() {
    let display = Display::start();
    let desk = Desk::open(&display);
    let autosave = "s-autosave.toml";
    let before = settled(&desk.demo);
    assert!(!desk.path(autosave).exists());
    desk.demo.client().tap(&[], keys::of('l'));
    let mine = changed(&desk.demo, &before);
    assert_eq!(lights(&desk.path(autosave)), 2);
    // What is taken back is not unsaved.
    desk.undo();
    changed(&desk.demo, &mine);
    until("no autosave", SOON, || (!desk.path(autosave).exists()).then_some(()));
    desk.demo.client().tap(&[], keys::of('l'));
    changed(&desk.demo, &before);

    let desk = desk.crash(&display);
    assert_eq!(desk.count(LEFT), 1);
    assert!(same(&before, &settled(&desk.demo)), "nothing happens before there is an answer");
    desk.answered("lightpaths: the edits of the last time are back", || desk.answer(BRING_BACK));
    assert!(same(&mine, &changed(&desk.demo, &before)), "they are back");
    assert_eq!(lights(&desk.path(autosave)), 2, "and still not saved");

    // Edits before there is an answer replace nothing.
    let desk = desk.crash(&display);
    desk.demo.client().tap(&[], keys::of('o'));
    desk.demo.wait_for_line("lightpaths: the edits of the last time are in s-rescued-001.toml", SOON);
    assert_eq!((lights(&desk.path("s-rescued-001.toml")), lights(&desk.path(autosave))), (2, 1));

    let desk = desk.crash(&display);
    desk.answered("lightpaths: the edits of the last time are deleted", || desk.answer(DELETE));
    assert!(!desk.path(autosave).exists());
    assert!(same(&before, &settled(&desk.demo)));
    close(&desk.demo);
}

#[test]
fn what_differs_between_disk_and_edits_is_listed() {
    let display = Display::start();
    let desk = Desk::open(&display);
    let before = settled(&desk.demo);
    desk.demo.client().tap(&[], keys::of('l'));
    changed(&desk.demo, &before);
    desk.write(&scene(BLUE), ASKED);
    desk.answer(WHAT_DIFFERS);
    until("lines", SOON, || {
        (lines_that_differ(&desk.demo.capture()).into_iter().min() > Some(100)).then_some(())
    });
    settled(&desk.demo);
    let [disk, mine] = lines_that_differ(&desk.demo.capture());
    // The added light's lines go, and the intensity's stay.
    desk.undo();
    let left = until("fewer lines", SOON, || {
        let left = lines_that_differ(&desk.demo.capture());
        (left[1] < mine / 2).then_some(left)
    });
    assert!(left[0] > disk / 2 && left[1] > 100, "{left:?}");
    desk.answered("lightpaths: your edits are kept", || desk.answer(KEEP_MINE));
    until("no lines", SOON, || (lines_that_differ(&desk.demo.capture())[0] == 0).then_some(()));
    close(&desk.demo);
}

#[test]
fn a_room_without_lights_outlives_a_crash() {
    let display = Display::start();
    let desk = Desk::open_in_view(&display);
    let lit = settled(&desk.demo);
    desk.demo.click(1, desk.gizmo());
    desk.demo.client().tap(&[], keys::of('x'));
    let dark = changed(&desk.demo, &lit);
    assert_eq!(lights(&desk.path("s-autosave.toml")), 0);
    let desk = desk.crash(&display);
    desk.answered("lightpaths: the edits of the last time are back", || desk.answer(BRING_BACK));
    desk.hide_panels();
    assert!(same(&dark, &settled(&desk.demo)));
    close(&desk.demo);
}

#[test]
fn an_autosave_that_failed_is_tried_again() {
    let display = Display::start();
    let desk = Desk::open(&display);
    let before = settled(&desk.demo);
    let autosave = desk.path("s-autosave.toml");
    std::fs::create_dir(&autosave).unwrap();
    let refused = "lightpaths: this edit is not kept in case of a crash";
    desk.answered(refused, || desk.demo.client().tap(&[], keys::of('l')));
    let one = changed(&desk.demo, &before);
    std::fs::remove_dir(&autosave).unwrap();
    desk.demo.client().tap(&[], keys::of('l'));
    changed(&desk.demo, &one);
    assert_eq!(lights(&autosave), 3);
    assert_eq!(desk.count(refused), 1, "not said in every frame");
    close(&desk.demo);
}

#[test]
fn a_drag_ends_where_the_window_shrinks_under_it_or_is_minimised() {
    let display = Display::start();
    let desk = Desk::open_in_view(&display);
    let client = desk.demo.client();
    let autosave = desk.path("s-autosave.toml");
    let (x, y) = desk.gizmo();
    for is_minimised in [false, true] {
        let before = settled(&desk.demo);
        client.move_to((x, y));
        client.press(1);
        for step in 1..=8 {
            client.move_to((x + 5 * step, y + 2 * step));
        }
        desk.demo.wait_for_change(&before, PICTURE, SOON);
        if is_minimised {
            client.hide();
            client.release(1);
            client.show();
        } else {
            client.resize((SIDE / 8, SIDE / 8));
            until("the smaller window", SOON, || (client.size().0 == SIDE / 8).then_some(()));
            client.release(1);
        }
        until("autosave", SOON, || autosave.exists().then_some(()));
        client.resize((SIDE, SIDE));
        desk.demo.assert_presents(SOON);
        desk.undo();
        until("no autosave", SOON, || (!autosave.exists()).then_some(()));
        assert!(same(&before, &settled(&desk.demo)), "one step back");
    }
    close(&desk.demo);
}

#[test]
fn the_windows_own_save_is_no_change_and_replaces_nothing_unseen() {
    let display = Display::start();
    let desk = Desk::open(&display);
    // The window saves the scene to the scene's own file.
    std::os::unix::fs::symlink("s.toml", desk.path("s-edited.toml")).unwrap();
    let before = settled(&desk.demo);
    desk.demo.client().tap(&[], keys::of('l'));
    changed(&desk.demo, &before);
    desk.answered("lightpaths: saved s-edited.toml", || desk.save());
    assert_eq!(lights(&desk.path("s.toml")), 2);
    // A saved edit does not count as unsaved.
    desk.reloads(|| std::fs::write(desk.path("s.toml"), scene(BLUE)).unwrap());
    assert_eq!((desk.count(LOADED), desk.count(ASKED)), (1, 0), "the own save is no change");

    let blue = settled(&desk.demo);
    desk.demo.client().tap(&[], keys::of('l'));
    changed(&desk.demo, &blue);
    desk.write(&scene(RED), ASKED);
    desk.answered("lightpaths: s-edited.toml: has changed on disk", || desk.save());
    assert_eq!(std::fs::read_to_string(desk.path("s.toml")).unwrap(), scene(RED), "theirs is still there");
    desk.answered("lightpaths: your edits are kept", || desk.answer(KEEP_MINE));
    desk.answered("lightpaths: saved s-edited.toml", || desk.save());
    assert_eq!(lights(&desk.path("s.toml")), 2, "mine, knowingly");
    close(&desk.demo);
}
