//! A model that is dragged by its gizmo, turned, and put back.

use std::path::Path;

use glam::Vec3;
use lightpaths::scene::{LoadOptions, Scene};

use crate::client::Point;
use crate::display::Display;
use crate::keys;
use crate::lights::Sight;
use crate::picture::changed_pixels;
use crate::scenarios::{PICTURE, READY, SIDE, SOON, close, open_in};

const SCENE: &str = r#"
[[model]]
built_in = "box"

[[model]]
name = "brick"
file = "brick.obj"
translate = [0.3, 0.3, 0.5]

[camera]
position = [0.0, 1.0, 3.4]
target = [0.0, 1.0, 0.0]

[[light]]
kind = "point"
position = [0.0, 1.6, 0.3]
intensity = [2.0, 2.0, 2.0]
"#;

const BRICK: &str = "v 0 0 0\nv 0.3 0 0\nv 0.3 0 0.2\nv 0 0 0.2\nv 0 0.1 0\nv 0.3 0.1 0\nv 0.3 0.1 0.2\nv 0 0.1 0.2\n\
f 1 2 3 4\nf 8 7 6 5\nf 5 6 2 1\nf 7 8 4 3\nf 8 5 1 4\nf 6 7 3 2\n";

/// The model's name in the panel while the light is chosen, and its second angle once it is chosen.
const NAME: Point = (SIDE as i32 + 67, 333);
const TURN: Point = (SIDE as i32 + 179, 259);

/// Writes the scene `s.toml` of the Box with a brick.
pub fn write_scene(folder: &Path) {
    std::fs::write(folder.join("s.toml"), SCENE).unwrap();
    std::fs::write(folder.join("brick.obj"), BRICK).unwrap();
}

#[test]
fn a_model_is_dragged_turned_and_put_back() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    write_scene(folder.path());
    let load = |name: &str| {
        let options = LoadOptions { size: Some([SIDE; 2]), ..LoadOptions::default() };
        Scene::load(folder.path().join(name).to_str().unwrap(), &options).unwrap()
    };
    let demo = open_in(&display, folder.path(), "s.toml");
    let saved = || {
        let mark = demo.mark();
        demo.client().tap(&[keys::CONTROL], keys::of('s'));
        let line = demo.wait_for_line_since(mark, "lightpaths: saved ", SOON);
        load(line.trim_start_matches("lightpaths: saved "))
    };
    let [low, high] = load("s.toml").model_boxes[1].unwrap();
    let middle = 0.5 * (low + high);

    demo.click(1, NAME);
    let before = demo.settled(Some(PICTURE));
    let seen = Sight::from_scene(&load("s.toml")).seen(middle);
    let arrow = (seen.x as i32 + 45, seen.y as i32);
    let client = demo.client();
    client.move_to(arrow);
    client.press(1);
    demo.wait_for_answer();
    for step in 1..=6 {
        client.move_to((arrow.0 - 12 * step, arrow.1));
        demo.wait_for_answer();
    }
    let held = demo.settled(Some(PICTURE));
    assert!(changed_pixels(&before, &held, PICTURE, 8) > 30_000, "direct light alone, of the moved model");
    let mark = demo.mark();
    client.release(1);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    let moved = saved().model_boxes[1].unwrap();
    let offset = moved[0] - low;
    assert!(offset.x < -0.2 && offset.y == 0.0 && offset.z == 0.0, "{offset}");
    assert!((moved[1] - high).distance(offset) < 1e-5);

    demo.click(1, TURN);
    let mark = demo.mark();
    demo.client().type_text("90");
    demo.client().tap(&[], keys::RETURN);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    let turned = saved().model_boxes[1].unwrap();
    assert!((0.5 * (turned[0] + turned[1])).distance(middle + offset) < 1e-5, "about its middle");
    let size = (turned[1] - turned[0]).distance(Vec3::new(0.2, 0.1, 0.3));
    assert!(size < 1e-5, "a quarter turn about y: {turned:?}");

    // The ring about y is seen from above: from its nearest point, 92 points before the middle.
    let scene = load("s.toml");
    let sight = Sight::from_scene(&scene);
    let middle = middle + offset;
    let ring = |angle: f32| {
        let seen = sight.seen(middle + sight.metres(middle, 92.0) * Vec3::new(angle.sin(), 0.0, angle.cos()));
        (seen.x.round() as i32, seen.y.round() as i32)
    };
    let mark = demo.mark();
    demo.drag(1, ring(0.0), ring(0.5), 6);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    let again = saved().model_boxes[1].unwrap();
    let extent = again[1] - again[0];
    // The lengths of the shadow of a rectangle of 0.2 by 0.3 m that has turned by half a radian.
    let (sin, cos) = 0.5_f32.sin_cos();
    let wanted = Vec3::new(0.2 * cos + 0.3 * sin, 0.1, 0.2 * sin + 0.3 * cos);
    assert!(extent.distance(wanted) < 0.02, "{extent} {wanted}");

    for _ in 0..3 {
        let mark = demo.mark();
        demo.client().tap(&[keys::CONTROL], keys::of('z'));
        demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    }
    assert_eq!(saved().model_boxes, load("s.toml").model_boxes);
    close(&demo);
}
