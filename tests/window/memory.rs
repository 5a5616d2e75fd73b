//! A device that runs out of memory or is lost during edits.

use std::path::{Path, PathBuf};
use std::process::Command;

use image::RgbImage;
use lightpaths::scene::{LoadOptions, Scene};

use crate::demo::{Demo, Stream};
use crate::display::Display;
use crate::faults::Faults;
use crate::keys;
use crate::picture::{Area, changed_pixels};
use crate::scenarios::{BOX, PICTURE, READY, SIDE, SOON, changed, close, device_memory, drag_light, settled};

/// The picture above the alarm.
const ABOVE: Area = Area { height: PICTURE.height - 48, ..PICTURE };

fn open_in<'a>(display: &'a Display, folder: &Path, faults: &Faults) -> Demo<'a> {
    let demo = start_in(display, folder, faults, &[]);
    demo.wait_for_line("lightpaths: ready", READY);
    demo
}

fn start_in<'a>(display: &'a Display, folder: &Path, faults: &Faults, arguments: &[&str]) -> Demo<'a> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.arg("demo").args(BOX).args(arguments).current_dir(folder);
    faults.afflict(&mut command);
    let demo = Demo::run(Some(display), command);
    demo.client();
    demo
}

/// Whether there is text in the alarm's colour, which the Box does not have.
fn shows_alarm(window: &RgbImage) -> bool {
    let part = image::imageops::crop_imm(window, 0, SIDE - 48, SIDE, 48).to_image();
    let is_orange = |[r, g, b]: [u8; 3]| r > 180 && (110..200).contains(&g) && b < 60;
    part.pixels().filter(|pixel| is_orange(pixel.0)).count() > 100
}

fn load(file: &Path) -> Scene {
    Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap()
}

/// In one window: sizes and edits that exceed the device's memory, and the loss of the device.
#[test]
fn what_does_not_fit_is_taken_back_and_a_lost_device_leaves_the_edited_scene_behind() {
    let (display, folder, faults) = (Display::start(), tempfile::tempdir().unwrap(), Faults::new());
    let demo = open_in(&display, folder.path(), &faults);
    an_edit_that_does_not_fit(&demo, folder.path(), &faults);
    a_size_that_does_not_fit(&demo, &faults);
    a_lost_device(&demo, folder.path(), &faults);
}

fn a_size_that_does_not_fit(demo: &Demo, faults: &Faults) {
    const LARGE: (u32, u32) = (1500, 900);
    // Panels have their own memory.
    demo.client().tap(&[], keys::of('p'));
    demo.client().resize((SIDE, SIDE));
    demo.assert_presents(SOON);
    let before = settled(demo);
    let memory = device_memory(demo);
    // More than the memory in use, less than a picture of this size takes.
    faults.strike(demo, "vkAllocateMemory:1+:MAX=150000000", || demo.client().resize(LARGE));
    demo.assert_presents(SOON);
    settled(demo);
    assert_eq!(device_memory(demo), memory, "the picture has kept its size");
    demo.client().resize((SIDE, SIDE));
    demo.assert_presents(SOON);
    let after = settled(demo);
    assert_eq!(changed_pixels(&before, &after, ABOVE, 0), 0, "as before");
    // The program tries again.
    faults.set("");
    demo.client().resize(LARGE);
    demo.assert_presents(SOON);
    settled(demo);
    assert!(device_memory(demo) > memory, "now it fits");
    demo.client().resize((SIDE, SIDE));
    demo.assert_presents(SOON);
}

