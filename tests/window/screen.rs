//! Full-screen windows, and screens of many small pixels.

use std::process::Command;

use image::RgbImage;

use crate::client::Point;
use crate::demo::Demo;
use crate::display::{Display, SCREEN};
use crate::keys;
use crate::manager::Manager;
use crate::picture::{Area, changed_pixels, colours};
use crate::scenarios::{BOX, READY, SIDE, SOON, changed, close, gizmo, settled};
use crate::until;

fn start<'a>(display: &'a Display, scale: &str, extra: &[&str]) -> Demo<'a> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.arg("demo").args(BOX).args(extra);
    let demo = Demo::run_scaled(Some(display), command, scale);
    demo.wait_for_line("lightpaths: ready", READY);
    demo.client();
    demo
}

/// The picture without the panels.
fn part(window: &RgbImage) -> RgbImage {
    image::imageops::crop_imm(window, 0, 0, SIDE, SIDE).to_image()
}

fn has_size(demo: &Demo, size: (u32, u32)) {
    until(&format!("window of {size:?}"), SOON, || (demo.client().size() == size).then_some(()));
}

#[test]
fn the_window_fills_the_screen_and_does_not() {
    let display = Display::start();
    let _manager = Manager::start(&display);
    let demo = start(&display, "1", &["--fullscreen"]);
    has_size(&demo, SCREEN);
    demo.assert_presents(SOON);
    assert_eq!(demo.client().place(), (0, 0));
    demo.client().tap(&[], keys::function(11));
    has_size(&demo, (SIDE + 310, SIDE));
    demo.assert_presents(SOON);
    demo.client().tap(&[], keys::function(11));
    has_size(&demo, SCREEN);
    demo.assert_presents(SOON);
    close(&demo);
}

#[test]
fn on_a_screen_of_small_pixels_panels_are_twice_as_large_and_the_picture_is_as_fine() {
    const WIDTH: u32 = 2 * 310;
    let display = Display::start();
    let plain = start(&display, "1", &[]);
    let alone = part(&settled(&plain));
    close(&plain);
    let demo = start(&display, "2", &[]);
    has_size(&demo, (SIDE + WIDTH, SIDE));
    let picture = Area { x: 0, y: 160, width: SIDE, height: SIDE - 160 };
    let before = settled(&demo);
    // A pixel of the picture is a pixel of the screen. Gizmos are larger, and the rest is the same.
    let below = Area { y: 300, height: SIDE - 300, ..picture };
    assert_eq!(changed_pixels(&part(&before), &alone, below, 0), 0, "the same picture");
    let panels = Area { x: SIDE, y: 0, width: WIDTH, height: SIDE };
    assert!(colours(&before, panels) > 100, "panels");

    // The pointer finds the light where it is drawn.
    let (x, y): Point = gizmo();
    demo.drag(1, (x, y), (x + 60, y), 12);
    let after = changed(&demo, &before);
    let fraction = changed_pixels(&before, &after, below, 2) as f64 / below.pixels() as f64;
    assert!(fraction > 0.1, "{fraction}");
    demo.client().tap(&[keys::CONTROL], keys::of('z'));
    let undone = changed(&demo, &after);
    assert_eq!(changed_pixels(&before, &undone, picture, 0), 0, "undone");
    close(&demo);
}
