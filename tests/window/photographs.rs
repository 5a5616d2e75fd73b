//! Pictures of the window for the documentation: `make screenshots`.

use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use crate::client::Point;
use crate::demo::Demo;
use crate::display::Display;
use crate::keys;
use crate::models;
use crate::scenarios::{READY, close};

/// A step from one picture of the documentation to the next.
enum Act {
    Key(u32),
    Click(Point),
    /// Wait for work that never ends.
    Wait(u64),
}

/// Pictures of the window for the documentation: the steps from the one before, and the file.
const SHOTS: [(&[Act], &str); 11] = [
    (&[], "window-box.png"),
    (&[Act::Key(b'2' as u32)], "window-direct.png"),
    (&[Act::Key(b'3' as u32)], "window-indirect.png"),
    (&[Act::Key(b'4' as u32)], "window-cache-points.png"),
    (&[Act::Key(b'5' as u32)], "window-cells.png"),
    (&[Act::Key(b'5' as u32), Act::Key(b'5' as u32), Act::Key(b'5' as u32)], "window-cells-coarse.png"),
    (&[Act::Key(b'6' as u32), Act::Click((250, 410))], "window-rays.png"),
    (&[Act::Key(b'8' as u32)], "window-light.png"),
    (
        &[Act::Key(b'1' as u32), Act::Click((300, 400)), Act::Key(b'm' as u32), Act::Wait(45)],
        "window-monte-carlo.png",
    ),
    (&[Act::Key(b'7' as u32), Act::Wait(1)], "window-error.png"),
    (&[Act::Key(b'm' as u32), Act::Key(keys::function(1))], "window-keys.png"),
];

/// Takes pictures of the window for the documentation, each after its steps.
fn photograph(demo: &Demo, shots: &[(&[Act], &str)]) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/images");
    std::fs::create_dir_all(&folder).unwrap();
    for (acts, file) in shots {
        let mut is_endless = false;
        for act in *acts {
            match *act {
                Act::Key(key) => demo.client().tap(&[], key),
                Act::Click(place) => demo.client().click(1, place),
                Act::Wait(seconds) => {
                    sleep(Duration::from_secs(seconds));
                    is_endless = true;
                }
            }
            sleep(Duration::from_millis(500));
        }
        demo.client().move_to((300, 200));
        // Values under the pointer are shown in the next frame.
        sleep(Duration::from_millis(500));
        let picture = if is_endless { demo.capture() } else { demo.settled(None) };
        picture.save(folder.join(file)).unwrap();
    }
}

#[test]
#[ignore = "writes docs/images"]
fn screenshots() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    models::write_scene(folder.path());
    let brick = folder.path().join("s.toml");
    let chosen: (&[Act], &str) = (&[Act::Click((512 + 67, 333))], "window-models.png");
    for (args, shots) in [
        (["room", "--preset", "draft", "--size", "640x480"], &[(&[] as &[Act], "window.png")][..]),
        (["box", "--preset", "draft", "--size", "512x512"], &SHOTS[..]),
        ([brick.to_str().unwrap(), "--preset", "draft", "--size", "512x512"], &[chosen]),
    ] {
        let demo = Demo::start(&display, &args);
        demo.wait_for_line("lightpaths: ready", READY);
        photograph(&demo, shots);
        close(&demo);
    }
}
