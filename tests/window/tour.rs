//! One window with many edits and undos: its picture always returns to the first one, to the byte.

use std::thread::sleep;
use std::time::Duration;

use image::RgbImage;

use crate::client::Point;
use crate::demo::{Demo, Stream};
use crate::display::Display;
use crate::keys;
use crate::picture::{Area, changed_pixels, colours, mean_difference};
use crate::scenarios::{LEFT, PICTURE, READY, RIGHT, SIDE, SOON, changed, close, drag_light, open, settled};
use crate::until;

/// A point on a wall, away from every gizmo.
const WALL: Point = (325, 244);

fn tap(demo: &Demo, key: char) {
    demo.client().tap(&[], keys::of(key));
}

/// A step in a window that shows `home`.
type Step = fn(demo: &Demo, home: &RgbImage);

const STEPS: [(&str, Step); 8] = [
    ("the Box is shown", the_box_is_shown),
    ("the light is dragged", the_light_is_dragged),
    ("every view is another one", every_view_is_another_one),
    ("the camera turns and flies", the_camera_turns_and_flies),
    ("Monte Carlo stands right of the wipe", monte_carlo_stands_right_of_the_wipe),
    ("the window takes any size and is minimised", any_size_and_minimised),
    ("sizes in quick succession", sizes_in_quick_succession),
    ("left alone", left_alone_it_takes_no_time),
];

#[test]
fn what_is_done_and_taken_back_leaves_the_picture() {
    let display = Display::start();
    let demo = open(&display);
    let home = settled(&demo);
    for (name, step) in STEPS {
        println!("{name}");
        step(&demo, &home);
        assert_eq!(
            changed_pixels(&home, &settled(&demo), PICTURE, 0),
            0,
            "{name}: the picture is what it was"
        );
    }
    a_film_plays(&demo, &home);
    close(&demo);
    let said = demo.lines(Stream::Err).iter().any(|line| line.starts_with("lightpaths: device memory "));
    assert!(said, "memory is said at the end");
}

fn the_box_is_shown(_: &Demo, home: &RgbImage) {
    assert_eq!(home.dimensions(), (SIDE, SIDE));
    for area in [LEFT, RIGHT] {
        assert!(colours(home, area) > 500, "a picture, not a plain colour: {}", colours(home, area));
    }
    // The left wall differs from the right one.
    let mirrored = image::imageops::flip_horizontal(home);
    assert!(mean_difference(home, &mirrored, PICTURE) > 4.0);
}

fn the_light_is_dragged(demo: &Demo, home: &RgbImage) {
    drag_light(demo);
    let after = changed(demo, home);
    for area in [LEFT, RIGHT] {
        let fraction = changed_pixels(home, &after, area, 2) as f64 / area.pixels() as f64;
        assert!(fraction > 0.1, "{area:?}: {fraction}");
    }
    demo.client().tap(&[keys::CONTROL], keys::of('z'));
    let undone = changed(demo, &after);
    assert_eq!(changed_pixels(home, &undone, PICTURE, 0), 0, "undone");
    demo.client().tap(&[keys::CONTROL, keys::SHIFT], keys::of('z'));
    let redone = changed(demo, &undone);
    assert_eq!(changed_pixels(&after, &redone, PICTURE, 0), 0, "redone");
    demo.client().tap(&[keys::CONTROL], keys::of('z'));
}

fn every_view_is_another_one(demo: &Demo, home: &RgbImage) {
    let mut seen = vec![home.clone()];
    for key in ['2', '3', '4', '5', '6', '8', '8'] {
        tap(demo, key);
        if key == '6' {
            // Shows rays and paths of the clicked point.
            demo.client().click(1, WALL);
        }
        let view = changed(demo, seen.last().unwrap());
        for other in &seen {
            assert!(changed_pixels(&view, other, PICTURE, 8) > 500, "view {key} shows something of its own");
        }
        seen.push(view);
    }
    tap(demo, '1');
}

fn the_camera_turns_and_flies(demo: &Demo, home: &RgbImage) {
    demo.drag(1, WALL, (WALL.0 - 40, WALL.1 + 10), 6);
    let turned = changed(demo, home);
    assert!(mean_difference(home, &turned, PICTURE) > 2.0, "turned");
    demo.client().scroll(WALL, 3);
    let near = changed(demo, &turned);
    demo.client().key_down(keys::of('w'));
    demo.wait_for_change(&near, PICTURE, SOON);
    demo.client().key_up(keys::of('w'));
    changed(demo, &near);
    demo.client().tap(&[], keys::HOME);
}

