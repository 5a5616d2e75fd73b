//! Actions of a user in the window.
//!
//! Each test starts the program on its own screen. `LIGHTPATHS_MONKEY_ACTIONS` and
//! `LIGHTPATHS_MONKEY_SEED` set the monkey's number of actions and seed.

use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::Command;
use std::str::FromStr;

use image::RgbImage;
use lightpaths::scene::film::Film;
use lightpaths::scene::{LoadOptions, Scene};
use lightpaths::types::View;

use crate::client::Point;
use crate::demo::{Demo, Stream};
use crate::display::Display;
use crate::keys::{self, Chord};
use crate::monkey::Monkey;
use crate::picture::{Area, changed_pixels, mean_difference};
use crate::until;

pub const SIDE: u32 = 416;
/// The size as an argument.
pub const SIZE: &str = "416x416";
/// Few light paths and no samples of edge pixels: these tests are about the window.
pub const BOX: [&str; 16] = [
    "box",
    "--preset",
    "draft",
    "--size",
    SIZE,
    "--validation",
    "--set",
    "quality.entry_points=5000",
    "--set",
    "quality.cache_points=500",
    "--set",
    "quality.gather_rays=16",
    "--set",
    "quality.cells=16",
    "--set",
    "quality.edge_samples=0",
];

/// The area of the picture without panels and numbers that change by themselves.
pub const PICTURE: Area = Area { x: 0, y: 160, width: SIDE, height: SIDE - 160 };
pub const LEFT: Area = Area { width: SIDE / 2, ..PICTURE };
pub const RIGHT: Area = Area { x: SIDE / 2, ..LEFT };

/// Position of the pointer during captures, so that no item is highlighted in one capture and not
/// in the other.
pub const ASIDE: Point = (SIDE as i32 - 2, SIDE as i32 - 2);

pub use crate::HANG as READY;
pub use crate::HANG as SOON;

/// The Box in a window that is ready for input. Panels are hidden, so that the picture
/// fills the window.
pub fn open(display: &Display) -> Demo<'_> {
    open_with(display, &[])
}

/// The same with more arguments.
pub fn open_with<'a>(display: &'a Display, arguments: &[&str]) -> Demo<'a> {
    let demo = Demo::start(display, &[&BOX[..], arguments].concat());
    demo.wait_for_line("lightpaths: ready", READY);
    let (width, height) = demo.client().size();
    assert!(width > SIDE && height == SIDE, "a picture of that size, and panels beside it");
    demo.client().tap(&[], keys::of('p'));
    demo.client().resize((SIDE, SIDE));
    demo.assert_presents(SOON);
    demo
}

/// The picture when all input is processed.
pub fn settled(demo: &Demo) -> RgbImage {
    demo.client().move_to(ASIDE);
    demo.settled(Some(PICTURE))
}

/// The settled picture after a change from `before`.
pub fn changed(demo: &Demo, before: &RgbImage) -> RgbImage {
    let after = settled(demo);
    assert!(changed_pixels(before, &after, PICTURE, 0) > 0, "the picture changes");
    after
}

/// Position of the light's gizmo in a viewport that fills the window.
pub fn gizmo() -> Point {
    gizmo_of("box")
}

/// Position of the gizmo of the first light of a scene.
pub fn gizmo_of(scene: &str) -> Point {
    let options = LoadOptions { size: Some([SIDE; 2]), ..LoadOptions::default() };
    let scene = Scene::load(scene, &options).unwrap();
    let view = View::from(&scene.cameras[0]);
    let towards = scene.lights[0].kind.position().unwrap() - view.position;
    let towards = towards / towards.dot(view.forward);
    let [x, y] = [view.right, -view.up].map(|axis| towards.dot(axis) / axis.length_squared());
    [x, y].map(|place| (0.5 * (place + 1.0) * SIDE as f32).round() as i32).into()
}

/// Drags the light 60 points to the right.
pub fn drag_light(demo: &Demo) {
    let (x, y) = gizmo();
    demo.drag(1, (x, y), (x + 60, y), 12);
}

fn no_complaints(demo: &Demo) {
    for line in demo.lines(Stream::Err) {
        assert!(!line.starts_with("lightpaths: validation") && !line.contains("panicked"), "{line}");
    }
}

/// What the window prints if there are unsaved edits.
pub const ASKS: &str = "lightpaths: unsaved edits";

/// Closes the window without saving and asserts a clean end.
pub fn close(demo: &Demo) {
    let mark = demo.mark();
    demo.client().close();
    if demo.asks(mark, ASKS) {
        demo.client().tap(&[keys::CONTROL, keys::SHIFT], keys::of('q'));
    }
    assert_eq!(demo.exit_code(SOON), Some(0));
    no_complaints(demo);
}

