//! Frames of the window: what they submit, and how many are shown a second.

use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::client::Point;
use crate::demo::Demo;
use crate::display::Display;
use crate::keys;
use crate::scenarios::{BOX, READY, SIDE, SOON, close, drag_light, gizmo, open, open_with, settled};

/// Submissions to the device and frames presented so far, as the process reports them after F10.
fn counts(demo: &Demo) -> [u64; 2] {
    let mark = demo.mark();
    demo.client().tap(&[], keys::function(10));
    let line = demo.wait_for_line_since(mark, "lightpaths: frames ", SOON);
    let words: Vec<&str> = line.split_whitespace().collect();
    let [_, "frames", frames, "submissions", submissions] = words[..] else { panic!("{line}") };
    [submissions, frames].map(|count| count.parse().unwrap())
}

/// Submissions and frames while `act` runs.
fn counted(demo: &Demo, act: impl FnOnce()) -> [u64; 2] {
    let before = counts(demo);
    act();
    let after = counts(demo);
    std::array::from_fn(|index| after[index] - before[index])
}

/// Moves the pointer with a button down. Asserts that each frame is one submission: the passes of
/// the renderer and the panels that show its picture. The first moves are not counted: a drag
/// begins with a query of the surface under the pointer, and its first frames may make the picture
/// coarser or lists longer.
fn assert_one_submission(demo: &Demo, what: &str, button: u8, (x, y): Point) {
    demo.client().move_to((x, y));
    demo.wait_for_answer();
    demo.client().press(button);
    for step in 1..=24 {
        demo.client().move_to((x + 12 + step % 2, y));
        demo.wait_for_answer();
    }
    let [submissions, frames] = counted(demo, || {
        for step in 1..=12 {
            demo.client().move_to((x + 12 + 4 * step, y));
        }
        demo.wait_for_answer();
    });
    demo.client().release(button);
    settled(demo);
    assert_eq!(submissions, frames, "{what}: submissions, and frames");
    assert!(frames >= 3, "{what}: {frames} frames");
}

#[test]
fn a_frame_is_one_submission() {
    let display = Display::start();
    let demo = open(&display);
    settled(&demo);
    // The first edit draws the glyphs that the others need.
    drag_light(&demo);
    demo.client().tap(&[keys::CONTROL], keys::of('z'));
    settled(&demo);
    assert_one_submission(&demo, "a light", 1, gizmo());
    assert_one_submission(&demo, "the camera", 3, (100, 300));
    let [submissions, frames] = counted(&demo, || (0..5).for_each(|_| demo.wait_for_answer()));
    assert_eq!(submissions, frames, "no edit: submissions, and frames");
    close(&demo);
}

/// Edits, sizes and other swapchains, each while earlier frames may be in flight: during the
/// precomputation with the hazard check, afterwards without; always with validation.
#[test]
fn a_window_is_edited_resized_and_closed_with_frames_in_flight() {
    let display = Display::start();
    let demo = Demo::start(&display, &[&BOX[..], &["--no-vsync"]].concat());
    let stir = |rounds: i32| {
        let (x, y) = gizmo();
        for round in 0..rounds {
            let size = SIDE + 16 * (round as u32 % 3);
            demo.client().move_to((x, y));
            demo.client().press(1);
            for step in 1..=6 {
                demo.client().move_to((x + 5 * step, y + step));
                if step == 3 {
                    demo.client().resize((size, size));
                }
            }
            demo.client().release(1);
            demo.client().tap(&[], keys::of(['v', 'p', 'o', 'o'][round as usize % 4]));
            demo.client().tap(&[keys::CONTROL], keys::of('z'));
        }
    };
    stir(4);
    demo.wait_for_line("lightpaths: ready", READY);
    stir(8);
    demo.assert_presents(SOON);
    settled(&demo);
    stir(2);
    // Nothing is waited for.
    close(&demo);
}

#[test]
#[ignore = "measures: cargo test --test window frames_a_second -- --ignored --nocapture"]
fn frames_a_second() {
    const SECONDS: f64 = 15.0;
    let display = Display::start();
    let demo = open_with(&display, &["--no-vsync"]);
    settled(&demo);
    let (light, middle) = (gizmo(), (SIDE as i32 / 2, SIDE as i32 / 2));
    for (what, button, (x, y)) in [("light", 1, light), ("camera", 3, middle), ("panels", 2, (-1, -1))] {
        let is_drag = x >= 0;
        demo.client().move_to((x.max(4), y.max(4)));
        if is_drag {
            demo.client().press(button);
        }
        let start = Instant::now();
        let [submissions, frames] = counted(&demo, || {
            for step in 0.. {
                if start.elapsed().as_secs_f64() > SECONDS {
                    break;
                }
                demo.client().move_to((x.max(4) + step % 60, y.max(4)));
                sleep(Duration::from_millis(2));
            }
        });
        let seconds = start.elapsed().as_secs_f64();
        let (rate, share) = (frames as f64 / seconds, submissions as f64 / frames as f64);
        println!("{what}: {rate:.1} frames a second, {share:.2} submissions a frame");
        if is_drag {
            demo.client().release(button);
        }
    }
    close(&demo);
}