fn monte_carlo_stands_right_of_the_wipe(demo: &Demo, home: &RgbImage) {
    let left = Area { width: SIDE / 2 - 8, ..PICTURE };
    let right = Area { x: SIDE / 2 + 8, ..left };
    tap(demo, 'm');
    let both = demo.wait_for_change(home, right, READY);
    assert_eq!(changed_pixels(home, &both, left, 0), 0, "ours stays");
    let differs = mean_difference(home, &both, right);
    assert!(differs > 0.5 && differs < 40.0, "the same light, and noise: {differs}");
    // The map of our error, and back. None of its colours is grey, as much of the picture is.
    tap(demo, '7');
    let map = demo.wait_for_change(&both, right, READY);
    assert_eq!(changed_pixels(home, &map, left, 0), 0, "ours stays");
    let least_saturation = |image: &RgbImage| {
        let columns = right.x..right.x + right.width;
        let places = columns.flat_map(|x| (right.y..right.y + right.height).map(move |y| (x, y)));
        let saturation = |(x, y)| {
            let [red, green, blue] = image.get_pixel(x, y).0;
            red.max(green).max(blue) - red.min(green).min(blue)
        };
        places.map(saturation).min().unwrap()
    };
    assert!(least_saturation(home) < 30 && least_saturation(&map) > 60);
    tap(demo, '7');
    let both = demo.wait_for_change(&map, right, READY);
    assert!(mean_difference(home, &both, right) < 40.0);
    tap(demo, 'm');
    let back = changed(demo, &both);
    // Switched on again while the earlier samples are still computed.
    for _ in 0..3 {
        tap(demo, 'm');
    }
    let again = demo.wait_for_change(&back, right, READY);
    let differs = mean_difference(home, &again, right);
    assert!(differs > 0.5 && differs < 40.0, "the same light, and noise: {differs}");
    tap(demo, 'm');
}

fn any_size_and_minimised(demo: &Demo, home: &RgbImage) {
    const SIZES: [(u32, u32); 10] = [
        (1, 1),
        (1200, 800),
        (2, 700),
        (1100, 3),
        (64, 64),
        (1, 800),
        (1200, 1),
        (511, 513),
        (333, 777),
        (SIDE, SIDE),
    ];
    for size in SIZES {
        demo.client().resize(size);
        demo.assert_presents(SOON);
        assert_eq!(demo.client().size(), size);
    }
    assert_eq!(changed_pixels(home, &settled(demo), PICTURE, 0), 0, "back at its size");

    demo.client().hide();
    // Time for a possible redraw; the test does not depend on it.
    sleep(Duration::from_millis(300));
    assert!(demo.is_running());
    demo.client().show();
    demo.assert_presents(SOON);
}

fn sizes_in_quick_succession(demo: &Demo, _: &RgbImage) {
    // No wait: the window gets outdated sizes.
    for step in 0..100 {
        demo.client().resize((1 + step * 373 % 1200, 1 + step * 211 % 800));
    }
    demo.client().resize((SIDE, SIDE));
    demo.assert_presents(SOON);
}

/// Processor time of a process so far, clock ticks.
fn ticks(process: u32) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    // The name in brackets may contain spaces; user and system time are the 12th and 13th
    // fields after it.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
}

/// The program first computes ahead for the camera. Afterwards, a second takes at most a tenth of a
/// second of processor time. A program that never rests hangs here.
fn left_alone_it_takes_no_time(demo: &Demo, _: &RgbImage) {
    let mut before = ticks(demo.process());
    until("second of rest", SOON, || {
        sleep(Duration::from_secs(1));
        let taken = ticks(demo.process()) - std::mem::replace(&mut before, ticks(demo.process()));
        (taken < 10).then_some(())
    });
}

/// The teapot becomes glossy, which needs other light paths: the picture hardly changes.
fn a_film_plays(demo: &Demo, home: &RgbImage) {
    let mark = demo.mark();
    tap(demo, ' ');
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    let first = demo.wait_for_change(home, PICTURE, SOON);
    let next = demo.wait_for_change(&first, PICTURE, SOON);
    demo.wait_for_change(&next, PICTURE, SOON);
    tap(demo, ' ');
    let differs = mean_difference(home, &settled(demo), PICTURE);
    assert!(differs < 3.0, "as it was, by other light paths: {differs}");
}
