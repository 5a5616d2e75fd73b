//! What the window can show besides the picture, and what moves the camera.

use std::os::unix::fs::MetadataExt;

use crate::client::Point;
use crate::demo::Demo;
use crate::display::Display;
use crate::keys;
use crate::picture::{Area, changed_pixels, mean_difference};
use crate::scenarios::{PICTURE, READY, SIDE, SOON, changed, close, open, open_with, settled};
use crate::until;

/// On a wall, off every handle.
const WALL: Point = (400, 300);

fn tap(demo: &Demo, key: char) {
    demo.client().tap(&[], keys::of(key));
}

#[test]
fn every_view_is_another_one_and_the_picture_comes_back() {
    let display = Display::start();
    let demo = open(&display);
    let picture = settled(&demo);
    let mut seen = vec![picture.clone()];
    for key in ['2', '3', '4', '5', '6'] {
        tap(&demo, key);
        if key == '6' {
            // Rays and paths of what is clicked.
            demo.client().click(1, WALL);
        }
        let view = changed(&demo, seen.last().unwrap());
        for other in &seen {
            assert!(changed_pixels(&view, other, PICTURE, 8) > 500, "view {key} shows something of its own");
        }
        seen.push(view);
    }
    tap(&demo, '1');
    let back = changed(&demo, seen.last().unwrap());
    assert_eq!(changed_pixels(&picture, &back, PICTURE, 0), 0, "the picture is what it was");
    close(&demo);
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
    // A file that is written again is another one.
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
fn the_camera_turns_flies_and_comes_home() {
    let display = Display::start();
    let demo = open(&display);
    let home = settled(&demo);
    demo.drag(1, WALL, (WALL.0 - 40, WALL.1 + 10), 6);
    let turned = changed(&demo, &home);
    assert!(mean_difference(&home, &turned, PICTURE) > 2.0, "turned");
    demo.client().scroll(WALL, 3);
    let near = changed(&demo, &turned);
    demo.client().key_down(keys::of('w'));
    demo.wait_for_change(&near, PICTURE, SOON);
    demo.client().key_up(keys::of('w'));
    let flown = changed(&demo, &near);
    demo.client().tap(&[], keys::HOME);
    let back = changed(&demo, &flown);
    assert_eq!(changed_pixels(&home, &back, PICTURE, 0), 0, "home");
    close(&demo);
}

#[test]
fn monte_carlo_stands_right_of_the_wipe_and_ours_left() {
    let display = Display::start();
    let demo = open(&display);
    let ours = settled(&demo);
    let left = Area { width: SIDE / 2 - 8, ..PICTURE };
    let right = Area { x: SIDE / 2 + 8, ..left };
    tap(&demo, 'm');
    let both = demo.wait_for_change(&ours, right, READY);
    assert_eq!(changed_pixels(&ours, &both, left, 0), 0, "ours stays");
    let differs = mean_difference(&ours, &both, right);
    assert!(differs > 0.5 && differs < 40.0, "the same light, and noise: {differs}");
    tap(&demo, 'm');
    let back = changed(&demo, &both);
    assert_eq!(changed_pixels(&ours, &back, PICTURE, 0), 0);
    // On again while the samples of before are under way.
    for _ in 0..3 {
        tap(&demo, 'm');
    }
    let again = demo.wait_for_change(&back, right, READY);
    let differs = mean_difference(&ours, &again, right);
    assert!(differs > 0.5 && differs < 40.0, "the same light, and noise: {differs}");
    close(&demo);
}

#[test]
fn a_film_plays_and_leaves_the_scene_as_it_was() {
    let display = Display::start();
    let demo = open(&display);
    let before = settled(&demo);
    let mark = demo.mark();
    tap(&demo, ' ');
    // Its teapot gets to shine, which takes other light paths.
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    let first = demo.wait_for_change(&before, PICTURE, SOON);
    let next = demo.wait_for_change(&first, PICTURE, SOON);
    demo.wait_for_change(&next, PICTURE, SOON);
    tap(&demo, ' ');
    let after = settled(&demo);
    let differs = mean_difference(&before, &after, PICTURE);
    assert!(differs < 3.0, "as it was, by other light paths: {differs}");
    close(&demo);
}

/// Processor time of a process so far, clock ticks.
fn ticks(process: u32) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    // The name in brackets may hold anything; user and system time are the 12th and 13th fields behind it.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
}

#[test]
fn a_window_left_alone_takes_no_time() {
    let display = Display::start();
    let demo = open(&display);
    settled(&demo);
    // Work is done ahead for the camera first; then a second takes a tenth of one at most. One that never rests hangs here.
    let mut before = ticks(demo.process());
    until("second of rest", SOON, || {
        std::thread::sleep(std::time::Duration::from_secs(1));
        let taken = ticks(demo.process()) - std::mem::replace(&mut before, ticks(demo.process()));
        (taken < 10).then_some(())
    });
    close(&demo);
}