/// Bytes of device memory, as the process reports after F10.
pub fn device_memory(demo: &Demo) -> u64 {
    let mark = demo.mark();
    demo.client().tap(&[], keys::function(10));
    let line = demo.wait_for_line_since(mark, "lightpaths: device memory ", SOON);
    let count = line.strip_prefix("lightpaths: device memory ").and_then(|rest| rest.strip_suffix(" bytes"));
    count.unwrap_or_else(|| panic!("{line}")).parse().unwrap()
}

/// A number from the environment. An invalid one is an error; the default does not replace it.
pub fn setting<T: FromStr>(name: &str, default: T) -> T {
    std::env::var(name).map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name}={text}")))
}

/// The Box with its panels, in its own folder.
pub fn open_in<'a>(display: &'a Display, folder: &Path, scene: &str) -> Demo<'a> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.arg("demo").arg(scene).args(&BOX[1..]).current_dir(folder);
    let demo = Demo::run(Some(display), command);
    demo.wait_for_line("lightpaths: ready", READY);
    demo
}

fn a_material_is_chosen_by_a_click_edited_and_taken_back(demo: &Demo) {
    // Position of the first channel of the selected material's albedo in the panel.
    const ALBEDO: Point = (SIDE as i32 + 178, 175);
    demo.client().click(1, (203, 333));
    let before = settled(demo);
    demo.drag(1, ALBEDO, (ALBEDO.0 - 60, ALBEDO.1), 12);
    let after = changed(demo, &before);
    let teapot = Area { x: 155, y: 309, width: 96, height: 48 };
    assert!(mean_difference(&before, &after, teapot) > 4.0, "the teapot has another colour");
    demo.client().tap(&[keys::CONTROL], keys::of('z'));
    let undone = changed(demo, &after);
    assert_eq!(changed_pixels(&before, &undone, PICTURE, 0), 0, "undone");
}

#[test]
fn a_window_with_unsaved_edits_asks_before_it_closes() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let demo = open_in(&display, folder.path(), "box");
    let client = demo.client();
    let asked = |by: &dyn Fn()| {
        let mark = demo.mark();
        by();
        demo.wait_for_line_since(mark, ASKS, SOON);
        demo.wait_for_answer();
        assert!(demo.is_running());
    };
    let quit = || client.tap(&[keys::CONTROL], keys::of('q'));
    // A new light.
    client.tap(&[], keys::of('l'));
    asked(&|| client.close());
    client.tap(&[], keys::ESCAPE);
    asked(&quit);
    // Without the edit there is nothing to ask.
    client.tap(&[keys::CONTROL], keys::of('z'));
    demo.wait_for_answer();
    client.tap(&[], keys::of('l'));
    asked(&quit);
    client.tap(&[keys::CONTROL], keys::of('s'));
    until("the saved scene", SOON, || folder.path().join("box-edited.toml").exists().then_some(()));
    demo.wait_for_answer();
    quit();
    assert_eq!(demo.exit_code(SOON), Some(0));
    let saved = folder.path().join("box-edited.toml");
    let scene = Scene::load(saved.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(scene.lights.len(), 2);
    no_complaints(&demo);
}

#[test]
fn a_material_is_edited_and_scene_picture_and_film_are_saved_as_they_were_edited() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let demo = open_in(&display, folder.path(), "box");
    let file = |name: &str| folder.path().join(name);
    let appears = |name: &str| until(name, SOON, || file(name).exists().then_some(()));
    let before = settled(&demo);
    demo.client().tap(&[keys::CONTROL], keys::of('r'));
    drag_light(&demo);
    let after = changed(&demo, &before);
    demo.client().tap(&[keys::CONTROL], keys::of('r'));
    appears("box-edited-film.toml");
    demo.client().tap(&[keys::CONTROL], keys::of('s'));
    appears("box-edited.toml");
    demo.client().tap(&[keys::CONTROL], keys::of('p'));
    appears("box-edited-001.png");
    appears("box-edited-001.exr");
    a_material_is_chosen_by_a_click_edited_and_taken_back(&demo);
    close(&demo);

    let options = LoadOptions { preset: Some("draft".into()), ..LoadOptions::default() };
    let load = |spec: &str| Scene::load(spec, &options).unwrap();
    let place = |scene: &Scene| scene.lights[0].kind.position().unwrap();
    let saved = load(file("box-edited.toml").to_str().unwrap());
    let moved = place(&saved) - place(&load("box"));
    assert!(moved.length() > 0.05, "the light was dragged: {moved}");
    let (film, scene) = Film::load(file("box-edited-film.toml").to_str().unwrap(), &options).unwrap();
    let at = |frame: u32| film.state(frame).lights.first().and_then(|light| light.1.position());
    assert!(at(0).unwrap().distance(place(&scene)) < 2e-3, "it begins where the light was");
    assert!(at(film.frame_count - 1).unwrap().distance(place(&saved)) < 2e-3, "and ends where it is");
    let picture = image::open(file("box-edited-001.png")).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (SIDE, SIDE));
    let shown = image::imageops::crop_imm(&after, 0, 300, SIDE, SIDE - 300).to_image();
    let saved = image::imageops::crop_imm(&picture, 0, 300, SIDE, SIDE - 300).to_image();
    assert_eq!(
        changed_pixels(&shown, &saved, Area::from_image(&saved), 0),
        0,
        "what is saved is what was shown"
    );
}

