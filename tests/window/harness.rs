//! Tests of the harness, with a toy window and small commands.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use image::{Rgb, RgbImage};

use crate::client::{BLOT, Client};
use crate::demo::{Demo, Stream, failures};
use crate::display::Display;
use crate::keys::{self, Chord};
use crate::monkey::{Action, Actions, Monkey};
use crate::picture::{Area, changed_pixels, colours, mean_difference};
use crate::toy::{self, Seen, Toy, colour};
use crate::{HANG as SOON, until};

/// Wait for events that must not happen.
const SHORT: Duration = Duration::from_millis(300);

fn shell(text: &str) -> Command {
    let mut command = Command::new("/bin/sh");
    command.args(["-c", text]);
    command
}

/// A long-running process; a toy is its window.
fn lasting(display: &Display) -> Demo<'_> {
    Demo::run(Some(display), shell("exec sleep 600"))
}

fn attach(display: &Display) -> Client {
    Client::attach(display, 0, SOON)
}

fn wait_for_seen(toy: &Toy, expected: &[Seen]) {
    until(&format!("{expected:?}"), SOON, || {
        expected.iter().all(|one| toy.seen().contains(one)).then_some(())
    });
}

fn wait_for_colour(client: &Client, expected: [u8; 3]) {
    until(&format!("colour {expected:?}"), SOON, || {
        let image = client.try_capture().ok()?;
        image.pixels().all(|pixel| pixel.0 == expected).then_some(())
    });
}

/// Whether a process exists, even as a zombie.
fn exists(process: u32) -> bool {
    Path::new(&format!("/proc/{process}")).exists()
}

#[test]
fn displays_started_at_once_differ_and_leave_nothing_behind() {
    let start = || {
        let display = Display::start();
        let toy = Toy::start(&display, "lightpaths toy", None);
        assert_eq!(attach(&display).size(), (320, 240));
        drop(toy);
        display
    };
    let [a, b] =
        thread::scope(|scope| [scope.spawn(start), scope.spawn(start)].map(|one| one.join().unwrap()));
    assert_ne!(a.name(), b.name());
    for display in [a, b] {
        let process = display.process();
        assert!(exists(process));
        drop(display);
        assert!(!exists(process), "the server has gone");
    }
}

#[test]
fn a_machine_without_a_server_is_told_what_to_install() {
    let fault = Display::with_server("no-such-server").err().expect("it cannot start");
    assert!(fault.contains("install the package xvfb") && fault.lines().count() == 1, "{fault}");
    let fault = Display::with_server("true").err().expect("that is no server");
    assert!(fault.contains("true names no display"), "{fault}");
}

#[test]
fn the_mouse_reaches_the_window_and_captures_show_it() {
    let display = Display::start();
    let toy = Toy::start(&display, "lightpaths toy", None);
    let demo = lasting(&display);
    let client = demo.client();
    wait_for_colour(client, colour(0, toy::SIZE));
    let before = demo.capture();
    assert_eq!(before.dimensions(), (320, 240));
    assert!(before.pixels().all(|pixel| pixel.0 == colour(0, toy::SIZE)));
    let whole = Area::from_image(&before);

    client.click(1, (17, 23));
    wait_for_seen(&toy, &[Seen::Press(1, (17, 23)), Seen::Release(1, (17, 23))]);
    let after = demo.wait_for_change(&before, whole, SOON);
    wait_for_colour(client, colour(1, toy::SIZE));
    assert_eq!(changed_pixels(&before, &after, whole, 9), whole.pixels());

    client.drag(3, (10, 10), (50, 30), 4);
    let moves = [(20, 15), (30, 20), (40, 25), (50, 30)].map(Seen::Move);
    wait_for_seen(&toy, &[&[Seen::Press(3, (10, 10)), Seen::Release(3, (50, 30))][..], &moves].concat());
    client.scroll((5, 6), 2);
    client.scroll((5, 6), -3);
    wait_for_seen(&toy, &[Seen::Press(4, (5, 6)), Seen::Press(5, (5, 6))]);
    until("clicks of the wheel", SOON, || {
        let count = |button| toy.seen().iter().filter(|one| **one == Seen::Release(button, (5, 6))).count();
        ([4, 5].map(count) == [2, 3]).then_some(())
    });
}

