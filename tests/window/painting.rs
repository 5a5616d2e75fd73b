//! Painting the region of a light meter, and choosing the image of a material.

use std::thread::sleep;
use std::time::Duration;

use image::{Rgb, RgbImage};
use lightpaths::scene::meter::MeterShape;
use lightpaths::scene::{LoadOptions, Scene};

use crate::client::Point;
use crate::designer::open;
use crate::display::Display;
use crate::keys;
use crate::picture::{Area, changed_pixels};
use crate::scenarios::{READY, SOON, close};
use crate::until;

const BACK_WALL: Point = (450, 400);
const IMAGE: Point = (761, 252);
const METERS: Point = (703, 546);
/// The brush before there is a meter, and with one.
const REGION: [Point; 2] = [(814, 567), (814, 613)];
/// From the floor up the right wall, and back over the wall.
const FLOOR: Point = (520, 740);
const WALL: Point = (600, 600);
const PICTURE: Area = Area { x: 0, y: 20, width: 640, height: 500 };

#[test]
fn a_region_is_painted_and_a_material_gets_an_image() {
    let (display, folder) = (Display::start(), tempfile::tempdir().unwrap());
    let checks =
        |x: u32, y: u32| Rgb(if (x / 8 + y / 8).is_multiple_of(2) { [230, 200, 120] } else { [60, 40, 20] });
    RgbImage::from_fn(64, 64, checks).save(folder.path().join("checks.png")).unwrap();
    let demo = open(&display, folder.path(), "box");
    let saved = || {
        let mark = demo.mark();
        demo.client().tap(&[keys::CONTROL], keys::of('s'));
        demo.wait_for_line_since(mark, "lightpaths: saved box-edited.toml", SOON);
        let file = folder.path().join("box-edited.toml");
        Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap()
    };
    // Heights and normals of the region's points, if a meter is there.
    let region = |scene: &Scene| match &scene.meters[..] {
        [meter] => match &meter.shape {
            MeterShape::Region { points } => points.clone(),
            shape => panic!("{shape:?}"),
        },
        meters => panic!("{} meters", meters.len()),
    };
    demo.click(1, BACK_WALL);
    demo.wait_for_answer();
    demo.click(1, METERS);
    demo.wait_for_answer();
    demo.click(1, REGION[0]);
    demo.wait_for_answer();
    let camera = Scene::load("box", &LoadOptions::default()).unwrap().cameras.remove(0);
    demo.drag(1, FLOOR, WALL, 20);
    demo.wait_for_answer();
    let painted = saved();
    let points = region(&painted);
    let of_floor = points.iter().filter(|(_, normal)| normal.y > 0.99).count();
    let of_wall = points.iter().filter(|(_, normal)| normal.x < -0.99).count();
    assert!(of_floor > 3 && of_wall > 3 && of_floor + of_wall == points.len(), "{points:?}");
    assert!(painted.cameras[0].position.distance(camera.position) < 1e-4, "the brush does not turn the view");

    // Ctrl erases. With it, no key tells that the window has answered, and a slow window may take
    // the gesture for a click without it.
    let mut left = points.clone();
    until("erased points", SOON, || {
        demo.client().key_down(keys::CONTROL);
        demo.client().press(1);
        for step in 0..8 {
            demo.client().move_to((WALL.0 - 12 + 3 * step, WALL.1));
            sleep(Duration::from_millis(30));
        }
        demo.client().release(1);
        demo.client().key_up(keys::CONTROL);
        demo.wait_for_answer();
        left = region(&saved());
        (left.len() < points.len()).then_some(())
    });
    assert!(!left.is_empty(), "the rest stays");
    let mark = demo.mark();
    demo.click(1, REGION[1]);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    until("undone", SOON, || {
        demo.client().tap(&[keys::CONTROL], keys::of('z'));
        demo.wait_for_answer();
        (region(&saved()) == points).then_some(())
    });

    let plain = demo.settled(Some(PICTURE));
    demo.click(1, IMAGE);
    until("dialog", SOON, || (changed_pixels(&plain, &demo.capture(), PICTURE, 2) > 1000).then_some(()));
    let listed = demo.settled(None);
    demo.client().tap(&[], keys::DOWN);
    until("a file", SOON, || (demo.capture() != listed).then_some(()));
    let mark = demo.mark();
    demo.client().tap(&[], keys::RETURN);
    demo.wait_for_line_since(mark, "lightpaths: ready", READY);
    let checked = demo.settled(Some(PICTURE));
    assert!(changed_pixels(&plain, &checked, PICTURE, 2) > 50_000, "an image");
    let scene = saved();
    let white = scene.materials.iter().find(|material| material.name == "white").unwrap();
    assert_eq!(white.texture.as_ref().unwrap().image.size, [64, 64]);
    demo.client().tap(&[keys::CONTROL], keys::of('z'));
    until("plain walls", READY, || (changed_pixels(&plain, &demo.capture(), PICTURE, 0) == 0).then_some(()));
    close(&demo);
}
