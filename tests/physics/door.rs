//! A door between two rooms, of which one is lit: open, ajar and closed.

use std::fmt::Write as _;
use std::fs;

use glam::Vec3;
use lightpaths::reference::Progressive;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{LoadOptions, Scene};

use crate::common::context;
use crate::path_tracer::trace;

/// The lamp is left of the wall at x = 0, the camera right of it. The hinge is the door's origin.
const SCENE: &str = r#"
[[model]]
file = "house.obj"
[[model]]
name = "door"
file = "door.obj"
translate = [0, 0, -0.45]
[camera]
position = [2.7, 1.5, 1.6]
target = [0, 1, -0.2]
fov_y = 60
size = [64, 48]
[[light]]
kind = "point"
position = [-1.5, 2, 0.5]
intensity = [6, 6, 6]
"#;

/// A box in OBJ; its fronts are inside if `is_room`.
fn add_box(obj: &mut String, (low, high): (Vec3, Vec3), is_room: bool) {
    const FACES: [[usize; 4]; 6] =
        [[1, 2, 3, 4], [8, 7, 6, 5], [5, 6, 2, 1], [7, 8, 4, 3], [8, 5, 1, 4], [6, 7, 3, 2]];
    let first = obj.matches('v').count();
    for (x, z, y) in [0, 1].into_iter().flat_map(|y| [(0, 0, y), (1, 0, y), (1, 1, y), (0, 1, y)]) {
        let pick = |axis: usize, end: usize| if end == 0 { low[axis] } else { high[axis] };
        writeln!(obj, "v {} {} {}", pick(0, x), pick(1, y), pick(2, z)).unwrap();
    }
    for mut face in FACES {
        if is_room {
            face.reverse();
        }
        let [a, b, c, d] = face.map(|corner| first + corner);
        writeln!(obj, "f {a} {b} {c} {d}").unwrap();
    }
}

/// The scene with the door at that angle, degrees.
fn scene(angle: f32) -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let [mut house, mut door] = [const { String::new() }; 2];
    let corners = |low: [f32; 3], high: [f32; 3]| (Vec3::from(low), Vec3::from(high));
    add_box(&mut house, corners([-3.0, 0.0, -2.0], [3.0, 2.5, 2.0]), true);
    add_box(&mut house, corners([-0.05, 0.0, -2.0], [0.05, 2.5, -0.45]), false);
    add_box(&mut house, corners([-0.05, 0.0, 0.45], [0.05, 2.5, 2.0]), false);
    add_box(&mut house, corners([-0.05, 2.05, -0.45], [0.05, 2.5, 0.45]), false);
    add_box(&mut door, corners([-0.025, 0.0, 0.0], [0.025, 2.05, 0.9]), false);
    for (name, text) in [("house.obj", &*house), ("door.obj", &door), ("s.toml", SCENE)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let set = vec![format!("model.door.rotate=[0, {angle:?}, 0]")];
    let options = LoadOptions { set, preset: Some("draft".into()), ..LoadOptions::default() };
    Scene::load(folder.path().join("s.toml").to_str().unwrap(), &options).unwrap()
}

/// Sum of the picture's radiance by light paths, and by path tracing with `samples` a pixel.
fn light(angle: f32, samples: u32) -> [f64; 2] {
    let mut renderer = Renderer::new(&context(), scene(angle), &mut Silent).unwrap();
    renderer.frame().unwrap();
    let sum =
        |pixels: &[[f32; 3]]| -> f64 { pixels.as_flattened().iter().map(|value| f64::from(*value)).sum() };
    let ours = sum(&renderer.layer(Layer::Beauty).unwrap());
    let paths = match samples {
        0 => 0.0,
        _ => {
            let picture = trace(scene(angle), [64, 48], samples).picture().unwrap();
            sum(&picture.direct) + sum(&picture.indirect)
        }
    };
    [ours, paths]
}

#[test]
fn a_door_that_closes_leaves_no_light_behind() {
    let [open, paths] = light(90.0, 64);
    assert!(open > 100.0, "there is light: {open}");
    println!("open: {:+.2} %", 100.0 * (open / paths - 1.0));
    assert!((open / paths - 1.0).abs() < 0.02, "{open} instead of {paths}");
    let [ajar, _] = light(10.0, 0);
    let [closed, _] = light(0.0, 0);
    println!("ajar {:.2e}, closed {:.2e} of it", ajar / open, closed / open);
    assert!(ajar < 0.2 * open && ajar > 1e-3 * open, "{ajar}");
    assert!(closed < 1e-3 * open, "{closed}");
}

/// Writes the picture of docs/films.md.
#[test]
#[ignore = "writes a document's picture: cargo test --test physics -- --ignored the_door_opens"]
fn the_door_opens() {
    const SIZE: [u32; 2] = [240, 180];
    const ANGLES: [f32; 4] = [4.0, 20.0, 50.0, 95.0];
    let mut strip = image::RgbaImage::new(SIZE[0] * ANGLES.len() as u32, SIZE[1]);
    for (place, angle) in (0..).zip(ANGLES) {
        let mut scene = scene(angle);
        scene.cameras[0].size = SIZE;
        let mut renderer = Renderer::new(&context(), scene, &mut Silent).unwrap();
        renderer.frame().unwrap();
        let codes = renderer.display().unwrap().into_flattened();
        let frame = image::RgbaImage::from_raw(SIZE[0], SIZE[1], codes).unwrap();
        image::imageops::replace(&mut strip, &frame, i64::from(place * SIZE[0]), 0);
    }
    let strip = image::DynamicImage::from(strip).into_rgb8();
    strip.save(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/images/film-door.png")).unwrap();
}