fn an_edit_that_does_not_fit(demo: &Demo, folder: &Path, faults: &Faults) {
    let start = settled(demo);
    drag_light(demo);
    let before = changed(demo, &start);
    // Another light needs its own form factors and irradiance buffers.
    faults.strike(demo, "vkCreateBuffer:1:VK_ERROR_OUT_OF_DEVICE_MEMORY", || {
        demo.client().tap(&[], keys::of('l'));
    });
    let after = settled(demo);
    assert_eq!(changed_pixels(&before, &after, ABOVE, 0), 0, "what was shown before");
    assert!(shows_alarm(&after) && !shows_alarm(&before), "a line says why");

    // The scene can be saved, with the earlier edits.
    demo.client().tap(&[keys::CONTROL], keys::of('s'));
    let file = folder.join("box-edited.toml");
    let saved = crate::until("saved scene", SOON, || file.exists().then(|| load(&file)));
    let scene = Scene::load("box", &LoadOptions::default()).unwrap();
    assert_eq!(saved.lights.len(), 1, "no second light");
    assert_ne!(saved.lights[0].kind, scene.lights[0].kind, "the light was dragged");

    // The light that did not fit is no undo step: undo reverts the drag.
    faults.set("");
    demo.client().tap(&[keys::CONTROL], keys::of('z'));
    let undone = changed(demo, &after);
    assert_eq!(changed_pixels(&start, &undone, ABOVE, 0), 0, "undone");
    // With enough memory, the light fits.
    demo.client().tap(&[], keys::of('l'));
    changed(demo, &undone);
}

#[test]
fn direct_light_remains_where_light_paths_do_not_fit() {
    let (display, folder, faults) = (Display::start(), tempfile::tempdir().unwrap(), Faults::new());
    // Direct light takes 40 MB, these light paths more than 65 MB.
    faults.set("vkAllocateMemory:1+:MAX=60000000");
    let demo = start_in(&display, folder.path(), &faults, &["--set", "quality.entry_points=500000"]);
    demo.wait_for_line("faults: vkAllocateMemory,", READY);
    let before = settled(&demo);
    assert!(shows_alarm(&before), "a line says why");
    drag_light(&demo);
    changed(&demo, &before);
    demo.client().tap(&[keys::CONTROL], keys::of('s'));
    crate::until("saved scene", SOON, || folder.path().join("box-edited.toml").exists().then_some(()));
    close(&demo);
    assert!(!demo.lines(Stream::Err).iter().any(|line| line.starts_with("lightpaths: ready")));
}

/// The file in which the program reports to have saved the edited scene.
fn rescued(demo: &Demo, folder: &Path) -> Option<PathBuf> {
    let lines = demo.lines(Stream::Err);
    let line = lines.iter().find_map(|line| line.strip_prefix("lightpaths: the edited scene is in "));
    line.map(|line| folder.join(line))
}

#[test]
fn a_signal_leaves_the_edited_scene_behind() {
    let original = Scene::load("box", &LoadOptions::default()).unwrap();
    // Tests without a window cover all signals.
    for (signal, is_edited) in [("TERM", true), ("INT", false)] {
        let (display, folder, faults) = (Display::start(), tempfile::tempdir().unwrap(), Faults::new());
        let demo = open_in(&display, folder.path(), &faults);
        let before = settled(&demo);
        if is_edited {
            drag_light(&demo);
            changed(&demo, &before);
        }
        let sent = Command::new("kill").args([format!("-{signal}"), demo.process().to_string()]).status();
        assert!(sent.unwrap().success());
        assert_eq!(demo.exit_code(SOON), None, "the signal ends it");
        let left = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(
            left,
            usize::from(is_edited),
            "{signal}: one scene, if it was edited, and no half of anything"
        );
        let file = rescued(&demo, folder.path());
        assert_eq!(file.is_some(), is_edited, "{signal}: {:?}", demo.lines(Stream::Err));
        if let Some(file) = file {
            assert_ne!(
                load(&file).lights[0].kind,
                original.lights[0].kind,
                "{signal}: the light was dragged"
            );
        }
    }
}

/// The device is lost after a light was added and not saved.
fn a_lost_device(demo: &Demo, folder: &Path, faults: &Faults) {
    faults.strike(demo, "vkQueueSubmit2KHR:1+:VK_ERROR_DEVICE_LOST", || {
        demo.client().tap(&[], keys::of('2'));
    });
    assert_eq!(demo.exit_code(SOON), Some(4));
    let lines = demo.lines(Stream::Err);
    let file = rescued(demo, folder).unwrap_or_else(|| panic!("{lines:?}"));
    assert_eq!(load(&file).lights.len(), 2, "the light that was added last");
    assert!(
        lines.iter().any(|line| line.contains("ERROR_DEVICE_LOST") || line.contains("device has been lost")),
        "{lines:?}"
    );
}