#[test]
fn keys_arrive_as_what_they_stand_for() {
    let display = Display::start();
    let toy = Toy::start(&display, "lightpaths toy", None);
    let client = attach(&display);
    // The window has the keyboard focus, wherever the pointer is.
    client.move_to((900, 900));
    client.type_text("aZ9! ");
    client.tap(&[keys::CONTROL], keys::of('z'));
    client.tap(&[keys::CONTROL, keys::SHIFT], keys::of('z'));
    for key in [keys::function(10), keys::ESCAPE, keys::LEFT, keys::DELETE] {
        client.tap(&[], key);
    }
    let is_modifier = |keysym| [keys::SHIFT, keys::CONTROL].contains(&keysym);
    let typed = || {
        let seen = toy.seen();
        let keys = seen.iter().filter_map(|one| match *one {
            Seen::Key(keysym, has_control) if !is_modifier(keysym) => Some((keysym, has_control)),
            _ => None,
        });
        keys.collect::<Vec<_>>()
    };
    until("last key", SOON, || (typed().len() >= 11).then_some(()));
    let expected = [
        ('a'.into(), false),
        ('Z'.into(), false),
        ('9'.into(), false),
        ('!'.into(), false),
        (' '.into(), false),
        ('z'.into(), true),
        ('Z'.into(), true),
        (0xffc7, false),
        (keys::ESCAPE, false),
        (keys::LEFT, false),
        (keys::DELETE, false),
    ];
    assert_eq!(typed(), expected);
    assert!(catch_unwind(AssertUnwindSafe(|| client.type_text("\u{3042}"))).is_err(), "no such key");
}

#[test]
fn sizes_hiding_and_painting_over_are_seen() {
    let display = Display::start();
    let toy = Toy::start(&display, "lightpaths toy", None);
    let demo = lasting(&display);
    let client = demo.client();
    for size in [(1, 1), (1500, 900), (333, 77)] {
        client.resize((size.0.into(), size.1.into()));
        assert_eq!(client.size(), (size.0.into(), size.1.into()));
        wait_for_seen(&toy, &[Seen::Resize(size.0, size.1)]);
        wait_for_colour(client, colour(0, size));
        demo.assert_presents(SOON);
        wait_for_colour(client, colour(0, size));
    }
    client.hide();
    assert!(!client.is_shown());
    assert!(client.try_capture().is_err());
    client.show();
    assert!(client.is_shown());
    wait_for_seen(&toy, &[Seen::Hidden, Seen::Shown]);
    client.type_text("k");
    wait_for_seen(&toy, &[Seen::Key('k'.into(), false)]);

    client.close();
    wait_for_seen(&toy, &[Seen::Close]);
    until("end of the toy", SOON, || toy.is_closed().then_some(()));
}

#[test]
fn a_window_that_presents_no_more_is_found_out() {
    let display = Display::start();
    let toy = Toy::start(&display, "lightpaths toy", None);
    let demo = lasting(&display);
    wait_for_colour(demo.client(), colour(0, toy::SIZE));
    toy.freeze(true);
    let frozen = AssertUnwindSafe(|| demo.assert_presents(SHORT));
    assert!(catch_unwind(frozen).is_err());
    assert!(demo.capture().pixels().all(|pixel| pixel.0 == BLOT));
    toy.freeze(false);
    wait_for_colour(demo.client(), colour(0, toy::SIZE));
    // Nothing changes, so the wait for a change times out.
    let before = demo.capture();
    let change = AssertUnwindSafe(|| demo.wait_for_change(&before, Area::from_image(&before), SHORT));
    assert!(catch_unwind(change).is_err());
}

#[test]
fn the_window_of_the_process_goes_before_one_with_the_name() {
    let display = Display::start();
    let _other = Toy::start(&display, "lightpaths of another process", Some(1));
    let first = attach(&display);
    let _unnamed = Toy::start(&display, "toy", Some(4711));
    let second = until("the process's window", SOON, || {
        let client = Client::attach(&display, 4711, SOON);
        (client.window() != first.window()).then_some(client)
    });
    assert_eq!(Client::attach(&display, 1, SOON).window(), first.window());
    assert_eq!(Client::attach(&display, 4711, SOON).window(), second.window());
}

#[test]
fn lines_and_exit_codes_are_kept() {
    let display = Display::start();
    let script =
        "echo out of \"$DISPLAY$WAYLAND_DISPLAY\"; echo err >&2; sleep 0.3; echo late; echo late 2; exit 7";
    let demo = Demo::run(Some(&display), shell(script));
    assert_eq!(demo.wait_for_line("out of", SOON), format!("out of {}", display.name()));
    assert_eq!(demo.wait_for_line("late", SOON), "late");
    let mark = demo.mark();
    assert!(mark >= 3);
    assert_eq!(demo.exit_code(SOON), Some(7));
    assert!(!demo.is_running());
    assert_eq!(demo.lines(Stream::Err), ["err"]);
    assert_eq!(demo.lines(Stream::Out).len(), 3);
    // The wait for a line stops once the process has ended.
    let start = Instant::now();
    assert!(catch_unwind(AssertUnwindSafe(|| demo.wait_for_line("never", SOON))).is_err());
    assert!(catch_unwind(AssertUnwindSafe(|| demo.wait_for_line_since(mark, "err", SOON))).is_err());
    assert!(start.elapsed() < SOON / 2);

    let killed = Demo::run(None, shell("echo \"<$DISPLAY>\"; kill -9 $$"));
    assert_eq!(killed.exit_code(SOON), None);
    assert_eq!(killed.lines(Stream::Out), ["<>"]);

    let lasting = lasting(&display);
    assert!(catch_unwind(AssertUnwindSafe(|| lasting.exit_code(SHORT))).is_err());
    let process = lasting.process();
    assert!(lasting.is_running() && exists(process));
    drop(lasting);
    assert!(!exists(process), "killed on the way out");
}