#[test]
fn without_a_display_one_line_says_what_to_run_instead() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.args(["demo", "box"]);
    let demo = Demo::run(None, command);
    assert_eq!(demo.exit_code(SOON), Some(3));
    let lines = demo.lines(Stream::Err);
    assert_eq!((lines.len(), demo.lines(Stream::Out).len()), (1, 0), "{lines:?}");
    let names_another = lines[0].contains("lightpaths render") || lines[0].contains("film");
    assert!(lines[0].starts_with("lightpaths: ") && names_another, "{lines:?}");
}

#[test]
fn light_paths_are_kept_and_taken_from_there() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let arguments = ["--cache", folder.path().to_str().unwrap()];
    let files = || {
        let entries = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap());
        entries.map(|entry| (entry.path(), entry.metadata().unwrap().len())).collect::<Vec<_>>()
    };
    let look = || {
        let demo = open_with(&display, &arguments);
        let picture = settled(&demo);
        close(&demo);
        picture
    };
    let traced = look();
    let kept = files();
    let [(path, length)] = &kept[..] else { panic!("{kept:?}") };
    // A file that is written again has another inode.
    let identity = || std::fs::metadata(path).unwrap().ino();
    let written = identity();
    let taken = look();
    assert_eq!(changed_pixels(&traced, &taken, PICTURE, 0), 0, "from the file");
    assert_eq!(identity(), written, "nothing was traced");
    let path_bytes = std::fs::read(path).unwrap();
    std::fs::File::options().write(true).open(path).unwrap().set_len(length / 2).unwrap();
    let mended = look();
    assert_eq!(changed_pixels(&traced, &mended, PICTURE, 0), 0, "from half a file");
    assert_eq!(files(), kept);
    assert!(std::fs::read(path).unwrap() == path_bytes, "the file is whole again");
    assert_ne!(identity(), written);
}

#[test]
fn a_monkey_does_no_harm() {
    const Z: u32 = b'z' as u32;
    // No chord closes the window or opens another scene, which would take other memory.
    const CHORDS: [Chord; 29] = [
        (&[keys::CONTROL], Z),
        (&[keys::CONTROL], Z),
        (&[keys::CONTROL, keys::SHIFT], Z),
        (&[], keys::TAB),
        (&[], keys::RETURN),
        (&[], keys::ESCAPE),
        (&[], keys::DELETE),
        (&[], keys::BACKSPACE),
        (&[], keys::HOME),
        (&[], keys::END),
        (&[], keys::LEFT),
        (&[], keys::RIGHT),
        (&[], keys::UP),
        (&[], keys::DOWN),
        (&[], keys::PAGE_UP),
        (&[], keys::PAGE_DOWN),
        (&[], b'w' as u32),
        (&[], b'a' as u32),
        (&[], b's' as u32),
        (&[], b'd' as u32),
        (&[], b'1' as u32),
        (&[], b'2' as u32),
        (&[], b'4' as u32),
        (&[], b'5' as u32),
        (&[], b'6' as u32),
        (&[], b'o' as u32),
        (&[], b'f' as u32),
        (&[], keys::function(1)),
        (&[], keys::function(2)),
    ];
    let actions = setting("LIGHTPATHS_MONKEY_ACTIONS", 50);
    let display = Display::start();
    let demo = open(&display);
    // Two rounds of the same input: allocations at first use happen in the first round.
    let mut memory = [0, 1].map(|_| {
        Monkey::new(&demo, setting("LIGHTPATHS_MONKEY_SEED", 1), &CHORDS).act(actions);
        // Some lists keep the length that the camera's views needed, until the picture
        // changes its size.
        demo.client().tap(&[], keys::of('1'));
        demo.client().tap(&[], keys::HOME);
        for width in [SIDE + 64, SIDE] {
            demo.client().resize((width, SIDE));
            demo.assert_presents(SOON);
            // The picture changes its size a while after the window does.
            settled(&demo);
        }
        device_memory(&demo)
    });
    memory[0] += memory[0] / 50;
    assert!(memory[1] <= memory[0], "device memory grows: {memory:?}");
    no_complaints(&demo);
    close(&demo);
}
