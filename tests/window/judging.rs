//! Tone curves, stripes, automatic exposure and snapshots in the window.

use image::RgbImage;
use std::path::Path;
use std::process::Command;

use crate::demo::Demo;
use crate::display::Display;
use crate::keys;
use crate::picture::{Area, changed_pixels, mean_difference};
use crate::scenarios::{
    BOX, LEFT, PICTURE, READY, RIGHT, SIDE, SOON, changed, close, drag_light, open_in, open_with, settled,
};
use crate::until;

/// Stripes on clipped and on black pixels.
const ON_WHITE: [u8; 3] = [0xe0, 0x10, 0x30];
const ON_BLACK: [u8; 3] = [0x20, 0x70, 0xff];

fn tap(demo: &Demo, key: char) {
    demo.client().tap(&[], keys::of(key));
}

fn opened(path: &Path) -> RgbImage {
    image::open(path).unwrap().into_rgb8()
}

/// The area below the marks of the light.
const BELOW: Area = Area { y: 300, height: SIDE - 300, ..PICTURE };

/// That area of an image.
fn below(image: &RgbImage) -> RgbImage {
    image::imageops::crop_imm(image, 0, BELOW.y, SIDE, BELOW.height).to_image()
}

#[test]
fn tone_curves_and_stripes_are_those_of_the_saved_picture() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let demo = open_in(&display, folder.path(), "box");
    tap(&demo, 'p');
    demo.client().resize((SIDE, SIDE));
    for _ in 0..6 {
        tap(&demo, '.');
    }
    let home = settled(&demo);
    // All curves, and back.
    let mut seen = vec![home.clone()];
    for _ in 1..5 {
        tap(&demo, 't');
        let toned = changed(&demo, seen.last().unwrap());
        assert!(seen.iter().all(|other| mean_difference(&toned, other, PICTURE) > 1.0));
        seen.push(toned);
    }
    tap(&demo, 't');
    assert_eq!(changed_pixels(&home, &changed(&demo, &seen[4]), PICTURE, 0), 0, "back to the first curve");

    tap(&demo, 't');
    let clipped = changed(&demo, &home);
    tap(&demo, 'z');
    let striped = changed(&demo, &clipped);
    let mut count = 0;
    for (x, y, codes) in below(&striped).enumerate_pixels() {
        let before = clipped.get_pixel(x, BELOW.y + y).0;
        let rule = before.iter().any(|code| *code >= 254);
        if codes.0 == ON_WHITE {
            assert!(rule, "({x}, {y}): {before:?}");
            count += 1;
        } else {
            assert!(codes.0 == before || codes.0 == ON_BLACK, "({x}, {y}): {codes:?}, {before:?}");
        }
    }
    assert!(count > 1000, "{count} pixels");
    // What is saved has no stripes.
    demo.client().tap(&[keys::CONTROL], keys::of('p'));
    let saved = folder.path().join("box-edited-001.png");
    until("saved picture", SOON, || saved.exists().then_some(()));
    demo.wait_for_answer();
    assert!(below(&opened(&saved)) == below(&clipped));
    tap(&demo, 'z');
    assert_eq!(changed_pixels(&clipped, &changed(&demo, &striped), PICTURE, 0), 0, "without stripes");
    close(&demo);
}

#[test]
fn the_automatic_exposure_is_that_of_render() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let demo = open_with(&display, &["--exposure", "-3"]);
    let dark = settled(&demo);
    tap(&demo, 'k');
    let exposed = changed(&demo, &dark);
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    let file = folder.path().join("a.png");
    let arguments = ["-o", file.to_str().unwrap(), "--exposure", "auto"];
    let ended = command.arg("render").args(BOX).args(arguments).output().unwrap();
    assert!(ended.status.success(), "{ended:?}");
    assert_eq!(changed_pixels(&exposed, &opened(&file), BELOW, 0), 0);
    // Locked, it does not follow the light.
    tap(&demo, 'k');
    drag_light(&demo);
    tap(&demo, 'o');
    let off = changed(&demo, &exposed);
    assert!(
        off.enumerate_pixels().all(|(_, y, codes)| y < BELOW.y || codes.0 == [0; 3]),
        "no light is black"
    );
    close(&demo);
}

#[test]
fn a_snapshot_stands_right_of_the_wipe_and_on_the_sheet() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let demo = open_in(&display, folder.path(), "box");
    tap(&demo, 'p');
    demo.client().resize((SIDE, SIDE));
    let first = settled(&demo);
    let mark = demo.mark();
    tap(&demo, 'n');
    demo.wait_for_line_since(mark, "lightpaths: kept as Snapshot 1", READY);
    drag_light(&demo);
    let second = changed(&demo, &first);
    tap(&demo, 'b');
    let both = changed(&demo, &second);
    let (left, right) =
        (Area { width: SIDE / 2 - 8, ..LEFT }, Area { x: SIDE / 2 + 8, width: SIDE / 2 - 8, ..RIGHT });
    assert_eq!(changed_pixels(&second, &both, left, 0), 0, "the live picture");
    // Marks of lights lie over both.
    assert!(changed_pixels(&first, &both, right, 0) < 1000, "the snapshot");
    assert!(mean_difference(&second, &both, right) > 1.0);
    tap(&demo, 'b');
    assert_eq!(changed_pixels(&second, &changed(&demo, &both), PICTURE, 0), 0);

    // Two pictures side by side, without marks of lights.
    tap(&demo, 'n');
    demo.wait_for_line_since(mark, "lightpaths: kept as Snapshot 2", SOON);
    tap(&demo, 'j');
    demo.wait_for_line_since(mark, "lightpaths: saved box-edited-sheet-001.png", SOON);
    let sheet = opened(&folder.path().join("box-edited-sheet-001.png"));
    assert_eq!(sheet.dimensions(), (2 * (SIDE + 16) + 16, SIDE + 28 + 32));
    for (number, shown) in [(0, &first), (1, &second)] {
        let x = 16 + number * (SIDE + 16);
        let tile = image::imageops::crop_imm(&sheet, x, 16, SIDE, SIDE).to_image();
        assert_eq!(changed_pixels(&tile, shown, BELOW, 0), 0, "picture {number}");
        let name = Area { x, y: 16 + SIDE, width: 120, height: 28 };
        assert!(crate::picture::colours(&sheet, name) > 5, "name {number}");
    }
    close(&demo);
}