#[test]
fn a_failed_test_leaves_the_last_picture() {
    let path = failures().join("failing-on-purpose.png");
    let _ = std::fs::remove_file(&path);
    let failing = thread::Builder::new().name("failing::on purpose".replace(' ', "-")).spawn(|| {
        let display = Display::start();
        let _toy = Toy::start(&display, "lightpaths toy", None);
        let demo = lasting(&display);
        wait_for_colour(demo.client(), colour(0, toy::SIZE));
        let _monkey = Monkey::new(&demo, 1, &[(&[], keys::TAB)]);
        panic!("on purpose");
    });
    assert!(failing.unwrap().join().is_err());
    let image = image::open(&path).unwrap().to_rgb8();
    assert_eq!(image.dimensions(), (320, 240));
    assert!(image.pixels().all(|pixel| pixel.0 == colour(0, toy::SIZE)));
}

#[test]
fn differences_are_counted_inside_the_area() {
    let before = RgbImage::from_pixel(4, 3, Rgb([10, 20, 30]));
    let mut after = before.clone();
    after.put_pixel(1, 2, Rgb([13, 20, 30]));
    after.put_pixel(3, 0, Rgb([10, 0, 30]));
    let whole = Area::from_image(&before);
    assert_eq!(mean_difference(&before, &after, whole), 23.0 / 36.0);
    assert_eq!([0, 2, 3, 19, 20].map(|codes| changed_pixels(&before, &after, whole, codes)), [2, 2, 1, 1, 0]);
    let left = Area { width: 2, ..whole };
    assert_eq!(mean_difference(&after, &before, left), 3.0 / 18.0);
    assert_eq!(changed_pixels(&before, &after, left, 0), 1);
    assert_eq!((colours(&after, whole), colours(&after, left), colours(&before, whole)), (3, 2, 1));
    assert_eq!(changed_pixels(&before, &RgbImage::new(4, 4), left, 255), 6);
    let outside = Area { x: 3, y: 0, width: 2, height: 1 };
    assert!(catch_unwind(|| mean_difference(&before, &after, outside)).is_err());
}

#[test]
fn a_monkey_repeats_itself_and_leaves_nothing_out() {
    const CHORDS: [Chord; 3] =
        [(&[], keys::TAB), (&[keys::CONTROL], 0x7a), (&[keys::SHIFT, keys::ALT], 0x61)];
    let actions = |seed| Actions::new(seed, (320, 240), &CHORDS).take(2000).collect::<Vec<_>>();
    let some = actions(5);
    assert_eq!(some, actions(5));
    assert_ne!(some, actions(6));
    let kind = |action: &Action| format!("{action:?}").split(' ').next().unwrap().to_owned();
    for expected in ["Move", "Drag", "Click", "Scroll", "Key", "Resize", "Hide", "Rest"] {
        assert!(some.iter().any(|action| kind(action) == expected), "{expected}");
    }
    for chord in CHORDS {
        assert!(some.contains(&Action::Key { chord }));
    }
    let sizes = some.iter().filter_map(|action| match action {
        Action::Resize { size } => Some(*size),
        _ => None,
    });
    assert!(sizes.clone().all(|(width, height)| (1..=1500).contains(&width) && (1..=900).contains(&height)));
    assert!(sizes.clone().any(|(width, _)| width < 17) && sizes.clone().any(|(width, _)| width > 1000));

    let display = Display::start();
    let toy = Toy::start(&display, "lightpaths toy", None);
    let demo = lasting(&display);
    let mut monkey = Monkey::new(&demo, 5, &CHORDS);
    monkey.act(12);
    let log = monkey.log();
    assert!(log.starts_with("seed 5\n") && log.lines().count() > 3, "{log}");
    assert!(log.lines().nth(1).unwrap().ends_with(&format!("s {:?}", some[0])), "{log}");
    assert!(demo.client().is_shown() && !toy.is_closed() && !toy.seen().is_empty());
    // The harness detects the end of a process at once.
    let short = Demo::run(Some(&display), shell("sleep 0.5"));
    let start = Instant::now();
    assert!(catch_unwind(AssertUnwindSafe(|| Monkey::new(&short, 5, &CHORDS).run(60.0))).is_err());
    assert!(start.elapsed() < SOON);
}
